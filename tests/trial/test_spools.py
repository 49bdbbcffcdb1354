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
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import reel_in
from wristctl.simulation.simulated_drives import drive_in_lanes, drive_of
from wristctl.simulation.spool_timing import spool_at
from wristctl.trial.rig_belief import RigBelief
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.wrist.directions import ACTIVE

WRIST, ACTUATOR = WristParameters(), Actuator(level="tendon")
SPOOLS, BELIEF = spools_of(ACTUATOR), RigBelief(WRIST, ACTUATOR, ("ulnar",))


@kernel
def _follow(drive: Any, state: Any, targets: Any, moving: float, h: float, out: Any) -> None:
    spools, rows = drive_in_lanes(drive), rows_of(state)
    rates = part(rows, 4, drive.sent)
    for tick in range(len(targets)):
        now = rows_of(out[tick])
        now[2], _ = reel_in(spools, rows, rates, 0, targets[tick] + zero_like(rows[0]), moving + zero_like(rows[0]), h)
        now[0], now[1] = rows[0], rates[0]
        now[3], _ = spool_at(spools.motor, rows[0], rows[1], rates, 0.5 * h + zero_like(rows[0]), h)


@settings(deadline=None)
@given(st.lists(st.floats(0.0, 60.0), min_size=4, max_size=4), st.floats(-0.9, 0.9))
def test_tension_to_position_and_back_gives_the_tension(tension: list[float], theta: float) -> None:
    taut, _ = BELIEF.taut((theta,))
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
    taut, _ = RigBelief(WRIST, ACTUATOR, ("flexion",)).taut((theta,))
    assert taut == pytest.approx([expected[bool(plus)] for plus in on_plus_side("flexion")], abs=1e-12)


def test_the_change_of_the_taut_length_is_its_derivative() -> None:
    h = 1e-5
    _, arm = BELIEF.taut((0.4,))
    assert (BELIEF.taut((0.4 + h,))[0] - BELIEF.taut((0.4 - h,))[0]) / (2.0 * h) == pytest.approx(arm[:, 0], rel=1e-6)


def test_each_direction_is_pulled_by_the_papers_two_tendons() -> None:
    for plane, tendons in (("ulnar", {4, 5}), ("flexion", {2, 5})):
        assert {tendon for tendon, on in zip(ACTIVE, on_plus_side(plane), strict=True) if on} == tendons


def test_spools_cannot_be_changed_once_they_are_made() -> None:
    with pytest.raises(FrozenInstanceError):
        SPOOLS.speed = 1.0  # type: ignore[misc]


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


@pytest.mark.parametrize("period", [2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("seed", range(3))
def test_a_trial_and_a_simulation_send_the_same_rates_and_see_the_same_spool(period: float, seed: int) -> None:
    """Through 60 ticks of a target that jumps about on its way; the trial's spool is where the simulated one is."""
    rng, moving = np.random.default_rng(seed), 400.0
    targets = moving * period * np.arange(60.0) + rng.uniform(-30.0, 30.0, 60)
    drive, out = drive_of(ACTUATOR, (1.0,), period), np.zeros((60, 4))
    state = np.zeros(4 + len(drive.sent))  # type: ignore[union-attr]
    _follow(drive, state, targets * SPOOLS.step, moving * SPOOLS.step, period, out)
    out /= SPOOLS.step
    rates = np.zeros((1, len(drive.sent)))  # type: ignore[union-attr]
    for target, (place, rate, believed, true) in zip(targets, out, strict=True):
        gap = target + moving * SPOOLS.timing.delay - SPOOLS.foreseen(np.array([place]), rates, period)
        sent = SPOOLS.rate(gap, np.array([moving]), rates[:, 0], period)
        assert sent[0] == pytest.approx(rate, abs=1e-6)
        rates = np.column_stack([sent, rates[:, :-1]])
        middle = SPOOLS.reckoned(np.array([place]), rates, 0.5 * period, period)
        assert middle[0] == pytest.approx(believed, abs=1e-6) == pytest.approx(true, abs=1e-6)
    assert np.ptp(out[:, 1]) > 300.0 and np.abs(out[20:, 0] - targets[20:]).max() < 60.0
