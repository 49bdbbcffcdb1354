"""`wristctl hw` as a user meets it."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.board.patience import wait_for
from wristctl.board.messages import FIRMWARE_VERSION
from wristctl.cli.app import main

ROOT = Path(__file__).parents[2]
WRISTCTL = [sys.executable, "-c", "from wristctl.cli.app import main; main()", "hw"]
BOOT_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "120"}

Served = Callable[..., str]
Typed = Callable[..., subprocess.CompletedProcess[str]]


def hw_alone(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs `wristctl hw ...` in a process of its own."""
    return subprocess.run([*WRISTCTL, *arguments], capture_output=True, text=True, env=ENVIRONMENT)


@pytest.fixture
def hw(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Typed:
    """Runs `wristctl hw ...` in this process, with what a person types."""

    def run(*arguments: str, typed: str = "") -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", "hw", *arguments])
        monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
        with pytest.raises(SystemExit) as ended:
            main()
        return subprocess.CompletedProcess(arguments, int(ended.value.code or 0), *capsys.readouterr())

    return run


@pytest.fixture
def emulate(tmp_path: Path) -> Iterator[Served]:
    """Starts `hw emulate` and gives the port it prints."""
    started = []

    def start(*arguments: str) -> str:
        command = [*WRISTCTL, "emulate", *arguments]
        with (tmp_path / "stderr").open("w") as said:
            child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True, env=ENVIRONMENT)
        started.append(child)
        assert child.stdout is not None
        return child.stdout.readline().strip()

    yield start
    for child in started:
        with child:
            child.terminate()
            assert child.wait(60) == 130


@pytest.mark.parametrize("how", [[], ["--tcp", "0"], ["--wrist"], ["--wrist", "--set", "planes=2"]])
@pytest.mark.slow
def test_check_tells_who_and_how_the_emulated_board_is(emulate: Served, hw: Typed, how: list[str]) -> None:
    port = emulate(*how)
    check = ("check", "--port", port, "--rounds", "20", "--json", "-q")
    done = wait_for(lambda: "no answer" not in (d := hw(*check)).stderr and d)  # which a busy computer may keep back
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (
        told["port"] == port
        and told["firmware"] == ".".join(map(str, FIRMWARE_VERSION))
        and told["state"] == "DISABLED"
    )
    assert [each["command"] for each in told["round_trips_s"]] == ["PING", "STATUS"]
    assert told["counters"]["uart_errors"] <= 1  # a byte in transit when the receiver starts


@pytest.mark.slow
def test_stop_latches_a_fault_beside_a_running_program(emulate: Served) -> None:
    port = emulate()
    holder = f"""
import time
from tests.board.patience import patient
from wristctl.board.board_errors import Faulted, NoAnswer, PortLost
from wristctl.board.transport import SerialTransport
board = patient(SerialTransport({port!r}, 250_000))
board.enable(); board.home(); print("moving", flush=True)
try:
    while True:
        time.sleep(0.01)
        try:
            board.turn((500, 0, 0, 0))
        except (NoAnswer, PortLost):
            pass  # two programs read one port: what one of them takes is missing or garbled for the other
except Faulted as error:
    print(error.faults.name, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", holder], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT) as mover:
        try:
            assert mover.stdout is not None and mover.stdout.readline() == "moving\n"
            hw_alone("stop", "--port", port)  # its answer may go to either program
            assert "ESTOP_COMMAND" in mover.stdout.readline()
        finally:
            mover.kill()


def test_an_axis_moves_only_after_a_typed_yes(hw: Typed) -> None:
    told = [
        hw("check", "--port", "emulated", "--rounds", "1", "--wiring", "2", "--json", typed=typed)
        for typed in ("yes\n", "y\n", "")
    ]
    assert told[0].returncode == 0 and json.loads(told[0].stdout)["position"] == [0, 0, 0, 0]
    assert told[1].returncode == 3 and "nothing was moved" in told[1].stderr
    assert told[2].returncode in (3, 130)


def test_without_a_board_check_says_how_to_go_on(hw: Typed) -> None:
    done = hw("check", "--port", "/dev/no-such-port")
    assert done.returncode == 4 and done.stdout == ""
    assert done.stderr.startswith("error: host: there is no such port") and "hw ports" in done.stderr


def test_ports_are_listed_for_people_and_programs(hw: Typed) -> None:
    assert hw("ports").returncode == 0
    assert json.loads(hw("ports", "--json").stdout)["schema"] == "wristctl.ports/1"


def test_finding_a_board_that_was_not_unplugged_fails_and_says_so(hw: Typed) -> None:
    done = hw("ports", "--find", typed="\n")
    assert done.returncode == 4 and "no port went away" in done.stderr


def test_flash_refuses_an_image_that_is_not_there(hw: Typed) -> None:
    done = hw("flash", "--port", "/dev/null", "--image", "none.hex")
    assert done.returncode == 2 and "none.hex" in done.stderr


@pytest.mark.skipif(not (BOOT_LOADER.exists() and shutil.which("avrdude")), reason="needs avrdude and arduino-core-avr")
@pytest.mark.slow
def test_flash_writes_the_firmware_through_the_stock_boot_loader(emulate: Served, tmp_path: Path) -> None:
    empty = tmp_path / "empty.hex"
    empty.write_text(":00000001FF\n")
    port = emulate("--image", str(empty), "--boot-loader", str(BOOT_LOADER))
    done = hw_alone("flash", "--port", port)
    assert done.returncode == 0, done.stderr
    assert "written, verified and answering" in done.stdout
    assert "bytes of flash verified" in done.stderr
