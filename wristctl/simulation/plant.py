"""The simulated wrist, which may differ from the one that its controller knows."""

from __future__ import annotations

from wristctl.config.plant import Plant
from wristctl.config.wrist import WristParameters


def plant_of(wrist: WristParameters, plant: Plant) -> WristParameters:
    """The wrist with the plant's own stiffness, damping and payload."""
    return wrist.model_copy(
        update={
            "stiffness": wrist.stiffness * plant.stiffness_scale,
            "damping": wrist.damping * plant.damping_scale,
            "hand_mass": wrist.hand_mass + plant.payload,
        }
    )
