"""Width, work and slope of a measured loop, without a model."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.identification.loop_shape import LoopShape, loop_shape
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST = WristParameters()
STIFFNESS, FRICTION, BEND = 0.6, 0.02, math.radians(20.0)


def _loop(spools: bool = True, tensions: bool = True, cycles: float = 2.25, first: float = 1.0) -> MeasuredLoop:
    """Torque STIFFNESS times the angle, and FRICTION against the motion, over so many cycles of +-BEND."""
    time = np.linspace(0.0, cycles, round(2000 * cycles) + 1)
    wave = first * np.sin(2.0 * np.pi * time)
    angle: Array = BEND * wave
    sign = np.sign(np.gradient(wave))
    torque = STIFFNESS * angle + FRICTION * sign
    half = torque / (2.0 * TENDONS_PER_SIDE * WRIST.tendon_offset)
    path = WRIST.tendon_offset * angle
    pulls = np.stack([30.0 + half, 30.0 - half], axis=1) if tensions else None
    reeled = np.stack([path, -path], axis=1) if spools else None
    return MeasuredLoop("made.csv", time, angle, reeled, pulls)


@pytest.mark.parametrize("first", [1.0, -1.0])
def test_coulomb_friction_takes_its_torque_times_the_way_there_and_back(first: float) -> None:
    for spools in (True, False):
        shape = loop_shape(_loop(spools, first=first), WRIST)
        assert shape.work == pytest.approx(4.0 * FRICTION * BEND, rel=0.01)
        assert shape.stiffness == pytest.approx(STIFFNESS, rel=0.02)
        assert shape.cycles == 1


@pytest.mark.parametrize("first", [1.0, -1.0])
def test_the_width_at_the_same_pull_is_twice_the_friction_over_the_stiffness(first: float) -> None:
    width = loop_shape(_loop(spools=False, first=first), WRIST).width
    assert width is not None and width == pytest.approx(2.0 * FRICTION / STIFFNESS, rel=0.05)
    assert loop_shape(_loop(first=first), WRIST).width == pytest.approx(0.0, abs=1e-6)


def test_what_the_columns_do_not_tell_is_none() -> None:
    shape = loop_shape(_loop(tensions=False), WRIST)
    assert (shape.work, shape.stiffness) == (None, None) and shape.gain == pytest.approx(1.0 / WRIST.tendon_offset)
    assert loop_shape(_loop(spools=False), WRIST).gain is None
    short: LoopShape = loop_shape(_loop(cycles=0.4), WRIST)
    assert short.work is None and short.width is None and short.cycles == 0
