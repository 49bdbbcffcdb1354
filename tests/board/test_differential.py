"""Our core and simavr run the same programs alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.board.bench import Bench, Chip
from tests.firmware.simavr_board import LIBRARY, SimavrBoard
from wristctl.board.emulator import Atmega2560
from wristctl.board.messages import Rate, Target

PROGRAMS = Path(__file__).parent / "programs"
BYTE = 160  # cycles at 1 Mbaud
RATES = (7.5, 300.0, 9000.0)
FIRMWARE = Path(__file__).parents[2] / "wristctl" / "board" / "firmware" / "wrist.hex"

pytestmark = pytest.mark.skipif(not LIBRARY.exists(), reason="simavr's board is not built: make -C tests/firmware")


def test_arithmetic_program_has_the_same_result_in_the_same_cycles() -> None:
    ours, theirs = Atmega2560(PROGRAMS / "arithmetic.hex"), SimavrBoard(PROGRAMS / "arithmetic.hex", 1_000_000)
    ours.run(100_000_000, until_sent=True)
    ended = ours.cycles - BYTE  # we show a byte when it is out, simavr when it is written
    theirs.run(ended - 1000)
    results = [ours.read(), theirs.read()]
    assert results[1] == b""
    while not results[1] and theirs.cycles < ended + 1000:
        theirs.run(1)
        results[1] += theirs.read()
    print(f"{theirs.cycles} cycles on simavr, {ended} on ours: {abs(ended - theirs.cycles) / ended:.1e} apart")
    assert abs(ended - theirs.cycles) <= 1e-6 * ended
    chips: tuple[Chip, ...] = (ours, theirs)
    for k, chip in enumerate(chips):
        chip.run(10 * BYTE)
        results[k] += chip.read()
    assert results[0] == results[1] and len(results[0]) == 4


def test_firmware_makes_the_same_steps_on_both() -> None:
    totals = []
    for chip in (Atmega2560(FIRMWARE), SimavrBoard(FIRMWARE)):
        rng = np.random.default_rng(6)
        bench = Bench(chip)
        bench.get_ready()
        reached = []
        for _ in range(8):
            goal = tuple(int(n) for n in rng.integers(-2000, 2000, 4))
            bench.do(Target(goal, tuple(int(n) for n in rng.integers(500, 10_000, 4))))  # type: ignore[arg-type]
            bench.wait_for_rest()
            reached.append([drive.position for drive in bench.drives])
        for rate in RATES:
            bench.do(Rate((rate, -rate, rate / 3, 0.0), 0.1))
            for _ in range(10):
                bench.run_ms(50)
                bench.do(Rate((rate, -rate, rate / 3, 0.0), 0.1))
        reached.append([drive.position for drive in bench.drives])
        totals.append(np.array(reached))
        chip.close()
    assert (totals[0][:-1] == totals[1][:-1]).all()
    one_tick = 0.001 * max(RATES)  # a command may land on the other side of a millisecond tick
    assert abs(totals[0][-1] - totals[1][-1]).max() <= 2 * one_tick
