"""The forward model in two planes: the bend that a wrist takes where its tendons' spools are moved as recorded.

Candidates run side by side, one a lane, on the plant, the tendons and the integrator of the simulation.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.wrist.spatial.posture import tip_bend
from wristctl.wrist.spatial.spatial_segments import (
    FIELDS,
    OF_A_TENDON,
    SpatialWrist,
    load_spatial_segments,
    rows_of_tendons,
    spatial_values,
)
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spatial_tendons import lengths_along
from wristctl.wrist.spatial.spooled_tendons import OF_A_STATE, RubbingTendons, remember_travel, travel_of
from wristctl.wrist.tendon_layout import TendonLayout

SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest on its first spool positions."""
# Bend of a segment [rad] beyond which a candidate stays where it was.
_MOST = 3.1


class SupposedBends(NamedTuple):
    """A wrist in two planes and its tendons as they may be."""

    wrist: WristParameters
    tendons: Actuator
    places: Array
    """Places of the tendons in the cross-section (M, 2) [m], toward ulnar and toward flexion."""
    taut: tuple[float, ...]
    """Length that each tendon has reeled in beyond its spool's count [m]."""


class _Shapes(NamedTuple):
    """Tuples with an entry, of no meaning, for each coordinate, each value and each state of tendons, each tendon."""

    cut: Any
    of_tendons: Any
    of_states: Any
    of_pulls: Any


@kernel
def _follow(values: Any, state: Any, reeled: Any, h: float, settle: int, out: Any, shapes: Any) -> None:
    rows, states = rows_of(values), rows_of(state)
    m, tendons = len(shapes.cut), len(shapes.of_pulls)
    wrist = SpatialWrist(load_spatial_segments(rows), part(rows, FIELDS, shapes.of_tendons))
    first = FIELDS + len(shapes.of_tendons)
    taut, stiffness = part(rows, first, shapes.of_pulls), part(rows, first + tendons, shapes.of_pulls)
    last = first + 2 * tendons
    memory = part(states, 2 * m, shapes.of_states)
    rubbing = RubbingTendons(stiffness, rows[last], rows[last + 1], rows[last + 2], memory)
    q, rate = part(states, 0, shapes.cut), part(states, m, shapes.cut)
    spools, lengths, before = lanes_like(taut), lanes_like(taut), lanes_like(q)
    zero = zero_like(wrist.segment.length)
    alive = 1.0 + zero
    for k in range(-settle, reeled.shape[0]):
        now = max(k, 0)
        for t in range(tendons):
            spools[t] = reeled[now, t] + taut[t]
        if k >= 0:
            row = rows_of(out[k])
            row[0], row[1], _, _, _ = tip_bend(wrist.segment, q, rate)
            lengths_along(wrist, q, lengths)
            for t in range(tendons):
                row[2 + t] = stiffness[t] * maximum(0.0, spools[t] - travel_of(wrist, t, lengths[t]))
        for i in range(m):
            before[i] = q[i]
        spatial_step(wrist, q, rate, spools, rubbing, h + zero)
        for i in range(m // 2):
            size = q[2 * i] * q[2 * i] + q[2 * i + 1] * q[2 * i + 1]
            alive = where(size < _MOST * _MOST, alive, zero)
        for i in range(m):
            q[i] = where(alive > 0.0, q[i], before[i])
            rate[i] = where(alive > 0.0, rate[i], zero)
        remember_travel(rubbing, wrist, q)


def courses_of_bends(candidates: Sequence[SupposedBends], reeled: Array, h: float, n: int) -> Array:
    """Bends [rad] and pulls at the spools [N] of candidates, (count, T, 2 + M), at steps of h [s].

    Parameters
    ----------
    candidates : wrists, cut into n segments, with M tendons each
    reeled : length that each spool has reeled in since its tendon was taut and free of tension on the straight wrist
        (T, M) [m], held over each step; at first the wrist is at rest
    """
    tendons, coordinates, count = reeled.shape[1], 2 * n, len(candidates)
    of_tendons, of_states = (0,) * (OF_A_TENDON * tendons), (0,) * (OF_A_STATE * tendons)
    shapes = _Shapes((0,) * coordinates, of_tendons, of_states, (0,) * tendons)
    rows = np.array([_values(candidate, n) for candidate in candidates])
    blocks = to_blocks(np.repeat(rows, 2, axis=0) if count == 1 else rows)  # one width is compiled
    spools = np.ascontiguousarray(reeled, float)
    out = np.empty((len(blocks), len(spools), 2 + tendons, blocks.shape[2]))
    for values, course in zip(blocks, out, strict=True):
        state = np.zeros((2 * coordinates + len(of_states), blocks.shape[2]))
        _follow(values, state, spools, h, round(SETTLE / h), course, shapes)
    flat = to_rows(out.reshape(len(out), -1, blocks.shape[2]), count)
    return flat.reshape(count, len(spools), 2 + tendons)


def _values(supposed: SupposedBends, n: int) -> Array:
    wrist, tendons, count = supposed.wrist, supposed.tendons, len(supposed.places)
    own = spatial_values(wrist, TendonLayout.four(wrist.tendon_radius), n, axis=np.radians(wrist.stiffness_axis_deg))
    friction = [tendons.friction, tendons.sheath, 1.0 / tendons.presliding]
    stiffness = np.full(count, tendons.tendon_stiffness)
    return np.concatenate([own[:FIELDS], rows_of_tendons(supposed.places, n), supposed.taut, stiffness, friction])
