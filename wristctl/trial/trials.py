"""The trials of an experiment: their order, their motions, what the log shows of them, and each in simulation."""

import math
from typing import NamedTuple

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Disturbances
from wristctl.simulation.motion import Motion
from wristctl.trial.motions import has_path
from wristctl.wrist.directions import DIRECTIONS

# Bend [rad] below which a push has nothing to be against.
_STRAIGHT = math.radians(1.0)


class Trial(NamedTuple):
    """One move and back."""

    number: int
    direction: str
    """Of bending; of a path in two planes its name."""
    repetition: int
    push: float
    """Largest force against the bend [N], 0 without a push."""
    row: int
    """Index into the settings' rows of controllers."""

    @property
    def scenario(self) -> str:
        """Name that the trial's noise goes by: direction and push, without row and repetition."""
        return f"{self.direction}, push {self.push:g} N"

    @property
    def plane(self) -> str:
        """The bending plane; empty where it is no direction of one plane."""
        return DIRECTIONS[self.direction].plane if self.direction in DIRECTIONS else ""

    def disturbances(self, settings: HwRunSettings, followed: Motion) -> Disturbances:
        """What disturbs this trial: in one plane its push against the bend, in two toward `push_toward_deg`.

        Without that it is against the bend that is wanted where the push begins.
        """
        if followed.planes == 1:
            force = -DIRECTIONS[self.direction].sign * self.push
            return Disturbances(push=settings.push.model_copy(update={"force": force}))
        toward = settings.push_toward_deg
        if toward is None:
            bend = [np.interp(settings.push.start, followed.time, plane) for plane in followed.bend_ref.T]
            toward = math.degrees(math.atan2(-bend[1], -bend[0])) if np.hypot(*bend) > _STRAIGHT else 90.0
        push = settings.push.model_copy(update={"force": self.push})
        return Disturbances(push=push, toward_deg=toward)


def motions_of(settings: HwRunSettings) -> list[str]:
    """Names of the motions: directions, or the one path in two planes that the reference is."""
    if settings.planes == 2 and has_path(settings):
        return [settings.reference.kind]
    return list(dict.fromkeys(settings.directions))


def trials_of(settings: HwRunSettings, rng: np.random.Generator) -> list[Trial]:
    """All trials: planes in random order, since the wrist must be turned between them, and all of a plane shuffled.

    On a rig that bends in two planes nobody turns the wrist, and all are shuffled.
    """
    pushes = [0.0] * settings.without_push + [settings.push.force] * (settings.push.force != 0.0)
    every = [
        (direction, repetition, push, row)
        for direction in motions_of(settings)
        for repetition in range(settings.repetitions)
        for push in pushes
        for row in range(len(settings.rows))
    ]
    turned = {name: "" if settings.planes == 2 else DIRECTIONS[name].plane for name in motions_of(settings)}
    ordered = []
    for plane in rng.permutation(list(dict.fromkeys(turned.values()))):
        members = [combination for combination in every if turned[combination[0]] == plane]
        ordered += [members[k] for k in rng.permutation(len(members))]
    return [Trial(number, *combination) for number, combination in enumerate(ordered)]
