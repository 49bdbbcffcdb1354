"""A recorded motion as a reference: angles or tips over time, from a CSV file whose header has units.

The samples' angles, and of tips the angles and lengths of the arcs that end there, are joined by a cubic spline with
continuous second derivatives (not-a-knot, de Boor, A Practical Guide to Splines, 1978; SciPy), whose own derivatives
are the rate and the acceleration. With `noise_deg` a quintic smoothing spline passes them by about as much (Dierckx,
Curve and Surface Fitting with Splines, 1993). Time counts from the first sample; after the last the angle is held.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.config.section import Parameter
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError, meant
from wristctl.records.log_columns import ANGLE, SYNONYMS, Units
from wristctl.records.open_log import OpenLog
from wristctl.simulation.reference import TIP_TOLERANCE, ReferenceKind, beyond_reach
from wristctl.wrist.kinematics import TipPath, exact_arc
from wristctl.wrist.spatial.spatial_kinematics import exact_bend

TIP = ("tip_x", "tip_y")
SPATIAL_TIP = (*TIP, "tip_z")
_EXAMPLE = "time [s],angle [deg]"
_FEWEST = 4
# Number of its usual steps that a recording's time may skip.
_GAP = 5.0
# Jump between two samples [rad]: beyond it a spline through them swings.
_JUMP = np.deg2rad(10.0)


@dataclass(frozen=True, eq=False)
class Recording:
    """T samples of a motion, SI units: `arc` (2, T) has the angle and, of tips, the length of the arc, else 0."""

    time: Array
    arc: Array
    of_tips: bool


def read_recording(file: Path, column: str | None = None, names: str = "") -> Recording:
    """The motion in an open log: the column that is named, else its bend, else tips. Empty cells are passed over.

    `names` are another author's columns as `wristctl.records.open_log` has them. Raises UserError for a file that is
    none, with line and column: gaps, times that repeat, jumps, units that are not there or not known.
    """
    more = {} if column is None or column in SYNONYMS or column == "tip" else {column: ANGLE}
    log = _recorded(file, names, more)
    chosen = _angle_in(log, column)
    if chosen is None and not all(name in log.columns for name in TIP):
        fix = f"a header such as {_EXAMPLE}, or time [s],tip_x [mm],tip_y [mm]"
        raise UserError("neither an angle nor tips", str(file), fix)
    if chosen is None:
        tip = np.column_stack([log.columns[name] for name in TIP])
        arc, unknown = np.stack(exact_arc(tip)), np.isnan(tip.sum(axis=1))
    else:
        arc, unknown = np.stack([chosen, 0.0 * chosen]), np.isnan(chosen)
    if unknown.any():
        log, arc = log.only(~unknown), arc[:, ~unknown]
    time = log.columns["time"]
    _check(log, time, arc[0])
    return Recording(time - time[0], arc, chosen is None)


def _recorded(file: Path, names: str, more: Mapping[str, Units]) -> OpenLog:
    """A recording with the looks of a log, of its motion alone: what tendons did then is not asked for."""
    from wristctl.records.log_converters import read_log
    from wristctl.records.log_looks import looked_at, telling

    log = read_log(file, names, "recording", others=True, more=more)
    log.whole("time", _EXAMPLE)
    seen = {name: column for name, column in log.columns.items() if not name.startswith(("spool_", "tension_"))}
    return telling(looked_at(replace(log, columns=seen), motion=False))


def _angle_in(log: OpenLog, column: str | None) -> Array | None:
    """The angle of a column, or of the first plane's bend where none is named; None where tips are meant."""
    if column == "tip":
        return None
    if column is None:
        bends = log.bends()
        return None if bends is None else bends[:, 0]
    name = next((name for name in (column, SYNONYMS.get(column, "")) if name in log.columns), None)
    if name is None or log.head(name) != column != name:
        raise UserError(f"no column {column}", str(log.file), f"reference.column: {meant(column, _columns(log))}")
    return log.columns[name]


def _columns(log: OpenLog) -> list[str]:
    return [log.head(name) for name in log.columns if name != "time"]


