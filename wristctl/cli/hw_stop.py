"""`wristctl hw stop`."""

from __future__ import annotations

from wristctl.cli.hw_options import BAUD, Baud, Port
from wristctl.cli.options import Debug


def stop(port: Port = None, baud: Baud = BAUD, debug: Debug = False) -> None:
    """Emergency stop: no further step, drives released. Works beside a running program."""
    from wristctl.board.driver import Board
    from wristctl.board.transport import open_transport

    transport = open_transport(port, baud, exclusive=False)
    try:
        result = Board(transport).stop_whatever_runs()
    finally:
        transport.close()
    print(f"stopped ({result.name}); the fault is latched until cleared")
