"""A run's data in formats of other programs: open logs, MATLAB's, LeRobot's, and MCAP, which robot log viewers open."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wristctl.commands.export.lerobot_data_set import write_data_set
from wristctl.commands.export.model import viewed_chain
from wristctl.commands.export.open_log_of_run import write_open_log
from wristctl.commands.export.recorded_motions import motions_of
from wristctl.errors import FILE, UserError
from wristctl.records import Run
from wristctl.records.files import replacing
from wristctl.records.formats import read_arrays, read_table

if TYPE_CHECKING:
    import pandas as pd

INSTALL = "pip install 'wristctl[logs]'"


def tables_of(run: Run) -> dict[str, pd.DataFrame]:
    """Every table of a run by its name: data/log.csv is log."""
    return {file.stem: read_table(run.file(f"data/{file.name}")) for file in sorted((run.path / "data").glob("*.csv"))}


def arrays_of(run: Run) -> dict[str, dict[str, np.ndarray]]:
    """Every set of arrays of a run by its name."""
    return {file.stem: read_arrays(run.file(f"data/{file.name}")) for file in sorted((run.path / "data").glob("*.npz"))}


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


def _mat(run: Run, path: Path) -> None:
    """A struct for each table and each set of arrays, `units` and `meaning` of the columns, `metrics`, `run`."""
    from scipy.io import savemat

    data = {
        name: {str(key): _column(column) for key, column in table.items()} for name, table in tables_of(run).items()
    }
    data |= arrays_of(run)
    columns = {name: columns_of(run, name) for name in data}
    struct = {
        "data": data,
        "units": {
            name: {key: unit for key, (unit, _) in table_columns.items()}
            for name, table_columns in columns.items()
            if table_columns
        },
        "meaning": {
            name: {key: meaning for key, (_, meaning) in table_columns.items()}
            for name, table_columns in columns.items()
            if table_columns
        },
        "metrics": {name: _number(metric["value"]) for name, metric in run.metrics.items()},
        "run": about(run),
    }
    with replacing(path, FILE) as temporary:
        savemat(
            str(temporary),
            _named(struct),
            appendmat=False,
            long_field_names=True,
            oned_as="column",
            do_compression=True,
        )


def _column(values: Any) -> np.ndarray:
    """Numbers as they are, words as cells."""
    array: np.ndarray = values.to_numpy()
    return array if array.dtype.kind in "fiub" else np.array(values.fillna("").astype(str), object)


def _number(value: float | None) -> float:
    return np.nan if value is None else value


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
    "csv": (".csv", write_open_log),
    "mat": (".mat", _mat),
    "lerobot": ("-lerobot", write_data_set),
    "mcap": (".mcap", _mcap),
}
