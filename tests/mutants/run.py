"""Are small wrong changes noticed? `make mutants`, or `python -m tests.mutants.run [--seed K] [--count N]`.

One change at a time is made to a copy of the package, and the tests run that should notice it, the nearest first,
until one fails: of drawn ones those that run the line (reach.py), before whole rooms. A test that fails without the
change too has noticed nothing. Without a seed the changes are those of known.yaml, with one they are drawn. The table
says which test noticed each; exit code 1 if fewer than 90 % of the drawn ones, or not all of the known ones, were
noticed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import yaml

from tests.mutants.draw import COUNT, drawn, entry
from tests.mutants.reach import Reach, measured

ROOT = Path(__file__).parents[2]
KNOWN = Path(__file__).with_name("known.yaml")
LEAST = 0.9
"""Share of drawn changes that must be noticed."""
LIMIT = 300
"""Seconds after which one test is taken to hang: that is noticed too."""
MOST_BESIDE = 100
"""Tests of a file that are tried where none is known to run the line, as where it is compiled or a constant."""
_HANGS, _BEGINS_NOTHING, _LEFT_OUT = " hangs", ": exit ", "--deselect={}"
_NONE_CHOSEN = 5
"""pytest's exit code where a folder has no quick test, or no slow one."""

NEIGHBOURS = {
    "arrays": ["tests/wrist"],
    "bench": ["tests/bench", "tests/trial", "tests/cli/test_hw_run.py"],
    "board": ["tests/board", "tests/bench", "tests/firmware"],
    "cli": ["tests/cli"],
    "comparison": ["tests/comparison", "tests/cli/test_audit.py", "tests/cli/test_loop_commands.py"],
    "config": [
        "tests/config",
        "tests/cli/test_help.py",
        "tests/cli/test_wrapper.py",
        "tests/simulation/test_reference.py",
        "tests/cli/test_loop_commands.py",
    ],
    "control": ["tests/control", "tests/simulation", "tests/lanes"],
    "identification": ["tests/identification", "tests/cli/test_identify_command.py"],
    "lanes": ["tests/lanes", "tests/wrist", "tests/simulation/test_rollout.py"],
    "learning": ["tests/learning", "tests/cli/test_learning_commands.py"],
    "records": [
        "tests/records",
        "tests/cli/test_runs_commands.py",
        "tests/cli/test_replay.py",
        "tests/cli/test_wrapper.py",
    ],
    "plotting": ["tests/plotting", "tests/cli/test_loop_commands.py"],
    "plugins": ["tests/doors"],
    "simulation": ["tests/simulation", "tests/newcomers/test_plants.py", "tests/comparison", "tests/tuning"],
    "stability": ["tests/stability", "tests/commands/test_analyse.py"],
    "commands": ["tests/commands", "tests/plotting", "tests/cli"],
    "study_files": ["tests/study_files", "tests/config", "tests/cli/test_wrapper.py"],
    "trial": [
        "tests/trial",
        "tests/cli/test_hw_run.py",
        "tests/cli/test_hw_run_stops.py",
        "tests/cli/test_hw_check_rig.py",
        "tests/cli/test_hw_check_two_planes.py",
    ],
    "tuning": ["tests/tuning", "tests/cli/test_loop_commands.py"],
    "vision": ["tests/vision", "tests/cli/test_vision_commands.py", "tests/bench/test_camera.py"],
    "wrist": ["tests/wrist", "tests/newcomers/test_plants.py", "tests/simulation", "tests/identification/test_fit.py"],
}
"""Where the tests of a package are, after those of the file's own name."""


@dataclass(frozen=True)
class Mutant:
    """A change by its texts: `old` stands once in the file from line `near` on, if that is given."""

    name: str
    file: str
    old: str
    new: str
    near: int = 1
    tests: tuple[str, ...] = ()
    equivalent: str = ""
    """Why it changes nothing that anybody could notice; empty where it does."""


@dataclass(frozen=True)
class Result:
    """What noticed a mutant (None: nothing did), and how long that took."""

    mutant: Mutant
    noticed: str | None
    seconds: float


def known() -> list[Mutant]:
    """The committed list."""
    listed = yaml.safe_load(KNOWN.read_text(encoding="utf-8"))
    return [Mutant(**{**each, "tests": tuple(each.get("tests", ()))}) for each in listed]


def from_seed(seed: int, count: int) -> list[Mutant]:
    """Drawn ones; those that the committed list has as equivalent with its reason."""
    listed = (entry(each, f"{seed}-{number:02}") for number, each in enumerate(drawn(seed, count), start=1))
    reasons = {(each.file, changed(each)): each.equivalent for each in known() if each.equivalent}
    mutants = (Mutant(**each) for each in listed)
    return [replace(each, equivalent=reasons.get((each.file, changed(each)), "")) for each in mutants]


def stages(mutant: Mutant, reach: Reach | None = None) -> list[list[str]]:
    """What pytest is given, in turn: tests that run the line (or else its file), the file's own, the room's.

    Quick ones come before slow ones. Where tests are named, those alone. Quick tests that do not run a line of Python
    cannot notice that it is changed.
    """
    if mutant.tests:
        return [list(mutant.tests)]
    parts = Path(mutant.file).with_suffix("").parts
    neighbours = NEIGHBOURS.get(parts[0], [f"tests/{parts[0]}", "tests/test_python_face.py"])
    rooms = [each for each in neighbours if (ROOT / each).exists()]
    paths = (each.relative_to(ROOT) for each in (ROOT / "tests").rglob(f"test_{parts[-1]}*.py"))
    named = sorted(str(each) for each in paths if each.parts[1] in (parts[0], *parts[1:-1]))
    running = reach.tests(mutant.file, line(mutant)) if reach else []
    beside = reach.tests_of_file(mutant.file)[:MOST_BESIDE] if reach and not running else []
    quick, slow = ("-m", "not slow"), ("-m", "slow")
    stages = [running] if running else [[*quick, *named]] * bool(named) + [beside] * bool(beside)
    stages += [[*slow, *named]] * bool(named)
    stages += [] if running else [[*quick, room] for room in rooms]
    return stages + [[*slow, room] for room in rooms]


