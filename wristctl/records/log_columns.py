"""Columns of logs: their names and units, and the text by which another author's columns are named (`--columns`)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from wristctl.arrays import Array
from wristctl.errors import Argument, UserError, meant, nearest
from wristctl.records.column_guesses import UNIT_WORDS, Guess, guesses
from wristctl.records.column_ranges import (
    count_told,
    numbers_of,
    range_of,
    unit_of_bend,
    unit_of_current,
    unit_of_spools,
    way_of_bend,
)
from wristctl.records.recorded_table import Cells

Units = Mapping[str, float]
"""Units that a column may have, with their factors to SI."""

TIME: Units = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE: Units = {"deg": math.pi / 180.0, "rad": 1.0}
LENGTH: Units = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2}
FORCE: Units = {"N": 1.0}
MASS: Units = {"kg": 1.0, "g": 1e-3}
CURRENT: Units = {"A": 1.0, "mA": 1e-3}
RATE: Units = {"deg/s": math.pi / 180.0, "rad/s": 1.0}
SHARE: Units = {"": 1.0}
GRAVITY: Units = {"m/s^2": 1.0, "g": 9.80665, "": 1.0}

QUATERNION = ("quat_x", "quat_y", "quat_z", "quat_w")
"""Orientation of an inertial unit on the tip."""
VERTICAL = ("gravity_x", "gravity_y", "gravity_z")
"""Direction of gravity, or of what an accelerometer at rest shows, in the axes of such a unit."""
COLUMNS: Mapping[str, Units] = {
    "time": TIME,
    **dict.fromkeys(("bend_y", "bend_z", "inclination", "orientation"), ANGLE),
    **dict.fromkeys(("tip_x", "tip_y", "tip_z"), LENGTH),
    **dict.fromkeys(("rate_y", "rate_z"), RATE),
    **dict.fromkeys(QUATERNION, SHARE),
    **dict.fromkeys(VERTICAL, GRAVITY),
    "mass": MASS,
    "pose": ANGLE,
}
"""Columns of numbers, beside those of tendons."""
OF_TENDONS: Mapping[str, Units] = {"spool": LENGTH, "tension": FORCE, "current": CURRENT}
WORDS = ("trial", "marker")
"""Columns of words."""

SYNONYMS: Mapping[str, str] = {
    "timestamp": "time",
    "angle": "bend_y",
    "bend": "bend_y",
    "theta": "bend_y",
    "x": "tip_x",
    "y": "tip_y",
    "z": "tip_z",
    "hand_mass": "mass",
    "spool_plus": "spool_1",
    "spool_minus": "spool_2",
    "tension_plus": "tension_1",
    "tension_minus": "tension_2",
}
"""Other names of columns. In a plane the + side's tendon is the first, that of the - side the second."""

EXAMPLE = "time [s],angle [deg],spool_1 [mm],spool_2 [mm]"

# Other spellings of units that mean one thing in every language.
_SPELT = {"°": "deg", "degrees": "deg", "degree": "deg", "sec": "s", "seconds": "s", "µs": "us", "μs": "us",
          "µm": "um", "μm": "um"}  # fmt: skip
# Most letters of a column's name.
_LONGEST = 1000
BENDS = ("bend_y", "bend_z", "inclination")
"""Columns that say how far the wrist bends."""
_HEAD = re.compile(r"\s*(.*?)\s*(?:\[\s*([^]]*?)\s*\])?\s*")
TENDON = re.compile(rf"({'|'.join(OF_TENDONS)})_([1-9]\d*)")
"""Name of a tendon's column: its quantity and its number."""
_SCALED = re.compile(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?:x\s*)?(\S*)")

Names = Mapping[str, tuple[str, str]]
"""Name in an open log and unit (empty: as the header says), by another author's name."""


class ReadColumn(NamedTuple):
    """A column that is read: its name in an open log, and its factor to SI."""

    name: str
    scale: float


