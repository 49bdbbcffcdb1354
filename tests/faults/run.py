"""Kill a command, or let the file system refuse, at each of its operations on files: what is left must be right.

`python -m tests.faults.run [--only COMMAND] [--modes kill,ENOSPC] [--every K]` tries each point once, in a process
forked from a warm one, and prints a line for each command; exit code 1 where anything was wrong. Of many writes to one
file the first, second, middle and last are tried. Built on tests/faults/fault.c, which needs gcc and Linux.
"""

from __future__ import annotations

import argparse
import ctypes
import errno
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from wristctl.records import Run, list_runs
from wristctl.records.leftovers import clear, clear_tags, leftovers, lost_tags
from wristctl.records.tags import known_tags

ROOT = Path(__file__).parents[2]
LIMIT = 120.0
"""Seconds after which a command hangs."""
ERRORS = ("EIO", "ENOSPC", "EDQUOT", "EFBIG", "EROFS", "ENOLCK", "EMFILE")
FAST = ("--set", "loops={fast: {plant_segments: 1}}")
MOVE = "{kind: minimum-jerk, duration: 0.1, angle_deg: 20}"
CLAIM = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
SCENARIO = f"scenarios=[{{loop: fast, reference: {MOVE}}}]"
COMMANDS: dict[str, tuple[str, ...]] = {
    "gen-data": ("gen-data", "--samples", "50"),
    "train": ("train", "--data", "DATA", "--epochs", "2", "--set", "hidden=[4]"),
    "tune": ("tune", *FAST, "--candidates", "4", "--iterations", "2", "--set", SCENARIO),
    "compare": (
        "compare", *FAST, "--horizon", "0.1", "--set", "inverses=[none]", "--set", f"references=[{MOVE}]",
        "--set", "rows=[{controller: smc, gains: initial}]",
    ),
    "simulate": ("simulate", "--set", "horizon=0.1"),
    "audit": ("audit", "--set", f"claims=[{CLAIM}]", "--set", "horizon=0.1"),
    "tag": ("runs", "tag", "DATA", "new"),
    "rm": ("runs", "rm", "DATA", "--yes"),
    "gc": ("runs", "gc", "--yes"),
    "ls": ("runs", "ls"),
    "verify": ("runs", "verify"),
    "report": ("runs", "report", "DATA", "--to", "results/page.html"),
}  # fmt: skip
VERBS = ("tag", "rm", "gc", "ls", "verify", "report")


@dataclass
class Found:
    """What came of a command's points."""

    tried: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def library() -> Path:
    """The compiled fault.c."""
    built = Path(tempfile.mkdtemp(prefix="wristctl-faults-")) / "fault.so"
    source = Path(__file__).with_name("fault.c")
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", str(built), str(source), "-ldl"], check=True)
    return built


def main() -> None:
    """Start again with the library before all others, and try every point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(COMMANDS), help="commands, by commas")
    parser.add_argument("--modes", default=",".join(("kill", *ERRORS)), help="kill, or names of errno")
    parser.add_argument("--every", type=int, default=1, help="each K-th point")
    given = parser.parse_args()
    if "WRISTCTL_FAULTS" not in os.environ:
        built = str(library())
        environment = {**os.environ, "LD_PRELOAD": built, "WRISTCTL_FAULTS": built, "PYTHONPATH": str(ROOT)}
        code = subprocess.run([sys.executable, "-m", "tests.faults.run", *sys.argv[1:]], env=environment).returncode
        shutil.rmtree(Path(built).parent)
        sys.exit(code)
    faults = ctypes.CDLL(os.environ["WRISTCTL_FAULTS"])
    _warm()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="wristctl-faults-") as scratch:
        base = Path(scratch) / "base"
        base.mkdir()
        _call(base, (*COMMANDS["gen-data"], "--label", "base"))  # else a run of the same second needs another name
        for name in given.only.split(","):
            for mode in given.modes.split(","):
                began = time.monotonic()
                found = points(faults, Path(scratch), base, name, mode, given.every)
                wrong += len(found.wrong)
                seen = ", ".join(f"{count} {outcome}" for outcome, count in found.outcomes.most_common())
                print(f"{name:9} {mode:7} {found.tried:4} points {time.monotonic() - began:5.0f} s  {seen}", flush=True)
                for each in found.wrong:
                    print(f"    WRONG {each}")
    print(f"{wrong} wrong")
    sys.exit(bool(wrong))


def points(faults: ctypes.CDLL, scratch: Path, base: Path, name: str, mode: str, every: int) -> Found:
    """Try a command's points in one mode."""
    log, work = scratch / "log", scratch / "work"
    log.unlink(missing_ok=True)
    code, _ = _once(faults, base, work, name, (0, 0, str(log)))
    operations = [line.split("\t") for line in log.read_text().splitlines()]
    before = {each.id for each in _runs(base)}
    sound = {each.kind: each.result_hash for each in _runs(work) if each.state == "ok"}
    found = Found()
    if code != 0:
        found.wrong.append(f"undisturbed: exit {code}")
    number = 0 if mode == "kill" else getattr(errno, mode)
    for at in list(_chosen(operations))[::every]:
        what = f"{at}: {operations[at - 1][0]} {Path(operations[at - 1][1]).relative_to(work)}"
        code, said = _once(faults, base, work, name, (at, number, ""))
        found.tried += 1
        states = [each.state for each in _runs(work)]
        found.outcomes[f"exit {code} {' '.join(sorted(states))}"] += 1
        found.wrong += [f"{what}: {each}" for each in _faulty(work, before, (name, mode), (code, said), sound)]
    return found


