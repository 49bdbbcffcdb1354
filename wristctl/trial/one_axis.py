"""One motor by itself before the camera: which way it turns, and how slack its tendon is, with a small bend at most."""

from __future__ import annotations

import math
from typing import NamedTuple

from wristctl.config.hw_run import CalibrateWristSettings
from wristctl.trial.in_sight import in_sight
from wristctl.trial.rig_strokes import RigStrokes
from wristctl.trial.testbeds import Testbed


class AxisTried(NamedTuple):
    """What one motor does."""

    sense: int
    """1 where positive steps reel in, -1 where they pay out."""
    taken_up: float
    """Tendon [m] until the wrist bent by half of what it may."""
    bend: float
    """Of the wrist then [rad], + as the markers count."""


def axis_tried(testbed: Testbed, settings: CalibrateWristSettings, axis: int) -> AxisTried:
    """Try an axis, let its tendon go again, and release the drives. Closes the testbed.

    Raises SafetyStop where it bends the wrist too far, or not at all; BoardError and CameraError.
    """
    with in_sight(testbed, settings) as (board, _, tracking):
        strokes = RigStrokes(board, tracking, settings, axis, math.radians(settings.max_deg))
        steps, bend = strokes.taken_up()
        strokes.let_go()
    return AxisTried(1 if steps > 0 else -1, abs(steps) * settings.actuator.step_length, bend)