def units_of(name: str) -> Units | None:
    """Units of a column of numbers by its name in an open log, None of no such column."""
    tendon = TENDON.fullmatch(name)
    return OF_TENDONS[tendon[1]] if tendon else COLUMNS.get(name)


def units_in_a_line() -> frozenset[str]:
    """Words that a line of units under a header may have."""
    maps = (*COLUMNS.values(), *OF_TENDONS.values())
    return frozenset({*_SPELT, *UNIT_WORDS, *(unit for units in maps for unit in units)})


def entries_of(text: str) -> list[str]:
    """Entries of a text for `--columns`: commas part them, but for those within brackets."""
    return [entry.strip() for entry in re.split(r",(?![^[]*\])", text) if entry.strip()]


def mapped_names(text: str) -> dict[str, tuple[str, str]]:
    """Name in an open log and unit, by another author's name: `bend_y=imu [deg]` gives {"imu": ("bend_y", "deg")}."""
    mapped: dict[str, tuple[str, str]] = {}
    for entry in entries_of(text):
        standard, equals, theirs = entry.partition("=")
        head, unit = _parted(theirs)
        name = SYNONYMS.get(standard.strip(), standard.strip())
        if not equals or not head:
            raise UserError(f"{entry.strip()!r} maps no column", "columns", "time=t [ms], bend_y=imu [deg]")
        if units_of(name) is None and name not in WORDS:
            fix = meant(name, [*COLUMNS, *WORDS, "spool_1", "tension_1", "current_1"])
            raise UserError(f"{name} is no column of an open log", "columns", fix)
        mapped[head] = name, unit
    return mapped


def _parted(head: str) -> tuple[str, str]:
    """Name and unit of a column in a header."""
    match = _HEAD.fullmatch(head)
    return (match[1], match[2] or "") if match else (head.strip(), "")


def name_of(head: str) -> str:
    """Name of a column in a header, without its unit."""
    return _parted(head)[0]


def head_of_open_log(head: str) -> str | None:
    """A head that names a column of an open log in a unit of its own, such as `spool_1 [m]`; None of any other."""
    name, unit = _parted(head)
    return head if unit in (units_of(name) or ()) else None


def chosen_columns(
    heads: Sequence[str],
    names: Names,
    units: Mapping[str, Units],
    others: bool,
    dated: Collection[int],
    where: str,
    proposed: Callable[[], Proposal],
) -> dict[int, ReadColumn]:
    """The columns that are read, by their places in a header.

    Raises UserError, with the text for `--columns` that may be meant, for a column without a name or a unit that is
    known, for one that stands there twice, and for a name of `names` that no column has.

    Parameters
    ----------
    heads
        Names with units in brackets, as they stand in the file.
    names
        Names of another author's columns.
    units
        Columns of numbers of other names, with their units.
    others
        Whether columns of other names are passed over.
    dated
        Places of columns that hold dates or Unix times, whose unit they say themselves.
    where
        File and line of the header, for errors.
    proposed
        The text for `--columns` that may be meant, for errors.
    """
    chosen, missing, unknown = dict[int, ReadColumn](), dict(names), list[int]()
    for place, cell in enumerate(heads):
        if len(cell) > _LONGEST:
            raise UserError(f"a column's name has {len(cell)} letters", where, f"a header such as {EXAMPLE}")
        written, unit = _parted(cell)
        name = SYNONYMS.get(written, written)
        if written in names:
            name, mapped_unit = missing.pop(written, names[written])
            unit = mapped_unit or unit
        elif cell.strip() in names:
            name, unit = missing.pop(cell.strip(), names[cell.strip()])
        known = units.get(written) or units_of(name) or ({"": 1.0} if name in WORDS else None)
        if known is None:
            unknown += [] if others else [place]
            continue
        if name in (column.name for column in chosen.values()):
            raise UserError(f"column {written} stands there twice", where, f"leave one out that is {name}")
        if name == "time" and place in dated and not unit:
            chosen[place] = ReadColumn(name, math.nan)
            continue
        factor = _factor(unit, known)
        if factor is None:
            raise _without_factor(written, name, unit, known, proposed(), where)
        chosen[place] = ReadColumn(name, factor)
    if unknown:
        raise _unknown(heads, unknown, units, proposed(), where)
    for theirs, (name, _) in missing.items():
        fix = meant(theirs, [name_of(head) for head in heads])
        raise UserError(f"no column {theirs!r}, which is to be {name}", where, fix)
    return chosen


