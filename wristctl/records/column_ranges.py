"""Units of bends and spools by the range of their numbers, where nothing else says them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.records.recorded_table import Cells

TENDON_OFFSET = 0.0141
"""Distance of the tendons from the axis [m] of a wrist that nobody has described."""
# Counts after which a counter begins again.
_SIZES = (2**16, 2**32)
FACTOR_OF_A_COUNT, FACTOR_OF_A_UNIT = 5.0, 10.0
"""Factors by which spools may go further, or less far, than the bend takes, for the length of a count or for a unit."""

# Largest share of a counter's range that a step between two samples may have for its wraps to be told.
_SHARE = 0.1
# Numbers below which a bend is in rad, and a spool in m.
_RAD, _METRES = 1.6, 0.05
# Current of no small motor [A].
_AMPERES = 20.0
# Smallest range of a bend [rad] that tells how far spools go.
_LEAST_BEND = 0.01


def numbers_of(cells: Cells) -> Array:
    """Numbers of a column (T,); nan where there is none."""
    import pandas as pd

    numbers: Array = pd.to_numeric(pd.Series(cells), errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)
    return numbers


def are_whole(numbers: Array) -> bool:
    """Whether numbers may be those of a counter."""
    there = numbers[np.isfinite(numbers)]
    return bool(np.all(np.abs(there - np.round(there)) <= 1e-6 * np.maximum(1.0, np.abs(there))))


def counter_of(numbers: Array) -> tuple[int, Array] | None:
    """Counts after which a counter begins again, and its turns before each number (T,); None of no such counter."""
    counts = np.round(numbers)
    for size in _SIZES if are_whole(numbers) else ():
        if counts.min() < -size // 2 or counts.max() >= size or np.ptp(counts) >= size:
            continue
        steps = np.diff(counts)
        wraps = np.abs(steps) > 0.5 * size
        rest = steps - size * np.sign(steps) * wraps
        if wraps.any() and not np.any(np.abs(rest) > _SHARE * size):
            return size, np.concatenate([[0.0], np.cumsum(-np.sign(steps) * wraps)])
    return None


def range_of(numbers: Array) -> float:
    """Largest less smallest of a motion's numbers (T,); nan where a jump makes half of it, or of fewer than three.

    Counters that wrap are taken to go on.
    """
    there = numbers[np.isfinite(numbers)]
    if len(there) < 3:
        return math.nan
    if (counter := counter_of(there)) is not None:
        there = there + counter[0] * counter[1]
    reach = float(np.ptp(there))
    return reach if float(np.abs(np.diff(there)).max()) <= 0.5 * reach else math.nan


def way_of_bend(bends: Sequence[float], offset: float) -> float:
    """Length [m] that spools reel in for bends over ranges [rad], with tendons at an offset [m]; nan of too small ones.

    Of two planes the one with the larger bend counts.
    """
    largest = max((bend for bend in bends if math.isfinite(bend)), default=math.nan)
    return largest * offset if largest >= _LEAST_BEND else math.nan


def unit_of_bend(numbers: Array) -> str | None:
    """rad of a bend whose numbers are all below 1.6, else deg; None of one without a number but 0."""
    largest = float(np.nanmax(np.abs(numbers), initial=0.0))
    return None if largest == 0.0 else "rad" if largest < _RAD else "deg"


def unit_of_current(numbers: Array) -> str:
    """mA of currents beyond 20, else A."""
    return "mA" if float(np.nanmax(np.abs(numbers), initial=0.0)) > _AMPERES else "A"


def unit_of_spools(columns: Sequence[Array], way: float) -> str | None:
    """Unit of spools whose numbers (T,) are to go a way [m], or the length of a count; None where nothing tells it.

    Without a way, numbers below 0.05 are in m.
    """
    reach = max((one for column in columns if math.isfinite(one := range_of(column))), default=math.nan)
    if math.isfinite(way) and reach > 0.0:
        return unit_or_count(way / reach, FACTOR_OF_A_COUNT if all(map(are_whole, columns)) else FACTOR_OF_A_UNIT)
    largest = max((float(np.nanmax(np.abs(column), initial=0.0)) for column in columns), default=0.0)
    return "m" if 0.0 < largest < _METRES else None


def unit_or_count(length: float, factor: float) -> str:
    """m or mm where the length [m] of one is so within a factor, else that length in mm, to two digits."""
    off, unit = min((abs(math.log(abs(length) / scale)), unit) for unit, scale in (("m", 1.0), ("mm", 1e-3)))
    return unit if length > 0.0 and off <= math.log(factor) else count_of(length)


def count_of(length: float) -> str:
    """Length [m] of one count as a unit, to two digits: 0.00072 mm."""
    return f"{1e3 * length:.2g} mm"


def count_told(counts: str, offset: float) -> str:
    """Words for the length of one count, which stands on the distance of the tendons from the axis [m]."""
    return f"one count is about {counts} if the tendon runs at wrist.tendon_radius ({1e3 * offset:.3g} mm off the axis)"
