"""The two-plane task's file, and its wrist."""

from __future__ import annotations

import numpy as np
from task import BendTask
from truth import GAINS, HORIZON, PERIOD

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.spatial_references import bend_path
from wristctl.simulation.worlds import bending_limit
from wristctl.wrist.directions import in_plane
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.spatial_segments import spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

WRIST = WristParameters(gravity=(-8.0, 4.0), gravity_flexion=4.0, flexion_ratio=1.5)
"""Its planes differ, in stiffness and in gravity."""
PATH, SIZE_DEG, TURN = "circumduction", 25.0, 2.0


def loop_of(task: BendTask, steps: int, actuator: str = "ideal") -> Loop:
    """wristctl's loop; motors that reel elastic tendons (`tendon`) or ideal ones."""
    free = {"level": actuator, "friction": 0.0} if actuator == "tendon" else {"level": actuator}
    return Loop.model_validate({
        "plant_segments": task.segments, "control_period": task.period, "substeps": steps, "planes": 2,
        "coupling": "ignored", "actuator": free,
    })  # fmt: skip


def make_bend_task(n: int) -> BendTask:
    """The hand circles about the straight wrist by 25 degrees, a turn in 2 s, at 1 kHz."""
    layout = TendonLayout.of(WRIST)
    return BendTask(
        n, PERIOD, WRIST.pretension, WRIST.tension_limit, bending_limit(WRIST),
        spatial_values(WRIST, layout, n), spatial_values(WRIST, layout, 1),
        segments(in_plane(WRIST, "ulnar"), 1), segments(in_plane(WRIST, "flexion"), 1), np.array(GAINS),
        bend_path(PATH, SIZE_DEG, TURN, HORIZON - PERIOD),
    )  # fmt: skip
