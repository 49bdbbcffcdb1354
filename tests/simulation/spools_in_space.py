"""A wrist in two planes on spools that move as they are told, with what a real one has: the step without a loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.nonideal import faults_of, inner_of, nonideal_of, spools_after_slip, unmoved
from wristctl.wrist.dahl import inner_in_lanes
from wristctl.wrist.plant import advance_or_stop, bend_of, kernel_of, parameters_of, path_before
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_segments import spatial_values
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import RealTendons, acting_pulls, read_faults, read_nonideal


class Wrist(NamedTuple):
    """A wrist with its tendons, cut into n segments, and a force on its tip (3,) [N]."""

    wrist: WristParameters
    layout: TendonLayout
    actuator: Actuator
    facts: TendonFacts = TrueActuator()
    plant: TrueWrist = TrueWrist()
    n: int = 2
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def values(self) -> Array:
        """Values of SpatialWrist."""
        axis = np.radians(self.wrist.stiffness_axis_deg)
        return spatial_values(self.wrist, self.layout, self.n, self.force, axis)


class Course(NamedTuple):
    """What it did at the start of each step: bend (K, 2) [rad], coordinates (K, 2n) [rad], pulls at the wrist and
    lengths that tendons have reeled in (K, T) [N, m]."""

    bend: Array
    q: Array
    pulls: Array
    held: Array


class _Values(NamedTuple):
    wrist: Any
    stiffness: Any
    nonideal: Any
    faults: Any
    state: Any
    inner: Any


def _move(model: Any, values: Any, reeled: Any, motion: Any, out: Any, h: float, cut: Any, pulls: Any) -> None:
    plant, m, count = parameters_of(model, rows_of(values.wrist), pulls), len(cut), len(pulls)
    tendons = RealTendons(
        part(rows_of(values.stiffness), 0, pulls), read_nonideal(rows_of(values.nonideal)),
        read_faults(rows_of(values.faults), pulls), rows_of(values.state), inner_in_lanes(values.inner), pulls,
        pulls + pulls,
    )  # fmt: skip
    q, rate = part(rows_of(motion), 0, cut), part(rows_of(motion), m, cut)
    turned, speeds = lanes_like(tendons.stiffness), lanes_like(tendons.stiffness)
    held, acts = lanes_like(tendons.stiffness), lanes_like(tendons.stiffness)
    bend, speed = part(rows_of(motion), 2 * m, (0, 0)), part(rows_of(motion), 2 * m + 2, (0, 0))
    zero = zero_like(q[0])
    alive = 1.0 + zero
    for k in range(reeled.shape[0]):
        for t in range(count):
            turned[t] = reeled[k, t] + zero
            speeds[t] = (reeled[k, t] - reeled[max(k - 1, 0), t]) / h + zero
        path = path_before(tendons, plant, q)
        spools_after_slip(tendons, turned, speeds, k * h + zero, path, held)
        acting_pulls(tendons, held, path, acts)
        bend_of(plant, q, rate, bend, speed)
        row = rows_of(out[k])
        row[0] = bend[0]
        row[1] = bend[1]
        for i in range(m):
            row[2 + i] = q[i]
        for t in range(count):
            row[2 + m + t] = acts[t]
            row[2 + m + count + t] = held[t]
        alive, _ = advance_or_stop(plant, q, rate, held, tendons, h + zero, alive)


def moved(wrist: Wrist, reeled: Array, h: float) -> Course:
    """From straight, where spools have reeled in (K, T) [m], in steps of h [s]."""
    alike, m = wrist.layout.multiplicity.astype(float), 2 * wrist.n
    count = len(alike)
    values = _Values(
        wrist.values,
        alike * wrist.actuator.tendon_stiffness,
        np.array(nonideal_of(wrist.plant, wrist.actuator, wrist.facts, h)),
        faults_of(wrist.actuator, wrist.facts, alike).ravel(),
        unmoved(np.array(reeled[0]), np.zeros(2 * count), np.zeros(count), np.zeros(m)),
        inner_of([wrist.plant], np.zeros((1, m)), np.zeros(1), lambda rows: rows[0], 2),
    )
    out, motion = np.empty((len(reeled), 2 + m + 2 * count)), np.zeros(2 * m + 4)
    move = kernel_of(_move, PCC_IN_SPACE)
    move(PCC_IN_SPACE, values, np.ascontiguousarray(reeled), motion, out, h, (0,) * m, (0,) * count)
    return Course(*np.split(out, [2, 2 + m, 2 + m + count], axis=1))
