"""The trials of hw-run with their log, a row for each by the log alone, and how they went."""

import logging
import math
from functools import partial

import cv2
import numpy as np
import pandas as pd

from wristctl.commands.live_record import keep_live, tell_address, with_record
from wristctl.commands.printed_table import Table, degrees
from wristctl.commands.rig_description import coming_first
from wristctl.commands.session import Session
from wristctl.config.choices import RIGS
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.table import Gains
from wristctl.errors import fix_of
from wristctl.reader_units import in_degrees
from wristctl.records import LiveRun
from wristctl.simulation.metrics import METRICS, metrics_in
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.experiment import Experiment, Stand, Stop, log_of
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog
from wristctl.trial.residuals import FILE, limits_of, plain, residual
from wristctl.trial.rig_belief import PLANES, layout_of_rig
from wristctl.trial.rig_settings import rig_of
from wristctl.trial.rig_stand import BEFORE_MOTION, RigStand
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import open_testbed
from wristctl.trial.trial_results import FURTHER, JUDGED, LOGGED, TRULY, metrics_of_trials
from wristctl.trial.trials import Trial, trials_of
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting
from wristctl.vision.recordings import COLUMNS as RAW
from wristctl.vision.recordings import AnnotatedVideo, RawVideo
from wristctl.vision.view import View
from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

# Films of each camera.
Films = list[list[AnnotatedVideo | RawVideo]]

_IN_TWO_PLANES = metrics_in(2)
_OF_ANY: dict[str, tuple[str, str]] = {
    "trial": ("", "number, from 0, in the order done"),
    "direction": ("", "of bending"),
    "repetition": ("", "number, from 0"),
    "push": ("N", "largest force against the bend"),
    "controller": ("", "name in the table of controllers"),
    "gains": ("", "preset, tuned or own"),
    "outcome": ("", "ok, or why it ended early or does not count"),
    "odd": ("", "what was odd all the same: beyond what a sound rig shows, within the limits"),
}
_OF_TRIALS: dict[str, tuple[str, str]] = {
    **_OF_ANY,
    **{name: (metric.unit, metric.formula) for name, metric in METRICS.items()},
    **{f"true_{name}": (METRICS[name].unit, f"{METRICS[name].formula}; of the true angle") for name in JUDGED},
    "recovery": ("s", "from the end of the push in the estimated load until |e| stays within 2 % of the move"),
    "true_recovery": ("s", "the same by the emulated wrist's true angle, from the true end of the push"),
    "push_torque": ("N m", "largest load torque of the push, as estimated"),
}
_OF_BENDS: dict[str, tuple[str, str]] = {
    **_OF_ANY,
    "direction": ("", "of bending, or the path in two planes"),
    "push": ("N", "largest force"),
    **{name: (_IN_TWO_PLANES[name].unit, _IN_TWO_PLANES[name].formula) for name in LOGGED},
    **{
        f"true_{name}": (_IN_TWO_PLANES[name].unit, f"{_IN_TWO_PLANES[name].formula}; of the true bend")
        for name in TRULY
    },
    **FURTHER,
}


def perform_trials(
    session: Session, bench: WristParameters, network: Inverse | None, tuned: Gains | None
) -> pd.DataFrame:
    """Do all trials, logged as they go; a row for each. What stops them is raised once everything is kept.

    The controller knows the session's wrist; `bench` is the one that an emulated bench weakens. What moves is logged on
    the disk as it does: there must be a run directory.
    """
    settings, run, study = session.study.hw_run, session.findings.run, session.study
    assert run is not None
    cv2.setNumThreads(1)
    trials = trials_of(settings, np.random.default_rng(session.findings.stream("order")))
    calibration = session.inputs.read("calibration", WristCalibration.load)
    rig = None if settings.rig is None else GuardedRig(rig_of(RIGS[settings.rig], settings.rig), settings.rig)
    monotonic = settings.port is not None or settings.real_time or (rig is not None and not rig.virtual)
    trial_log = log_of(run.file("data/log.csv").parent, settings, study.wrist, monotonic)
    live: LiveReference | None = None
    try:
        live = _listening(session, trials, rig)
        experiment = Experiment(settings, study.wrist, trials, trial_log, network, tuned, live)
        films = _films(run, settings) if rig is None else []
    except BaseException:
        trial_log.close()
        if live is not None:
            live.close()
        raise
    stopped: BaseException | None = None
    try:
        with coming_first(session, settings):
            stand = _stand_of(session, bench, rig, calibration, films)
            with session.operator.watch(trials, session) as shown:
                experiment.run(stand, shown)
    except BaseException as error:
        stopped = error
    try:
        trial_log.close()
    except OSError as error:
        stopped = stopped or SafetyStop(f"the log cannot be written: {error.strerror}", "data", fix_of(error))
    for number, of_camera in enumerate(films):
        for film in of_camera:
            film.close()
        run.columns(f"data/raw{_number(number)}.csv", RAW)
    for name, stream in trial_log.streams.items():
        run.columns(f"data/{name}.csv", stream.columns)
    if live is not None:
        live.close()
        keep_live(session.findings, live)
        session.operator.tell(live.said())
        if live.filled > 1:
            experiment.replay(with_record(session).study.hw_run)
    table = _evaluate(run, settings, study.wrist, experiment, trials)
    _summarise(session, experiment, trial_log, table, len(trials))
    if stopped is not None:
        raise stopped
    return table