def _check(log: OpenLog, time: Array, angle: Array) -> None:
    if len(time) < _FEWEST:
        raise UserError(f"{len(time)} samples, too few for a motion", str(log.file), f"at least {_FEWEST}")
    steps = np.diff(time)
    if (bad := np.flatnonzero(steps <= 0.0)).size:
        problem = "time repeats" if steps[bad[0]] == 0.0 else "time goes back"
        raise UserError(problem, log.at(int(bad[0]) + 1), "one motion a file, its samples in the order of their times")
    usual = float(np.median(steps))
    if (bad := np.flatnonzero(steps > _GAP * usual)).size:
        problem = f"a gap of {steps[bad[0]]:.3g} s, where samples are {usual:.3g} s apart"
        raise UserError(problem, log.at(int(bad[0]) + 1), "fill it in, or cut the recording there")
    if not np.isfinite(angle).all():
        raise UserError("a tip at the base", log.at(int(np.argmin(np.isfinite(angle)))), "tips in front of the base")
    jumps = np.abs(np.diff(angle))
    if (bad := np.flatnonzero(jumps > _JUMP)).size:
        problem = f"the angle jumps by {np.rad2deg(jumps[bad[0]]):.3g} deg from a sample to the next"
        fix = "mend that sample, record more often, or put the right unit into the header"
        raise UserError(problem, log.at(int(bad[0]) + 1), fix)


def recording_of(reference: Reference) -> Recording:
    """Recording in the file of a reference; read again where it has changed. Raises UserError as `read_recording`."""
    if not reference.file:
        raise UserError("a recording needs its file", "reference.file", "reference.file: walk.csv")
    file = Path(reference.file)
    stamp = file.stat() if file.is_file() else None
    return _read(file, reference.column, reference.columns or "", stamp and (stamp.st_mtime_ns, stamp.st_size))


@lru_cache(maxsize=16)
def _read(file: Path, column: str | None, names: str, stamp: object) -> Recording:
    return read_recording(file, column, names)


def _course(reference: Reference, time: Array) -> Array:
    """Angle [rad] and, of tips, arc length [m], with two derivatives each: (3, T) or (2, 3, T)."""
    course = _joined(recording_of(reference), reference.value("noise_deg"), time.tobytes()).copy()
    course[:1] *= reference.value("scale")
    return course if len(course) == 2 else course[0]


@lru_cache(maxsize=4)
def _joined(recorded: Recording, noise_deg: float, times: bytes) -> Array:
    """The recording at those times, (2, 3, T) of tips, else (1, 3, T): a sweep of its scale splines it once."""
    noises = (np.deg2rad(noise_deg), 0.0)[: 1 + recorded.of_tips]
    return _held(np.frombuffer(times), recorded.time, recorded.arc[: 1 + recorded.of_tips], noises)


def _held(time: Array, recorded: Array, columns: Iterable[Array], noises: Iterable[float]) -> Array:
    """Columns that were `recorded` at times from 0, splined at times (T,), (columns, 3, T); held after the last."""
    within = np.clip(time, 0.0, recorded[-1])
    pairs = zip(columns, noises, strict=True)
    course = np.stack([_splined(recorded, column, noise, within) for column, noise in pairs])
    course[:, 1:, (time < 0.0) | (time > recorded[-1] + 1e-12)] = 0.0
    return course


def _splined(time: Array, samples: Array, noise: float, times: Array) -> Array:
    """A spline through samples, or past them by a standard deviation, and its two derivatives, (3, T)."""
    from scipy.interpolate import CubicSpline, UnivariateSpline

    if noise == 0.0:
        spline = CubicSpline(time, samples)
        return np.stack([spline(times), spline(times, 1), spline(times, 2)])
    smooth = UnivariateSpline(time, samples, k=5, s=len(time) * noise**2)
    return np.stack([smooth(times), smooth.derivative(1)(times), smooth.derivative(2)(times)])


def _of_two_planes(reference: Reference) -> tuple[OpenLog, Array | None, bool]:
    """A recording's log, the bends (T, 2) that it has, and whether its tips are followed, which then are all there."""
    log = _recorded(Path(reference.file or ""), reference.columns or "", {})
    bends = log.bends() if {"bend_y", "bend_z"} <= log.columns.keys() or "orientation" in log.columns else None
    of_tips = (bends is None or reference.column == "tip") and all(name in log.columns for name in SPATIAL_TIP)
    if of_tips:
        log = log.only(np.asarray(np.isfinite([log.columns[name] for name in SPATIAL_TIP]).all(axis=0)))
    return log, bends, of_tips


