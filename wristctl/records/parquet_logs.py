"""Logs in parquet files: tables with a column each, or parts of a LeRobotDataset with vectors of named joints.

The layout of a LeRobotDataset v3 is that of its documentation: `data/chunk-000/file-000.parquet` holds `timestamp` [s],
`episode_index` and vectors such as `observation.state`, whose names stand in `meta/info.json`. Parts that are named as
columns of an open log with their units, such as `spool_1 [m]`, need no other name, and what else the data set has is
passed over. `observed` and `observed_at`, which `wristctl runs export --to lerobot` writes beside the state, are its
samples in double precision, and when each was taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain, read_json
from wristctl.records.folders_of_logs import info_of
from wristctl.records.log_columns import head_of_open_log
from wristctl.records.recorded_table import INSTALL, Cells, RecordedTable, cannot_read

STATE, ACTION = "observation.state", "action"
OBSERVED, OBSERVED_AT = "observed", "observed_at"
"""Columns of a data set with a part for each of the state: its last sample in double precision, and when that was taken
[s], since the motion began."""


def parquet_table(file: Path, what: str) -> RecordedTable:
    """Columns of a parquet file, vectors of equal length parted into `name.part`; `what` is what an error calls it.

    Raises UserError for a file that cannot be read.
    """
    frame = data_frame(file, what)
    info = info_of(file)
    names = _names(info) if info else {}
    if {"frame_index", "index"} <= set(frame):
        return _data_set(frame, names)
    heads, cells = _columns(frame, names)
    return RecordedTable(heads, cells)


def _columns(frame: Any, names: Mapping[str, list[str]]) -> tuple[list[str], list[Cells]]:
    """Heads and cells of all columns, vectors parted."""
    heads, cells = list[str](), list[Cells]()
    for column in map(str, frame.columns):
        values, parts = _plain(frame[column]), names.get(column, [])
        if values.ndim == 1:
            heads.append(f"{column}.{parts[0]}" if len(parts) == 1 else column)
            cells.append(values)
            continue
        distinct = len(set(parts)) == values.shape[1]
        heads += [f"{column}.{parts[k] if distinct else k}" for k in range(values.shape[1])]
        cells += list(values.T)
    return heads, cells


def _data_set(frame: Any, names: Mapping[str, list[str]]) -> RecordedTable:
    """Rows of a data set, episodes as trials; samples at their own times where the set says when they were taken."""
    numbers, parts = frame["episode_index"].to_numpy(), names.get(OBSERVED, [])
    if {OBSERVED, OBSERVED_AT} <= set(frame) and parts and all(head_of_open_log(part) for part in parts):
        (_, values), (_, taken) = (_columns(frame[[column]], {}) for column in (OBSERVED, OBSERVED_AT))
        if len(values) == len(taken) == len(parts):
            return _samples(parts, values, taken, numbers)
    standing = {f"{STATE}.{part}": head for part in names.get(STATE, []) if (head := head_of_open_log(part))}
    heads, cells = _columns(frame, names)
    own = {"timestamp": "timestamp [s]", "episode_index": "trial"} | standing
    return RecordedTable([own.get(head, head) for head in heads], cells, others=bool(standing))


def _samples(
    heads: Sequence[str], cells: Sequence[Cells], taken: Sequence[Cells], numbers: np.ndarray[Any, Any]
) -> RecordedTable:
    """A row for each time at which any part was taken (N,), without values that are held from the row before."""
    rows = list[tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]]()
    for values, times in zip(cells, taken, strict=True):
        at = np.asarray(times, float)
        fresh = np.isfinite(at)
        fresh[1:] &= (at[1:] != at[:-1]) | (numbers[1:] != numbers[:-1])
        rows.append((numbers[fresh], at[fresh], np.asarray(values, float)[fresh]))
    both = [np.stack([number.astype(float), at], axis=1) for number, at, _ in rows]
    every, places = np.unique(np.concatenate(both), axis=0, return_inverse=True)
    columns, begin = list[Cells](), 0
    for _, _, values in rows:
        column = np.full(len(every), np.nan)
        column[places[begin : begin + len(values)]] = values
        columns.append(column)
        begin += len(values)
    trial = every[:, 0].astype(int)
    return RecordedTable(["trial", "time [s]", *heads], [trial, every[:, 1], *columns], others=True)


def data_frame(file: Path, what: str) -> Any:
    """Data frame of a parquet or a CSV file. Raises UserError for one that cannot be read."""
    import pandas as pd

    try:
        with open_plain(file, LARGEST_DATA) as stream:
            return pd.read_csv(stream) if file.suffix == ".csv" else pd.read_parquet(stream)
    except ImportError:
        raise UserError("parquet files are read by pyarrow, which is not installed", str(file), INSTALL) from None
    except (OSError, ValueError) as error:
        raise cannot_read(what, file, error) from error


def _plain(series: Any) -> np.ndarray[Any, Any]:
    """Numbers, dates or texts (T,), or numbers (T, N) of vectors."""
    import pandas as pd

    if pd.api.types.is_numeric_dtype(series.dtype):
        return np.asarray(series.to_numpy(float, na_value=np.nan) if series.hasnans else series.to_numpy())
    if isinstance(series.dtype, pd.DatetimeTZDtype):
        series = series.dt.tz_convert("UTC").dt.tz_localize(None)
    values = np.asarray(series.to_numpy())
    vectors = values.dtype.kind == "O" and len(values) > 0 and all(np.ndim(value) == 1 for value in values)
    if vectors and len({len(value) for value in values}) == 1:
        return np.stack([np.asarray(value) for value in values])
    return values


def _names(info: Path) -> dict[str, list[str]]:
    """Names of the parts of each vector, which a data set gives as a list, or as one under a heading."""
    try:
        features = read_json(info).get("features", {})
    except (OSError, ValueError, AttributeError):
        raise UserError("it describes no data set", str(info), "the info.json that the data set came with") from None
    names = dict[str, list[str]]()
    for feature, described in features.items() if isinstance(features, dict) else ():
        given = described.get("names") if isinstance(described, dict) else None
        if isinstance(given, dict) and len(given) == 1:
            given = next(iter(given.values()))
        if isinstance(given, list):
            names[str(feature)] = [str(name) for name in given]
    return names
