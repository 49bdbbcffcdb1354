"""What `serve` does for any chip: it keeps time, lets clients in and waits, on a clock that the test moves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.board.emulator.atmega2560 import Halted
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import serve


class Scene:
    """A chip, its line and the clock: every wait lasts as long as is next in `waits`, with a client there or not."""

    address = "scene"

    def __init__(self, waits: Sequence[float], there: Sequence[bool] | None = None, cycles: int = 0) -> None:
        self.waits, self.there = list(waits), list(there or [True] * len(waits))
        self.now, self.cycles, self.begun = 1000.0, cycles, cycles
        self.timeouts: list[float] = []
        self.slept: list[float] = []
        self.resets, self.received, self.bytes_coming = 0, 0, 0
        self.crashes: list[int] = []
        self.ran: list[tuple[float, float]] = []
        """After each run: seconds that have passed, and seconds that the chip has run."""

    def wait(self, timeout: float) -> bool:
        self.timeouts.append(timeout)
        self.now += self.waits.pop(0)
        return self.there.pop(0)

    def receive(self) -> bytes:
        self.received += 1
        return bytes(400)

    def send(self, data: bytes) -> None:
        raise AssertionError("nothing is said")

    def close(self) -> None:
        """Nothing is open."""

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds

    def run(self, cycles: int) -> None:
        assert cycles >= 0
        self.cycles += cycles
        self.ran.append((self.now - 1000.0, (self.cycles - self.begun) / FREQUENCY))
        if len(self.ran) in self.crashes:
            raise Halted("a jump to nowhere")

    def reset(self) -> None:
        self.resets += 1

    def write(self, data: bytes) -> None:
        self.bytes_coming += len(data)

    def read(self) -> bytes:
        return b""

    def events(self) -> Any:
        return SimpleNamespace()


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Serves a scene to its end, and gives it back."""

    def play(scene: Any) -> Scene:
        monkeypatch.setattr("wristctl.board.emulator.serve.time", scene)
        monkeypatch.setattr("wristctl.board.emulator.serve.no_long_pauses", nullcontext)  # it takes 0.2 s
        serve(scene, scene, lambda: bool(scene.waits))
        played: Scene = scene
        return played

    return play


@pytest.mark.parametrize("cycles", [0, 5 * FREQUENCY])
def test_a_chip_keeps_time_from_when_it_is_served_however_long_it_has_run(played: Any, cycles: int) -> None:
    for passed, ran in played(Scene([0.0005, 0.02, 0.0, 0.09, 0.0001] * 3, cycles=cycles)).ran:
        assert ran == pytest.approx(passed, abs=1e-6)


def test_of_a_long_pause_a_tenth_of_a_second_is_made_up_for_and_no_more_is_ever(played: Any) -> None:
    first, pause, then, _ = played(Scene([0.05, 3.0, 0.01, 0.01])).ran
    assert pause[1] - first[1] == pytest.approx(0.1, abs=1e-6) and then[1] - pause[1] == pytest.approx(0.01, abs=1e-6)


def test_each_client_meets_a_board_that_was_just_reset(played: Any) -> None:
    assert played(Scene([0.001] * 4, [True] * 4)).resets == 1
    assert played(Scene([0.001] * 6, [False, True, True, False, False, True])).resets == 2
    assert played(Scene([0.001] * 3, [False] * 3)).resets == 0


def test_bytes_are_taken_only_of_a_client_that_is_there_and_while_few_wait_for_the_chip(played: Any) -> None:
    """They come 400 at a time: after the third 1200 wait, and the client has to."""
    assert played(Scene([0.001] * 5, [False] * 5)).received == 0
    full = played(Scene([0.001] * 5))
    assert full.received == 3 and full.bytes_coming == 1200
    assert len(full.slept) == 2 and all(0.0 < pause < 0.001 for pause in full.slept)


def test_a_client_waits_less_than_a_millisecond_and_nobody_keeps_a_core_busy(played: Any) -> None:
    nobody, *_, somebody = played(Scene([0.001] * 4)).timeouts
    assert 0.0 < somebody <= 0.0005 and 0.01 <= nobody <= 0.1


def test_a_program_that_crashes_is_reset_and_served_on(played: Any, caplog: pytest.LogCaptureFixture) -> None:
    scene = Scene([0.001] * 4)
    scene.crashes = [2]
    done = played(scene)
    assert done.resets == 2 and len(done.ran) == 4 and "a jump to nowhere" in caplog.text
