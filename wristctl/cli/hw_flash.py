"""`wristctl hw flash`."""

from __future__ import annotations

import json
import logging

from wristctl.cli.hw_options import BAUD, Image, Port, facts_of
from wristctl.cli.options import Debug, Json, Quiet
from wristctl.cli.progress import listening, progress
from wristctl.studies.counting import no_event

log = logging.getLogger(__name__)


def flash(
    port: Port = None, image: Image = None, as_json: Json = False, quiet: Quiet = False, debug: Debug = False
) -> None:
    """Write the firmware into the board, read it back, and see that it answers."""
    from wristctl.board.driver import Board
    from wristctl.board.flashing import IMAGE
    from wristctl.board.flashing import flash as write
    from wristctl.board.transport import BOOT_TIME, SerialTransport, only_board

    with listening(quiet, False) as console:
        place = port or only_board()
        with progress(console, no_event, f"flashing the board at {place}", None, "", quiet):
            write(place, image or IMAGE, log.info)
        if image is not None:
            return
        transport = SerialTransport(place, BAUD)
        transport.boot_time = BOOT_TIME
        with Board(transport) as board:
            assert board.hello is not None
            facts = facts_of(board.hello._asdict())
    if as_json:
        print(json.dumps({"schema": "wristctl.flashed/1", "port": place, **facts}, indent=2))
    else:
        print(f"firmware {facts['firmware']} written, verified and answering at {place}")
