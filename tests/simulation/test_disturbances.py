"""Disturbances: their course in time, and where the wrist rests under them."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Disturbances, Drift, Grasp, Plant, Push
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.disturbances import acting
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.wrist.compiled_model import linearised
from wristctl.wrist.segments import segments

WRIST = WristParameters()
TIME = np.arange(5000.0) * 1e-3


def run(disturbances: Disturbances, plant: Plant | None = None, horizon: float = 6.0) -> Outcome:
    loop = Loop(disturbances=disturbances, plant=plant or Plant())
    move = motion(Reference(angle_deg=10.0), WRIST, horizon, 1e-3)
    law = controller("feedforward")
    return rollout(law, np.zeros((1, 0)), [move], np.zeros(1, np.int64), loop, WRIST, record=True, threads=1)


def course(disturbances: Disturbances) -> np.ndarray:
    """Force [N] and stiffness over the plant's own at TIME, (T, 2)."""
    found = acting(disturbances, TIME)
    assert found is not None
    return found


def test_push_is_half_a_sine_with_its_impulse() -> None:
    force = course(Disturbances(push=Push(force=-2.0, start=1.0, duration=0.5)))[:, 0]
    assert force.sum() * 1e-3 == pytest.approx(-2.0 * 0.5 * 2 / np.pi, rel=1e-4)
    assert not force[TIME <= 1.0].any() and not force[TIME >= 1.5].any()
    assert force.min() == pytest.approx(-2.0, rel=1e-4)


def test_drift_runs_linearly_between_its_ends() -> None:
    scale = course(Disturbances(drift=Drift(scale=0.6, start=1.0, duration=2.0)))[:, 1]
    assert scale[[0, 1000, 2000, 3000, 4999]] == pytest.approx([1.0, 1.0, 0.8, 0.6, 0.6])


def test_a_loaded_wrist_rests_where_tendons_gravity_and_tip_force_balance() -> None:
    outcome = run(Disturbances(load=0.3))
    pulls = [2.0 * float(outcome.column(f"tension_{side}", 0)[-1]) for side in ("plus", "minus")]
    values, zero = segments(WRIST, 4, (0.0, 0.3)), np.zeros(4)
    assert np.abs(linearised(values, outcome.coordinates(0)[-1], zero, zero, pulls)[0]).max() < 1e-4
    assert outcome.column("theta", 0)[-1] > run(Disturbances()).column("theta", 0)[-1] + 0.03


@pytest.mark.parametrize("mass", [0.05, -0.05])
def test_an_object_taken_up_weighs_like_a_load_and_before_it_there_is_none(mass: float) -> None:
    taken = course(Disturbances(grasp=Grasp(mass=mass, start=1.0, duration=0.5)))[:, 0]
    assert not taken[TIME <= 1.0].any() and taken[TIME >= 1.5] == pytest.approx(9.81 * mass)
    assert taken[1250] == pytest.approx(9.81 * mass / 2.0)
    grasped = run(Disturbances(grasp=Grasp(mass=mass, start=0.5)), horizon=8.0).column("theta", 0)
    loaded = run(Disturbances(load=9.81 * mass), horizon=8.0).column("theta", 0)
    assert grasped[-1] == pytest.approx(loaded[-1], abs=1e-5) and abs(grasped[500] - loaded[500]) > 1e-3


def test_a_wrist_that_has_drifted_rests_where_a_softer_one_does() -> None:
    drifted = run(Disturbances(drift=Drift(scale=0.8, duration=1.0)), horizon=8.0)
    softer = run(Disturbances(), Plant(stiffness_scale=0.8), horizon=8.0)
    assert drifted.column("theta", 0)[-1] == pytest.approx(softer.column("theta", 0)[-1], abs=1e-4)
    assert np.abs(drifted.column("theta", 0) - softer.column("theta", 0)).max() > 1e-3


def test_a_push_leaves_every_lane_of_a_batch_and_the_next_rollout_as_they_were() -> None:
    calm = run(Disturbances()).column("theta", 0)
    pushed = run(Disturbances(push=Push(force=2.0))).column("theta", 0)
    again = run(Disturbances()).column("theta", 0)
    assert (calm[:2500] == pushed[:2500]).all() and (calm == again).all()
    assert np.abs(pushed - calm).max() > 0.1
