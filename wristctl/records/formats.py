"""Tables, arrays and figures as files whose bytes depend on their content alone."""

from __future__ import annotations

import csv
import io
import math
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl.errors import OUT, Phrase, UserError
from wristctl.plain_files import LARGEST_DATA, open_plain
from wristctl.records.files import replacing, write_bytes

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from matplotlib.figure import Figure

    Columns = pd.DataFrame | Mapping[str, np.ndarray]


# Table lines written at a time. Python's numbers take ten times the memory of an array.
_LINES = 50_000
# Largest ratio of unpacked to packed size. Runs store their arrays uncompressed.
_LARGEST_SHARE = 100


def write_table(path: Path, columns: Columns, by: Phrase = OUT) -> None:
    """Columns as CSV under their names; floats are written so that they read back exactly, nan as nothing.

    `by` is the argument that names another place, where this one cannot be written.
    """
    import numpy as np

    arrays = [np.asarray(column) for _, column in columns.items()]
    with replacing(path, by) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns.keys())
        for begin in range(0, max(map(len, arrays), default=0), _LINES):
            parts = (array[begin : begin + _LINES].tolist() for array in arrays)
            cells = ([None if cell != cell else cell for cell in part] for part in parts)
            writer.writerows(zip(*cells, strict=True))


def read_table(path: Path) -> pd.DataFrame:
    """A CSV file with floats exactly as they were written."""
    import pandas as pd

    with open_plain(path, LARGEST_DATA) as file:
        return pd.read_csv(file)


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Arrays as npz, uncompressed and with fixed dates."""
    import numpy as np

    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an npz file by name; UserError where it holds anything else, or far more than its size."""
    import numpy as np

    try:
        with open_plain(path, LARGEST_DATA) as file, zipfile.ZipFile(file) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST_SHARE * path.stat().st_size:
                raise ValueError("what it holds is far larger than the file")
            for entry in archive.infolist():
                _check_header(archive, entry)
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                return {name: arrays[name] for name in arrays.files}
    except (ValueError, EOFError, KeyError, zipfile.BadZipFile, NotImplementedError, SyntaxError) as error:
        raise UserError(f"no file of arrays: {error}", str(path), "bring back the file that was sealed") from error


def _check_header(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> None:
    """ValueError where an entry is no array, or its header promises more than there is: room is made for that first."""
    import numpy as np

    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(file)
    if not entry.filename.endswith(".npy") or math.prod(shape) * dtype.itemsize > entry.file_size:
        raise ValueError(f"{entry.filename} is no array, or less than its header says")


# Settings of matplotlib that are no look: a change of them is refused, or acts on more than figures.
_NO_LOOK = ("backend", "backend_fallback", "interactive")


@contextmanager
def own_look(**values: Any) -> Iterator[None]:
    """Within the block figures have matplotlib's defaults, whatever a user's matplotlibrc says, and these values.

    A value's name has two underscores for a dot.
    """
    import matplotlib as mpl

    look: Any = {name: value for name, value in mpl.rcParamsDefault.items() if name not in _NO_LOOK}
    with mpl.rc_context(look | {name.replace("__", "."): value for name, value in values.items()}):
        yield


# Layouts that are tried, each of a quarter more: sixfold in all.
_GROWTHS = 8


def lay_out(figure: Figure, dpi: float) -> None:
    """Lay a figure out for good; one whose names leave its axes no room grows until there is some."""
    if not (layout := figure.get_layout_engine()):
        return
    figure.set_dpi(dpi)
    for _ in range(_GROWTHS):
        with warnings.catch_warnings():
            warnings.filterwarnings("error", "constrained_layout not applied", UserWarning)
            try:
                layout.execute(figure)
                break
            except UserWarning:
                pass
        figure.set_size_inches(1.25 * figure.get_figwidth(), 1.25 * figure.get_figheight())
    figure.set_layout_engine(None)


def write_figure_for_paper(file: Path, figure: Figure, dpi: int = 300, by: Phrase = OUT) -> None:
    """A figure made without pyplot in the format that the file's name ends with, as large as it was laid out.

    `by` is the argument that names another place, where this one cannot be written. UserError for a format that is none
    of PDF, SVG and PNG.
    """
    metadata: dict[str, dict[str, Any]] = {
        ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
        ".svg": {"Date": None, "Creator": None},
        ".png": {"Software": None},
    }
    if file.suffix not in metadata:
        raise UserError("no format of a picture", str(file), f"let its name end with {', '.join(metadata)}")
    with own_look(svg__hashsalt=file.stem, agg__path__chunksize=500, pdf__fonttype=42), replacing(file, by) as part:
        lay_out(figure, dpi)
        figure.savefig(part, format=file.suffix[1:], dpi=dpi, metadata=metadata[file.suffix])


def pictures(figure: Figure, name: str, dpi: int = 150) -> dict[str, bytes]:
    """A figure made without pyplot as PNG and SVG, by suffix, without date or program version.

    `name` tells its parts from those of others on a page. Its layout stays as it is then.
    """
    options: dict[str, dict[str, Any]] = {
        "png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 1}},  # 30 % larger, 10 ms sooner
        "svg": {"metadata": {"Date": None, "Creator": None}},
    }
    painted = dict[str, bytes]()
    # in one piece, a line that chatters takes seconds to draw
    with own_look(svg__hashsalt=name, agg__path__chunksize=500):
        lay_out(figure, dpi)  # once: savefig would lay out, and draw in vain, for each format
        for suffix, keywords in options.items():
            content = io.BytesIO()
            figure.savefig(content, format=suffix, dpi=dpi, **keywords)
            painted[f".{suffix}"] = content.getvalue()
    return painted


def write_figure(stem: Path, figure: Figure) -> None:
    """A figure made without pyplot beside its stem, as PNG and SVG."""
    for suffix, content in pictures(figure, stem.name).items():
        write_bytes(stem.with_name(f"{stem.name}{suffix}"), content)
