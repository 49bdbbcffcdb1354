"""What a recording says of its own angles: their noise, and a camera that does not stand where it was calibrated."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.recordings import RawVideo, angle_noise, base_askew, times_beside
from wristctl.vision.view import View

SQUARE = 22.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) + 200.0


def test_the_table_beside_a_video_is_its_own_where_it_has_a_row_for_each_frame(tmp_path: Path) -> None:
    times, grey = [0.1, 0.1 + 1.0 / 3.0, 7.0], np.full((48, 64), 90, np.uint8)
    video = RawVideo(tmp_path / "raw.avi", 30.0)
    for number, time in enumerate(times):
        video.add(Frame(grey, time, number), sighting(SQUARE))
    video.close()
    found = times_beside(tmp_path / "raw.avi", 3)
    assert found is not None and found.tolist() == times
    assert times_beside(tmp_path / "raw.avi", 2) is None and times_beside(tmp_path / "raw.avi", 4) is None
    table = tmp_path / "raw.csv"
    table.write_text(table.read_text().replace("number,clock", "clock,number"))
    assert times_beside(tmp_path / "raw.avi", 3) is None
    assert times_beside(tmp_path / "other.avi", 3) is None and times_beside(tmp_path, 3) is None


def test_noise_is_told_apart_from_motion() -> None:
    rng, time = np.random.default_rng(0), np.arange(4000) / 60.0
    still = 0.07 * rng.standard_normal(len(time))
    for motion in (0.0 * time, 25.0 + 3.0 * time, 20.0 * np.sin(0.5 * time)):
        assert angle_noise(motion + still) == pytest.approx(0.07, rel=0.05)
    assert angle_noise(3.0 * time) == pytest.approx(0.0, abs=1e-12)


def test_frames_without_an_angle_leave_the_noise_of_the_others() -> None:
    angles = 0.07 * np.random.default_rng(1).standard_normal(4000)
    angles[::50] = np.nan
    assert angle_noise(angles) == pytest.approx(0.07, rel=0.05)
    assert math.isnan(angle_noise(np.array([1.0, np.nan, 2.0, 3.0, np.nan]))) and math.isnan(angle_noise(np.zeros(2)))


def sighting(corners: np.ndarray, theta: float = 0.1) -> Sighting:
    return Sighting(0.0, 0, theta, SightingVerdict.OK, np.stack([corners, corners + 50.0]))


def test_a_square_that_looks_narrow_is_as_far_off_as_its_shape_allows() -> None:
    narrow = SQUARE * [0.9, 1.0]
    assert base_askew(View(), [sighting(SQUARE)]) == pytest.approx(0.0, abs=1e-12)
    # turned by a, its diagonal appears at atan(0.9 tan a) or so: at worst asin((1 - 0.9) / (1 + 0.9)) off
    assert base_askew(View(), [sighting(narrow)]) == pytest.approx(math.asin(0.1 / 1.9), rel=1e-9)


def test_noise_of_single_corners_averages_out_and_frames_without_an_angle_do_not_count() -> None:
    rng = np.random.default_rng(2)
    seen = [sighting(SQUARE + rng.normal(0.0, 0.3, (4, 2))) for _ in range(400)]
    wild = [sighting(SQUARE * [0.5, 1.0], math.nan)] * 50
    assert base_askew(View(), seen + wild) < 0.1 * np.mean([base_askew(View(), [each]) for each in seen])
