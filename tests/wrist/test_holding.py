"""Which bends the tendons can hold, against where the wrist rests under full pull, and what would do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.simulation.stepped_loops import largest_torque
from wristctl.wrist.statics import Shortfall, balance, equilibrium, shortfall

STIFF = WristParameters(stiffness=6.0, length=0.12)
LEANING = WristParameters(stiffness=6.0, length=0.12, gravity=(-7.0, 6.9), hand_mass=0.5)
WRISTS = [STIFF, LEANING, STIFF.model_copy(update={"discs": 2, "tendon_radius": 0.03, "pretension": 0.0})]
SIDES = [1.0, -1.0]


def short_at(wrist: WristParameters, degrees: float) -> Shortfall:
    found = shortfall(wrist, *sorted((0.0, math.radians(degrees))))
    assert found is not None
    return found


def holds(wrist: WristParameters, degrees: float, **changed: Any) -> bool:
    return shortfall(wrist.model_copy(update=changed), *sorted((0.0, math.radians(degrees)))) is None


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("wrist", WRISTS)
def test_the_farthest_bend_is_where_full_pull_on_one_side_leaves_the_wrist(wrist: WristParameters, side: float) -> None:
    pulls = (wrist.tension_limit, wrist.pretension) if side > 0.0 else (wrist.pretension, wrist.tension_limit)
    rest = float(equilibrium(wrist, 1, pulls)[0])
    found = short_at(wrist, side * 45.0)
    assert found.theta == pytest.approx(math.radians(side * 45.0)) and abs(found.given) < abs(found.asked)
    assert found.angle == pytest.approx(rest, abs=1e-6) and side * rest > 0.1


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("wrist", WRISTS)
def test_each_thing_that_would_do_does_and_a_thousandth_less_does_not(wrist: WristParameters, side: float) -> None:
    found, degrees = short_at(wrist, side * 40.0), side * 40.0
    for leaf in ("tension_limit", "tendon_radius"):
        value = getattr(found, leaf)
        assert holds(wrist, degrees, **{leaf: 1.001 * value}) and not holds(wrist, degrees, **{leaf: 0.999 * value})
    assert holds(wrist, 0.999 * math.degrees(found.angle)) and not holds(wrist, 1.001 * math.degrees(found.angle))


def test_gravity_across_and_a_force_at_the_tip_count_to_the_side_that_they_pull_to() -> None:
    easy, hard = short_at(LEANING, 40.0), short_at(LEANING, -40.0)
    assert abs(easy.asked) < abs(short_at(STIFF, 40.0).asked) < abs(hard.asked) and easy.angle > -hard.angle
    end = math.radians(40.0)
    pushed = [shortfall(STIFF, 0.0, end, force) for force in (-5.0, 5.0)]
    assert pushed[0] and pushed[1] and pushed[0].asked > short_at(STIFF, 40.0).asked > pushed[1].asked


def test_where_straight_cannot_be_held_no_angle_is() -> None:
    sagging = WristParameters(gravity=(0.0, 9.81), hand_mass=8.0, tension_limit=10.0)
    found = shortfall(sagging, -0.1, 0.1)
    assert found is not None and math.isnan(found.angle) and found.asked < found.given < 0.0
    assert holds(sagging, 5.0, tension_limit=1.01 * found.tension_limit)


def test_what_tendons_give_is_what_the_control_loop_allows_them() -> None:
    theta = np.radians(np.linspace(-55.0, 55.0, 101))
    for wrist in WRISTS:
        found = balance(wrist, theta)
        assert np.abs([found.least, found.most]).max() == pytest.approx(largest_torque(wrist), rel=1e-12)
        np.testing.assert_allclose(found.least, -found.most[::-1], rtol=1e-12)
    assert holds(WristParameters(), 50.0) and holds(WristParameters(), -50.0)
