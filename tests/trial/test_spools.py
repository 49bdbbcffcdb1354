"""From force to motion and back."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.simulation.actuator import motor_of, reel_in
from wristctl.trial.spools import Paths, on_plus_side, spools_of
from wristctl.wrist.directions import ACTIVE

WRIST, ACTUATOR = WristParameters(), Actuator(level="tendon")
SPOOLS = spools_of(ACTUATOR)


@kernel
def _reel_in(motor: Any, state: Any, target: float, moving: float, h: float) -> None:
    reel_in(motor, motor.stiffness, rows_of(state), 0, target, moving, h)


@settings(deadline=None)
@given(st.lists(st.floats(0.0, 60.0), min_size=4, max_size=4), st.floats(-0.9, 0.9))
def test_tension_to_position_and_back_gives_the_tension(tension: list[float], theta: float) -> None:
    taut, _ = Paths(WRIST, "ulnar").taut(theta)
    position = SPOOLS.target(np.array(tension), taut)
    assert SPOOLS.tension(position, taut) == pytest.approx(tension, abs=1e-9)


@settings(deadline=None)
@given(st.floats(1e-3, 0.9) | st.floats(-0.9, -1e-3))
def test_taut_length_is_the_shortening_of_four_straight_spans(theta: float) -> None:
    """Written out: each span of the +-c tendon is 2 (l/theta -+ c) sin(theta/2) of its share of bend and length."""
    bend, length = theta / 4.0, WRIST.length / 4.0
    chord = 2.0 * length / bend * math.sin(bend / 2.0)
    across = 2.0 * WRIST.tendon_offset * math.sin(bend / 2.0)
    expected = {True: WRIST.length - 4.0 * (chord - across), False: WRIST.length - 4.0 * (chord + across)}
    taut, _ = Paths(WRIST, "flexion").taut(theta)
    assert taut == pytest.approx([expected[bool(plus)] for plus in on_plus_side("flexion")], abs=1e-12)


def test_the_change_of_the_taut_length_is_its_derivative() -> None:
    paths, h = Paths(WRIST, "ulnar"), 1e-5
    _, arm = paths.taut(0.4)
    assert (paths.taut(0.4 + h)[0] - paths.taut(0.4 - h)[0]) / (2.0 * h) == pytest.approx(arm, rel=1e-6)


def test_each_direction_is_pulled_by_the_papers_two_tendons() -> None:
    for plane, tendons in (("ulnar", {4, 5}), ("flexion", {2, 5})):
        assert {tendon for tendon, on in zip(ACTIVE, on_plus_side(plane), strict=True) if on} == tendons


def test_spools_cannot_be_changed_once_they_are_made() -> None:
    with pytest.raises(FrozenInstanceError):
        SPOOLS.speed = 1.0  # type: ignore[misc]


def test_torque_at_the_pulley_is_tension_times_radius() -> None:
    assert SPOOLS.torque(np.array([60.0])) == pytest.approx([0.45])


@settings(deadline=None)
@given(st.floats(-2000.0, 2000.0), st.floats(-3000.0, 3000.0))
def test_a_spool_reaches_a_moving_target_without_exceeding_speed_or_acceleration(gap: float, moving: float) -> None:
    """Chasing a target that moves at a steady rate, the gap closes and is not overrun by more than a step."""
    h, position, target, rate = 5e-3, 0.0, gap, 0.0
    furthest = 0.0
    for _ in range(600):
        wanted = SPOOLS.rate(np.array([target - position]), np.array([moving]), np.array([rate]), h)[0]
        assert abs(wanted) <= SPOOLS.speed and abs(wanted - rate) <= SPOOLS.acceleration * h + 1e-9
        position, rate, target = position + h * wanted, float(wanted), target + h * moving
        furthest = max(furthest, math.copysign(1.0, gap) * (position - target))
    assert abs(target - position) < 0.01
    if gap * moving >= 0.0:
        assert furthest < 1.0 + abs(moving) ** 2 / SPOOLS.acceleration


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_spools_are_behind_by_what_is_left_when_they_have_braked(way: float) -> None:
    """From v over a period h and then braking they go h v + v^2/(2 a); at the speed that closes the gap that is all."""
    period, moving, speeds = 5e-3, np.array([0.0, 300.0, -300.0, 0.0]), np.array([2000.0, 500.0, 4000.0, 0.0])
    to_stop = way * (period * speeds + speeds**2 / (2.0 * SPOOLS.acceleration))
    sent = moving + way * speeds
    assert SPOOLS.rate(to_stop, moving, sent, period) == pytest.approx(sent)
    assert (SPOOLS.behind(to_stop, moving, sent, period) == 0.0).all()
    assert SPOOLS.behind(to_stop + 120.0, moving, sent, period) == pytest.approx(np.full(4, 120.0))
    assert (SPOOLS.behind(to_stop - 0.9, moving, sent, period) == 0.0).all(), "less than a step"


@settings(deadline=None)
@given(st.floats(-2000.0, 2000.0), st.floats(-3000.0, 3000.0), st.floats(-4000.0, 4000.0))
@pytest.mark.slow
def test_a_trial_and_a_simulation_turn_a_spool_by_the_same_law(gap: float, moving: float, before: float) -> None:
    h = 1e-3
    out = np.array([0.0, before * SPOOLS.step])
    _reel_in(motor_of(ACTUATOR), out, gap * SPOOLS.step, moving * SPOOLS.step, h)
    wanted = SPOOLS.rate(np.array([gap]), np.array([moving]), np.array([before]), h)[0]
    assert out[1] / SPOOLS.step == pytest.approx(wanted, abs=1e-6)