def line(mutant: Mutant) -> int:
    """Number of the first line that it changes."""
    source = _source(mutant)
    return source.count("\n", 0, _place(mutant, source)) + 1


def changed(mutant: Mutant) -> str:
    """Its file with the change. ValueError where the old text is not there."""
    source = _source(mutant)
    place = _place(mutant, source)
    return source[:place] + mutant.new + source[place + len(mutant.old) :]


def _source(mutant: Mutant) -> str:
    return (ROOT / "wristctl" / mutant.file).read_text(encoding="utf-8")


def _place(mutant: Mutant, source: str) -> int:
    before = sum(map(len, source.splitlines(keepends=True)[: mutant.near - 1]))
    place = source.find(mutant.old, before)
    if place < 0:
        raise ValueError(f"{mutant.name}: {mutant.file} has no {mutant.old!r} from line {mutant.near} on")
    return place


def copied(folder: Path) -> Path:
    """The project in another folder, which it makes."""
    folder.mkdir(parents=True)
    for name in ("wristctl", "tests", "experiments", "docs", "benchmarks"):
        ignored = shutil.ignore_patterns("__pycache__", "results", "*.avi")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for each in (each for each in ROOT.iterdir() if each.is_file() and each.name != ".git"):  # a worktree's
        shutil.copy(each, folder)
    if (ROOT / "build").is_dir():
        os.symlink(ROOT / "build", folder / "build")
    return folder


def try_out(mutant: Mutant, sound: Path, reach: Reach | None = None) -> Result:
    """Run its tests until one fails that passes on the `sound` copy of the project."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="wristctl-mutant-") as scratch:
        folder = copied(Path(scratch) / "project")
        (folder / "wristctl" / mutant.file).write_text(changed(mutant), encoding="utf-8")
        noticed, failing = None, list[str]()
        for stage in stages(mutant, reach):
            while noticed := _failing(folder, chosen := [*stage, *map(_LEFT_OUT.format, failing)], Path(scratch)):
                test = noticed.removesuffix(_HANGS)
                if not _failing(sound, chosen if _BEGINS_NOTHING in noticed else [test], Path(scratch)):
                    return Result(mutant, noticed, time.monotonic() - began)
                if _BEGINS_NOTHING in noticed:
                    break  # without the change too
                failing.append(test)
    return Result(mutant, None, time.monotonic() - began)


def _failing(folder: Path, tests: list[str], scratch: Path) -> str | None:
    """Name of the first test that fails in a copy of the project; None if none does."""
    hangs = ("-o", f"faulthandler_timeout={LIMIT}", "-o", "faulthandler_exit_on_timeout=true")
    own = ("-x", "-q", "-p", "no:cacheprovider", "--basetemp", str(scratch / "tmp"))
    command = [sys.executable, "-m", "pytest", *own, *hangs, *tests]
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode in (0, _NONE_CHOSEN):
        return None
    found = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    stopped = re.findall(r"File \"[^\"]*/(tests/[^\"]+)\", line \d+ in (test_\w+)", done.stderr)
    hanging = [f"{file}::{name}{_HANGS}" for file, name in stopped[:1]]
    return (found or hanging or [f"{tests[-1]}{_BEGINS_NOTHING}{done.returncode}"])[0]


def main() -> None:
    """Try all, print the table, and end with the verdict."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, help="draw changes from this seed, in place of the known ones")
    parser.add_argument("--count", type=int, default=COUNT, help="how many to draw")
    parser.add_argument("--only", default="", help="those whose name or file contains this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    mutants = known() if given.seed is None else from_seed(given.seed, given.count)
    mutants = [each for each in mutants if given.only in each.name or given.only in each.file]
    alive = [each for each in mutants if not each.equivalent]
    survivors, began = [], time.monotonic()
    reach = measured() if given.seed is not None else None
    with tempfile.TemporaryDirectory(prefix="wristctl-sound-") as folder, ThreadPoolExecutor(given.jobs) as pool:
        for result in pool.map(partial(try_out, sound=copied(Path(folder) / "project"), reach=reach), alive):
            told = result.noticed or "NOTHING NOTICED"
            print(f"{result.mutant.name:28} {result.mutant.file:40} {result.seconds:4.0f} s  {told}", flush=True)
            if result.noticed is None:
                survivors.append(result.mutant)
    for each in (each for each in mutants if each.equivalent):
        print(f"{each.name:28} {each.file:40}         equivalent: {each.equivalent}")
    for each in survivors:
        print(f"\nsurvived: {each.name}, {each.file}\n- {each.old.strip()}\n+ {each.new.strip()}")
    noticed, count = len(alive) - len(survivors), max(1, len(alive))
    share, seconds = noticed / count, time.monotonic() - began
    print(f"\n{noticed} of {count} noticed ({100.0 * share:.0f} %), {seconds:.0f} s")
    if share < (1.0 if given.seed is None else LEAST):
        sys.exit(1)


if __name__ == "__main__":
    main()