def _factor(unit: str, units: Units) -> float | None:
    """Factor to SI of a unit, which may be a multiple of one: 0.175 mm; None of one that is not known."""
    unit = _SPELT.get(unit, unit)
    if unit in units:
        return units[unit]
    scaled = _SCALED.fullmatch(unit)
    return float(scaled[1]) * units[scaled[2]] if scaled and scaled[2] in units else None


def _without_factor(written: str, name: str, unit: str, units: Units, proposed: Proposal, where: str) -> UserError:
    choices = f"{written} [{'] or ['.join(units)}]"
    mapped = f"{name}={written} [{UNIT_WORDS.get(unit.lower(), next(iter(units)))}]"
    if unit and unit.lower() not in UNIT_WORDS:
        fix = f"{choices}, or a multiple such as [0.5 {next(iter(units))}]"
        return UserError(f"{written} is in {unit!r}", where, fix)
    whole = proposed.text if f"{name}={written} " in proposed.text else mapped
    problem = f"{written} is in {unit!r}" if unit else f"column {written!r} has no unit"
    told = (f"{choices}; or leave the file as it is: ", Argument("columns", whole, quoted=True), proposed.doubts)
    return UserError(problem, where, told)


def _unknown(
    heads: Sequence[str], unknown: Sequence[int], units: Mapping[str, Units], proposed: Proposal, where: str
) -> UserError:
    written = [name_of(heads[place]) for place in unknown]
    choices = [*units, *WORDS, *SYNONYMS, "spool_3", "tension_3", "current_3"]
    like = nearest(written[0], choices) if len(written[0]) > 3 else None
    text = proposed.text or f"NAME={written[0]}{'' if '[' in heads[unknown[0]] else ' [UNIT]'}"
    option = Argument("columns", text, quoted=True)
    if proposed.text and like is None:
        begin = "if this is what they are: " if len(written) > 1 else "if this is what it is: "
    else:
        begin = f"{meant(written[0], choices)} Else leave it out, or "
    problem = f"unknown column{'s' if len(written) > 1 else ''} {', '.join(map(repr, written[:6]))}"
    return UserError(f"{problem}{', ...' if len(written) > 6 else ''}", where, (begin, option, proposed.doubts))


class Proposal(NamedTuple):
    """A text for `--columns` that may be meant."""

    text: str
    """Empty where no column's name says what it is."""
    doubts: str
    """Which units are guesses, and which columns it passes over; empty where there are none."""


# A column's name in the file, as `--columns` has it, and what it is; its unit is empty where the header says it.
_Meant = tuple[str, Guess]


