"""The paper's experiment on the whole chain, from marker to motor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.hw_run.answer import answer_of
from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    check_inverses,
    check_reach,
    check_row,
    identified,
    inverses_of,
    network_for,
    tuned_gains,
)
from wristctl.commands.loop_warnings import outside_conditions, warn_outside_conditions
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.rig_description import describe_rig
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import under

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.simulation.repetitions import Simulation


@dataclass(frozen=True, repr=False, eq=False)
class Performed(StudyResult):
    """Trials on a rig, and the same in simulation."""

    kind = "hw-run"

    trials: pd.DataFrame
    twins: dict[int, Simulation]
    """by the trial's number"""

    @property
    def answer(self) -> Answer:
        """Error by direction, settling and recovery, and how far simulation agrees."""
        return answer_of(self.trials, self.twins, self.metrics, self.marks, self.place)

    @property
    def marks(self) -> list[str]:
        """In how many of the trials that ended well the wrist does not arrive, or tensions chatter."""
        import numpy as np

        from wristctl.simulation.arrival import SHORT
        from wristctl.simulation.oscillation import chatter
        from wristctl.simulation.trajectory import rests

        completed = self.trials[self.trials["outcome"] == "ok"]
        courses = [self.twins[number].trajectory for number in completed["trial"]]
        most = np.array([np.abs(course.theta_ref).max() if rests(course) else np.inf for course in courses])
        short = int((completed["steady_state"].to_numpy(float) > SHORT * most).sum())
        chatters = int((chatter(completed["chattering"].to_numpy(float), self.study.wrist.tension_range) > 0.0).sum())
        counts = {"does not arrive": short, "chatters": chatters}
        return [f"{mark}: {count} of {len(completed)} trials" for mark, count in counts.items() if count]

    def frame(self) -> pd.DataFrame:
        """One row per trial that began."""
        return self.trials


def plan(study: Study, inputs: Inputs) -> str:
    """Check controllers and gains and say what would be done; opens nothing."""
    settings, tuned = study.hw_run, tuned_gains(inputs)
    for number, row in enumerate(settings.rows):
        with under(f"hw-run.controllers.{number}"):
            check_row(row, tuned)
    with under("hw-run"):
        check_reach([settings.reference], identified(study, "hw-run", inputs).wrist, "reference")
        check_inverses(inverses_of([settings.reference]), inputs)
    pushes = settings.without_push + (settings.push.force != 0.0)
    count = len(settings.rows) * len(set(settings.directions)) * settings.repetitions * pushes
    trial_seconds = settings.horizon + settings.back + settings.rest
    return f"{describe_rig(settings)}\n{count} trials, about {count * trial_seconds:.0f} s of motion after homing"


def hw_run(session: Session) -> Performed:
    """Perform the paper's experiment: four directions, with and without a push, on hardware or all emulated."""
    session.operator.tell(describe_rig(session.study.hw_run))
    from wristctl.commands.hw_run.results import trial_tables
    from wristctl.commands.hw_run.trials import perform_trials

    study, bench = session.study, session.study.wrist
    identified_session = replace(session, study=identified(study, "hw-run", session.inputs))
    believed = identified_session.study.hw_run
    network, tuned = (
        network_for(session.inputs, identified_session.study.wrist, [believed.loop]),
        tuned_gains(session.inputs),
    )
    if believed.port is None:
        warn_outside_conditions(believed.rows, [believed.loop])
    elif swinging := outside_conditions(believed.rows, [believed.loop]):
        session.operator.dare("; ".join(swinging))
    trials = perform_trials(identified_session, bench, network, tuned)
    tables, twins = trial_tables(identified_session, trials, network, tuned)
    return Performed(study, session.findings, tables, trials, twins)


HW_RUN = Procedure(
    "hw-run",
    plan,
    hw_run,
    (
        EarlierRun("calibration", kind="calibrate-wrist", optional=True),
        EarlierRun("optics", kind="calibrate-camera", optional=True),
        EarlierRun("optics_2", kind="calibrate-camera", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("network", kind="train", optional=True),
    ),
)
