"""`wristctl hw ports`."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Json
from wristctl.config.errors import UserError
from wristctl.report.printed_table import Table


def ports(
    find: Annotated[bool, typer.Option("--find", help="Find the board's port by unplugging it.")] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the serial ports of this computer, those that may be a board first."""
    from wristctl.board.transport import ports as serial_ports

    found = serial_ports()
    if find:
        typer.prompt("Unplug the board, then press Enter", default="", show_default=False, err=True)
        left = {port.device for port in serial_ports()}
        found = [port for port in found if port.device not in left]
        if len(found) != 1:
            what = f"{len(found)} ports went away" if found else "no port went away"
            raise UserError(what, fix="plug the board in, start again, and unplug only the board", exit_code=4)
    if as_json:
        print(json.dumps({"schema": "wristctl.ports/1", "ports": [port._asdict() for port in found]}, indent=2))
    elif find:
        print(found[0].device)
    elif found:
        columns = ("port", "may be a board", "description", "serial number")
        print(Table("", columns, [(p.device, p.board_like, p.description, p.serial_number) for p in found]).text())
    else:
        print("no serial ports; wristctl hw emulate serves a board without hardware")
