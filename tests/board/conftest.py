"""The same board suite on two emulators: simavr (Debian's, built by `make -C tests/firmware`) and our own core."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.board.bench import Bench, Chip
from tests.firmware.simavr_board import LIBRARY, SimavrBoard

IMAGE = Path(__file__).parents[2] / "wristctl" / "board" / "firmware" / "wrist.hex"


def new_chip(emulator: str) -> Chip:
    if emulator == "simavr":
        return SimavrBoard(IMAGE)
    from wristctl.board.emulator import Atmega2560

    return Atmega2560(IMAGE)


@pytest.fixture(params=["simavr", "own"])
def emulator(request: pytest.FixtureRequest) -> str:
    if request.param == "simavr" and not LIBRARY.exists():
        pytest.skip("simavr's board is not built: make -C tests/firmware")
    if request.param == "own" and find_spec("wristctl.board.emulator") is None:
        pytest.skip("no emulator in the package")
    return str(request.param)


@pytest.fixture
def bench(emulator: str) -> Iterator[Bench]:
    chip = new_chip(emulator)
    bench = Bench(chip)
    yield bench
    bench.assert_drives_content()  # in every test, whatever it was about
    chip.close()


@pytest.fixture
def rounds() -> int:
    """How thorough: 1 in everyday runs, 25 with WRISTCTL_THOROUGH=1 (make test-firmware)."""
    return 25 if os.environ.get("WRISTCTL_THOROUGH") else 1
