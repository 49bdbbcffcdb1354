"""Loops in two planes against equations of motion in NumPy that SciPy integrates (`tests/oracles`)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.oracles.spatial_augmented import Rubbing, parameters_of, spatial_motion
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.bend_paths import bend_path
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Motion

LAW = controller("pid-ff")
# Springs on oblique axes, gravity across, and a force aside.
WRIST = WristParameters(flexion_ratio=1.6, stiffness_axis_deg=30.0, gravity=(-7.0, 2.0), gravity_flexion=-1.0)
CORNER = WRIST.tendon_radius / np.sqrt(2.0)
PLACES = CORNER * np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
FORCE = np.array([0.2, 0.6, -0.4])
TICK = 0.01
RUBBING = Rubbing(stiffness=20e3, friction=0.15, sheath=1.0, presliding=2e-5)
MOTORS = {"level": "tendon", "friction": RUBBING.friction, "sheath": RUBBING.sheath}


@pytest.mark.slow
@pytest.mark.parametrize(("segments", "motors", "horizon"), [(1, {}, 0.8), (2, {}, 0.4), (1, MOTORS, 0.8)])
def test_what_a_loop_pulls_bends_the_same_wrist_by_another_integrator(
    segments: int, motors: dict[str, Any], horizon: float
) -> None:
    """To a thousandth of a degree: under the loop's pulls, or of tendons that stretch and rub its spools' lengths."""
    loop = Loop.model_validate(
        {"control_period": TICK, "substeps": 20, "plant_segments": segments, "actuator": motors}
    )  # fmt: skip
    path = bend_path("circumduction", 25.0, horizon, horizon)[:, :, :: round(TICK / 1e-3)]
    followed = Motion.of_bends(path, TICK, WRIST.length)
    course = follow(LAW, np.array(gains_of(LAW, "default")), followed, WRIST, loop, FORCE).trajectory
    held = course.spools if motors else course.tension
    acting = course.acting
    assert held is not None and acting is not None
    parameters = parameters_of(WRIST, PLACES, segments, FORCE)
    found = spatial_motion(parameters, segments, held[:-1], TICK, RUBBING if motors else None)
    assert np.ptp(course.bend, axis=0).min() > 0.5 and np.ptp(acting, axis=0).min() > 5.0
    np.testing.assert_allclose(course.segment_theta, found, atol=np.deg2rad(1e-3))
