"""Angles over time that are worked out where they are asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.choices import REFERENCES
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.motion import Angles
from wristctl.simulation.reference import ReferenceKind, motion
from wristctl.simulation.rollout import rollout

WRIST, LOOP = WristParameters(), Loop()


@pytest.fixture
def counted() -> Iterator[list[int]]:
    """How often the course of the reference `counted` has been worked out, one entry for each time."""
    calls = list[int]()

    def course(reference: Reference, time: Array) -> Array:
        calls.append(len(time))
        return np.array([np.sin(time), np.cos(time), -np.sin(time)])

    REFERENCES["counted"] = ReferenceKind("for tests", course, lambda reference: "counted")
    yield calls
    del REFERENCES["counted"]


def test_rows_are_kept_once_asked_for_and_nobody_can_change_them(counted: list[int]) -> None:
    followed = motion(Reference(kind="counted", angle_deg=17.0), WRIST, 1.0, 1e-3)
    assert counted == [], "nobody has asked"
    turn, time = np.deg2rad(17.0), np.arange(1000) * 1e-3
    assert np.array_equal(followed.theta_ref, turn * np.sin(time))
    assert np.array_equal(followed.rate_ref, turn * np.cos(time))
    assert np.array_equal(followed.acceleration_ref, turn * -np.sin(time) + 0.0)
    assert np.array_equal(followed.theta_desired, followed.theta_ref)
    assert followed.final == turn * np.sin(0.999)
    assert counted == [1000]
    with pytest.raises(ValueError, match="read-only"):
        followed.theta_ref[0] = 1.0


def test_rollouts_leave_no_rows_behind_and_use_those_that_there_are(counted: list[int]) -> None:
    """A thousand references of a sweep are a table in the batch, and not as much again in their motions."""
    law = controller("pid-ff")
    motions = [motion(Reference(kind="counted", angle_deg=float(each)), WRIST, 0.2, 1e-3) for each in (5, 9)]
    gains, which = np.tile(gains_of(law, "default"), (2, 1)), np.arange(2)
    assert motions[1].theta_ref.shape == (200,) and len(counted) == 1
    for begun in (1, 2):
        outcome = rollout(law, gains, motions, which, loop=LOOP, wrist=WRIST)
        assert len(counted) == 1 + begun, "the first one's, which nobody has asked for, each time"
    assert "rows" not in vars(motions[0].angles) and "rows" in vars(motions[1].angles)
    for own, each in zip(outcome.references, motions, strict=True):
        assert np.array_equal(own, each.angles.rows)


def test_a_course_of_its_own_may_be_left_for_later() -> None:
    """It is worked out where a batch asks for it, and its last move is from straight to where it ends."""
    asked: dict[str, object] = {"kind": "chirp", "angle_deg": 30.0}
    ahead = motion(Reference.model_validate(asked), WRIST, 1.0, 1e-3)
    assert "rows" in vars(ahead.angles) and ahead.goals.move == ahead.final == ahead.angles.rows[0, -1]
    too_far = Reference.model_validate(asked | {"offset_deg": -25.0})
    with pytest.raises(UserError, match="bends by 5"):
        motion(too_far, WRIST, 1.0, 1e-3)
    waiting = motion(too_far, WRIST, 1.0, 1e-3, later=True)
    with pytest.raises(UserError, match="bends by 5"):
        waiting.angles.into(np.empty((3, 1000)))
    later = motion(Reference.model_validate(asked | {"offset_deg": 5.0}), WRIST, 1.0, 1e-3, later=True)
    law = controller("pid-ff")
    outcome = rollout(law, np.array([gains_of(law, "default")] * 2), [ahead, later], np.arange(2), LOOP, WRIST)
    assert "rows" not in vars(later.angles)
    np.testing.assert_array_equal(outcome.references[1], later.angles.rows)
    same = rollout(law, np.array([gains_of(law, "default")]), [later], np.zeros(1, int), LOOP, WRIST)
    for name, values in outcome.metrics.items():
        assert values[1:].tobytes() == same.metrics[name].tobytes(), "its move was known once its rows were"


def test_what_is_known_is_copied() -> None:
    known = Angles.of(np.arange(6.0).reshape(3, 2))
    out = np.full((3, 2), np.nan)
    known.into(out)
    assert np.array_equal(out, [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]) and np.array_equal(known.rows, out)


def test_no_zero_of_a_move_is_negative() -> None:
    rows = motion(Reference(angle_deg=-20.0), WRIST, 3.0, 1e-3).angles.rows
    assert (rows == 0.0).any() and not np.signbit(rows[rows == 0.0]).any()
