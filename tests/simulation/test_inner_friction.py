"""Friction inside the wrist against closed forms: where slack tendons leave a bent wrist, and the area of its loop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.simulation.spool_driven import Spooled, SpooledWrist, spooled

WRIST = WristParameters(gravity=(0.0, 0.0), gravity_flexion=0.0, damping=0.05)
SLOW = WRIST.model_copy(update={"damping": 0.4})
SMOOTH = Actuator(level="tendon", friction=0.0, tendon_stiffness=20e3)
N, H = 4, 1e-3


def driven(travel: Array, wrists: list[SpooledWrist], slack: float = 0.0) -> Spooled:
    """Spools that reel in on one side what they pay out on the other, and tendons with so much slack [m]."""

    def told(time: Array, lanes: NDArray[np.int64]) -> Array:
        path = np.interp(time, H * np.arange(len(travel)), travel)
        both = np.stack([path - slack, -path - slack], axis=1)
        return np.repeat(both[:, :, None], len(np.ravel(lanes)), axis=2).reshape(len(time), 2, *np.shape(lanes))

    return spooled(wrists, told, len(travel), H)


def wrist(torque: float, presliding_deg: float = 0.2, begin: float = 0.0, z: float = 0.0) -> SpooledWrist:
    """A wrist let go of far from straight is damped enough not to overshoot."""
    plant = TrueWrist(inner_friction=torque, inner_presliding_deg=presliding_deg)
    return SpooledWrist(SLOW if abs(begin) > 0.1 else WRIST, SMOOTH, np.full(N, begin / N), plant=plant, inner_z=z)


def test_slack_tendons_leave_a_bent_wrist_where_friction_balances_its_springs() -> None:
    """K theta = T on its way back from either side, and anywhere between it stays: no tendon pulls."""
    torques = [0.05, 0.05, 0.1, 0.0]
    begins = [0.4, -0.4, 0.5, 0.4]
    rest = driven(
        np.zeros(6000), [wrist(t, begin=b, z=math.copysign(1.0, b)) for t, b in zip(torques, begins, strict=True)], 0.02
    ).theta[:, -1]
    expected = np.sign(begins) * np.array(torques) / WRIST.stiffness
    np.testing.assert_allclose(rest, expected, atol=1e-4)
    within = 0.6 * 0.05 / WRIST.stiffness
    held = driven(np.zeros(3000), [wrist(0.05, begin=within, z=-0.6), wrist(0.05, begin=-within, z=0.6)], 0.02).theta
    np.testing.assert_allclose(held, np.array([[within], [-within]]) * np.ones(held.shape), atol=1e-6)


@pytest.mark.parametrize("presliding_deg", [0.1, 1.0])
def test_the_area_of_a_loop_is_the_torque_along_its_way(presliding_deg: float) -> None:
    """Of the work at the spools, damping apart, a cycle loses T (4 swing - 4 presliding): its bristle turns twice."""
    time = np.arange(0.0, 9.0, H)
    torques = [0.02, 0.06]
    course = driven(4e-3 * np.sin(0.5 * np.pi * time), [wrist(torque, presliding_deg) for torque in torques], -2e-4)
    one = slice(5000, 9000)
    for lane, torque in enumerate(torques):
        raw, damped, theta = course.raw[lane, one], course.damped[lane, one], course.theta[lane, one]
        lost = (raw[-1] - raw[0]) - (damped[-1] - damped[0])
        exact = torque * (2.0 * float(np.ptp(theta)) - 4.0 * math.radians(presliding_deg))
        assert lost == pytest.approx(exact, rel=0.01) and lost > 5e-3
    np.testing.assert_array_equal(course.friction, 0.0 * course.friction)


def test_no_inner_friction_beside_some_is_none_to_the_bit() -> None:
    travel = 4e-3 * np.sin(2.0 * np.pi * np.arange(0.0, 0.3, H))
    alone = driven(travel, [wrist(0.0), wrist(0.0)], -2e-4)
    beside = driven(travel, [wrist(0.0), wrist(0.05)], -2e-4)
    np.testing.assert_array_equal(alone.theta[0], beside.theta[0])
    assert np.abs(beside.theta[1] - beside.theta[0]).max() > 1e-3
