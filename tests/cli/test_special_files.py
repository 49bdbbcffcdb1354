"""Whatever stands in the place of a file, each verb ends soon and names it; other runs are listed as ever."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.records import list_runs, start_run

ROOT = Path(__file__).parents[2]
# Seconds after which a verb that has not ended is interrupted, and waits for what will never come.
PATIENCE = 30.0
SPARSE = 100_000_000_000


def _out_of_the_run(file: Path) -> None:
    """A link to a sound copy elsewhere."""
    elsewhere = file.parents[2] / "elsewhere"
    elsewhere.mkdir(exist_ok=True)
    if file.is_file():
        shutil.copy(file, elsewhere / file.name)
    else:
        (elsewhere / file.name).write_text("{}")
    file.unlink(missing_ok=True)
    file.symlink_to(elsewhere / file.name)


def _linked_pipe(file: Path) -> None:
    pipe = file.parents[2] / "pipe"
    if not pipe.exists():
        os.mkfifo(pipe)
    file.symlink_to(pipe)


def _bound(file: Path) -> None:
    """A socket, bound by its name in the folder: a whole path may be too long for one."""
    here = os.open(".", os.O_RDONLY)
    os.chdir(file.parent)
    try:
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(file.name)
    finally:
        os.fchdir(here)
        os.close(here)


def _sparse(file: Path) -> None:
    with file.open("wb") as stream:
        stream.truncate(SPARSE)


KINDS: dict[str, Callable[[Path], object]] = {
    "a pipe": os.mkfifo,
    "a link to a pipe": _linked_pipe,
    "a link to /dev/zero": lambda file: file.symlink_to("/dev/zero"),
    "a link to /dev/urandom": lambda file: file.symlink_to("/dev/urandom"),
    "a link to /dev/tty": lambda file: file.symlink_to("/dev/tty"),
    "a socket": _bound,
    "a folder": Path.mkdir,
    "a link to nowhere": lambda file: file.symlink_to("nowhere"),
    "a link to itself": lambda file: file.symlink_to(file.name),
    "a link out of the run": _out_of_the_run,
    "100 GB": _sparse,
    "nested JSON": lambda file: file.write_text("[" * 100_000),
    "nothing": Path.touch,
    "unreadable": lambda file: file.touch(0),
}

_OF_ALL = ("run.json", "SHA256SUMS")
_TABLE = "data/trajectory.csv"
_SHOWN = (*_OF_ALL, "metrics.json", "overview.json", "../tags.json")
NAMED: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "ls": (("runs", "ls"), _SHOWN),
    "show": (("runs", "show", "RUN"), _SHOWN),
    "show --json": (("runs", "show", "RUN", "--json"), (*_OF_ALL, "metrics.json", "../tags.json")),
    "diff": (("runs", "diff", "RUN", "OTHER"), (*_OF_ALL, "config.yaml", "metrics.json", "environment.txt")),
    "verify": (("runs", "verify"), (*_OF_ALL, "config.yaml", "README.md", "events.jsonl", "report.html", _TABLE)),
    "replay": (("runs", "replay", "RUN"), (*_OF_ALL, "config.yaml", _TABLE, "metrics.json")),
    "report": (
        ("runs", "report", "RUN", "--to", "page.html"),
        (*_OF_ALL, "config.yaml", "metrics.json", "overview.json", "tables.json", _TABLE),
    ),
    "figures": (("runs", "figures", "RUN"), (*_OF_ALL, "config.yaml", "overview.json")),
    "table": (("runs", "table", "RUN"), (*_OF_ALL, "tables.json")),
    "export": (("runs", "export", "RUN", "--file", "log.csv"), (*_OF_ALL, _TABLE)),
    "lineage": (("runs", "lineage", "RUN"), _OF_ALL),
    "tag": (("runs", "tag", "RUN", "x"), ("../tags.json",)),
    "pack": (("runs", "pack", "RUN", "--file", "run.zip"), (*_OF_ALL, "README.md", _TABLE)),
    "rm": (("runs", "rm", "RUN", "--yes"), ("SHA256SUMS",)),
    "export-model": (("export-model", "RUN", "--to", "mujoco"), (*_OF_ALL, "config.yaml")),
    "simulate": (("simulate", "--config", "results/RUN/config.yaml", "--dry-run"), ("config.yaml",)),
}
"""Words of each verb, and the files that it reads, which it has to name."""
LENIENT = {"overview.json", "../tags.json"}
"""Files that may be links, or damaged within, and cost nothing then."""


@pytest.fixture(scope="module")
def simulated(made: Callable[..., Path]) -> Path:
    """A folder with two small simulations."""
    small = ("--set", "horizon=0.3", "--set", "loop={plant_segments: 1}", "--set", "reference.duration=0.2")
    return made("simulate", *small, "--label", "b", after=made("simulate", *small, "--label", "a"))


@contextmanager
def in_place_of(file: Path, write: Callable[[Path], object]) -> Iterator[None]:
    """Something else in the place of a file within the block."""
    aside = file.parent.parent.parent / "aside"
    there = file.is_file()
    if there:
        shutil.copy(file, aside)
    if write is not _out_of_the_run:
        file.unlink(missing_ok=True)
    try:
        write(file)
        yield
    finally:
        if file.is_dir() and not file.is_symlink():
            file.rmdir()
        file.unlink(missing_ok=True)
        if there:
            aside.rename(file)


def _exempt(kind: str, name: str, verb: str) -> bool:
    """Whether what stands there may be read, or is of no account."""
    if name in LENIENT:
        return kind in ("nothing", "nested JSON", "a link out of the run", "a link to nowhere")
    return verb == "simulate" and kind == "a link out of the run"  # of a file that is named itself


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_whatever_stands_in_the_place_of_a_runs_file_each_verb_ends_and_names_it(
    call: Call, simulated: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    if kind == "unreadable" and os.geteuid() == 0:
        pytest.skip("root may read everything")
    shutil.copytree(simulated / "results", tmp_path / "results")
    run, other = (next(each for each in list_runs(tmp_path / "results") if f"-{label}-" in each.id) for label in "ab")
    call("runs", "tag", run.id, "kept")
    for verb, (words, names) in NAMED.items():
        for name in names:
            if kind in ("nothing", "nested JSON") and (verb, name) not in DAMAGED_TOO:
                continue
            file = tmp_path / "results" / name[3:] if name.startswith("../") else run.path / name
            with in_place_of(file, KINDS[kind]):
                typed = [word.replace("RUN", run.id).replace("OTHER", other.id) for word in words]
                began = time.monotonic()
                signal.setitimer(signal.ITIMER_REAL, PATIENCE)
                code, out, err = call(*typed)
                signal.setitimer(signal.ITIMER_REAL, 0.0)
            place = f"{verb} with {kind} for {name}: {code} {err}"
            assert code != 130 and time.monotonic() - began < 2.0 * PATIENCE, place
            assert "bug in wristctl" not in err, place
            if not _exempt(kind, name, verb):
                assert Path(name).name in out + err + caplog.text, place
                assert code != 0 or verb == "ls" or name in LENIENT, place
            caplog.clear()
            assert verb != "ls" or other.id in out, place
    assert call("runs", "verify", run.id, other.id)[0] == 0, "all is as it was"


DAMAGED_TOO = {
    (verb, name)
    for verb in ("ls", "show", "verify", "report", "lineage", "pack")
    for name in ("run.json", "metrics.json", "tables.json")
    if name in NAMED[verb][1]
}
"""What is named where the content alone is damaged."""
FILES: dict[str, tuple[str, ...]] = {
    "a study": ("simulate", "odd.yaml", "--dry-run"),
    "a configuration": ("compare", "--config", "odd.yaml", "--dry-run"),
    "a log": ("identify", "odd.csv"),
    "a parquet log": ("identify", "odd.parquet"),
    "a recording of another robot": ("identify", "odd.csv", "--columns", "spirob"),
    "a measured loop": ("identify", "odd.csv", "--model", "hysteresis"),
    "measured data": ("gen-data", "--source", "csv", "--set", "files=[odd.csv]"),
    "a reference": ("simulate", "--set", "reference.kind=recording", "--set", "reference.file=odd.csv"),
    "a controller": ("simulate", "--controller", "odd.py:LAW"),
    "an archive": ("runs", "unpack", "odd.zip"),
    "a network": ("simulate", "--network", "odd.safetensors"),
    "a run": ("runs", "show", "odd.json"),
    "a video": ("track", "odd.mp4"),
    "a picture": ("track", "odd.d"),
    "a folder of data": ("validate", "opencr-v4", "--data", "odd"),
    "firmware": ("hw", "flash", "--port", "/dev/null", "--image", "odd.hex"),
    "a rig's study": ("hw", "drawings", "out", "--config", "odd.yaml"),
}
"""Words of commands that are given a file by name."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_whatever_stands_where_a_file_is_named_its_command_ends_and_names_it(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    if kind == "unreadable" and os.geteuid() == 0:
        pytest.skip("root may read everything")
    for what, words in FILES.items():
        folder = tmp_path / what / "within" / "work"
        folder.mkdir(parents=True)
        monkeypatch.chdir(folder)
        name = next(word for word in words if "odd" in word).partition(":")[0].rpartition("[")[2].rstrip("]")
        if name == "odd.d":
            Path(name).mkdir()
        KINDS[kind](folder / (name if name != "odd.d" else "odd.d/odd.png"))
        signal.setitimer(signal.ITIMER_REAL, PATIENCE)
        code, out, err = call(*words)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        place = f"{what} that is {kind}: {code} {err}"
        assert code != 130 and "bug in wristctl" not in err, place
        assert code == 0 or "odd" in out + err or kind in ("a link out of the run", "nothing", "nested JSON"), place
        assert code != 0 or kind in ("a link out of the run", "nothing"), place


