"""Trials rehearsed on the emulated rig in virtual time: how a wrist truly does under each of some controllers."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study
from wristctl.control.table import Gains
from wristctl.errors import UserError
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.motion_limit import limited, peak_tension
from wristctl.trial.rig_belief import layout_of_rig
from wristctl.trial.testbeds import open_testbed
from wristctl.trial.trial_results import metrics_of_trials
from wristctl.trial.trials import Trial, trials_of
from wristctl.vision.view import View


class Rehearsed(NamedTuple):
    """How one controller's trials went."""

    outcome: str
    """ok, or why one of them was stopped or does not count."""
    rmse: float
    """Root of the mean square of the true error over its trials [rad]."""
    swing: float
    """Largest true swing at rest, peak to peak [rad]; 0 where none can be seen."""


def rehearse(study: Study, tuned: Gains | None = None) -> list[Rehearsed]:
    """The trials of the study's hw-run section, for each of its controllers.

    A controller whose trial is stopped ends the run; another run goes on with those that were not tried. Raises what
    ended a run that has tried none, as SafetyStop where the rig cannot be homed.
    """
    left, found = list(range(len(study.hw_run.rows))), dict[int, Rehearsed]()
    while left:
        rows = tuple(study.hw_run.rows[row] for row in left)
        settings = study.hw_run.model_copy(update={"rows": rows})
        done = _run(study.model_copy(update={"hw_run": settings}), tuned)
        found |= {left[row]: each for row, each in done.items()}
        left = [row for row in left if row not in found]
    return [found[row] for row in range(len(study.hw_run.rows))]


def _run(study: Study, tuned: Gains | None) -> dict[int, Rehearsed]:
    """Of the controllers that one run has tried, by their rows: all, or up to the one that ended it."""
    trials = _by_row(study.hw_run)
    study = limited(study, peak_tension(study, trials, None, tuned))
    settings, wrist = study.hw_run, study.wrist
    with tempfile.TemporaryDirectory(prefix="wristctl-rehearsal-") as folder:
        log = log_of(Path(folder), settings, wrist)
        try:
            done = Experiment(settings, wrist, trials, log, tuned=tuned)
            testbed = open_testbed(settings, wrist, study.seed, View(), lambda text, meanwhile: None)
            stop: UserError | None = None
            try:
                done.run(BoardStand(testbed, seed=study.seed))
            except UserError as error:
                stop = error
        finally:
            log.close()
        begun = [trial for trial in trials if trial.number in done.outcomes]
        metrics = metrics_of_trials(Path(folder), begun, done.motions, settings, layout_of_rig(settings, wrist))
    found = {}
    for row in range(len(settings.rows)):
        own = [(done.outcomes[t.number], m) for t, m in zip(begun, metrics, strict=True) if t.row == row]
        bad = next((outcome for outcome, _ in own if outcome != "ok"), "")
        if bad:
            found[row] = Rehearsed(bad.removeprefix("stopped: "), np.nan, np.nan)
        elif own and len(own) == sum(trial.row == row for trial in trials):
            errors, swings = (np.array([m[f"true_{name}"] for _, m in own]) for name in ("rmse", "oscillation"))
            found[row] = Rehearsed("ok", float(np.sqrt(np.mean(errors**2))), 2.0 * float(np.nan_to_num(swings).max()))
    if stop is not None and not found:
        raise stop
    return found


def _by_row(settings: HwRunSettings) -> Sequence[Trial]:
    """All trials, those of a controller one after the other, so that one that swings ends no other's."""
    trials = sorted(trials_of(settings, np.random.default_rng(0)), key=lambda trial: (trial.row, trial.plane))
    return [trial._replace(number=number) for number, trial in enumerate(trials)]
