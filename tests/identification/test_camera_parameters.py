"""The camera that a simulation gets is the one that the logged frames came from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from wristctl.identification.intervals import Knowledge
from wristctl.identification.measured_trials import camera_parameters


def logged(run: str, trial: int, start: float, frames: int = 120, rate: float = 60.0) -> pd.DataFrame:
    captured = start + np.arange(frames) / rate
    verdict = np.where(np.arange(frames) % 10 == 3, "no tip", "ok")
    used = captured + 0.02
    return pd.DataFrame({"run": run, "trial": trial, "captured": captured, "used": used, "verdict": verdict})


def test_rate_delay_and_losses_are_those_of_the_frames() -> None:
    """Each trial's clock begins anew: the gaps between trials are no frame times."""
    frames = pd.concat([logged("a", 0, 0.0), logged("a", 1, 0.0), logged("b", 0, 7.0)])
    found = camera_parameters(frames, delay=0.03, noise=np.deg2rad(0.08))
    assert found == pytest.approx({"frame_rate": 60.0, "delay_frames": 3.0, "noise_deg": 0.08, "dropped": 0.1})


def test_a_delay_stays_within_what_a_simulated_camera_may_have() -> None:
    frames = logged("a", 0, 0.0)
    assert camera_parameters(frames, -1.0, 1e-3)["delay_frames"] == 0.0
    assert camera_parameters(frames, 1.0, 1e-3)["delay_frames"] == 20.0


def test_residuals_that_resemble_their_neighbours_speak_against_the_model() -> None:
    known = Knowledge(np.ones(1), np.eye(1), 1.0, 0.1, 100.0, np.zeros(1))
    assert not known.misses_something and replace(known, autocorrelation=0.5).misses_something
