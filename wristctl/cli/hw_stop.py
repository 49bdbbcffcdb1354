"""`wristctl hw stop`."""

from __future__ import annotations

from wristctl.cli.hw_options import BAUD, Baud, Port
from wristctl.cli.options import Debug


def stop(port: Port = None, baud: Baud = BAUD, debug: Debug = False) -> None:
    """Emergency stop: no further step, drives released. Works beside a running program."""
    from wristctl.board.board_errors import PortUnusable
    from wristctl.board.driver import Board
    from wristctl.board.transport import open_transport

    try:
        transport = open_transport(port, baud)
    except PortUnusable:  # a program of ours has it: opening it a second time resets nothing, and every moment counts
        transport = open_transport(port, baud, exclusive=False)
        transport.boot_time = 0.0
    try:
        result = Board(transport).stop_whatever_runs()
    finally:
        transport.close()
    print(f"stopped ({result.name}); the fault is latched until cleared")
