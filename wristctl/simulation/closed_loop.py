"""Trajectories out of rollouts, and `simulate`: one closed loop from a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.plant import plant_of
from wristctl.simulation.reference import Motion, motion
from wristctl.simulation.rollout import Outcome, rollout, sample_period
from wristctl.simulation.trajectory import Trajectory, desired_errors
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse, chain_tip
from wristctl.wrist.statics import equilibrium

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Simulation:
    """A trajectory with its metrics; `failed` where the wrist bent beyond a full turn."""

    trajectory: Trajectory
    metrics: dict[str, float]
    failed: bool


def trajectory(outcome: Outcome, index: int, followed: Motion, wrist: WristParameters, label: str) -> Trajectory:
    """The recorded rollout `index` as a Trajectory."""
    angles = outcome.segment_theta(index)
    return Trajectory(
        label=label,
        time=followed.time,
        theta=outcome.column("theta", index),
        segment_theta=angles,
        rate=outcome.column("rate", index),
        theta_ref=followed.theta_ref,
        theta_desired=followed.theta_desired,
        tip=chain_tip(angles, wrist.length),
        tip_desired=followed.tip_desired,
        torque_wanted=outcome.column("torque_wanted", index),
        torque=outcome.column("torque", index),
        tension=_sides(outcome, "tension", index),
        acting=_sides(outcome, "acting", index),
        seen=outcome.column("seen", index),
    )


def _sides(outcome: Outcome, name: str, index: int) -> Array:
    """A recorded pair of columns of the + and the - side, (T, 2)."""
    return np.stack([outcome.column(f"{name}_{side}", index) for side in ("plus", "minus")], axis=-1)


def simulation(outcome: Outcome, index: int, followed: Motion, wrist: WristParameters, label: str) -> Simulation:
    """The recorded rollout `index` with all its metrics."""
    course = trajectory(outcome, index, followed, wrist, label)
    metrics = {name: float(values[index]) for name, values in outcome.metrics.items()}
    failed = bool(outcome.failed[index])
    return Simulation(course, metrics | desired_errors(course) | {"outside_domain": followed.outside}, failed)


def simulate(
    study: Study, network: Inverse | None = None, tuned: Mapping[str, Mapping[str, float]] | None = None
) -> Simulation:
    """Run the study's `simulate` section: one closed loop.

    `network` is needed where the reference has `inverse: network`, `tuned` (gains by controller and name) where the
    gains are `tuned`. Raises UserError for an unknown controller or preset, a reference out of reach, or a start in
    equilibrium of a wrist that buckles.
    """
    chosen = study.simulate
    law = controller(chosen.controller)
    gains = np.array([gains_of(law, chosen.gains, tuned)])
    wrist, reference = in_plane(study.wrist, chosen.direction), chosen.reference
    if DIRECTIONS[chosen.direction].sign < 0:
        reference = reference.mirrored()
    followed = motion(reference, wrist, chosen.horizon, sample_period(chosen.loop), network)
    start = None
    if chosen.start == "equilibrium":
        plant = plant_of(wrist, chosen.loop.plant)
        start = equilibrium(plant, chosen.loop.plant_segments, (plant.pretension, plant.pretension))
    which = np.zeros(1, np.int64)
    outcome = rollout(law, gains, [followed], which, chosen.loop, wrist, start, record=True)
    name = chosen.gains if isinstance(chosen.gains, str) else "given"
    return simulation(outcome, 0, followed, wrist, f"{law.name}/{name}")
