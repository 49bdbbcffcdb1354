"""Trials that wind by the stretch of the tendons that homing has measured, and not by the believed one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.commands.adoption import with_planes
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.rehearsed import rehearse

WRIST = WristParameters()


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("believed", [12e3, 20e3])
def test_steps_per_radian_tell_the_stiffness_of_tendons_softer_and_stiffer_than_believed(
    planes: int, believed: float
) -> None:
    settings = HwRunSettings.model_validate(
        {"planes": planes, "actuator": {"level": "tendon", "tendon_stiffness": believed}}
    )
    moves = ExpectedMoves(settings, WRIST, "ulnar" if planes == 1 else "")
    for share in (0.85, 1.0, 1.5, 1.9):
        true = share * believed
        assert moves.measured_stiffness([moves.steps(true)] * 4) == pytest.approx(true, rel=1e-9)
    apart = moves.steps(true) + np.array([-9.0, 9.0, 4.0, -4.0])
    assert moves.measured_stiffness(apart.tolist()) == pytest.approx(true, rel=1e-9), "by the mean of all tendons"
    assert moves.measured_stiffness([moves.steps(1e3)] * 4) == 0.8 * believed
    assert moves.measured_stiffness([0.98 * moves.steps(math.inf)] * 4) == 2.0 * believed


@pytest.mark.slow
@pytest.mark.parametrize("tendons", ["four", "three"])
def test_an_emulated_rig_with_weak_springs_misses_less_without_feedback_once_it_winds_as_homing_measured(
    tendons: str,
) -> None:
    """Springs of 0.7 are bent too far by tendons that are wound for springs as they are believed."""
    missed: dict[str, float] = {}
    for stretch in ("believed", "measured"):
        study: Any = wristctl.load_study(
            None,
            "hw-run={controllers: [{controller: feedforward, gains: {}}], directions: [radial], push: {force: 0}, "
            "horizon: 2.5, back: 0.5, rest: 0.1, reference: {angle_deg: 20, duration: 0.8}, "
            f"bench: {{person: {{takes: 0}}}}, homing: {{frames: 4, rest: 0.1, let_go: 0.6, stretch: {stretch}}}}}",
            f"wrist.tendons={tendons}",
            "wrist.gravity=[9.81, 0.0]",
            "wrist.stiffness=1.5",
        )
        (done,) = rehearse(with_planes(study))
        assert done.outcome == "ok"
        missed[stretch] = math.degrees(done.rmse)
    assert missed["believed"] > 0.3 and missed["measured"] < 0.6 * missed["believed"], missed
