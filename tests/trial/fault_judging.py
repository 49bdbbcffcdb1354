"""How a run under a fault ended, and whether that is right; tables of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tests.trial.fault_cases import AT, PHASES, Case, End, Phase
from wristctl.arrays import Array

WITHIN, PULL, LITTLE_PULL, LITTLE_ERROR = 0.4, 60.0, 30.0, 2.0
"""Of what is caught: seconds and true newtons; of what is tolerated: newtons and true degrees."""
_SHOWN, _CAMERA = np.deg2rad(1.0), 3.0 / 60.0
"""Difference from a sound wrist that a frame can show, and how long after."""
_ALIKE = np.deg2rad(0.5), 3.0
"""True radians and newtons above a sound run's, below which a fault had no effect."""
_CREEPS = 1.0
"""Seconds without a moving reference before what is seen of a fault: small moves are made, if any."""


class Course(NamedTuple):
    """What the wrist did, against the board's clock, and how the run ended."""

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


def judge(cases: Sequence[Case], phase: Phase, course: Course, sound: Course) -> Judged:
    """What ended it, and whether that is right."""
    end: End = "caught" if course.reason else "tolerated"
    begin = AT[phase] + (0.0 if phase == "homing" else course.first)
    creeping = phase in ("homing", "waiting")
    if not any(case.kind for case in cases):
        creeping = not np.isfinite(course.first)
        begin = 0.0 if creeping else course.first
    after = course.time >= begin
    pull = float(course.pull[after].max(initial=0.0))
    stopped = min(course.decided, course.last_step)
    if not np.isfinite(begin):  # it never came to that
        begin = course.decided
    demanding = [case for case in cases if "tolerated" not in case.right(phase)]
    shown = [_shown(case, begin, course, sound) for case in demanding or cases]
    seen = min(shown) if demanding else max(shown)  # of two that may be tolerated, either may end it
    seconds = max(0.0, stopped - seen) if course.reason else np.nan
    near = (course.moves > seen - _CREEPS) & (course.moves <= stopped)
    creeping |= not near.any()  # it came out in the small moves before a further plane's motion
    name = " + ".join(case.name for case in cases)
    ends = {each for case in cases for each in case.right(phase)}
    right = end in ends if len(cases) == 1 else end == "caught" or all("tolerated" in c.right(phase) for c in cases)
    if end == "tolerated" and _as_sound(course, sound):
        return Judged(name, phase, "no effect", right, np.nan, pull, float(np.rad2deg(course.error)), course.odd)
    if end == "caught":
        right &= course.code in (4, 5) and pull < PULL and (seconds <= WITHIN or creeping)
    else:
        right &= pull <= LITTLE_PULL and np.rad2deg(course.error) <= LITTLE_ERROR
        right &= bool(course.odd) or any(phase in case.mended for case in cases)
    said = course.reason or course.odd
    return Judged(name, phase, end, bool(right), seconds, pull, float(np.rad2deg(course.error)), said)


def _as_sound(course: Course, sound: Course) -> bool:
    """Whether it went as well as the sound run."""
    return course.error - sound.error < _ALIKE[0] and float(course.pull.max() - sound.pull.max()) < _ALIKE[1]


def _shown(case: Case, begin: float, course: Course, sound: Course) -> float:
    """When a frame or a status could first show this fault."""
    if case.shows == "at once":
        return begin
    if case.shows == "by chance":
        return course.decided
    if case.shows == "motion":
        moves = course.moves[course.moves >= begin]
        return float(moves[0]) + _CAMERA if len(moves) else begin
    time = course.time[course.time >= begin]
    off = [
        np.abs(np.interp(time, run.time, getattr(run, name)) - np.interp(time, sound.time, getattr(sound, name)))
        for name, run in (("angle", course), ("across", course))
    ]
    differs = time[np.max(off, axis=0) > _SHOWN]
    return float(differs[0]) + _CAMERA if len(differs) else float(course.decided)


def table(judged: Sequence[Judged]) -> str:
    """In Markdown: a row for each that was judged."""
    lines = ["| case | phase | end | ms | true pull [N] | true error [deg] | said |", "|---|---|---|---|---|---|---|"]
    for each in judged:
        ms = "" if np.isnan(each.seconds) else f"{1e3 * each.seconds:.0f}"
        end = each.end if each.right else f"**{each.end}: wrong**"
        said = each.said[:110]
        lines.append(f"| {each.name} | {each.phase} | {end} | {ms} | {each.pull:.0f} | {each.error:.1f} | {said} |")
    return "\n".join(lines)


def by_phase(judged: Sequence[Judged]) -> str:
    """In Markdown: a row for each case, a column for each phase."""
    phases = [phase for phase in PHASES if any(each.phase == phase for each in judged)]
    lines = [f"| case | {' | '.join(phases)} |", "|---" * (1 + len(phases)) + "|"]
    for name in dict.fromkeys(each.name for each in judged):
        cells = []
        for phase in phases:
            own = next((each for each in judged if (each.name, each.phase) == (name, phase)), None)
            cells.append("" if own is None else _cell(own))
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(judged: Judged) -> str:
    timed = judged.end == "caught" and judged.phase in ("moving", "holding")
    ms = f" {1e3 * judged.seconds:.0f} ms," if timed else ""
    return f"{judged.end},{ms} {max(judged.pull, 0.0):.0f} N"
