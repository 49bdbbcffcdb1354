"""A wrist on spools that move as they are told, with what a real one has: the integration step without a loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, fsolve

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.nonideal import faults_of_sides, inner_of, nonideal_of, spools_after_slip, unmoved
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.dahl import inner_in_lanes
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import advance_or_stop, kernel_of, parameters_of, travel
from wristctl.wrist.segments import segments
from wristctl.wrist.tendon_mechanics import RealTendons, Z, pulls_along, read_faults, read_nonideal, row_of, spool_pull
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST = WristParameters()
STIFF = Actuator(level="tendon", friction=0.1, sheath=1.0)
HOME = WRIST.pretension / STIFF.tendon_stiffness
"""What both sides have reeled in at pretension on the straight wrist [m]."""


def minimum_jerk(begin: float, end: float, duration: float, h: float = 1e-3) -> np.ndarray:
    s = np.arange(0.0, duration, h) / duration
    return begin + (end - begin) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def antagonists(travel: np.ndarray) -> np.ndarray:
    """Spools (T, 2) that reel in on the + side what they pay out on the other."""
    return HOME + np.stack([travel, -travel], axis=1)


class Spooled(NamedTuple):
    """What it did at the start of each step, (T,) each: bend and rate [rad, rad/s], travel of both sides' tendons [m],
    their pulls at the spools and at the wrist [N], what the + side has reeled in [m], and its bristle's state."""

    theta: Array
    rate: Array
    x_plus: Array
    x_minus: Array
    spool_plus: Array
    spool_minus: Array
    plus: Array
    minus: Array
    given_plus: Array
    z_plus: Array


def _spooled(
    model: Any,
    parameters: Any,
    values: Any,
    faults: Any,
    stiffness: Any,
    reeled: Any,
    state: Any,
    memory: Any,
    inner: Any,
    out: Any,
    h: float,
    cut: Any,
) -> None:
    segment, n = parameters_of(model, rows_of(parameters)), len(cut)
    zero = zero_like(segment.length)
    tendons = RealTendons(
        part(rows_of(stiffness), 0, (0, 0)), read_nonideal(rows_of(values)), read_faults(rows_of(faults), (0, 0)),
        rows_of(memory), inner_in_lanes(inner), (0, 0), (0, 0, 0),
    )  # fmt: skip
    q, rate = part(rows_of(state), 0, cut), part(rows_of(state), n, cut)
    alive, before = 1.0 + zero, (reeled[0, 0] + zero, reeled[0, 1] + zero)
    given = lanes_like(part(rows_of(values), 0, (0, 0)))
    for k in range(reeled.shape[0]):
        path, turned = travel(segment, q), (reeled[k, 0] + zero, reeled[k, 1] + zero)
        speeds = (turned[0] - before[0]) / h, (turned[1] - before[1]) / h
        spools_after_slip(tendons, turned, speeds, k * h + zero, path, given)
        before = turned
        row = rows_of(out[k])
        row[4] = spool_pull(tendons, given[0], 0, path[0])
        row[5] = spool_pull(tendons, given[1], 1, path[1])
        row[6], row[7] = pulls_along(tendons, given, path)
        row[0], row[1] = zero, zero
        for i in range(n):
            row[0] = row[0] + q[i]
            row[1] = row[1] + rate[i]
        row[2], row[3], row[8], row[9] = path[0], path[1], given[0], rows_of(memory)[row_of(0, Z)]
        alive, _ = advance_or_stop(segment, q, rate, given, tendons, h + zero, alive)


def spooled(
    reeled: Array,
    actuator: Actuator,
    facts: TendonFacts | None = None,
    plant: TrueWrist | None = None,
    wrist: WristParameters | None = None,
    h: float = 1e-3,
    n: int = 4,
    rate: Array | None = None,
    force: float = 0.0,
) -> Spooled:
    """From straight, where both sides' spools have reeled in (T, 2) [m], in steps of h [s]."""
    values = nonideal_of(plant or TrueWrist(), actuator, facts or TrueActuator(), h)
    faults = faults_of_sides(values, 2).ravel()
    memory, out = (
        unmoved(np.array(reeled[0]), np.zeros(3), np.zeros(2), np.zeros(n)),
        np.empty((len(reeled), len(Spooled._fields))),
    )
    state = np.concatenate([np.zeros(n), np.zeros(n) if rate is None else rate])
    parameters = segments(wrist or WristParameters(), n, (0.0, force))
    stiffness = np.full(2, TENDONS_PER_SIDE * actuator.tendon_stiffness)
    move = kernel_of(_spooled, PCC)
    inner = inner_of([plant or TrueWrist()], np.zeros((1, n)), np.zeros(1), lambda rows: rows[0])
    given = np.ascontiguousarray(reeled)
    move(PCC, parameters, np.array(values), faults, stiffness, given, state, memory, inner, out, h, (0,) * n)
    return Spooled(*out.T)


def rest_angle(
    reeled: tuple[float, float], actuator: Actuator, z: tuple[float, float], wrist: WristParameters, n: int
) -> float:
    """Bend [rad] at which held spools hold the wrist with the bristles in these states, by the statics alone."""
    values, still = segments(wrist, n), np.zeros(n)
    stiffness, mu, sheath = TENDONS_PER_SIDE * actuator.tendon_stiffness, actuator.friction, actuator.sheath

    def residual(theta: Array) -> Array:
        here = terms(values, theta, still)
        torque = np.zeros(n)
        for side in range(2):
            shortening = wrist.length - here.tendon_lengths[:, side].sum()
            wrapped = sheath + np.abs(theta).sum()
            pull = stiffness * max(0.0, reeled[side] - shortening) * np.exp(-mu * wrapped * z[side])
            torque += pull * here.moment_arms[:, side]
        return here.bias + wrist.stiffness * n * theta - torque

    guess = brentq(lambda bend: residual(np.full(n, bend / n)).sum(), -1.2, 1.2)
    return float(fsolve(residual, np.full(n, guess / n), xtol=1e-13).sum())
