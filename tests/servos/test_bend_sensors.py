"""Bends by a robot's own sensors: rotations that are known, however the unit is mounted, and drifts that drop out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from wristctl.errors import UserError
from wristctl.servos.bend_sensors import (
    StraightGravity,
    StraightOrientation,
    bends_from_encoders,
    bends_from_gravity,
    bends_from_quaternion,
    bends_from_rotation,
    relative_quaternion,
)

BENDS = st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
ROTATIONS = st.integers(0, 10_000).map(lambda seed: Rotation.random(rng=np.random.default_rng(seed)))
MOUNTINGS = st.sampled_from([("x", "y"), ("z", "x"), ("y", "z"), ("-z", "x"), ("x", "-z")])
LETTERS = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2]}


def frame(mounting: tuple[str, str]) -> Any:
    """Axes of the wrist in the sensor's, as rows."""
    along, toward = ((-1.0 if name[0] == "-" else 1.0) * LETTERS[name[-1]] for name in mounting)
    return np.stack([along, toward, np.cross(along, toward)])


def bent(bend: tuple[float, float], mounting: tuple[str, str] = ("x", "y")) -> Rotation:
    """Rotation without twist by a bend, in the sensor's axes when the wrist is straight."""
    _, ulnar, flexion = frame(mounting)
    along = frame(mounting)[0]
    return Rotation.from_rotvec(np.cross(along, bend[0] * ulnar + bend[1] * flexion))


def wxyz(rotation: Rotation) -> Any:
    return rotation.as_quat()[[3, 0, 1, 2]]


@given(BENDS, ROTATIONS, MOUNTINGS, st.sampled_from([1.0, -1.0]))
def test_a_unit_tells_its_bend_however_it_is_mounted_and_whatever_its_zero(
    bend: tuple[float, float], zero: Rotation, mounting: tuple[str, str], sign: float
) -> None:
    now = zero * bent(bend, mounting)
    assert bends_from_quaternion(sign * wxyz(now), wxyz(zero), *mounting) == pytest.approx(bend, abs=1e-9)
    assert bends_from_rotation(now.as_matrix(), zero.as_matrix(), *mounting) == pytest.approx(bend, abs=1e-9)


@given(BENDS, ROTATIONS, ROTATIONS, st.floats(-3.0, 3.0))
def test_motions_of_the_forearm_and_a_common_drift_drop_out_with_two_units(
    bend: tuple[float, float], forearm: Rotation, mounted: Rotation, drift: float
) -> None:
    heading = Rotation.from_rotvec([0.0, 0.0, drift])
    straight = relative_quaternion(wxyz(Rotation.identity()), wxyz(mounted))
    now = relative_quaternion(wxyz(heading * forearm), wxyz(heading * forearm * mounted * bent(bend)))
    assert bends_from_quaternion(now, straight) == pytest.approx(bend, abs=1e-9)


@given(BENDS, st.floats(-2.0, 2.0), MOUNTINGS)
def test_the_heading_of_an_upright_wrist_may_drift(
    bend: tuple[float, float], drift: float, mounting: tuple[str, str]
) -> None:
    along = frame(mounting)[0]
    now = wxyz(Rotation.from_rotvec(drift * along) * bent(bend, mounting))
    straight = (1.0, 0.0, 0.0, 0.0)
    assert bends_from_quaternion(now, straight, *mounting, upright=True) == pytest.approx(bend, abs=1e-8)
    if abs(drift) > 0.1 and math.hypot(*bend) > 0.1:
        assert np.linalg.norm(bends_from_quaternion(now, straight, *mounting) - np.array(bend)) > 1e-3


@given(BENDS, MOUNTINGS, st.floats(0.1, 20.0))
def test_gravity_tells_the_bend_of_a_wrist_that_stands(
    bend: tuple[float, float], mounting: tuple[str, str], size: float
) -> None:
    down = -size * frame(mounting)[0]
    now = bent(bend, mounting).inv().apply(down)
    assert bends_from_gravity(now, down, *mounting) == pytest.approx(bend, abs=1e-7)


def test_gravity_across_the_wrist_tells_none() -> None:
    assert np.isnan(bends_from_gravity([0.0, 1.0, 0.0], [0.0, 1.0, 0.0])).all()


@given(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.integers(-3, 3), st.sampled_from([(1, 1), (-1, 1), (1, -1)]))
def test_two_encoders_are_two_turns_one_after_the_other(
    ulnar: float, flexion: float, turns: int, senses: tuple[int, int]
) -> None:
    hand = (Rotation.from_rotvec([0.0, 0.0, ulnar]) * Rotation.from_rotvec([0.0, -flexion, 0.0])).apply([1.0, 0, 0])
    size = math.acos(min(1.0, hand[0]))
    across = math.hypot(hand[1], hand[2])
    expected = hand[1:] * (size / across if across > 1e-9 else 1.0)
    counts = np.array([ulnar, flexion]) / math.tau * 4096 * np.array(senses) + [100.0 + 4096 * turns, -7.0]
    found = bends_from_encoders(counts, (100.0, -7.0), 4096, senses)
    assert found == pytest.approx(expected, abs=1e-6)


def test_one_plane_alone_is_the_encoders_own_angle() -> None:
    assert bends_from_encoders((0.3, 0.0)) == pytest.approx([0.3, 0.0])
    assert bends_from_encoders((0.0, -0.4)) == pytest.approx([0.0, -0.4])


@pytest.mark.parametrize("reading", [[0.0] * 4, [math.nan, 0.0, 0.0, 1.0]])
def test_a_reading_that_is_none_is_a_bend_not_seen(reading: list[float]) -> None:
    assert np.isnan(bends_from_quaternion(reading)).all()
    assert np.isnan(bends_from_gravity(reading[:3], [1.0, 0.0, 0.0])).all()
    assert np.isnan(bends_from_encoders([reading[0], math.nan])).all()
    assert np.isnan(bends_from_rotation(np.zeros((3, 3)))).all()


def test_the_zero_is_the_mean_of_the_first_readings_whatever_their_sign() -> None:
    rng, sensor = np.random.default_rng(0), StraightOrientation("z", "x", readings=200)
    mounted = Rotation.random(rng=rng)
    for _ in range(200):
        shaken = mounted * Rotation.from_rotvec(rng.normal(0.0, 0.02, 3))
        assert np.isnan(sensor.bend(rng.choice([1.0, -1.0]) * wxyz(shaken))).all()
    assert np.isnan(sensor.bend([0.0] * 4)).all()
    found = sensor.bend(wxyz(mounted * bent((0.2, -0.1), ("z", "x"))))
    assert found == pytest.approx((0.2, -0.1), abs=0.006)


def test_gravitys_zero_is_the_mean_of_the_first_readings() -> None:
    sensor = StraightGravity("z", "x", readings=2)
    assert np.isnan(sensor.bend([0.1, 0.0, -9.81])).all() and np.isnan(sensor.bend([-0.1, 0.0, -9.81])).all()
    down = bent((0.3, 0.2), ("z", "x")).inv().apply([0.0, 0.0, -9.81])
    assert sensor.bend(down) == pytest.approx((0.3, 0.2), abs=1e-9)


def test_axes_that_are_one_are_named() -> None:
    with pytest.raises(UserError, match="one axis"):
        bends_from_quaternion([1.0, 0.0, 0.0, 0.0], along="x", toward="-x")
