"""A table of a run that lacks something is named by whoever shows the run, and is no bug of wristctl."""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.plotting.test_spatial_view import course, run_of
from wristctl.commands.export.run_data import export_run
from wristctl.errors import UserError
from wristctl.identification.rig_trend import reading_of
from wristctl.plotting.page import page
from wristctl.plotting.several_page import several_page
from wristctl.records import Run
from wristctl.records.manifest import MANIFEST, SUMS
from wristctl.records.seal import CHANGED, write_seal

KINDS = ("hw-run", "simulate", "compare", "track", "in two planes")
Damage = Callable[[str], str]


def _rows(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


def _text(rows: list[list[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def _without(column: int, text: str) -> str:
    return _text([[*row[:column], *row[column + 1 :]] for row in _rows(text)])


def _of_words(column: int, text: str) -> str:
    head, *rows = _rows(text)
    return _text([head, *([*row[:column], "word", *row[column + 1 :]] for row in rows)])


WHOLE: dict[str, Damage] = {
    "nothing": lambda text: "",
    "its head alone": lambda text: text.partition("\n")[0] + "\n",
    "one row": lambda text: "".join(text.splitlines(keepends=True)[:2]),
    "its last half missing": lambda text: text[: len(text) // 2],
    "no text": lambda text: "\0\1\2",
    "quotes": lambda text: '"' + text,
}


def _damaged(text: str) -> Iterator[tuple[str, str]]:
    """What of the table is damaged, and the table so."""
    yield from ((name, damage(text)) for name, damage in WHOLE.items())
    for column, name in enumerate(_rows(text)[0]):
        yield f"without {name}", _without(column, text)
        yield f"words in {name}", _of_words(column, text)


def _shown(run: Run, folder: Path, every_way: bool) -> Iterator[Callable[[], object]]:
    yield lambda: page(run, run.manifest)
    if run.kind == "hw-run":
        yield lambda: _reading(run)
    if every_way:
        yield lambda: several_page([run, run])
        for to in ("csv", "mat"):
            yield partial(_exported, run, to, folder)


def _exported(run: Run, to: str, folder: Path) -> None:
    with run.reading():
        shutil.rmtree(export_run(run, to, folder / f"out.{to}"), ignore_errors=True)


def _reading(run: Run) -> None:
    with run.reading():
        reading_of(run)


@pytest.fixture
def copied(earlier: Path, tmp_path: Path) -> Callable[[str], Run]:
    """A copy of the sealed run of a kind, or one in two planes."""

    def copy(kind: str) -> Run:
        if kind == "in two planes":
            return run_of(tmp_path / "results", course())
        source = next(path for path in sorted(earlier.iterdir()) if f"Z-{kind}-" in path.name)
        return Run(shutil.copytree(source, tmp_path / "results" / source.name))

    return copy


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_a_damaged_table_is_named_by_whoever_reads_it(copied: Callable[[str], Run], tmp_path: Path, kind: str) -> None:
    run, said = copied(kind), 0
    for table in sorted((run.path / "data").glob("*.csv")):
        sound = table.read_text()
        for what, text in _damaged(sound):
            table.write_text(text)
            for show in _shown(Run(run.path), tmp_path, what in WHOLE):
                (tmp_path / "out.csv").unlink(missing_ok=True)
                (tmp_path / "out.mat").unlink(missing_ok=True)
                try:
                    show()
                except UserError as error:
                    said += 1
                    assert table.name in str(error) or "holds no motion" in error.what, (table.name, what, str(error))
        table.write_text(sound)
    assert said


def _sealed_anew(run: Run, name: str) -> None:
    """As one who means to deceive seals it: the manifest's hash of the file is gone, the sums are new."""
    (run.path / SUMS).unlink()
    manifest = Run(run.path).manifest
    manifest.outputs = [output for output in manifest.outputs if output.path != name]
    (run.path / MANIFEST).write_text(manifest.model_dump_json(by_alias=True))
    write_seal(run.path, {})


@pytest.mark.parametrize("anew", [False, True], ids=["tampered with", "sealed anew"])
def test_a_report_of_trials_without_their_outcome_names_the_table(copied: Callable[[str], Run], anew: bool) -> None:
    run = copied("hw-run")
    table = run.path / "data" / "trials.csv"
    table.write_text(_without(_rows(table.read_text())[0].index("outcome"), table.read_text()))
    if anew:
        _sealed_anew(run, "data/trials.csv")
    run = Run(run.path)
    with pytest.raises(UserError) as caught:
        page(run, run.manifest)
    assert str(table) in caught.value.where and caught.value.exit_code == 3
    assert caught.value.what == CHANGED if not anew else "KeyError: 'outcome'" in caught.value.what


@pytest.mark.parametrize("name", ["trajectories.npz"])
@pytest.mark.slow
def test_damaged_arrays_are_named(copied: Callable[[str], Run], name: str) -> None:
    run = copied("compare")
    file = run.path / "data" / name
    with np.load(file) as arrays:
        sound = dict(arrays)
    for left in sound:
        for damaged in (None, np.zeros(3), np.array(["a"])):
            np.savez(file, **{each: array for each, array in sound.items() if each != left or damaged is not None})
            if damaged is not None:
                np.savez(file, **(sound | {left: damaged}))
            try:
                page(Run(run.path), run.manifest)
            except UserError as error:
                assert name in str(error), (left, damaged, str(error))
