"""A run and its repetition: a verdict on each file, and what may have caused a difference."""

from __future__ import annotations

import math
import re
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from wristctl.config.former_names import label_today
from wristctl.errors import UserError
from wristctl.records.difference import Change, difference
from wristctl.records.files import sha256_of
from wristctl.records.formats import read_arrays, read_table
from wristctl.records.lineage import input_run
from wristctl.records.manifest import CONFIG, MANIFEST
from wristctl.records.run import Run
from wristctl.records.seal import CHANGED

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd


# Numbers alike: |now - before| <= ABSOLUTE + RELATIVE |before|; other processors and libraries round differently.
RELATIVE, ABSOLUTE = 1e-6, 1e-9
# Pictures alike: mean difference of their pixels, of 1.
_PIXELS = 0.02
# Names of clip paths and markers in an SVG of matplotlib: hashes of their coordinates' last bits.
_SVG_NAME = re.compile(r"\b[pm][0-9a-f]{10}\b")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class FileComparison(NamedTuple):
    """A verdict, and where the files differ or by how much."""

    verdict: Literal["identical", "within tolerance", "differs"]
    detail: str = ""


def compare_files(before: Path, after: Path) -> FileComparison:
    """Compare two files of the same name by what they hold."""
    try:
        if sha256_of(before) == sha256_of(after):
            return FileComparison("identical")
        match before.suffix:
            case ".csv":
                return _compare_tables(read_table(before), read_table(after))
            case ".npz":
                return _compare_arrays(read_arrays(before), read_arrays(after))
            case ".safetensors":
                from safetensors.numpy import load_file

                return _compare_arrays(load_file(before), load_file(after))
            case ".png":
                from matplotlib.image import imread

                return _compare_pictures(imread(before), imread(after))
            case ".svg":
                return _compare_texts(*(_svg_by_order(each.read_text(encoding="utf-8")) for each in (before, after)))
            case _:
                return _compare_texts(before.read_text(encoding="utf-8"), after.read_text(encoding="utf-8"))
    except Exception as error:  # each format's reader has errors of its own for a file that is damaged
        return FileComparison("differs", f"cannot be compared by content: {error}")


def _compare_tables(a: pd.DataFrame, b: pd.DataFrame) -> FileComparison:
    if a.shape != b.shape:
        return FileComparison("differs", f"{_size(a)} before, {_size(b)} now")
    renamed = [f"column {x} before, {y} now" for x, y in zip(a.columns, b.columns, strict=True) if x != y]
    if renamed:
        return FileComparison("differs", renamed[0])
    columns = {str(name): (a[name].to_numpy(), b[name].to_numpy()) for name in a.columns}
    return _first_difference(columns, a["time"].to_numpy() if "time" in a else None, "column")


def _size(frame: pd.DataFrame) -> str:
    return f"{len(frame)} rows of {len(frame.columns)} columns"


