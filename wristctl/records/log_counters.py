"""Counters of logs that begin again at 2^16 or 2^32, of encoders and of microcontrollers' clocks, made to go on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from wristctl.records.column_ranges import SIZES, turns_of
from wristctl.records.open_log import OpenLog


def without_wraps(log: OpenLog) -> OpenLog:
    """The log with spools and times that count on where a whole counter begins again, which its remarks say.

    A column is a counter where its numbers are whole, all in the range of 16 or 32 bits, signed or not, and where its
    largest steps are that range within a tenth while all others are below a tenth of it.
    """
    columns, told = dict(log.columns), list[str]()
    for name, scale in log.scales.items():
        if name not in columns or (name != "time" and not name.startswith("spool_")):
            continue
        counts, there = columns[name] / scale, np.flatnonzero(np.isfinite(columns[name]))
        whole = np.round(counts[there])
        if len(there) < 3 or np.any(np.abs(counts[there] - whole) > 1e-6 * np.maximum(1.0, np.abs(whole))):
            continue
        for size in SIZES:
            turns = turns_of(whole, size)
            if turns is None:
                continue
            columns[name] = columns[name].copy()
            columns[name][there] = scale * (whole + size * turns)
            wraps = np.flatnonzero(np.diff(turns)) + 1
            where = Path(log.at(int(there[wraps[0]]))).name
            more = f", {len(wraps)} times in all" if len(wraps) > 1 else ""
            power = size.bit_length() - 1
            told.append(f"{log.head(name)} begins again after 2^{power} counts at {where}{more}: it is taken to go on.")
            break
    return replace(log, columns=columns, remarks=[*log.remarks, *told]) if told else log
