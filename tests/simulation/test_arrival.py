"""A loop arrives or not by where it ends; saturation alone says nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.commands.conftest import course
from wristctl.api import load_study
from wristctl.simulation.arrival import SHORT, arrives, missing, why_not
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.trajectory import Trajectory, rests


def ends_at(share: float) -> Trajectory:
    """A course that ends with so much of its move done."""
    one = course("smc/x")
    return replace(one, theta=share * one.theta_ref)


@pytest.mark.parametrize(("share", "there"), [(1.0, True), (1.0 - SHORT + 1e-6, True), (1.0 - SHORT - 1e-6, False)])
def test_a_fifth_of_the_move_may_be_missing(share: float, there: bool) -> None:
    assert arrives(ends_at(share)) is there and arrives(ends_at(2.0 - share)) is there
    assert missing(ends_at(share)) == pytest.approx(1.0 - share)


def test_what_failed_has_not_arrived_and_what_is_asked_to_stay_has() -> None:
    one = course("smc/x", diverges=True)
    assert missing(one) == np.inf and not arrives(one)
    assert arrives(replace(one, theta=np.zeros(200), theta_ref=np.zeros(200)))


def test_a_torque_that_is_cut_off_at_every_tick_arrives_where_the_angle_does() -> None:
    """The same saturated torque, and two ends."""
    slammed = np.where(np.arange(200) % 2, 50.0, -50.0)
    there, short = (replace(ends_at(x), torque_wanted=slammed, torque=slammed / 50.0) for x in (0.98, 0.01))
    assert arrives(there) and not arrives(short)
    assert "to one side and the other" in why_not(short, 60.0) and "hardly moves: 0.3 of 30 deg" in why_not(short, 60.0)


def test_the_reason_tells_limits_from_gains() -> None:
    one = ends_at(0.5)
    limited = replace(one, torque_wanted=np.full(200, 9.0), torque=np.full(200, 2.0))
    weak = replace(one, torque_wanted=np.full(200, 0.1), torque=np.full(200, 0.1))
    assert why_not(limited, 60.0).startswith("ends at 15 of 30 deg; tensions of 60 N give at most 2 N m of the 9")
    assert "no more than 0.1 N m there: its gains are too small" in why_not(weak, 60.0)
    for each in (limited, weak):
        names = ("theta", "theta_ref", "torque", "torque_wanted")
        mirrored = replace(each, **{name: -getattr(each, name) for name in names})
        assert why_not(mirrored, 60.0) == why_not(each, 60.0).replace("at 15 of 30", "at -15 of -30")


def test_the_papers_exchanged_gains_arrive_sampled_and_not_on_four_segments() -> None:
    asked = "simulate={controller: smc, gains: exchanged, horizon: 2.0, loop: {plant_segments: %d}}"
    one, four = (simulate(load_study(None, asked % n)) for n in (1, 4))
    assert one.metrics["saturation"][0] > 0.9 and one.arrives, "saturated, and there"
    assert four.metrics["saturation"][0] > 0.9 and not four.arrives and four.fate.startswith("DOES NOT ARRIVE")


def test_who_stands_still_does_not_arrive_where_a_swing_happens_to_end() -> None:
    """10 deg (1 - cos) over two whole periods ends where it began."""
    one = course("smc/x")
    swing = np.radians(10.0) * (1.0 - np.cos(2.0 * np.pi * one.time))
    assert not arrives(replace(one, theta=np.zeros(200), theta_ref=swing))
    assert arrives(replace(one, theta=0.95 * swing, theta_ref=swing))


def test_a_reference_rests_or_never_does() -> None:
    one = course("smc/x")
    assert rests(one) and not rests(replace(one, theta_ref=np.sin(one.time)))