def proposal(heads: Sequence[str], names: Names, cells: Sequence[Cells], tendon_offset: float) -> Proposal:
    """The text for `--columns` that columns may be meant by, from their names and units, and from their numbers' range.

    Parameters
    ----------
    heads
        Names with units in brackets, as they stand in the file.
    names
        What is named already, and stays.
    cells
        Columns of the file, whose ranges tell the units of bends and spools that are not said.
    tendon_offset
        Distance of the tendons from the axis [m], for the same.
    """
    columns = _meant(heads, names)
    by_range = _units_by_range(heads, columns, cells, tendon_offset) if cells else {}
    entries, guessed, ranged = list[str](), list[str](), list[str]()
    count = ""
    for place, column in enumerate(columns):
        if column is None or column[1].standing:
            continue
        theirs, guess = column
        unit = by_range.get(place, guess.unit)
        entry = f"{guess.name}={theirs}{f' [{unit}]' * bool(unit)}"
        if not _reads_back(entry):
            continue
        entries.append(entry)
        if guess.unsure:
            (ranged if place in by_range else guessed).append(theirs)
            if guess.name.startswith("spool_") and place in by_range and unit not in LENGTH:
                count = f"; {count_told(unit, tendon_offset)}"
            elif guess.name.startswith("spool_") and place not in by_range and unit == "mm":
                count = count or "; of a counter [0.175 mm] is what one count reels in"
    units = [f"the unit of {', '.join(guessed)}"] * bool(guessed)
    units += [f"by the range of the numbers the unit of {', '.join(ranged)}"] * bool(ranged)
    doubts = f" (guessed: {'; '.join(units)}{count})" if units else ""
    passed = [name_of(head) for head, column in zip(heads, columns, strict=True) if column is None]
    return Proposal(", ".join(entries), doubts + (f" (it passes over {', '.join(passed[:6])})" if passed else ""))


def _meant(heads: Sequence[str], named: Names) -> list[_Meant | None]:
    """What each column is by its name or by its head, None of one that nothing is known of."""
    taken = {name for name, _ in named.values()}
    fresh = [head for head in heads if name_of(head) not in named and head.strip() not in named]
    guess_of = dict(zip(fresh, guesses(fresh, taken, _known_already), strict=True))
    columns = list[_Meant | None]()
    for head in heads:
        theirs = name_of(head)
        key = theirs if theirs in named else head.strip()
        if key in named:
            name, unit = named[key]
            in_header = _factor(_parted(head)[1], units_of(name) or {}) is not None
            unsure = not (unit or name in WORDS or in_header)
            columns.append((key, Guess(name, unit or _first_unit(name) * unsure, unsure, False)))
        else:
            guess = guess_of[head]
            columns.append(guess and (theirs, guess))
    return columns


def _units_by_range(
    heads: Sequence[str], columns: Sequence[_Meant | None], cells: Sequence[Cells], tendon_offset: float
) -> dict[int, str]:
    """Units of bends and spools that are guesses, by the places of the columns, where the numbers tell them."""
    units, ranges, spools = dict[int, str](), list[float](), dict[int, Array]()
    for place, column in enumerate(columns):
        if column is None:
            continue
        _, guess = column
        if guess.name in BENDS:
            numbers = numbers_of(cells[place])
            unit = unit_of_bend(numbers)
            if guess.unsure and unit:
                units[place] = unit
            factor = _factor(units.get(place, guess.unit or _parted(heads[place])[1]), ANGLE)
            ranges += [factor * range_of(numbers)] if factor else []
        elif guess.name.startswith("spool_") and guess.unsure:
            spools[place] = numbers_of(cells[place])
        elif guess.name.startswith("current_") and guess.unsure:
            units[place] = unit_of_current(numbers_of(cells[place]))
    unit = unit_of_spools(list(spools.values()), way_of_bend(ranges, tendon_offset))
    return units | dict.fromkeys(spools, unit) if unit else units


def _known_already(head: str) -> Guess | None:
    """What a column is that an open log has by its name and unit."""
    written, unit = _parted(head)
    name = SYNONYMS.get(written, written)
    units = units_of(name)
    if name in WORDS:
        return Guess(name, "", False, True)
    if units is None:
        return None
    if _factor(unit, units) is not None:
        return Guess(name, unit, False, True)
    spelt = UNIT_WORDS.get(unit.lower(), "")
    return Guess(name, spelt if spelt in units else _first_unit(name), spelt not in units, False)


def _first_unit(name: str) -> str:
    """The commonest unit of a column."""
    return "mm" if units_of(name) is LENGTH else next(iter(units_of(name) or ()), "")


def _reads_back(entry: str) -> bool:
    """Whether an entry means one column: names may hold commas, brackets or equals signs."""
    try:
        return len(mapped_names(entry)) == 1
    except UserError:
        return False
