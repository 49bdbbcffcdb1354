"""A client of the bench in real time, to be stopped and killed: turns the motors, says what happens, goes on."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from pathlib import Path

from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters
from wristctl.hardware.bench.connect import connect
from wristctl.hardware.board import Board
from wristctl.hardware.errors import Faulted, NoAnswer

if __name__ == "__main__":
    with connect(BenchSettings(), WristParameters(), 0, record=Path(sys.argv[1])) as bench:
        board = Board(bench.transport)
        board.connect()
        while True:
            board.enable()
            board.home()
            print("turning", flush=True)
            try:
                while True:
                    with suppress(NoAnswer):  # of a busy computer: the board's watchdog decides
                        board.turn((-50.0, -50.0, 50.0, 50.0))
                    time.sleep(0.005)
            except Faulted as error:
                print(error.faults.name, flush=True)
                board.clear()
