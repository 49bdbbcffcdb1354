"""The ways of a trial: there, back and rest."""

from __future__ import annotations

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.arrays import Array
from wristctl.config.choices import REFERENCES
from wristctl.config.loop import Reference
from wristctl.errors import UserError
from wristctl.simulation.reference import ReferenceKind
from wristctl.trial.motions import back, motion_of

PERIOD = 5e-3


def test_the_way_back_begins_where_the_wrist_is_and_ends_straight_and_at_rest() -> None:
    way = back(0.4, 1.0, 0.5, PERIOD)
    assert way.time == pytest.approx(np.arange(300) * PERIOD)
    assert way.theta_ref[0] == 0.4 and (way.theta_ref[way.time >= 1.0] == 0.0).all()
    assert way.theta_ref[100] == pytest.approx(0.2), "half way in half of its time"
    assert (way.rate_ref[[0, -1]] == 0.0).all() and way.rate_ref[100] == pytest.approx(-0.4 * 15.0 / 8.0)
    assert (way.goals.move, way.begin, way.rest, way.horizon, way.final) == (-0.4, 0.0, 1.0, 1.5, 0.0)
    assert np.array_equal(way.theta_desired, way.theta_ref)
    assert way.tip_desired.shape == (300, 2)


def test_its_rate_and_acceleration_are_its_derivatives() -> None:
    way = back(-0.3, 0.8, 0.0, 1e-3)
    assert np.gradient(way.theta_ref, way.time)[1:-1] == pytest.approx(way.rate_ref[1:-1], abs=1e-4)
    assert np.gradient(way.rate_ref, way.time)[1:-1] == pytest.approx(way.acceleration_ref[1:-1], abs=1e-2)


def test_at_rest_it_stays_straight() -> None:
    way = back(0.0, 0.25, 0.0, PERIOD)
    assert len(way.time) == 50
    assert not np.any([way.theta_ref, way.rate_ref, way.acceleration_ref])


def test_a_trials_motion_is_mirrored_where_its_direction_counts_negative() -> None:
    settings = settings_of(horizon=0.6)
    there, other, flexion = (motion_of(settings, WRIST, each) for each in ("ulnar", "radial", "flexion"))
    assert np.degrees(there.final) == pytest.approx(8.0) and len(there.time) == 60 and there.horizon == 0.6
    assert there.theta_ref == pytest.approx(-other.theta_ref) and there.theta_ref == pytest.approx(flexion.theta_ref)
    assert np.diff(there.time) == pytest.approx(settings.control_period)


def test_a_reference_that_is_no_number_somewhere_never_comes_to_the_motors(monkeypatch: pytest.MonkeyPatch) -> None:
    def course(reference: Reference, time: Array) -> Array:
        return np.array([time, np.where(time > 0.3, np.nan, 1.0), 0.0 * time])

    monkeypatch.setitem(REFERENCES, "gap", ReferenceKind("for tests", course, lambda reference: "gap"))
    with pytest.raises(UserError, match="samples that are no number"):
        motion_of(settings_of(reference=Reference(kind="gap")), WRIST, "ulnar")