def _compare_arrays(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> FileComparison:
    shapes = [{name: array.shape for name, array in arrays.items()} for arrays in (a, b)]
    if shapes[0] != shapes[1]:
        unlike = sorted(name for name in shapes[0] | shapes[1] if shapes[0].get(name) != shapes[1].get(name))
        return FileComparison(
            "differs", f"array {unlike[0]}: {shapes[0].get(unlike[0])} before, {shapes[1].get(unlike[0])} now"
        )
    return _first_difference({name: (a[name], b[name]) for name in a}, a.get("time"), "array")


def _first_difference(pairs: dict[str, tuple[Any, Any]], time: Any, kind: str) -> FileComparison:
    """The earliest place at which any pair of arrays differs; the first of the pairs where several do."""
    import numpy as np

    places, largest = [], 0.0
    for name, (a, b) in pairs.items():
        if np.issubdtype(a.dtype, np.number) and np.issubdtype(b.dtype, np.number):
            alike = np.isclose(b, a, rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True)
            with np.errstate(invalid="ignore", over="ignore"):  # infinities, which are left out below
                differences = np.abs(a.astype(float) - b.astype(float))
            largest = max(largest, float(np.nanmax(differences[np.isfinite(differences)], initial=0.0)))
        else:
            alike = (a == b) | ((a != a) & (b != b)) | (_names_today(a) == _names_today(b))
        if not np.all(alike):
            index = tuple(int(k) for k in np.argwhere(~np.atleast_1d(alike))[0])
            timed = time is not None and (time.shape == a.shape or time.shape == a.shape[:1])
            instant = float(time[index] if timed and time.shape == a.shape else time[index[0]]) if timed else math.inf
            row = index[0] if len(index) == 1 else list(index)
            places.append((instant, index, f"{kind} {name} from " + (f"time {instant:g} s" if timed else f"row {row}")))
    if not places:
        return FileComparison("within tolerance", f"largest difference {largest:.2g}")
    *_, place = min(places, key=lambda place: place[:2])
    return FileComparison("differs", f"{place}; largest difference {largest:.2g}")


def _names_today(names: np.ndarray) -> np.ndarray:
    """Text with former names of gain presets as they are called today."""
    import numpy as np

    return np.array([label_today(str(name)) for name in names.ravel()], dtype=object).reshape(names.shape)


def _compare_pictures(a: np.ndarray, b: np.ndarray) -> FileComparison:
    import numpy as np

    if a.shape != b.shape:
        return FileComparison("differs", f"{a.shape[1]} x {a.shape[0]} pixels before, {b.shape[1]} x {b.shape[0]} now")
    mean = float(np.abs(a.astype(float) - b.astype(float)).mean())
    return FileComparison(
        "within tolerance" if mean <= _PIXELS else "differs", f"mean difference of pixels {mean:.2g} of 1"
    )


def _svg_by_order(text: str) -> str:
    """An SVG whose hashed names are their numbers, in the order in which they first stand."""
    numbers = dict[str, int]()
    return _SVG_NAME.sub(lambda name: f"name-{numbers.setdefault(name[0], len(numbers))}", text)


def _compare_texts(a: str, b: str) -> FileComparison:
    """Text alike but for numbers within tolerance: JSON, SVG."""
    if _NUMBER.sub("0", a) != _NUMBER.sub("0", b):
        line = next((n for n, (x, y) in enumerate(zip(a.splitlines(), b.splitlines(), strict=False), 1) if x != y), 1)
        return FileComparison("differs", f"from line {line}")
    numbers_a, numbers_b = list(_NUMBER.finditer(a)), list(_NUMBER.finditer(b))
    largest = 0.0
    for x, y in zip(numbers_a, numbers_b, strict=True):
        difference = abs(float(x[0]) - float(y[0]))
        if difference > ABSOLUTE + RELATIVE * abs(float(x[0])):
            return FileComparison("differs", f"line {a.count(chr(10), 0, x.start()) + 1}: {x[0]} before, {y[0]} now")
        largest = max(largest, difference)
    return FileComparison("within tolerance", f"largest difference {largest:.2g}")


class ReplayVerdict(NamedTuple):
    """Verdict on one file of a repetition. Volatile files (wall times) are not compared."""

    path: str
    verdict: Literal["identical", "within tolerance", "differs", "missing", "added", "drawn now", "undrawn", "volatile"]
    detail: str = ""


def verdicts(original: Run, again: Run) -> list[ReplayVerdict]:
    """A verdict on each output of either run."""
    before = {output.path: output for output in original.manifest.outputs}
    after = {output.path: output for output in again.manifest.outputs}
    compared = []
    for path in dict.fromkeys([*before, *after]):
        if (before.get(path) or after[path]).volatile:
            compared.append(ReplayVerdict(path, "volatile", "not compared"))
        elif path not in after:
            lost = _undrawn(again, path)
            compared.append(ReplayVerdict(path, "missing", f"not {lost or 'written'} this time"))
        elif path not in before:
            lost = _undrawn(original, path)
            compared.append(ReplayVerdict(path, "drawn now" if lost else "added", f"not {lost or 'written'} then"))
        else:
            compared.append(ReplayVerdict(path, *compare_files(original.path / path, again.path / path)))
    for name in original.manifest.undrawn.keys() & again.manifest.undrawn.keys():
        compared.append(ReplayVerdict(name, "undrawn", f"neither then nor now: {again.manifest.undrawn[name]}"))
    return compared


def _undrawn(run: Run, path: str) -> str:
    """Why a run has no such picture: `drawn (LinAlgError: Singular matrix)`; empty where nothing failed."""
    reason = run.manifest.undrawn.get(f"figure {PurePosixPath(path).stem}") if path.startswith("figures/") else None
    return f"drawn ({reason})" if reason else ""


def changed_inputs(run: Run) -> list[str]:
    """Faults of the inputs as they are now. Empty where every input is sealed as it was read."""
    faults = []
    for record in run.manifest.inputs:
        try:
            now = input_run(run, record)
            problems = now.problems()
        except UserError as error:
            faults.append(f"input: {record.role}: {error.what} ({error.where})")
            continue
        readable = (MANIFEST, CHANGED) not in problems
        if readable and now.result_hash != record.result_sha256:
            faults.append(f"input: {record.role}: another result than was read ({now.path})")
        faults += [f"input: {record.role}: {problem} ({now.path / path})" for path, problem in problems]
    return faults


def causes(original: Run, again: Run) -> list[str]:
    """Likely causes of a difference between a run and its repetition. Nondeterminism where everything else is equal."""
    changed = difference(original, again)
    likely = [f"input: {change.name}" for change in changed.inputs]
    likely += [f"config: {_change_text(change)}" for change in changed.config]
    if any(path == CONFIG for path, _ in original.problems()):
        likely.append("config: config.yaml was changed after the run")
    likely += _causes_of("code", changed.code)
    likely += _causes_of("environment", changed.environment)
    return likely or ["nondeterminism: configuration, code, inputs and environment are the same"]


def _causes_of(origin: str, changed: list[Change], most: int = 6) -> list[str]:
    """The first of what changed, one line each, and how many more there are."""
    more = [f"{origin}: and {len(changed) - most} more"] if len(changed) > most else []
    return [f"{origin}: {_change_text(change)}" for change in changed[:most]] + more


def _change_text(change: Change) -> str:
    before, after = ("absent" if value is None else value for value in change[1:])
    return f"{change.name}: {before} -> {after}"
