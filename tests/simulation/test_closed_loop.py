"""Where a closed loop begins: straight, or at rest under pretension and gravity."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.errors import UserError
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.trajectory import Trajectory
from wristctl.study_files.load import load_study
from wristctl.wrist.statics import equilibrium

LEANING = "wrist={gravity: [-9.0, 3.0]}"


def course(*settings: str) -> Trajectory:
    """Of a single loop on four segments."""
    study = load_study(overrides=[LEANING, "horizon=0.05", "loop.plant_segments=4", *settings], command="simulate")
    return simulate(study).first.trajectory


def test_a_loop_begins_straight_or_where_the_wrist_hangs_under_its_pretension() -> None:
    study = load_study(overrides=[LEANING])
    pretension = study.wrist.pretension
    hanging = equilibrium(study.wrist, 4, (pretension, pretension))
    assert course().theta[0] == 0.0
    found = course("start=equilibrium")
    np.testing.assert_allclose(found.theta[0], hanging.sum(), rtol=1e-9)
    assert found.theta[0] > 0.01


def test_a_wrist_that_its_pretension_buckles_has_nowhere_to_hang() -> None:
    with pytest.raises(UserError, match="buckles"):
        course("start=equilibrium", "wrist.hand_mass=0.9")