def recorded_bends(reference: Reference, wrist: WristParameters, time: Array) -> Array:
    """Bends of a recording's two planes with two derivatives, (2, 3, T) [rad], at times (T,) [s].

    Its columns are bends toward ulnar and flexion, inclination and orientation, or all three of the tip, which stand
    for the bend of the one arc that ends there. Raises UserError where it has one plane alone, and with the line for a
    tip where no arc of the wrist ends.
    """
    log, bends, of_tips = _of_two_planes(reference)
    if of_tips:
        bends = _bends_of_tips(log, wrist)
    elif bends is None or reference.column == "tip":
        fix = "a header such as time [s],bend_y [deg],bend_z [deg] or time [s],x [mm],y [mm],z [mm], or loop.planes: 1"
        raise UserError("no bends in two planes", str(Path(reference.file or "")), fix)
    whole = np.asarray(np.isfinite(bends).all(axis=1))
    log, bends = log.only(whole), bends[whole]
    recorded_time = log.columns["time"]
    for plane in bends.T:
        _check(log, recorded_time, plane)
    noises = [np.deg2rad(reference.value("noise_deg"))] * 2
    return _held(time, recorded_time - recorded_time[0], reference.value("scale") * bends.T, noises)


def recorded_tips(reference: Reference, time: Array) -> TipPath | None:
    """Path of a recording's tips in space, as they are, at times (T,) [s]; None where its bends are followed.

    Raises UserError as `read_recording`, and for what is of bends alone: a scale, and noise that is smoothed.
    """
    log, _, of_tips = _of_two_planes(reference)
    if not of_tips:
        return None
    if reference.value("scale") != 1.0 or reference.value("noise_deg") != 0.0:
        fix = "leave scale and noise_deg out, or write the tips that are wanted"
        raise UserError("recorded tips behind a network are followed as they are", "reference.scale", fix)
    tips, since = np.stack([log.columns[name] for name in SPATIAL_TIP]), log.columns["time"]
    for plane in exact_bend(tips.T)[0].T:
        _check(log, since, plane)
    return TipPath(*_held(time, since - since[0], tips, [0.0] * 3).transpose(1, 2, 0))


def _bends_of_tips(log: OpenLog, wrist: WristParameters) -> Array:
    """Bends (T, 2) [rad] of arcs of the wrist that end at a log's tips. Raises UserError for a tip where none ends."""
    tips = np.column_stack([log.columns[name] for name in SPATIAL_TIP])
    bends, length = exact_bend(tips)
    size, across = np.hypot(*bends.T), np.hypot(tips[:, 1], tips[:, 2])
    off = np.abs(length - wrist.length) * np.abs(np.sinc(size / (2.0 * np.pi)))  # along the chord: no less than it is
    sound = (size <= np.deg2rad(wrist.range_deg)) & (off <= TIP_TOLERANCE * wrist.length)
    for sample in np.flatnonzero(~sound):
        if (missed := beyond_reach((float(tips[sample, 0]), float(across[sample])), wrist)) is not None:
            why, (x, r) = missed
            toward = tips[sample, 1:] / across[sample] if across[sample] else np.array([1.0, 0.0])
            nearest, there = (_millimetres(point) for point in ((x, *(r * toward)), tips[sample]))
            fix = f"the nearest tip within reach, {nearest}; x is along the straight wrist, from its first disc"
            raise UserError(f"tip {there} {why}", log.at(int(sample)), fix)
    return bends


def _millimetres(tip: Iterable[float]) -> str:
    return f"({', '.join(f'{1e3 * value + 0.0:.2f}' for value in tip)}) mm"


def _rest(reference: Reference, begin: float, horizon: float) -> float:
    return min(float(recording_of(reference).time[-1]), horizon)


def _described(reference: Reference) -> str:
    name = Path(reference.file or "no file").name
    scale = reference.value("scale")
    parts = ("recording", name, reference.column or "", "" if abs(scale) == 1.0 else f"x{abs(scale):g}")
    return " ".join(part for part in parts if part)


RECORDING = ReferenceKind(
    "a recorded motion: `file`, a CSV with units in its header (documentation: Motions)",
    course=_course,
    rest=_rest,
    described=_described,
    targets="none",
    parameters={
        "scale": Parameter(1.0, "", "factor on the recorded angle", mirrors=True),
        "noise_deg": Parameter(0.0, "deg", "how far a smoothing spline passes the samples by, RMS; 0: none"),
    },
)
