"""Waiting and reading the marker beside a board that stands."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.trial.rig import Marker, RigBoard
from tests.trial.test_rig_facts import posed
from wristctl.config.hw_run import Homing
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Patience
from wristctl.vision.marker import Sighting, SightingVerdict


def test_waiting_keeps_the_boards_link_alive() -> None:
    board: Any = RigBoard()
    Patience(board).wait(0.1)
    assert board.transport.now() == pytest.approx(100.1)
    assert len(board.pings) == pytest.approx(5, abs=1) and max(np.diff(board.pings)) < 0.05
    Patience(board).wait(0.0)
    assert board.transport.now() == pytest.approx(100.1)


def test_a_reading_is_the_median_of_as_many_usable_frames_as_asked_for() -> None:
    board: Any = RigBoard()
    angles = iter([9.0, 0.1, math.nan, 0.5, 0.2, 7.0, 7.0])
    tracking: Any = Marker(board, lambda: next(angles))
    assert Patience(board).reading(tracking, 3).theta == 0.2, "what was seen before does not count"
    assert next(angles) == 7.0


def test_frames_taken_before_the_reading_began_do_not_count() -> None:
    board: Any = RigBoard()
    angles = iter([0.0, 1.0, 2.0, 3.0, 4.0])
    tracking: Any = Marker(board, lambda: next(angles))
    tracking.delay = 0.03  # at 20 ms between looks: the first comes from before
    assert Patience(board).reading(tracking, 1).theta == 2.0


def test_a_marker_that_cannot_be_read_for_two_seconds_is_said_with_why() -> None:
    board: Any = RigBoard()
    tracking: Any = Marker(board, lambda: math.nan)
    with pytest.raises(SafetyStop, match=r"could not be read \(newest frame: no tip\)"):
        Patience(board).reading(tracking, 1)
    assert 2.0 < board.transport.now() - 100.0 < 2.1


def test_a_step_that_nobody_has_asked_for_ends_the_wait() -> None:
    board: Any = RigBoard()
    patience = Patience(board)
    patience.pulse()
    board.position[2] += 1
    with pytest.raises(SafetyStop, match=r"moved by \[0, 0, 1, 0\] steps"):
        patience.pulse()


def test_a_camera_too_oblique_for_its_markers_is_refused_and_one_that_is_not_is_told() -> None:
    board: Any = RigBoard()
    tracking: Any = Marker(board, lambda: 0.0)
    for pan, most in ((-14.0, 15.0), (14.0, 15.0), (4.0, 5.0)):
        tracking.stand_square = lambda seen, pan=pan: posed(0.0, pan)
        (pose,) = Patience(board).stand_square(tracking, Homing(oblique_deg=most))
        assert pose is not None and math.degrees(pose.oblique) == pytest.approx(abs(pan))
        with pytest.raises(SafetyStop, match=f"looks {abs(pan):.0f} deg off square .*, beyond") as stopped:
            Patience(board).stand_square(tracking, Homing(oblique_deg=abs(pan) - 0.5))
        assert "--optics" in str(stopped.value.fix)


@pytest.mark.parametrize("lost", [None, 0, 1])
def test_a_bend_that_two_cameras_do_not_give_is_no_reading(monkeypatch: pytest.MonkeyPatch, lost: int | None) -> None:
    seen = [Sighting(0.0, k, 0.1, SightingVerdict.OK, np.zeros((2, 4, 2)), plane=k) for k in range(2)]
    tracking: Any = SimpleNamespace(
        zero=(0.0, 0.0), bend=lambda sighting, _: math.nan if sighting.plane == lost else 0.2
    )
    board: Any = RigBoard()
    patience = Patience(board)
    monkeypatch.setattr(patience, "sightings", lambda *_: seen)
    if lost is None:
        assert patience.reading(tracking, 1).beside == 0.2
    else:
        with pytest.raises(SafetyStop):
            patience.reading(tracking, 1)
