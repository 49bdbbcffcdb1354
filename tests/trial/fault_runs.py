"""Whole experiments under a fault, in virtual time with a person who waits, and how they ended."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from tests.trial.conftest import WRIST
from tests.trial.fault_cases import AT, Case, End, Phase
from wristctl.arrays import Array
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.config.errors import UserError
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.experiment import Experiment
from wristctl.trial.homing import Zero
from wristctl.trial.log import TrialLog
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.trials import trials_of
from wristctl.vision.view import View

WITHIN, PULL, LITTLE_PULL, LITTLE_ERROR = 0.4, 60.0, 30.0, 2.0
"""Of what is caught: seconds and true newtons; of what is tolerated: newtons and true degrees."""
_SHOWN, _CAMERA = np.deg2rad(1.0), 3.0 / 60.0
"""Difference from a sound wrist that a frame can show, and how long after."""
_FULL = {
    "directions": ("ulnar", "flexion"), "rows": ({"controller": "smc-tracking", "gains": "stepper"},),
    "reference": {"duration": 1.0, "angle_deg": 30.0}, "horizon": 2.0, "back": 1.0, "rest": 0.3,
    "push": {"force": 0.0}, "calibration": "given", "positions": "stored",
    "bench": {"motors": {"slack": (0.0, 0.0, 0.0, 0.0)}, "person": {"takes": 10.0}},
}  # fmt: skip
_HOMED = {
    "calibration": None, "positions": "find", "reference": {"duration": 0.5, "angle_deg": 10.0}, "horizon": 0.8,
    "back": 0.5, "bench": {"motors": {"slack": (3e-4, 2e-4, 4e-4, 2.5e-4)}},
}  # fmt: skip


def over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with those above in place of those below."""
    made = dict(below)
    for name, value in above.items():
        made[name] = over(made[name], value) if isinstance(value, Mapping) and name in made else value
    return made


class Course(NamedTuple):
    """What the wrist did, against the board's clock, and how the run ended."""

    settings: HwRunSettings
    first: float
    """Start of the first trial's motion, nan if none began."""
    time: Array
    angle: Array
    across: Array
    pull: Array
    error: float
    """Largest true error in a trial [rad]."""
    decided: float
    """When the motors were told to stop, inf: never."""
    last_step: float
    reason: str
    fix: str
    code: int
    odd: str
    moves: Array
    """Times at which the reference moves."""


@cache
def _at_zero() -> WristCalibration:
    settings = HwRunSettings.model_validate(_FULL)
    nonce = Board(VirtualBench(settings.bench, WRIST, 0).transport).connect().boot_nonce
    return WristCalibration(Zero((1, 1, 1, 1), (1930.0,) * 4, 0.0, (0.0,) * 4), "ulnar", nonce, (0, 0, 0, 0))


class _Watched(Experiment):
    decided = np.inf

    def _stopped(self, testbed: Any, board: Board, error: BaseException) -> None:
        self.decided = board.transport.now()
        super()._stopped(testbed, board, error)


def perform(changes: Mapping[str, Any], seed: int = 0) -> Course:
    """Do the experiment of these settings."""
    settings = HwRunSettings.model_validate(changes)
    bench = VirtualBench(settings.bench, WRIST, seed, settings.markers)
    stored = _at_zero() if settings.positions == "stored" else None
    with tempfile.TemporaryDirectory() as folder:
        log = TrialLog(Path(folder), settings.bench.segments, settings.control_period)
        trials = trials_of(settings, np.random.default_rng(0))
        done = _Watched(settings, WRIST, trials, log, calibration=stored, seed=seed)
        reason, fix, code = "", "", 0
        try:
            done.run(EmulatedTestbed(bench, settings, View(), None))
        except UserError as error:
            reason, fix, code = error.what, str(error.fix), error.exit_code
        log.close()
        rows = pd.read_csv(Path(folder) / "log.csv")
        between = pd.read_csv(Path(folder) / "between.csv")
    stopped = bench.transport.now()
    bench.transport.wait(0.3)
    truth, start = bench.truth(), bench._rig.faults._starts["first trial"]
    error = 0.0
    if len(rows):
        true = np.interp(rows["clock"], truth.time, truth.angle)
        error = float(np.abs(true - rows["theta_ref"]).max())
    both = pd.concat([rows, between])
    moves = np.sort(both["clock"][both["rate_ref"].abs() > 0.05].to_numpy()) if len(both) else np.empty(0)
    steps = [each for each in bench.motion().last_step if each is not None]
    odd = "; ".join(words for words in done.odd.values() if words)
    decided = min(done.decided, stopped) if reason else np.inf
    return Course(
        settings, start, truth.time, truth.angle, truth.across, truth.pull.max(axis=1), error, decided,
        max(steps, default=0.0), reason, fix, code, odd, moves,
    )  # fmt: skip


