"""Samples of the loaded wrist at rest: n segments in gravity, bent by tendons, where curvature is not constant.

At each pose and payload the tendons are pulled until the last disc has the wanted angle. The tip alone does not tell
that angle: the same tip belongs to another angle where the load is another.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from wristctl.config.errors import UserError
from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, Samples, unit_cube
from wristctl.learning.domain import OTHERS, Domain
from wristctl.wrist.kinematics import chain_tip, exact_arc
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.statics import equilibria_at
from wristctl.wrist.tendons import TENDONS_PER_SIDE

GRAVITY = 9.81
"""[m/s^2]"""

BLOCK = 20_000
"""Equilibria that are searched together: a bound on memory."""


def draw_equilibria(
    settings: DataSettings, wrist: WristParameters, rng: np.random.Generator, done: Callable[[int], object] = int
) -> Samples:
    """Stable equilibria with the angle in +-range_deg, poses in turn, payloads in their range; `done` gets their count.

    What the tendons cannot hold within their limit, or what buckles, is left out. Raises UserError where that is
    more than half.
    """
    count, n = settings.samples, settings.segments
    unit = unit_cube(settings.sampling, count, 2, rng)
    theta = math.radians(wrist.range_deg) * (2.0 * unit[:, 0] - 1.0)
    low, high = settings.payload
    payload = low + (high - low) * unit[:, 1]
    tilts = np.radians([*settings.poses, *settings.held_out_poses])
    which = np.arange(count) % len(tilts)
    pose, hand = tilts[which], wrist.hand_mass * (1.0 + payload)

    found = []
    for begin in range(0, count, BLOCK):
        some = slice(begin, begin + BLOCK)
        parameters = np.tile(segments(wrist, n), (len(theta[some]), 1))
        parameters[:, Segments._fields.index("hand_mass")] = hand[some]
        parameters[:, Segments._fields.index("gravity_x")] = -GRAVITY * np.cos(pose[some])
        parameters[:, Segments._fields.index("gravity_y")] = GRAVITY * np.sin(pose[some])
        found.append(equilibria_at(parameters, n, theta[some], TENDONS_PER_SIDE * wrist.pretension))
        done(begin + len(parameters))
    bent, pulls, stable = (np.concatenate(parts) for parts in zip(*found, strict=True))
    held = stable & (pulls.max(axis=1) <= TENDONS_PER_SIDE * wrist.tension_limit)
    if 2 * held.sum() < count:
        raise UserError(
            f"{count - held.sum()} of {count} equilibria buckle or need more than {wrist.tension_limit:g} N",
            where="gen-data.payload",
            fix="lower the payload or wrist.hand_mass, or leave out the upright pose",
        )
    first, last = settings.held_out_payload
    code = np.where((payload >= first) & (payload <= last), HELD_PAYLOAD, 0)
    code = np.where(which >= len(settings.poses), HELD_POSE, code)[held]
    tip = chain_tip(bent[held], wrist.length)
    others = np.column_stack([pose, hand])[held]
    inside = code != HELD_POSE
    domain = Domain.around(tip[inside], others[inside])
    return Samples(tip, theta[held], exact_arc(tip)[1], domain, others, tuple(OTHERS), code, n)
