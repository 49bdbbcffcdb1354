"""The world that a rollout runs in, which may differ from what its controller knows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.config.loop import Loop
from wristctl.config.plant import Plant
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy


class World(NamedTuple):
    """A loop, and the wrist as its controller knows it."""

    loop: Loop
    wrist: WristParameters


def plant_of(wrist: WristParameters, plant: Plant) -> WristParameters:
    """The wrist with the plant's own stiffness, damping and payload."""
    return wrist.model_copy(
        update={
            "stiffness": wrist.stiffness * plant.stiffness_scale,
            "damping": wrist.damping * plant.damping_scale,
            "hand_mass": wrist.hand_mass + plant.payload,
        }
    )


def drawn(plant: Plant, stream: Entropy) -> Plant:
    """The plant with its spreads drawn; the same stream draws every plant the same way, each by its own spreads."""
    if plant.stiffness_spread == plant.damping_spread == plant.payload_spread == 0.0:
        return plant
    stiffness, damping, payload = np.random.default_rng(stream).random(3).tolist()
    return plant.model_copy(
        update={
            "stiffness_scale": plant.stiffness_scale * (1.0 + plant.stiffness_spread * (2.0 * stiffness - 1.0)),
            "damping_scale": plant.damping_scale * (1.0 + plant.damping_spread * (2.0 * damping - 1.0)),
            "payload": plant.payload + plant.payload_spread * payload,
            "stiffness_spread": 0.0,
            "damping_spread": 0.0,
            "payload_spread": 0.0,
        }
    )


def loops_of(loop: Loop, streams: Sequence[Entropy]) -> list[Loop]:
    """The loop with its plant drawn by each of the streams."""
    plants = [drawn(loop.plant, each) for each in streams]
    return [loop if each is loop.plant else loop.model_copy(update={"plant": each}) for each in plants]
