"""Two cameras as one rig's look: bends of one time, each picture told once."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Sensor
from wristctl.config.wrist import WristParameters
from wristctl.trial.board_rig import BoardRig
from wristctl.trial.camera_record import CameraRecord
from wristctl.vision.marker import Sighting, SightingVerdict

RATE, SPEED = 60.0, np.array([0.5, -0.3])


class _Clock:
    """Pictures of two cameras half a frame apart, of a wrist that bends evenly."""

    def __init__(self) -> None:
        self.time = 0.0
        self._told = [0, 0]

    def now(self) -> float:
        return self.time

    def look(self) -> list[Sighting]:
        found = []
        for plane in (0, 1):
            while (at := (self._told[plane] + 0.5 * plane) / RATE) <= self.time:
                self._told[plane] += 1
                corners = np.full((2, 4, 2), math.nan)
                bend = float(SPEED[plane] * at)
                found.append(Sighting(at, self._told[plane], bend, SightingVerdict.OK, corners, plane=plane))
        return found

    def bend(self, sighting: Sighting, other: float) -> float:
        return sighting.theta


def test_a_look_has_both_bends_of_its_time_and_is_news_once_a_frame() -> None:
    clock = _Clock()
    testbed: Any = SimpleNamespace(transport=clock, tracking=lambda: clock)
    rig = BoardRig(testbed, HwRunSettings(planes=2), WristParameters())
    rig._tracking = cast("Any", clock)
    times = list[float]()
    for tick in range(200):
        clock.time = 0.01 * tick
        look = rig.look()
        if np.isfinite(look.bend).all():
            assert np.allclose(look.bend, SPEED * look.time, atol=1e-12)
            times.append(look.time)
    news = np.unique(times)
    assert len(news) / 2.0 == pytest.approx(RATE, rel=0.03) and (np.diff(times) >= 0.0).all()


def test_more_bends_than_expected_are_no_missing_ones() -> None:
    record, sensor = CameraRecord(math.nan), Sensor(level="camera", frame_rate=60.0, dropped=0.0)
    sighting = Sighting(0.0, 0, 0.0, SightingVerdict.OK, np.full((2, 4, 2), math.nan))
    for frame in range(180):
        record.saw(sighting, frame / 90.0, np.zeros(2), 0.0, frame / 90.0)
    assert record.unseen(2.0, 2.0, sensor) == 0.0
    assert record.unseen(2.0, 2.0, sensor.model_copy(update={"frame_rate": 180.0})) == pytest.approx(0.5, abs=0.01)