@pytest.mark.parametrize("name", ["run.json", "SHA256SUMS"])
def test_a_pipe_in_the_place_of_a_file_keeps_no_process_waiting(tmp_path: Path, name: str) -> None:
    with start_run("tune", Study(), "odd", tmp_path) as live:
        pass
    with start_run("tune", Study(), "sound", tmp_path) as sound:
        pass
    (live.path / name).unlink()
    os.mkfifo(live.path / name)
    command = [sys.executable, "-P", "-m", "wristctl", "runs", "ls", "--out", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=20)
    lines = {line.split()[0]: line for line in done.stdout.splitlines()[2:]}
    assert done.returncode == 0 and " ok " in lines[sound.id]
    assert " broken " in lines[live.id] and f"{name}: cannot be read: a pipe, and no plain file" in lines[live.id]


def test_a_folder_with_a_link_to_itself_is_listed(tmp_path: Path, call: Call) -> None:
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        pass
    (tmp_path / "results" / "loop").symlink_to("loop")
    code, out, _ = call("runs", "ls")
    assert code == 0 and live.id in out


def test_a_signature_that_is_a_link_is_not_packed(tmp_path: Path, call: Call) -> None:
    """An archive would carry away whatever it leads to."""
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        pass
    (tmp_path / "secret").write_text("a secret")
    (live.path / "SHA256SUMS.sig").symlink_to(tmp_path / "secret")
    code, _, err = call("runs", "pack", live.id, "--file", "run.zip")
    assert code == 2 and "SHA256SUMS.sig" in err and not Path("run.zip").exists()


def test_a_lock_that_is_a_link_makes_no_file_elsewhere(tmp_path: Path, call: Call) -> None:
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        pass
    (live.path / ".lock").symlink_to(tmp_path / "elsewhere")
    assert call("runs", "rm", live.id, "--yes")[0] == 0 and not live.path.exists()
    (tmp_path / "results" / ".tags.lock").unlink(missing_ok=True)
    (tmp_path / "results" / ".tags.lock").symlink_to(tmp_path / "elsewhere")
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        pass
    assert call("runs", "tag", live.id, "x")[0] == 2 and not (tmp_path / "elsewhere").exists()
