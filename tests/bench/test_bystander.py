"""Whoever stands at the emulated rig does what is typed, and nothing waits for it."""

from __future__ import annotations

import os

import pytest

from wristctl.bench.emulated_rig import Bystander, EmulatedRig
from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters


def test_the_button_is_pressed_and_released_and_the_wrist_turned(caplog: pytest.LogCaptureFixture) -> None:
    rig = EmulatedRig(BenchSettings(), WristParameters(), 0)
    typed, keyboard = os.pipe()
    bystander = Bystander(rig, typed)
    bystander.look()
    assert not rig.chip.pin("G", 0)
    os.write(keyboard, b"pre")
    bystander.look()
    assert not rig.chip.pin("G", 0), "half a word is none"
    os.write(keyboard, b"ss\nflexion\n")
    bystander.look()
    assert rig.chip.pin("G", 0) and rig.wrist._load.plane == "flexion"
    os.write(keyboard, b"dance\nrelease\n")
    bystander.look()
    assert not rig.chip.pin("G", 0) and "dance" in caplog.text and "press, release" in caplog.text
    os.close(keyboard)
    for _ in range(2):
        bystander.look()
    os.close(typed)
