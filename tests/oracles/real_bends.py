"""A wrist in two planes with all that a real one has, as differential equations in NumPy for SciPy's solver.

Inertia, gravity, springs and tendons' arms are those of the augmented form (`spatial_augmented`). What a real wrist has
is written out as rates: a tendon's bristle z' = (x' - z |x'|)/s along its travel x, its creep psi' = (e - psi)/tau of
the stretch e, that of the springs alike; of each segment's bend u the vector bristle z' = (u' - z |u'|)/s, and an end
stop at |u| that pushes back along u, by Hunt and Crossley's law. One state at a time; SI units.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracles.spatial_augmented import augmented_tendons, spatial_augmented
from wristctl.arrays import Array
from wristctl.wrist.spatial.spatial_segments import FIELDS, OF_A_TENDON, SpatialSegments


class Facts(NamedTuple):
    """What a real wrist has; per tendon (T,) or for the whole wrist. Nothing of it by default."""

    stiffness: Any
    """Of each place [N/m]."""
    friction: float = 0.0
    sheath: float = 0.0
    presliding: float = 1.0
    creep: float = 0.0
    creep_time: float = 1.0
    spring_creep: float = 0.0
    spring_time: float = 1.0
    inner: float = 0.0
    inner_presliding: float = 1.0
    """Of the whole wrist's bend [rad]."""
    stop: float = np.inf
    stop_stiffness: float = 0.0
    stop_dissipation: float = 0.0


def _toward(z: Array, rate: Array, path: float) -> Array:
    return np.asarray((rate - z * np.linalg.norm(rate)) / path)


def real_course(
    parameters: Array, facts: Facts, left: Callable[[float], Array], reeled: Callable[[float], Array], times: Array
) -> Array:
    """Coordinates (K, 2n) at the times [s], from straight at rest with nothing crept or bent.

    `left` is the share of each place's tendons that is whole at a time (T,), `reeled` the length that they have reeled
    in (T,) [m]. Both may jump at the times alone, between which each piece is solved.
    """
    segment = SpatialSegments(*parameters[:FIELDS])
    tendons = np.reshape(parameters[FIELDS:], (-1, OF_A_TENDON))
    count, n = len(tendons), round(float(tendons[:, 2].max()))
    m = 2 * n
    along = np.clip(tendons[:, 2:] - np.arange(n), 0.0, 1.0)
    springs = np.array([[segment.stiffness_yy, segment.stiffness_yz], [segment.stiffness_yz, segment.stiffness_zz]])
    dampers = np.array([[segment.damping_yy, segment.damping_yz], [segment.damping_yz, segment.damping_zz]])
    tip = np.array([segment.force_x, segment.force_y, segment.force_z])
    straight = tendons[:, 2] * segment.length
    sizes = np.cumsum([m, m, count, count, m])

    def rates(time: float, state: Array) -> Array:
        q, rate, z, crept, slack, bent = np.split(state, sizes)
        lengths, arms = augmented_tendons(parameters, q)
        stretch = np.maximum(reeled(time) - (straight - lengths), 0.0)
        wrapped = facts.sheath + along @ np.linalg.norm(q.reshape(-1, 2), axis=1)
        at_spool = (
            left(time) * facts.stiffness * np.maximum(reeled(time) - (straight - lengths) - facts.creep * crept, 0.0)
        )
        pulls = at_spool * np.exp(-facts.friction * wrapped * z)
        at = spatial_augmented(parameters, q, rate)
        passive = (q.reshape(-1, 2) @ springs + rate.reshape(-1, 2) @ dampers).ravel()
        force = at.coriolis @ rate + at.gravity + passive - at.tip_jacobian.T @ tip - pulls @ arms
        force -= facts.spring_creep * (slack.reshape(-1, 2) @ springs).ravel()
        force += facts.inner * bent
        for k in range(n):
            u, v = q[2 * k : 2 * k + 2], rate[2 * k : 2 * k + 2]
            size = float(np.linalg.norm(u))
            if size > facts.stop / n:
                damped = max(0.0, 1.0 + facts.stop_dissipation * float(u @ v) / size)
                force[2 * k : 2 * k + 2] += n * facts.stop_stiffness * (size - facts.stop / n) * damped * u / size
        travelling = arms @ rate
        turning = [
            _toward(bent[2 * k : 2 * k + 2], rate[2 * k : 2 * k + 2], facts.inner_presliding / n) for k in range(n)
        ]
        return np.concatenate([
            rate, np.linalg.solve(at.mass, -force), (travelling - z * np.abs(travelling)) / facts.presliding,
            (stretch - crept) / facts.creep_time, (q - slack) / facts.spring_time, *turning,
        ])  # fmt: skip

    course = [np.zeros(2 * m + 2 * count + 2 * m)]
    for begin, end in pairwise(times):
        last = np.nextafter(end, 0.0)

        def piecewise(time: float, state: Array, last: float = last) -> Array:
            return rates(min(time, last), state)

        span = (float(begin), float(end))
        piece: Any = solve_ivp(piecewise, span, course[-1], "LSODA", rtol=1e-8, atol=1e-10)
        assert piece.success
        course.append(piece.y[:, -1])
    return np.array(course)[:, :m]
