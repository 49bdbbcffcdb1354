"""Loops in two planes against equations of motion in NumPy that SciPy integrates (`tests/oracles`)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.oracles.spatial_augmented import Rubbing, parameters_of, spatial_motion
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Motion
from wristctl.simulation.spatial_references import bend_path

LAW = controller("pid-ff")
# Springs on oblique axes, gravity across, and a force aside.
WRIST = WristParameters(flexion_ratio=1.6, stiffness_axis_deg=30.0, gravity=(-7.0, 2.0), gravity_flexion=-1.0)
CORNER = WRIST.tendon_radius / np.sqrt(2.0)
PLACES = CORNER * np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
FORCE = np.array([0.2, 0.6, -0.4])
TICK = 0.01
RUBBING = Rubbing(stiffness=20e3, friction=0.15, sheath=1.0, presliding=2e-5)
# Spools that turn evenly from tick to tick, in microsteps too small to matter: their rates take effect at once.
EVENLY = {
    "command_delay": 0.0,
    "update": 1e-6,
    "ramp": 1e12,
    "microstep": 16384,
    "step_rate": 2e7,
    "step_acceleration": 5e7,
}
MOTORS = {"level": "tendon", "friction": RUBBING.friction, "sheath": RUBBING.sheath, **EVENLY}


@pytest.mark.slow
@pytest.mark.parametrize(("segments", "motors", "horizon", "steps"), [(2, {}, 0.4, 20), (1, MOTORS, 0.6, 40)])
def test_what_a_loop_pulls_bends_the_same_wrist_by_another_integrator(
    segments: int, motors: dict[str, Any], horizon: float, steps: int
) -> None:
    """To a thousandth of a degree: under the loop's pulls, or of tendons that stretch and rub its spools' lengths."""
    loop = Loop.model_validate(
        {"control_period": TICK, "substeps": steps, "plant_segments": segments, "actuator": motors}
    )  # fmt: skip
    path = bend_path("circumduction", 25.0, horizon, horizon)[:, :, :: round(TICK / 1e-3)]
    followed = Motion.of_bends(path, TICK, WRIST.length)
    course = follow(LAW, np.array(gains_of(LAW, "default")), followed, WRIST, loop, FORCE).trajectory
    acting = course.acting
    assert acting is not None
    if motors:
        assert course.spools is not None
        middles = (np.arange(steps * (len(course.time) - 1)) + 0.5) / steps
        held = np.array([np.interp(middles, np.arange(len(course.time)), spool) for spool in course.spools.T]).T
    else:
        held = np.repeat(course.tension[:-1], steps, axis=0)
    parameters = parameters_of(WRIST, PLACES, segments, FORCE)
    found = spatial_motion(parameters, segments, held, TICK / steps, RUBBING if motors else None)[::steps]
    assert np.ptp(course.bend, axis=0).min() > 0.5 and np.ptp(acting, axis=0).min() > 5.0
    np.testing.assert_allclose(course.segment_theta, found, atol=np.deg2rad(1e-3))