class Judged(NamedTuple):
    """How a case ended."""

    name: str
    phase: str
    end: str
    right: bool
    seconds: float
    """From when it could be seen to the beginning of the ramp; nan if it was not caught."""
    pull: float
    error: float
    said: str


@cache
def _sound(phase: Phase) -> Course:
    return perform(over(_FULL, _HOMED) if phase == "homing" else _FULL)


def run_case(cases: Sequence[Case], phase: Phase) -> Judged:
    """Perform and judge one case, or several at once: then the earliest that is caught counts."""
    changes = over(_FULL, _HOMED) if phase == "homing" else dict(_FULL)
    for case in cases:
        changes = over(changes, {"bench": case.bench})
    changes = over(changes, {"bench": {"faults": tuple(fault for case in cases for fault in case.faults(phase))}})
    return judge(cases, phase, perform(changes), _sound(phase))


def judge(cases: Sequence[Case], phase: Phase, course: Course, sound: Course) -> Judged:
    """What ended it, and whether that is right."""
    end: End = "caught" if course.reason else "tolerated"
    begin = AT[phase] + (0.0 if phase == "homing" else course.first)
    if not any(case.kind for case in cases):
        begin = 0.0
    after = course.time >= begin
    pull = float(course.pull[after].max(initial=0.0))
    stopped = min(course.decided, course.last_step)
    if not np.isfinite(begin):  # it never came to that
        begin = course.decided
    seen = min(_shown(case, begin, course, sound) for case in cases)
    seconds = max(0.0, stopped - seen) if course.reason else np.nan
    ends = {each for case in cases for each in case.right(phase)}
    right = end in ends if len(cases) == 1 else end == "caught" or all("tolerated" in c.right(phase) for c in cases)
    if end == "caught":
        creeping = phase in ("homing", "waiting")
        right &= course.code in (4, 5) and pull < PULL and (seconds <= WITHIN or creeping)
    else:
        right &= pull <= LITTLE_PULL and np.rad2deg(course.error) <= LITTLE_ERROR and bool(course.odd)
    name = " + ".join(case.name for case in cases)
    return Judged(name, phase, end, right, seconds, pull, float(np.rad2deg(course.error)), course.reason or course.odd)


def _shown(case: Case, begin: float, course: Course, sound: Course) -> float:
    """When a frame or a status could first show this fault."""
    if case.shows == "at once":
        return begin
    if case.shows == "motion":
        moves = course.moves[course.moves >= begin]
        return float(moves[0]) + _CAMERA if len(moves) else begin
    time = course.time[course.time >= begin]
    off = [
        np.abs(np.interp(time, run.time, getattr(run, name)) - np.interp(time, sound.time, getattr(sound, name)))
        for name, run in (("angle", course), ("across", course))
    ]
    differs = np.flatnonzero(np.max(off, axis=0) > _SHOWN) if len(time) else []
    return float(time[differs[0]]) + _CAMERA if len(differs) else float(course.decided)


def table(judged: Sequence[Judged]) -> str:
    """In Markdown."""
    lines = ["| case | phase | end | ms | true pull [N] | true error [deg] | said |", "|---|---|---|---|---|---|---|"]
    for each in judged:
        ms = "" if np.isnan(each.seconds) else f"{1e3 * each.seconds:.0f}"
        end = each.end if each.right else f"**{each.end}: wrong**"
        said = each.said[:110]
        lines.append(f"| {each.name} | {each.phase} | {end} | {ms} | {each.pull:.0f} | {each.error:.1f} | {said} |")
    return "\n".join(lines)
