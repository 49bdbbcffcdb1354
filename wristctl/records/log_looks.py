"""Looks at a log before anything is fitted: what no wrist does is refused with its line, what is mended is told."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import Argument, Phrase, UserError
from wristctl.records.column_ranges import (
    FACTOR_OF_A_COUNT,
    FACTOR_OF_A_UNIT,
    TENDON_OFFSET,
    count_of,
    count_told,
    range_of,
    unit_of_bend,
    unit_or_count,
    way_of_bend,
)
from wristctl.records.log_columns import ANGLE, BENDS, LENGTH, Units, units_of
from wristctl.records.log_jumps import jumps_told
from wristctl.records.log_mending import in_order, parted, without_repeats, without_wraps
from wristctl.records.log_sensors import sensors_told
from wristctl.records.open_log import OpenLog, filled

_log = logging.getLogger(__name__)

# Bend [rad], spool [m], tension [N] and current [A] beyond any wrist's; steady steps [s] over a time [s] that no motion
# takes.
_BEND, _SPOOL, _TENSION, _CURRENT, _STEP, _LONG = 4.0 * math.pi, 2.0, 5000.0, 100.0, 5.0, 3600.0
# Steps [s] over a time of _LONG that may be those of ms read as s.
_SLOW = 0.9
# Way [m] between two samples, and its speed [m/s], that no motor makes; speed of most steps that no motor has [m/s].
_JUMP, _SPEED, _MOSTLY = 0.02, 2.0, 1.0
# Correlation of bend and pull from which the senses are opposite, and of bend and both spools from which one's sign is.
_OPPOSITE, _TOGETHER_WITH = -0.9, 0.9
# Factor within which spools go as far as the bend takes where only the bend's unit is in question.
_NEARLY = 3.0
# Number of its usual steps, and time [s], that a recording may skip without a word.
_GAP, _PAUSE = 10.0, 0.1
# Length [m] by which all tendons together are reeled in on no wrist.
_TOGETHER = 0.01


def telling(log: OpenLog) -> OpenLog:
    """The log, with each of its remarks as a warning: for a reader whose answer has no place for them."""
    for remark in log.remarks:
        _log.warning("%s", remark)
    return log


def looked_at(log: OpenLog, motion: bool = True, tendon_offset: float | None = None) -> OpenLog:
    """The log without repeated rows, in the order of its times, and in a trial for each start of its clock.

    Counters that wrap at 2^16 or 2^32 go on. What is mended so, and what is to be looked at (gaps, sensors that stand
    or are at their ends, streams that are apart in time), is said in the log's remarks. Raises UserError, with line and
    column and what may mend it, for spools that stand still where a `motion` is wanted or that jump, for bends, spools,
    tensions, speeds and times beyond any wrist's, and for two antagonists whose pull goes against the bend. Where the
    distance of the tendons from the axis is known, `tendon_offset` [m], so are spools whose way is not the bend's, by a
    factor of 5 where the length of a count was given, as far as a gain is looked for, and of 10 in a plain unit.
    """
    if "time" in log.columns:
        log.without_gaps("time")
    log = in_order(parted(without_repeats(without_wraps(log))))
    _check_units(log, TENDON_OFFSET if tendon_offset is None else tendon_offset)
    if tendon_offset is not None:
        _check_ways(log, tendon_offset)
    _check_spools(log, motion)
    _check_senses(log)
    told = [*jumps_told(log), *_slow_clock(log), *_gaps(log), *_zeros(log), *sensors_told(log)]
    return replace(log, remarks=[*log.remarks, *told]) if told else log


def _check_units(log: OpenLog, tendon_offset: float) -> None:
    in_mn = "is it in mN, or a current in mA with a factor for A? [0.001 N] is a thousandth"
    for names, most, shown, question, other in (
        (BENDS, _BEND, (1.0 / ANGLE["deg"], "deg"), "is it in degrees?", "deg"),
        (log.known("tension"), _TENSION, (1.0, "N"), in_mn, ""),
        (log.known("current"), _CURRENT, (1.0, "A"), "is it in mA?", "mA"),
    ):
        for name in names:
            column = np.abs(log.columns.get(name, np.empty(0)))
            if np.any(column > most):
                fix = columns_fix(log, question, {name: (log.head(name), other)}) if other else question
                problem = f"{log.head(name)} reaches {shown[0] * np.nanmax(column):,.0f} {shown[1]} by its header"
                raise UserError(problem, log.at(int(np.nanargmax(column))), fix)
    for name, column in log.known("spool").items():
        reach = float(np.nanmax(column) - np.nanmin(column))
        if reach > _SPOOL:
            where = log.at(int(np.nanargmax(np.abs(column))))
            fix = _of_other_units(log, tendon_offset)
            raise UserError(f"{log.head(name)} moves {reach:,.3g} m by its header", where, fix)
    for trial in log.trials().values():
        steps = np.diff(trial.columns.get("time", np.empty(0)))
        slow = steps.size > 0 and float(np.min(steps)) > _STEP and float(np.sum(steps)) > _LONG
        if slow and float(np.ptp(steps)) < 0.01 * float(np.median(steps)):
            problem = f"{float(np.median(steps)):.3g} s between samples of {log.head('time')}"
            raise UserError(problem, trial.at(1), columns_fix(log, "is it in ms?", {"time": (log.head("time"), "ms")}))


def _check_ways(log: OpenLog, tendon_offset: float) -> None:
    """Refuse spools that go much further, or less far, than the bend takes."""
    spools = [name for name in log.known("spool") if name in log.scales]
    if not spools:
        return
    furthest = max(spools, key=lambda name: np.nan_to_num(_range(log, name)))
    moved, way = _range(log, furthest), way_of_bend(_bends(log), tendon_offset)
    if not way > 0.0 and any(_is_in_rad(log, name) for name in BENDS):  # too small to tell more than its unit
        turned = way_of_bend([bend / ANGLE["deg"] for bend in _bends(log)], tendon_offset)
        way = turned * ANGLE["deg"] if not _is_off(moved, turned, 1.0, _NEARLY) else way
    if not (moved > 0.0 and way > 0.0 and _is_off(moved, way, log.scales[furthest])):
        return
    problem = f"{log.head(furthest)} moves {_in_mm(moved)} mm, and the bend takes {_in_mm(way)} mm"
    raise UserError(problem, log.header or str(log.file), _of_other_units(log, tendon_offset))


def _is_off(moved: float, way: float, scale: float, factor: float | None = None) -> bool:
    """Whether a spool with such a factor to SI moves much further, or less far [m], than the bend takes [m]."""
    factor = factor or (FACTOR_OF_A_UNIT if scale in LENGTH.values() else FACTOR_OF_A_COUNT)
    return not way / factor <= moved <= way * factor


def _in_mm(length: float) -> str:
    return f"{1e3 * length:,.0f}" if length >= 0.1 else f"{1e3 * length:.2g}"


def _of_other_units(log: OpenLog, tendon_offset: float) -> Phrase:
    """Units of spools, and of bends, with which the spools go as far as the bend takes; without a bend mm for m."""
    spools = [name for name in log.known("spool") if name in log.scales]
    if not spools:
        return "its unit in the header"
    in_rad = {name: (log.head(name), "rad") for name in BENDS if _is_in_rad(log, name)}
    turned = 1.0 / ANGLE["deg"] if in_rad else 1.0
    way = way_of_bend([turned * bend for bend in _bends(log)], tendon_offset)
    moves = {name: moved for name in spools if (moved := _range(log, name)) > 0.0}
    in_deg = {name: (log.head(name), "deg") for name in BENDS if log.scales.get(name) == 1.0}
    if in_deg and way > 0.0 and moves and not _is_off(max(moves.values()), way * ANGLE["deg"], 1.0, _NEARLY):
        return columns_fix(log, f"is {log.head(next(iter(in_deg)))} in deg?", in_deg)
    if not (way > 0.0 and moves):
        moved = max(float(np.nanmax(column) - np.nanmin(column)) for column in log.known("spool").values())
        if all(log.scales[name] == 1.0 for name in spools) and 1e-3 * moved < _SPOOL:
            return columns_fix(log, "is it in mm?", {name: (log.head(name), "mm") for name in spools})
        most = count_of(_SPOOL / moved * abs(log.scales[spools[0]]))
        return f"the length that one count reels in: less than {most}, for no wrist reels in {_SPOOL:g} m"
    off = [name for name, moved in moves.items() if _is_off(moved, way, log.scales[name])]
    off = off or [name for name in moves if not in_rad]
    plain = all(log.scales[name] in LENGTH.values() for name in off)
    reach = max((moves[name] for name in off), default=math.nan)
    lengths = {name: log.scales[name] * way / reach for name in off}
    units = {
        name: unit_or_count(length, FACTOR_OF_A_UNIT) if plain else count_of(length) for name, length in lengths.items()
    }
    meant = in_rad | {name: (log.head(name), unit) for name, unit in units.items()}
    if in_rad:
        return columns_fix(log, f"is {log.head(next(iter(in_rad)))} in rad?", meant)
    unit = units[off[0]]
    question = f"is it in {unit}?" if unit in LENGTH else f"{count_told(unit.removeprefix('-'), tendon_offset)}."
    return columns_fix(log, question, meant)


def _range(log: OpenLog, name: str) -> float:
    """Largest range of a column in a trial; nan where none tells it."""
    ranges = (range_of(trial.columns[name]) for trial in log.trials().values())
    return max((reach for reach in ranges if math.isfinite(reach)), default=math.nan)


def _bends(log: OpenLog) -> list[float]:
    """Range of the bend in each plane [rad]."""
    bends = log.bends()
    if bends is None:
        return []
    both = replace(log, columns={"y": bends[:, 0], "z": bends[:, 1]})
    return [_range(both, name) for name in both.columns]


def _is_in_rad(log: OpenLog, name: str) -> bool:
    """Whether a bend was read in degrees whose numbers are those of radians."""
    scale = log.scales.get(name)
    return scale == ANGLE["deg"] and unit_of_bend(log.columns[name] / scale) == "rad"


def _check_spools(log: OpenLog, motion: bool) -> None:
    spools = log.known("spool")
    still = all(float(np.nanmax(spool) - np.nanmin(spool)) == 0.0 for spool in spools.values())
    if motion and spools and len(log) > 1 and still:
        problem = "no spool moves: nothing can be identified from a log without motion"
        raise UserError(problem, log.header or str(log.file), "a log in which the tendons bend the wrist to both sides")
    if "time" not in log.columns or not spools:
        return
    for trial in log.trials().values():
        for name, jumps in _jumps(trial, list(spools)).items():
            if jumps.size:
                row, way = int(jumps[0, 0]), 1e3 * float(jumps[0, 1])
                problem = f"{log.head(name)} jumps {way:.3g} mm between two samples, which no motor does"
                fix = "a counter that wraps (at an encoder's turn)? Unwrap it in the file"
                raise UserError(problem, trial.at(row), fix)


def _jumps(trial: OpenLog, names: Sequence[str]) -> dict[str, Array]:
    """Rows and ways [m] (J, 2) of jumps that one spool makes alone. Raises UserError where most steps are too fast."""
    found, together = dict[str, Array](), np.zeros(len(trial))
    for name in names:
        there = np.flatnonzero(np.isfinite(trial.columns[name]))
        ways, steps = np.abs(np.diff(trial.columns[name][there])), np.diff(trial.columns["time"][there])
        moving = (ways > 0.0) & (steps > 0.0)
        if moving.sum() >= 20 and float(np.median(ways[moving] / steps[moving])) > _MOSTLY:
            problem = f"{trial.head(name)} moves at {float(np.median(ways[moving] / steps[moving])):.3g} m/s"
            fix = columns_fix(trial, f"is {trial.head('time')} in s?", {"time": (trial.head("time"), "s")})
            raise UserError(problem, trial.at(int(there[1])), fix)
        fast = (ways > _JUMP) & (ways > _SPEED * steps)
        found[name] = np.stack([there[1:][fast], ways[fast]], axis=1)
        together[there[1:][fast]] += 1
    return {name: jumps[together[jumps[:, 0].astype(int)] == 1] for name, jumps in found.items()}


def _check_senses(log: OpenLog) -> None:
    pulls = next(
        (pulls for kind in ("spool", "tension") if list(pulls := log.known(kind)) == [f"{kind}_1", f"{kind}_2"]), {}
    )
    if not pulls or "bend_y" not in log.columns or "bend_z" in log.columns:
        return
    one, two = pulls
    for name, trial in {"": log, **log.trials()}.items():
        bend = trial.columns["bend_y"]
        reeled = [filled(trial.time, trial.columns[pull]) for pull in pulls]
        there = np.isfinite(np.stack([bend, *reeled])).all(axis=0)
        bend, first, second = (column[there] for column in (bend, *reeled))
        within = f" in trial {name}" if name else ""
        if _alike(bend, first - second) < _OPPOSITE:
            act = "is reeled in" if one.startswith("spool") else "pulls more"
            problem = f"{log.head('bend_y')} falls while tendon 1 {act}{within}"
            question = f"tendons 1 and 2 exchanged, or the bend counted the other way: exchange {one} and {two}."
            exchanged = {one: (log.head(two), unit_read(log, two)), two: (log.head(one), unit_read(log, one))}
            raise UserError(problem, log.header or str(log.file), columns_fix(log, question, exchanged))
        likeness = _alike(bend, first), _alike(bend, second)
        if one.startswith("spool") and min(likeness) * max(likeness) > 0.0 and min(map(abs, likeness)) > _TOGETHER_WITH:
            wrong = two if likeness[0] > 0.0 else one
            problem = f"{log.head(one)} and {log.head(two)} reel in together{within}, and the wrist bends"
            turned = {wrong: (log.head(wrong), turned_unit(log, wrong))}
            question = f"{log.head(wrong)} with the other sign?"
            raise UserError(problem, log.header or str(log.file), columns_fix(log, question, turned))


def _alike(one: Array, other: Array) -> float:
    """Correlation of two columns; 0 where one does not move."""
    if len(one) < 3 or np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def _slow_clock(log: OpenLog) -> list[str]:
    """A sentence where even steps of whole seconds make hours: they may be ms."""
    if "time" not in log.columns:
        return []
    steps = np.diff(log.columns["time"])
    whole = steps.size > 0 and bool(np.all(log.columns["time"] == np.round(log.columns["time"])))
    if not (whole and float(np.median(steps)) > _SLOW and float(np.sum(steps)) > _LONG):
        return []
    return [
        f"{log.place(0)}: {log.head('time')} has rows {float(np.median(steps)):.3g} s apart over "
        f"{float(np.sum(steps)) / 3600.0:.3g} h; is it in ms? Delay and damping go with it."
    ]


def turned_unit(log: OpenLog, name: str) -> str:
    """Unit with which a column is read with the other sign."""
    unit = unit_read(log, name)
    return unit[1:] if unit.startswith("-") else f"-{unit}" if unit[0].isdigit() else f"-1 {unit}"


def columns_fix(log: OpenLog, question: str, meant: Mapping[str, tuple[str, str]]) -> Phrase:
    """A question, and the text for `--columns` that answers it: names in the file and units by names in an open log."""
    if not all(name in log.heads for name in meant):
        return question
    if all((log.head(name), unit_read(log, name)) == column for name, column in meant.items()):
        unit = next(iter(meant.values()))[1]
        return f"the numbers, or their unit: [0.1 {unit}] is a tenth of one"
    mapped = {name: (log.head(name), unit_read(log, name)) for name in log.scales if name in log.mapped}
    text = ", ".join(f"{name}={head} [{unit}]" for name, (head, unit) in {**mapped, **meant}.items())
    return (f"{question} Then ", Argument("columns", text, quoted=True))


def unit_read(log: OpenLog, name: str) -> str:
    """Unit with which a column was read, or the multiple of one."""
    units, scale = units_of(name) or {"": 1.0}, log.scales.get(name, 1.0)
    unit = next((unit for unit, factor in units.items() if math.isclose(factor, scale, rel_tol=1e-9)), None)
    return unit or f"{scale / units[_common(units)]:.9g} {_common(units)}"


def _common(units: Units) -> str:
    return "mm" if "mm" in units else next(iter(units))


def _gaps(log: OpenLog) -> list[str]:
    """A sentence where rows are further apart than elsewhere: whatever is between is joined by a line."""
    found = list[tuple[str, float, float]]()
    if "time" in log.columns:
        for trial in log.trials().values():
            steps = np.diff(trial.columns["time"])
            usual = float(np.median(steps)) if steps.size else 0.0
            gaps = np.flatnonzero(steps > max(_GAP * usual, _PAUSE))
            found += [(trial.place(int(row) + 1), float(steps[row]), usual) for row in gaps]
    if not found:
        return []
    where, gap, usual = found[0]
    others = f" (the first of {len(found)} gaps)" if len(found) > 1 else ""
    return [
        f"{where}: {gap:.3g} s without a row, where rows are {usual:.3g} s apart{others}; the motion is taken as "
        "even in between. If it is not, give what follows its own trial in a column trial."
    ]


def _zeros(log: OpenLog) -> list[str]:
    """A sentence where all tendons are reeled in by more than any wrist takes: their encoders have another zero."""
    spools = log.known("spool")
    if len(spools) < 2:
        return []
    together = float(np.mean([np.nanmean(spool) for spool in spools.values()]))
    if abs(together) < _TOGETHER:
        return []
    names = ", ".join(log.head(name) for name in spools)
    return [
        f"{log.place(0)}: {names} are reeled in by {1e3 * together:.3g} mm in the mean; a spool counts from where "
        "its tendon is just taut: slack and tendon stiffness are wrong unless you take that off in the file."
    ]
