"""Disturbances, evaluated on the sample grid before the loop runs: forces on the last disc and stiffness in time.

The entries of `wristctl.config.choices.DISTURBANCES`: their forces add, their scales of the stiffness multiply.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import DISTURBANCES as _TABLE
from wristctl.config.choices import Choices
from wristctl.config.plant import Disturbances
from wristctl.config.section import Parameter

# [m/s^2]
_GRAVITY = 9.81
# From the settings and times (T,) [s] to what is so then, (T,).
Of = Callable[[Disturbances, Array], Array]


@dataclass(frozen=True)
class Disturbance:
    """One kind of disturbance: what it does over time, and whether these settings have it act at all.

    `parameters` are the leaves that it adds to the section, where it is not the section's own.
    """

    meaning: str
    acts: Callable[[Disturbances], bool]
    force: Of | None = None
    """On the last disc, across the straight wrist [N]."""
    scale: Of | None = None
    """Stiffness over that of the plant."""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)


DISTURBANCES: Choices[Disturbance] = _TABLE


def acting(settings: Disturbances, time: Array) -> Array | None:
    """Tip force across the straight wrist [N] and stiffness over the plant's own, (T, 2); None if nothing acts."""
    chosen = [disturbance for disturbance in DISTURBANCES.values() if disturbance.acts(settings)]
    if not chosen:
        return None
    force, scale = np.zeros(len(time)), np.ones(len(time))
    for disturbance in chosen:
        force = force if disturbance.force is None else force + disturbance.force(settings, time)
        scale = scale if disturbance.scale is None else scale * disturbance.scale(settings, time)
    return np.stack([force, scale], axis=1)


def acting_in_space(settings: Disturbances, time: Array) -> Array | None:
    """Tip force [N] along the straight wrist, toward ulnar and toward flexion, and stiffness over the plant's own.

    (T, 4); None if nothing acts.
    """
    if (pushes := acting(settings, time)) is None:
        return None
    toward = np.deg2rad(settings.toward_deg)
    force, scale = pushes.T
    return np.stack([np.zeros_like(force), np.cos(toward) * force, np.sin(toward) * force, scale], axis=1)


def _push(settings: Disturbances, time: Array) -> Array:
    push = settings.push
    phase = (time - push.start) / push.duration
    return np.where((phase > 0.0) & (phase < 1.0), push.force * np.sin(np.pi * phase), 0.0)


def _drift(settings: Disturbances, time: Array) -> Array:
    drift = settings.drift
    return 1.0 + (drift.scale - 1.0) * np.clip((time - drift.start) / drift.duration, 0.0, 1.0)


def _grasp(settings: Disturbances, time: Array) -> Array:
    grasp = settings.grasp
    return grasp.mass * _GRAVITY * np.clip((time - grasp.start) / grasp.duration, 0.0, 1.0)


LOAD = Disturbance(
    "a constant force", lambda settings: settings.load != 0.0, force=lambda s, time: np.full(len(time), s.load)
)
PUSH = Disturbance("a person's push", lambda settings: settings.push.force != 0.0, force=_push)
GRASP = Disturbance("an object taken up", lambda settings: settings.grasp.mass != 0.0, force=_grasp)
DRIFT = Disturbance("springs that change", lambda settings: settings.drift.scale != 1.0, scale=_drift)
