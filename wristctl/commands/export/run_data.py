"""A run's data in formats of other programs: open logs, MATLAB's, LeRobot's, and MCAP, which robot log viewers open."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.export.lerobot_data_set import write_data_set
from wristctl.commands.export.model import viewed_chain
from wristctl.commands.export.recorded_motions import Columns, Stream, motions_of
from wristctl.config.wrist import WristParameters
from wristctl.errors import FILE, UserError
from wristctl.records import Run
from wristctl.records.files import replacing
from wristctl.records.log_columns import units_of
from wristctl.records.open_log import OpenLog, write_log
from wristctl.records.recorded_table import INSTALL

if TYPE_CHECKING:
    import pandas as pd


def tables_of(run: Run) -> dict[str, pd.DataFrame]:
    """Every table of a run by its name: data/log.csv is log."""
    return {file.stem: run.data(file.stem) for file in sorted((run.path / "data").glob("*.csv"))}


def arrays_of(run: Run) -> dict[str, dict[str, np.ndarray]]:
    """Every set of arrays of a run by its name."""
    return {file.stem: run.array(file.stem) for file in sorted((run.path / "data").glob("*.npz"))}


def columns_of(run: Run, table: str) -> dict[str, tuple[str, str]]:
    """Unit and meaning of a table's columns, as far as the run says them."""
    outputs = [output for output in run.manifest.outputs if output.path == f"data/{table}.csv"]
    return {column.name: (column.unit, column.meaning) for output in outputs for column in output.columns}


def export_run(run: Run, to: str, file: Path | None) -> Path:
    """Write a run's data as `to` (csv, mat, mcap, lerobot); where they were written.

    Raises UserError for a run without data, a file in the way, or a package that is not installed.
    """
    ending, write = FORMATS[to]
    path = file or Path(f"{run.id}{ending}")
    if path.exists():
        raise UserError("a file is in the way", str(path), "remove it, or name another with --file")
    if not (run.path / "data").is_dir():
        raise UserError("the run has no data", str(run.path), "name another")
    write(run, path)
    return path


def open_log_of(run: Run) -> OpenLog:
    """Motions of a run, one after the other. Raises UserError for a run that holds none."""
    motions = motions_of(run)
    parts = [_merged(motion.measured) for motion in motions]
    names = list(dict.fromkeys(name for part in parts for name in part))
    if len(parts) > 1:
        names.sort(key=lambda name: (name != "time", name))
    columns: dict[str, Array] = {
        name: np.concatenate([part.get(name, np.full(len(part["time"]), np.nan)) for part in parts]) for name in names
    }
    if run.kind == "hw-run" and _mass_is_said(run):
        columns["mass"] = np.full(len(columns["time"]), run.config.wrist.hand_mass)
    trials = [np.full(len(part["time"]), motion.name) for motion, part in zip(motions, parts, strict=True)]
    words = {"trial": np.concatenate(trials)} if any(motion.name for motion in motions) else {}
    return OpenLog(run.path, "log", columns, words)


def _mass_is_said(run: Run) -> bool:
    """Whether somebody has said the hand's mass: of a rig of one's own the default is nobody's."""
    default = WristParameters.model_fields["hand_mass"].default
    return run.config.hw_run.rig is None or run.config.wrist.hand_mass != default


def _merged(streams: Sequence[Stream]) -> Columns:
    """Columns at times of their own as columns at all times, in their order; cells of other times are empty."""
    time = np.unique(np.concatenate([stream.time for stream in streams]))
    merged = {"time": time}
    for stream in streams:
        rows = np.searchsorted(time, stream.time)
        for name, column in stream.columns.items():
            if units_of(name) is None:
                continue
            merged[name] = np.full(len(time), np.nan)
            merged[name][rows] = column
    return merged


def _csv(run: Run, path: Path) -> None:
    write_log(open_log_of(run), path, FILE)


def _mat(run: Run, path: Path) -> None:
    """A struct for each table and each set of arrays, `units` and `meaning` of the columns, `metrics`, `run`."""
    from scipy.io import savemat

    data = {
        name: {str(key): _column(column) for key, column in table.items()} for name, table in tables_of(run).items()
    }
    data |= arrays_of(run)
    described = {name: columns for name in data if (columns := columns_of(run, name))}
    units, meaning = (
        {name: {key: words[part] for key, words in columns.items()} for name, columns in described.items()}
        for part in range(2)
    )
    values = {name: metric["value"] for name, metric in run.metrics.items()}
    metrics = {name: np.nan if value is None else value for name, value in values.items()}
    struct = {"data": data, "units": units, "meaning": meaning, "metrics": metrics, "run": about(run)}
    named = _named(struct)
    with replacing(path, FILE) as temporary:
        savemat(str(temporary), named, appendmat=False, long_field_names=True, oned_as="column", do_compression=True)


def _column(values: Any) -> np.ndarray:
    """Numbers as they are, words as cells."""
    array: np.ndarray = values.to_numpy()
    return array if array.dtype.kind in "fiub" else np.array(values.fillna("").astype(str), object)


def _named(content: Any) -> Any:
    """Names that MATLAB has: letters, digits and underscores, 63 at most; of two alike the second ends in _2."""
    if not isinstance(content, Mapping):
        return content
    renamed: dict[str, Any] = {}
    for key, value in content.items():
        word = re.sub(r"\W", "_", str(key))
        base = name = (word if word[:1].isalpha() else f"x{word}")[:60]
        number = 1
        while name in renamed:
            name = f"{base}_{(number := number + 1)}"
        renamed[name] = _named(value)
    return renamed


def about(run: Run) -> dict[str, str]:
    """Id, kind, seed, version and hash of a run."""
    manifest = run.manifest
    facts = {"id": run.id, "kind": run.kind, "seed": str(manifest.seed), "version": manifest.code.version}
    return facts | {"result_sha256": run.result_hash, "started": manifest.timing.started}


def _mcap(run: Run, path: Path) -> None:
    try:
        from wristctl.commands.export.mcap_log import write_mcap
    except ImportError:
        raise UserError("MCAP needs the packages mcap and rosbags", "--to mcap", INSTALL) from None
    try:
        motions = motions_of(run)
    except UserError:  # its tables may go on in time all the same
        motions = []
    tables = {name: (table, columns_of(run, name)) for name, table in tables_of(run).items()}
    metrics = {name: json.dumps(metric) for name, metric in run.metrics.items()}
    with replacing(path, FILE) as temporary:
        write_mcap(run, motions, viewed_chain(run), tables, {"run": about(run), "metrics": metrics}, temporary)


# File ending and writer of each format.
FORMATS: dict[str, tuple[str, Callable[[Run, Path], None]]] = {
    "csv": (".csv", _csv),
    "mat": (".mat", _mat),
    "lerobot": ("-lerobot", write_data_set),
    "mcap": (".mcap", _mcap),
}
