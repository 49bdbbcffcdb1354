"""E22 as printed, its output an angle: what the law comes to, and that a search may find what is printed."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.test_laws import inertia_and_load, torque
from wristctl.control.table import CONTROLLERS


def test_the_torque_holds_the_angle_that_e22_gives() -> None:
    """-(2 e + 3 int(e) + 0.5 de/dt), one period of 1 ms into the integral."""
    memory = np.array([0.05])
    angle = -(2.0 * -0.1 + 3.0 * (0.05 - 1e-4) + 0.5 * 0.2)
    got = torque("pid-angle", (2.0, 3.0, 0.5), memory, theta=0.2, theta_ref=0.3, rate=0.3, rate_ref=0.1)
    assert got == pytest.approx(inertia_and_load(angle, 0.0)[1], rel=1e-12)
    assert memory[0] == pytest.approx(0.05 - 1e-4)


@pytest.mark.parametrize("error", [-0.3, 0.3])
def test_an_angle_beyond_half_a_turn_is_half_a_turn(error: float) -> None:
    for gain in (20.0, 1e4):
        got = torque("pid-angle", (gain, 0.0, 0.0), theta=error)
        assert got == pytest.approx(inertia_and_load(-np.sign(error) * np.pi, 0.0)[1], rel=1e-9)


def test_it_drives_toward_the_reference_and_its_integral_waits_while_it_cannot() -> None:
    memory = np.zeros(1)
    got = torque("pid-angle", (1.0, 1.0, 0.0), memory, theta=-0.5, torque_low=-0.1, torque_high=0.1)
    assert got > 0.1 and memory[0] == 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_search_may_find_every_preset(name: str) -> None:
    """The paper's among them: a box that does not hold its gains could not return them."""
    law = CONTROLLERS[name]
    for preset, gains in law.presets.items():
        for gain, value in gains.items():
            assert law.gains[gain].low <= value <= law.gains[gain].high, (preset, gain)