def _listening(session: Session, trials: list[Trial], rig: GuardedRig | None) -> LiveReference | None:
    """The live reference of trials, at its socket before any motor moves; None where there is none.

    A rig whose clock is virtual waits for the wall clock.
    """
    settings, wrist = session.study.hw_run, session.study.wrist
    if not settings.reference.is_live:
        return None
    plane, virtual = trials[0].plane or "ulnar", rig is not None and rig.virtual
    live = LiveReference(
        settings.reference, wrist, settings.planes, plane, settings.horizon, settings.control_period, paced=virtual
    )
    tell_address(session, live)
    return live


def _stand_of(
    session: Session, bench: WristParameters, rig: GuardedRig | None, calibration: WristCalibration | None, films: Films
) -> Stand:
    """The rig, or the opened board with its cameras."""
    study, settings = session.study, session.study.hw_run
    if rig is not None:
        return RigStand(rig) if rig.virtual else RigStand(rig, partial(session.operator.confirm, BEFORE_MOTION))
    with session.progress("preparing the emulated bench" if settings.port is None else "opening board and camera"):
        runs = session.inputs.runs()
        view, view_2 = View.of(runs.get("optics")), View.of(runs.get("optics_2"))
        keep = partial(_add, films) if films else None
        testbed = open_testbed(settings, bench, study.seed, view, session.operator.confirm, keep, view_2)
    return BoardStand(testbed, calibration, study.seed)


def _films(run: LiveRun, settings: HwRunSettings) -> Films:
    if not settings.video:
        return []
    rate, names = settings.sensor.frame_rate, [_number(camera) for camera in range(settings.planes)]
    return [
        [AnnotatedVideo(run.file(f"data/video{name}.avi"), rate), RawVideo(run.file(f"data/raw{name}.avi"), rate)]
        for name in names
    ]


def _number(camera: int) -> str:
    """What a camera's files are called beside those of the first."""
    return f"_{camera + 1}" if camera else ""


def _add(films: Films, frame: Frame, sighting: Sighting) -> None:
    for film in films[sighting.plane]:
        film.add(frame, sighting)


def _evaluate(
    run: LiveRun,
    settings: HwRunSettings,
    wrist: WristParameters,
    experiment: Experiment,
    trials: list[Trial],
) -> pd.DataFrame:
    """trials.csv: a row for each trial that began, by the log alone."""
    begun = [trial for trial in trials if trial.number in experiment.outcomes]
    layout = layout_of_rig(settings, wrist)
    metrics = metrics_of_trials(run.path / "data", begun, experiment.motions, settings, layout)
    rows = [
        {
            "trial": trial.number,
            "direction": trial.direction,
            "repetition": trial.repetition,
            "push": trial.push,
            "controller": settings.rows[trial.row].controller,
            "gains": settings.rows[trial.row].gains_name,
            "outcome": experiment.outcomes[trial.number],
            "odd": experiment.odd.get(trial.number, ""),
            **values,
        }
        for trial, values in zip(begun, metrics, strict=True)
    ]
    columns = _OF_BENDS if settings.planes == 2 else _OF_TRIALS
    table = pd.DataFrame(rows, columns=list(columns))
    units, meaning = ({name: column[i] for name, column in columns.items()} for i in range(2))
    run.table("data/trials.csv", table, units=units, meaning=meaning)
    return table


def _stand(stop: Stop) -> str:
    return "the motors stand" if stop.halt.verified else "the motors could NOT be seen to stand"


def stopped_answer(stop: Stop, table: pd.DataFrame, count: int) -> list[str]:
    """Lines on trials that were stopped: when, why, whether the motors stand, and what came of those that were done.

    `table` has a row for each trial that began, of `count` in all.
    """
    when = "before the first trial, while the rig was opened or homed"
    if stop.trial is not None:
        when = f"in trial {stop.trial} (of {count}, from 0)"
        when += f", {stop.time:.1f} s after it began" if stop.time is not None else ""
    elif len(table):
        when = f"after trial {table['trial'].iloc[-1]} (of {count}, from 0)"
    lines = [f"Stopped {when}: {stop.reason.removeprefix('stopped: ')}; {_stand(stop)}.", ""]
    for _, trial in table[table["outcome"] == "ok"].iterrows():
        push = f", push of {trial['push']:g} N" if trial["push"] else ""
        error = f"error {degrees(trial['rmse'])} deg RMSE" if "rmse" in table else "done"
        lines.append(
            f"Trial {trial['trial']}, {trial['direction']}{push}, {trial['controller']}/{trial['gains']}: {error}"
        )
    return lines


