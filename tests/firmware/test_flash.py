"""The packaged image goes onto an emulated Mega through its stock bootloader, the way users flash it."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
import tty
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.board.bench import Bench
from tests.firmware.simavr_board import LIBRARY, SimavrBoard
from wristctl.board.messages import DICTIONARY_HASH, Command, State

IMAGE = Path(__file__).parents[2] / "wristctl" / "board" / "firmware" / "wrist.hex"
BOOTLOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex")
BOOTLOADER_BAUD = 115_200

pytestmark = pytest.mark.skipif(
    not (LIBRARY.exists() and BOOTLOADER.exists() and shutil.which("avrdude")),
    reason="needs simavr's board (make -C tests/firmware), arduino-core-avr and avrdude",
)


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    """A pseudo terminal: our end, and the name avrdude opens."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def serve_until_done(chip: SimavrBoard, ours: int, process: subprocess.Popen[str]) -> None:
    """Run the chip in real time, its line on `ours`, for as long as the process lives."""
    begun, started = time.monotonic(), chip.cycles
    while process.poll() is None:
        behind = (time.monotonic() - begun) * 16e6 - (chip.cycles - started)
        if behind < 0:
            time.sleep(0.0005)
            continue
        with suppress(BlockingIOError):
            chip.write(os.read(ours, 4096))
        chip.run(min(int(behind) + 1, 160_000))
        if sent := chip.read():
            os.write(ours, sent)


def test_avrdude_writes_and_verifies_and_the_board_answers_hello(line: tuple[int, str]) -> None:
    ours, name = line
    chip = SimavrBoard(BOOTLOADER, baud=BOOTLOADER_BAUD, start_in_bootloader=True)
    command = ["avrdude", "-c", "wiring", "-p", "atmega2560", "-P", name, "-b", str(BOOTLOADER_BAUD), "-D"]
    with subprocess.Popen([*command, "-U", f"flash:w:{IMAGE}:i"], stderr=subprocess.PIPE, text=True) as avrdude:
        serve_until_done(chip, ours, avrdude)
        assert avrdude.stderr is not None
        said = avrdude.stderr.read()
    assert avrdude.returncode == 0, said
    size = sum(int(record[1:3], 16) for record in IMAGE.read_text().splitlines() if record[7:9] == "00")
    assert f"{size} bytes of flash verified" in said
    chip.set_baud(250_000)
    chip.reset()
    chip.run(3 * 16_000_000)  # the bootloader waits for a flasher, then starts the program
    chip.read()
    board = Bench(chip)
    assert board.do(Command.HELLO).dictionary == DICTIONARY_HASH
    assert board.status().state is State.DISABLED
    chip.close()
