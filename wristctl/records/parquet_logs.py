"""Logs in parquet files: tables with a column each, or parts of a LeRobotDataset with vectors of named joints.

The layout of a LeRobotDataset v3 is that of its documentation: `data/chunk-000/file-000.parquet` holds `timestamp` [s],
`episode_index` and vectors such as `observation.state`, whose names stand in `meta/info.json`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain, read_json
from wristctl.records.folders_of_logs import info_of
from wristctl.records.recorded_table import INSTALL, Cells, RecordedTable


def parquet_table(file: Path, what: str) -> RecordedTable:
    """Columns of a parquet file, vectors of equal length parted into `name.part`; `what` is what an error calls it.

    Raises UserError for a file that cannot be read.
    """
    frame = parquet_frame(file, what)
    info = info_of(file)
    names = _names(info) if info else {}
    of_a_set = (
        {"timestamp": "timestamp [s]", "episode_index": "trial"} if {"frame_index", "index"} <= set(frame) else {}
    )
    heads, cells = list[str](), list[Cells]()
    for column in map(str, frame.columns):
        values = _plain(frame[column])
        if values.ndim == 1:
            heads.append(of_a_set.get(column, column))
            cells.append(values)
            continue
        parts = names.get(column, [])
        distinct = len(set(parts)) == values.shape[1]
        heads += [f"{column}.{parts[k] if distinct else k}" for k in range(values.shape[1])]
        cells += list(values.T)
    return RecordedTable(heads, cells)


def parquet_frame(file: Path, what: str) -> Any:
    """Data frame of a parquet file. Raises UserError for one that cannot be read."""
    import pandas as pd

    try:
        with open_plain(file, LARGEST_DATA) as stream:
            return pd.read_parquet(stream)
    except ImportError:
        raise UserError("parquet files are read by pyarrow, which is not installed", str(file), INSTALL) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UserError(f"cannot read the {what}: {reason}", str(file), "check the path") from error


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
