"""Disturbances, evaluated on the sample grid before the loop runs: forces on the last disc and stiffness in time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.config.plant import Disturbances
from wristctl.lanes.compiled import compiled
from wristctl.wrist.segments import Segments

Array = NDArray[np.float64]


def course(disturbances: Disturbances, time: Array) -> Array | None:
    """Tip force across the straight wrist [N] and stiffness over the plant's own, (T, 2); None if nothing acts."""
    push, load, drift = disturbances.push, disturbances.load, disturbances.drift
    if push.force == load == 0.0 and drift.scale == 1.0:
        return None
    phase = (time - push.start) / push.duration
    force = load + np.where((phase > 0.0) & (phase < 1.0), push.force * np.sin(np.pi * phase), 0.0)
    scale = 1.0 + (drift.scale - 1.0) * np.clip((time - drift.start) / drift.duration, 0.0, 1.0)
    return np.stack([force, scale], axis=1)


@compiled
def disturb(own: Any, force: float, scale: float) -> Any:
    """The plant under one sample's disturbance."""
    return Segments(
        own.length, own.mass, own.hand_mass, own.hand_offset, own.gravity_x, own.gravity_y, own.tendon_offset,
        own.spans, scale * own.stiffness, own.damping, own.force_x, force + own.force_y,
    )  # fmt: skip
