"""A client of the bench in real time, to be stopped and killed: turns the motors, says what happens, goes on."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from tests.board.patience import patient
from wristctl.bench.real_time_bench import connect
from wristctl.board.board_errors import Faulted
from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters

if __name__ == "__main__":
    with connect(BenchSettings(), WristParameters(), 0, record=Path(sys.argv[1])) as bench:
        board = patient(bench.transport)
        while True:
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