def _summarise(session: Session, experiment: Experiment, trial_log: TrialLog, table: pd.DataFrame, count: int) -> None:
    """Timing, zero, and where it was stopped whether the motors stand, and the last second: the error says why."""
    findings, settings, timing = session.findings, session.study.hw_run, experiment.timing
    findings.metric("ticks", len(timing.late), meaning="control ticks")
    meaning = "ticks skipped because one before took too long"
    findings.metric("overruns", timing.overruns, better="lower", meaning=meaning)
    meaning = "from due to begun, of a tick"
    for name, share in (("late_p50", 0.5), ("late_p99", 0.99), ("late_max", 1.0)):
        findings.metric(name, timing.jitter(share), "s", "lower", n=len(timing.late), meaning=meaning)
    if timing.late and (settings.real_time or settings.port is not None):
        session.operator.tell(timing.said())
        findings.summary(timing.said())
    if timing.late:
        findings.summary(timing.camera.summary())
    _tell_oddities(session, experiment)
    own = settings.rig is not None
    findings.plain(FILE, plain(limits_of(settings.within(session.study.wrist)), own))
    if not own:
        findings.plain(
            "data/camera_pose.json", {plane: pose and pose.plain() for plane, pose in experiment.poses.items()}
        )
    if experiment.zero is not None:
        findings.plain("data/zero.json", experiment.zero.plain())
    if experiment.stop is None:
        return
    stop = experiment.stop
    findings.plain("data/stop.json", stop.plain())
    findings.overview.answer[:] = stopped_answer(stop, table, count)
    findings.keep_overview()
    log.warning("%s after %.0f ms (%s)", _stand(stop), 1e3 * stop.halt.seconds, stop.halt.how)
    if not trial_log.last:
        findings.summary(stop.reason)
        return
    text = _last_second(trial_log, settings.rig is not None).text()
    findings.summary(f"{stop.reason}\n\n```\n{text}\n```")
    log.warning("%s", text)


def _tell_oddities(session: Session, experiment: Experiment) -> None:
    """Report how near trials came to the limits on unexpected motion, and anything odd."""
    findings, most = session.findings, experiment.most
    parts = []
    for name, unit, limit, *_ in limits_of(session.study.hw_run.within(session.study.wrist)):
        line = residual(name, session.study.hw_run.rig is not None)
        if math.isfinite(limit) and limit > 0.0 and name in most:
            shown, people = in_degrees(limit, unit)
            meaning = f"{line.meaning}; limit {shown:.3g} {people}"
            findings.metric(f"greatest_{name}", most[name], unit, "lower", meaning=meaning)
            parts.append(f"{name} {line.shown(most[name])} of {line.shown(limit)}")
    if parts:
        again = f" Tick by tick: `wristctl hw limits --from {findings.run.path.name}`." if findings.run else ""
        findings.summary(f"Greatest residuals, and their limits: {', '.join(parts)}.{again}")
    for number, words in experiment.odd.items():
        if words and experiment.outcomes.get(number) == "ok":
            text = f"Trial {number} went through, but was odd: {words}"
            log.warning(text)
            findings.summary(text)


def _last_second(trial_log: TrialLog, own: bool) -> Table:
    """The last second of ticks, every tenth of it, with the trial where there is more than one or none.

    What was seen is the newest of each tenth: few ticks have a picture of their own.
    """
    rows = list(trial_log.last)
    every = max(1, len(rows) // 10)
    tenths = [rows[max(0, end - every) : end] for end in range(len(rows), 0, -every)][::-1]
    shown = [tenth[-1] for tenth in tenths]
    angles = {"theta": "theta [deg]", "theta_ref": "reference [deg]"}
    seen = "look" if own else "marker"
    verdicts = {"verdict": seen}
    if shown and "bend_ulnar" in shown[0]:
        both = {"bend": "", "bend_ref": "wanted "}
        angles = {f"{name}_{plane}": f"{word}{plane} [deg]" for name, word in both.items() for plane in PLANES}
        verdicts = {f"verdict_{plane}": f"{plane} {seen}" for plane in PLANES}
    pulls = {name: f"T{name.removeprefix('tension_')} [N]" for name in shown[0] if name.startswith("tension_")}
    trials = {row["trial"] for row in shown}
    named = len(trials) > 1 or min(trials, default=0) < 0  # times begin anew with each
    columns = (*["trial"] * named, "time [s]", *angles.values(), *verdicts.values(), *pulls.values(), "state")
    cells = [
        (
            *[row["trial"] if row["trial"] >= 0 else "none"] * named,
            round(row["time"], 3),
            *(round(float(np.degrees(row[name])), 2) for name in angles),
            *(next((str(one[name]) for one in tenth[::-1] if one[name]), "none") for name in verdicts),
            *(round(row[name], 2) for name in pulls),
            row["state"],
        )
        for tenth, row in zip(tenths, shown, strict=True)
    ]
    return Table("The last second", columns, cells)