def _chosen(operations: list[list[str]]) -> Iterator[int]:
    """Numbers of the operations, from 1; of writes to one file the first, second, middle and last."""
    writes = defaultdict(list)
    for at, (kind, path, _) in enumerate(operations, start=1):
        if kind == "write":
            writes[path].append(at)
    kept = {at for each in writes.values() for at in (*each[:2], each[len(each) // 2], each[-1])}
    yield from (at for at, (kind, *_) in enumerate(operations, start=1) if kind != "write" or at in kept)


def _once(faults: ctypes.CDLL, base: Path, work: Path, name: str, fault: tuple[int, int, str]) -> tuple[int | str, str]:
    """Exit code (or the signal's name) of one try in a fresh folder, and what it said on stderr."""
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(base, work)
    tags = {each.id: ["paper"] for each in _runs(work)} | {"20200101T000000Z-tune-1": ["another"]}
    (work / "results" / "tags.json").write_text(json.dumps(tags))
    if name == "gc":
        for each in (".20200101T000000Z-tune-1.removed/x", "20200101T000000Z-tune-2/config.yaml", ".index-1"):
            (work / "results" / each).parent.mkdir(exist_ok=True)
            (work / "results" / each).write_text("left")
    child = os.fork()
    if child == 0:
        at, number, log = fault
        faults.arm(str(work / "results").encode(), ctypes.c_long(at), number, 0, log.encode())
        _call(work, COMMANDS[name])
    until = time.monotonic() + LIMIT
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > until:
            os.kill(child, 9)
            os.waitpid(child, 0)
            return "hangs", ""
        time.sleep(0.005)
    status = ended[1]
    code: int | str = "killed" if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)
    return code, (work / "err").read_text(errors="replace")


def _call(work: Path, arguments: tuple[str, ...]) -> None:
    """The command in `work`; in a child it does not come back, in the first process it makes what others read."""
    child = os.getpid() != _FIRST
    here, streams = os.getcwd(), (os.dup(1), os.dup(2))
    os.chdir(work)
    for number, file in ((1, "out"), (2, "err")):
        os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    data = [each.id for each in _runs(work) if "-gen-data-" in each.id]
    sys.argv = ["wristctl", *(data[0] if each == "DATA" else each for each in arguments)]
    code = 99
    try:
        importlib.import_module("wristctl.cli.app").main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        if child:
            os._exit(code)
    os.chdir(here)
    for number, stream in zip((1, 2), streams, strict=True):
        os.dup2(stream, number)


def _faulty(
    work: Path, before: set[str], given: tuple[str, str], ended: tuple[int | str, str], sound: dict[str, str]
) -> Iterator[str]:
    """What is wrong with what was left; `before` are the runs that were there, `sound` the results there should be."""
    (name, mode), (code, said) = given, ended
    results = work / "results"
    if "bug in wristctl" in said or "Traceback" in said:
        yield f"a bug: {said[-300:]}"
    if mode == "kill" and code != "killed":
        yield f"was not killed: {code}"
    if mode != "kill" and code not in (0, 2):
        yield f"exit {code}: {said[-300:]}"
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    if code == 2 and len(errors) != 1:
        yield f"{len(errors)} errors told"
    for run in _runs(work):
        state = run.state
        if state == "ok" and (run.problems() or run.result_hash != sound.get(run.kind, run.result_hash)):
            yield f"{run.id} is ok, and {run.problems() or 'has another result'}"
        if state == "ok" and run.id not in before and code not in (0, "killed"):
            yield f"{run.id} is ok, and the exit code {code}"
        if state == "failed" and run.problems():
            yield f"{run.id} has failed, and {run.problems()}"
        if state == "running" or (mode == "kill" and state in ("failed", "interrupted")):
            yield f"{run.id} is {state}"
        if state in ("crashed", "broken") and mode != "kill" and code == 0:
            yield f"{run.id} is {state}, and the exit code 0"
    if name != "gc" and "20200101T000000Z-tune-1" not in known_tags(results):
        yield "another run's tags are gone"
    for each in list(leftovers(results)):
        clear(each)
    clear_tags(results, lost_tags(results))
    if known_tags(results).keys() - {each.id for each in _runs(work)}:
        yield "tags of lost runs after gc"
    hidden = [each.name for each in results.rglob(".*") if each.name not in (".index.json", ".tags.lock")]
    if hidden:
        yield f"left after gc: {hidden}"
    if broken := [run.id for run in _runs(work) if run.state == "broken"]:
        yield f"broken after gc: {broken}"
    outside = {each.name for each in work.iterdir()} - {"results", "out", "err"}
    if outside:
        yield f"outside results: {outside}"


def _runs(work: Path) -> list[Run]:
    return [each for each in list_runs(work / "results") if re.match(r"\d{8}T", each.id)]


def _warm() -> None:
    """Import what the commands import, so that a forked process begins at once."""
    from wristctl.cli.app import COMMANDS as ALL

    for module, *_ in ALL.values():
        importlib.import_module(module)
    for module in (
        "matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "jinja2", "pandas", "scipy.optimize",
        "wristctl.report.page", "wristctl.report.comparison_page", "wristctl.studies.compare", "wristctl.studies.tune",
        "wristctl.studies.simulate", "wristctl.studies.audit", "wristctl.studies.gen_data", "wristctl.studies.train",
    ):  # fmt: skip
        importlib.import_module(module)


_FIRST = os.getpid()

if __name__ == "__main__":
    main()
