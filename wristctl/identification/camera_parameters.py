"""The camera as the logged frames of identified trials show it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

MOST_DELAYED = 20.0
"""Frames of delay that a simulated camera may have."""


def camera_parameters(frames: pd.DataFrame, delay: float, noise: float) -> dict[str, float]:
    """Frame rate [1/s], delay in frames from exposure to use, noise [deg], dropped share: as `loop.sensor` has them.

    `frames` has a row for each frame: run, trial, the time stamp `captured` and the time `used` [s], and the verdict.
    `delay` is how much older a picture is than its time stamp [s], `noise` the standard deviation of an angle [rad].
    """
    rate = 1.0 / float(frames.groupby(["run", "trial"]).captured.diff().median())
    used = float((frames.used - frames.captured).mean())
    return {
        "frame_rate": rate,
        "delay_frames": float(np.clip((used + delay) * rate, 0.0, MOST_DELAYED)),
        "noise_deg": float(np.degrees(noise)),
        "dropped": float((frames.verdict != "ok").mean()),
    }
