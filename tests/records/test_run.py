"""A run as it is read again: what is wrong with its files, and what it lacks."""

from __future__ import annotations

import io
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from PIL import Image

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, formats, start_run
from wristctl.records.formats import read_arrays, write_arrays, write_figure, write_table
from wristctl.records.provenance import code_state

Make = Callable[..., Run]


def test_every_file_that_is_not_as_sealed_is_named_in_their_order(make: Make) -> None:
    run = make()
    assert run.problems() == [] and run.sealed
    (run.path / "config.yaml").unlink()
    (run.path / "added.txt").write_text("new")
    (run.path / "data" / "samples.csv").write_text("x\n")
    assert run.problems() == [
        ("added.txt", "file was added after sealing"),
        ("config.yaml", "sealed file is missing"),
        ("data/samples.csv", "hash does not match what was sealed"),
    ]
    with pytest.raises(UserError, match=r"missing - .*config\.yaml - fix: restore it or run `wristctl gen-data` again"):
        run.check()
    (run.path / "SHA256SUMS").unlink()
    assert not run.sealed
    with pytest.raises(UserError, match="run is not sealed"):
        run.problems()


def test_a_run_that_goes_on_has_no_result_yet_and_one_without_metrics_none(results: Path) -> None:
    with start_run("tune", Study(), "", results) as live:
        run = Run(live.path)
        assert (run.state, run.result_hash, run.metrics, run.sealed) == ("running", "", {}, False)
    assert run.state == "ok" and len(run.result_hash) == 64 and run.metrics == {}


def test_a_file_that_a_run_lacks_is_named_with_the_nearest(make: Make) -> None:
    run = make()
    assert run.file("data/samples.csv") == run.path / "data" / "samples.csv"
    with pytest.raises(UserError, match=rf"run {run.id} has no file data/sample\.csv - .* mean 'data/samples\.csv'"):
        run.data("sample")


def test_runs_of_one_second_are_numbered(results: Path) -> None:
    with patch("wristctl.records.start.datetime") as clock:
        clock.now.return_value.strftime.return_value = "20260101T000000Z"
        for _ in range(3):
            with start_run("tune", Study(), "", results):
                pass
    first, second, third = sorted(each.name for each in results.iterdir())
    assert (second, third) == (f"{first}-2", f"{first}-3")


@pytest.mark.painted
def test_a_figure_has_150_dots_per_inch_in_both_formats(tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2.0, 1.0), layout="constrained")
    figure.subplots()
    write_figure(tmp_path / "a", figure)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (300, 150) and "Software" not in picture.info
    assert 'width="144pt"' in (tmp_path / "a.svg").read_text()


@pytest.mark.painted
def test_a_figure_without_room_for_its_names_grows_until_they_fit(tmp_path: Path) -> None:
    """Its layout says nothing of it: a warning would be an error here."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2.0, 1.0), layout="constrained")
    axes = figure.subplots()
    axes.set_xlabel("name\n" * 12)
    write_figure(tmp_path / "a", figure)
    figure.draw_without_rendering()
    label, within = axes.xaxis.label.get_window_extent(), figure.bbox
    assert within.x0 <= label.x0 and within.y0 <= label.y0 and label.y1 < axes.get_window_extent().y0 + 1.0
    assert axes.get_window_extent().height > 0.0


def test_arrays_hold_numbers_and_no_objects(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    with pytest.raises(ValueError, match="Object arrays"):
        write_arrays(file, {"x": np.array([{}], dtype=object)})
    np.savez(file, x=np.array([{}], dtype=object))
    with pytest.raises(UserError, match="Object arrays"):
        read_arrays(file)
    file.write_bytes(b"")
    with pytest.raises(UserError, match="no file of arrays"):
        read_arrays(file)
    np.savez_compressed(file, x=np.zeros(1_000_000))
    with pytest.raises(UserError, match="far larger than the file"):
        read_arrays(file)
    write_arrays(file, {"x": np.arange(2)})
    with zipfile.ZipFile(file) as archive:
        assert [each.date_time for each in archive.infolist()] == [(1980, 1, 1, 0, 0, 0)], "the first date there is"


def test_a_package_that_a_repository_holds_but_does_not_track_has_no_commit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").touch()
    monkeypatch.setattr("wristctl.records.provenance._PACKAGE", package)
    subprocess.run([*git, "init", "-q", "-b", "trunk"], check=True)
    assert code_state()[0].commit is None, "no commit yet"
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "none of it"], check=True)
    code, changes, listing = code_state()
    assert (code.commit, code.branch, code.dirty, changes) == (None, None, None, b"")
    assert listing == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  __init__.py\n"
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "all"], check=True)
    code, changes, _ = code_state()
    assert (code.branch, code.dirty, changes) == ("trunk", False, b"") and len(code.commit or "") == 40


def test_a_table_is_the_same_however_many_lines_are_made_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = {"x": np.array([0.1, np.nan, -1e300, 3.0, 5e-324]), "name": np.array(list("abcde"))}
    written = []
    for lines in (1, 2, 5, 50):
        monkeypatch.setattr(formats, "_LINES", lines)
        write_table(tmp_path / "t.csv", columns)
        written.append((tmp_path / "t.csv").read_text())
    assert written == 4 * ["x,name\n0.1,a\n,b\n-1e+300,c\n3.0,d\n5e-324,e\n"]
    with pytest.raises(ValueError, match="zip"):
        write_table(tmp_path / "t.csv", {"x": np.ones(3), "y": np.ones(60)})


@pytest.mark.parametrize(
    ("name", "shape", "there"),
    [("x.npy", (10**12,), 0), ("x.npy", (2**62, 2**62), 0), ("x.npy", (1000,), 80), ("x.txt", (10,), 80)],
)
def test_a_header_that_promises_more_than_there_is_costs_no_memory(
    tmp_path: Path, name: str, shape: tuple[int, ...], there: int
) -> None:
    header, file = io.BytesIO(), tmp_path / "x.npz"
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(name, header.getvalue() + bytes(there))
    with pytest.raises(UserError, match="no file of arrays"):
        read_arrays(file)
