"""A bend across by the size of a marker: told of a wrist that bends, not of light, dirt or lens."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.trial.picture_faults import FAULTS, performed
from wristctl.trial.camera_record import CameraRecord
from wristctl.vision.marker import Sighting, SightingVerdict

# Bend for a relative change of the size, and what a marker that stands may seem to bend [rad].
NEARER, DOUBTFUL = 5.0, math.radians(0.5)
RATE = 60.0


class Shown:
    """A camera that shows a wrist at rest, then what is asked for, picture by picture."""

    def __init__(self) -> None:
        self.record, self._number = CameraRecord(NEARER, DOUBTFUL), 0
        for _ in range(30):
            self(0.0)

    def __call__(self, across: float, stands: float = 1.0, grey: float = 100.0) -> float:
        """What a picture of a bend across [rad] tells of it."""
        time, self._number = self._number / RATE, self._number + 1
        sighting = Sighting(
            time, self._number, 0.0, SightingVerdict.OK, np.zeros((2, 4, 2)), 0.8 * math.exp(-across / NEARER),
            stands=stands, grey=grey,
        )  # fmt: skip
        self.clock = time + 0.03
        return self.record.saw(sighting, time, np.zeros(2), 0.0, self.clock).away

    @property
    def doubted(self) -> float:
        return self.record.doubted(self.clock, 10.0)


@pytest.mark.parametrize("toward", [1.0, -1.0])
def test_a_wrist_that_bends_across_is_told_as_fast_as_wrists_do(toward: float) -> None:
    shown = Shown()
    for bend in np.radians(np.arange(0.7, 5.0, 0.7)) * toward:
        assert shown(bend) == pytest.approx(bend)
    assert shown.doubted == 0.0


@pytest.mark.parametrize("toward", [1.0, -1.0])
def test_a_size_that_jumps_is_the_pictures_and_counts_from_there(toward: float) -> None:
    shown, jump = Shown(), math.radians(4.0) * toward
    told = [shown(jump) for _ in range(45)]
    assert math.isnan(told[0]) and told[-1] == pytest.approx(0.0)
    assert 0.3 < shown.doubted < 0.7, "one jump stops nobody"
    for _ in range(60):
        shown(jump)
    for bend in np.radians(np.arange(0.5, 3.0, 0.5)):
        last = shown(jump + bend)
    assert last == pytest.approx(bend), "a bend after it is told"


@pytest.mark.parametrize(
    "looks", [{"stands": 1.002}, {"stands": 0.998}, {"stands": math.nan}, {"grey": 111.0}, {"grey": 89.0}]
)
def test_a_picture_in_which_what_stands_changes_tells_no_bend(looks: dict[str, float]) -> None:
    shown = Shown()
    drift = math.radians(0.05)
    assert all(math.isnan(shown(k * drift, **looks)) for k in range(59))
    assert shown.doubted > 0.95


@pytest.mark.parametrize("looks", [{"stands": 1.001}, {"stands": 0.999}, {"grey": 109.0}, {"grey": 91.0}])
def test_a_little_noise_is_no_doubt(looks: dict[str, float]) -> None:
    shown = Shown()
    assert shown(math.radians(0.5), **looks) == pytest.approx(math.radians(0.5)) and shown.doubted == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["exposure that hunts", "rim covered by 6 %"])
def test_no_spoiled_picture_is_called_a_motor_or_a_tendon(name: str) -> None:
    outcome, odd = performed(FAULTS[name])
    assert "axis" not in outcome and "motor" not in outcome and "pictures" in odd
