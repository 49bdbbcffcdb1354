"""The same trial in simulation: loop, reference, push and controller of a trial, without board and camera."""

from __future__ import annotations

from collections.abc import Mapping

from wristctl.config.control import SimulateSettings
from wristctl.config.plant import Disturbances
from wristctl.config.study import Study
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.repetitions import Simulation
from wristctl.trial.trials import Trial
from wristctl.wrist.kinematics import Inverse


def twin(
    study: Study, trial: Trial, network: Inverse | None, tuned: Mapping[str, Mapping[str, float]] | None
) -> Simulation:
    """Simulate a trial of the study's hw-run section."""
    settings = study.hw_run
    row = settings.rows[trial.row]
    disturbances = Disturbances(push=trial.pushed(settings.push))
    chosen = SimulateSettings(
        controller=row.controller,
        gains=row.gains,
        loop=settings.loop.model_copy(update={"disturbances": disturbances}),
        reference=settings.reference,
        direction=trial.direction,
        horizon=settings.horizon,
    )
    return simulate(study.model_copy(update={"simulate": chosen}), network, tuned).first
