"""Work that tendons do: of a signal in closed form, and the same of one course and of many at once."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.cases import Case, measure
from wristctl.simulation.closed_loop import trajectory
from wristctl.simulation.metrics import METRICS, energy
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout


def test_work_there_and_back_counts_twice() -> None:
    time = np.arange(0.0, 1.0, 1e-4)
    rate = 2.0 * np.pi * np.cos(2.0 * np.pi * time)
    assert energy(3.0 * rate, 1e-4) == pytest.approx(3.0 * 4.0, rel=1e-3)
    assert energy(np.array([[3.0, -6.0], [0.0, 0.0]]), 0.5).tolist() == [4.5, 0.0]


def test_many_at_once_give_what_each_course_gives() -> None:
    loop, wrist, law = Loop(plant_segments=1), WristParameters(), controller("pid-ff")
    followed = motion(Reference(duration=0.3), wrist, 0.6, sample_period(loop.control_period))
    gains = np.array([law.values(each) for each in law.presets.values()])
    found = measure(law, gains, [Case(loop, followed, (0,), 0)], wrist, ["energy"]).metrics["energy"][:, 0]
    which = np.zeros(len(gains), np.int64)
    outcome = rollout(law, gains, [followed], which, loop, wrist, record=True)
    of_course = METRICS["energy"].of_trajectory
    assert of_course is not None
    alone = [of_course(trajectory(outcome, lane, followed, wrist, Loop())) for lane in range(len(gains))]
    assert np.allclose(found, alone, rtol=1e-12) and (found > 0.1 * 0.5 * wrist.stiffness * 0.52**2).all()
