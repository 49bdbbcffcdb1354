"""What hw-run does in its run directory: the trials with their log, then metrics and tables of them."""

from __future__ import annotations

import json
import logging
from typing import Any

import cv2
import numpy as np
import pandas as pd

from wristctl.cli.command import Session, Table
from wristctl.cli.loops import network_of, tuned_of
from wristctl.cli.operator import operator
from wristctl.cli.trial_panel import trials_shown
from wristctl.config.tables import PLANTS
from wristctl.config.wrist import WristParameters
from wristctl.simulation.metrics import METRICS
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.experiment import Experiment
from wristctl.trial.log import TrialLog
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import open_testbed
from wristctl.trial.trial_metrics import JUDGED, evaluated
from wristctl.trial.trials import Trial, trials_of
from wristctl.vision.annotate import AnnotatedVideo
from wristctl.vision.view import View
from wristctl.wrist.directions import ACTIVE

log = logging.getLogger(__name__)

_OF_TRIALS: dict[str, tuple[str, str]] = {
    "trial": ("", "number, from 0, in the order done"),
    "direction": ("", "of bending"),
    "repetition": ("", "number, from 0"),
    "push": ("N", "largest force against the bend"),
    "controller": ("", "name in the table of controllers"),
    "gains": ("", "preset, tuned or own"),
    "outcome": ("", "ok, or why it ended early"),
    **{name: (metric.unit, metric.formula) for name, metric in METRICS.items()},
    **{f"true_{name}": (METRICS[name].unit, f"{METRICS[name].formula}; of the true angle") for name in JUDGED},
    "recovery": ("s", "from the end of the push in the estimated load until |e| stays within 2 % of the move"),
    "true_recovery": ("s", "the same by the emulated wrist's true angle, from the true end of the push"),
    "push_torque": ("N m", "largest load torque of the push, as estimated"),
}


def performed(session: Session, bench: WristParameters) -> pd.DataFrame:
    """Do all trials, logged as they go; a row for each. What stops them is raised once everything is kept.

    The controller knows the session's wrist; `bench` is the one that an emulated bench weakens.
    """
    settings, run, study = session.settings, session.run, session.study
    cv2.setNumThreads(1)
    trials = trials_of(settings, np.random.default_rng(run.stream("order")))
    calibration = WristCalibration.load(session.inputs["calibration"]) if "calibration" in session.inputs else None
    plant = PLANTS[settings.bench.plant.model]
    coordinates = plant.coordinates(settings.bench.segments) if settings.port is None else None
    trial_log = TrialLog(run.file("data/log.csv").parent, coordinates, settings.control_period)
    experiment = Experiment(
        settings,
        study.wrist,
        trials,
        trial_log,
        network_of(session),
        tuned_of(session.inputs),
        calibration,
        study.seed,
    )
    film = AnnotatedVideo(run.file("data/video.avi"), settings.sensor.frame_rate) if settings.video else None
    stopped: BaseException | None = None
    try:
        with session.progress("preparing the emulated bench" if settings.port is None else "opening board and camera"):
            view, keep = View.of(session.inputs.get("optics")), film.add if film else None
            testbed = open_testbed(settings, bench, study.seed, view, operator(session), keep)
        with trials_shown(session, trials) as shown:
            experiment.run(testbed, shown)
    except BaseException as error:
        stopped = error
    try:
        trial_log.close()
    except OSError as error:
        stopped = stopped or SafetyStop(f"the log cannot be written: {error.strerror}", "data", "free space")
    if film is not None:
        film.close()
    for name, stream in trial_log.streams.items():
        run.columns(f"data/{name}.csv", stream.columns)
    table = _judged(session, experiment, trials)
    _say_how_it_went(session, experiment, trial_log)
    if stopped is not None:
        raise stopped
    return table


def _judged(session: Session, experiment: Experiment, trials: list[Trial]) -> pd.DataFrame:
    """trials.csv: a row for each trial that began, by the log alone."""
    settings, run = session.settings, session.run
    courses = pd.read_csv(run.file("data/log.csv"))
    file = run.file("data/truth.csv")
    truths = pd.read_csv(file) if file.is_file() else None
    rows = []
    for trial in trials:
        if trial.number not in experiment.outcomes:
            continue
        row = settings.rows[trial.row]
        course = courses[courses["trial"] == trial.number]
        truth = None if truths is None else truths[truths["trial"] == trial.number]
        followed = experiment.motions[trial.direction]
        rows.append(
            {
                "trial": trial.number,
                "direction": trial.direction,
                "repetition": trial.repetition,
                "push": trial.push,
                "controller": row.controller,
                "gains": row.gains_name,
                "outcome": experiment.outcomes[trial.number],
                **evaluated(trial, course, followed, settings.push, settings.control_period, truth),
            }
        )
    table = pd.DataFrame(rows, columns=list(_OF_TRIALS))
    units, meaning = ({name: column[i] for name, column in _OF_TRIALS.items()} for i in range(2))
    run.table("data/trials.csv", table, units=units, meaning=meaning)
    return table


def _say_how_it_went(session: Session, experiment: Experiment, trial_log: TrialLog) -> None:
    """Timing, zero, and where it was stopped why, whether the motors stand, and the last second."""
    run, settings, timing = session.run, session.settings, experiment.timing
    run.metric("ticks", len(timing.late), meaning="control ticks")
    run.metric("overruns", timing.overruns, better="lower", meaning="ticks skipped because one before took too long")
    for name, share in (("late_p50", 0.5), ("late_p99", 0.99), ("late_max", 1.0)):
        run.metric(name, timing.jitter(share), "s", "lower", n=len(timing.late), meaning="from due to begun, of a tick")
    if timing.late and (settings.real_time or settings.port is not None):
        late, median, most = (f"{1e3 * timing.jitter(share):.2f} ms" for share in (0.99, 0.5, 1.0))
        told = (
            f"{len(timing.late)} ticks of {1e3 * timing.period:g} ms, late by {median} (p50), {late} (p99), {most} at "
            f"most; {timing.overruns} overruns"
        )
        session.console.print(told, markup=False, highlight=False, soft_wrap=True)
        run.summary(told)
    if experiment.zero is not None:
        _write(session, "data/zero.json", experiment.zero.plain())
    if experiment.stop is None:
        return
    stop = experiment.stop
    _write(session, "data/stop.json", stop.plain())
    sure = "the motors stand" if stop.halt.verified else "the motors could NOT be seen to stand"
    log.warning("%s after %.0f ms (%s)", sure, 1e3 * stop.halt.seconds, stop.halt.how)
    text = last_second(trial_log).text()
    run.summary(f"{stop.reason}\n\n```\n{text}\n```")
    log.warning("%s\n%s", stop.reason, text)


def last_second(trial_log: TrialLog) -> Table:
    """The last second of ticks, every tenth of it."""
    rows = list(trial_log.last)
    shown = rows[:: -max(1, len(rows) // 10)][::-1]
    columns = ("time [s]", "theta [deg]", "reference [deg]", "marker", *(f"T{k} [N]" for k in ACTIVE), "state")
    cells = [
        (
            round(row["time"], 3),
            round(float(np.degrees(row["theta"])), 2),
            round(float(np.degrees(row["theta_ref"])), 2),
            str(row["verdict"]) or "-",
            *(round(row[f"tension_{k}"], 2) for k in ACTIVE),
            row["state"],
        )
        for row in shown
    ]
    return Table("The last second", columns, cells)


def _write(session: Session, name: str, content: Any) -> None:
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    session.run.file(name).write_text(text, encoding="utf-8")
