"""A client of the bench in real time, to be stopped and killed: turns the motors, says what happens, goes on."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from wristctl.bench.real_time_bench import connect
from wristctl.board.board import Board
from wristctl.board.board_errors import Faulted
from wristctl.board.messages import Configure
from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters

WATCHDOG = 1.0
"""Seconds of silence that the board bears: more than a busy computer is silent for by itself."""

if __name__ == "__main__":
    with connect(BenchSettings(), WristParameters(), 0, record=Path(sys.argv[1])) as bench:
        board = Board(bench.transport)
        board.connect()
        while True:
            board.configure(Configure(watchdog=WATCHDOG))
            try:
                board.enable()
                board.home()
                print("turning", flush=True)
                while True:
                    board.turn((-50.0, -50.0, 50.0, 50.0))
                    time.sleep(0.005)
            except Faulted as error:
                print(error.faults.name, flush=True)
                board.clear()
