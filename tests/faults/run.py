"""Kill a command, or let the file system refuse, at each of its operations on files: what is left must be right.

`python -m tests.faults.run [--only COMMAND] [--modes kill,ENOSPC] [--every K] [--jobs 2]` tries each point once, in a
process forked from a warm one, and prints a line for each command; exit code 1 where anything was wrong. Of many writes
to one file the first, second, middle and last are tried; in the mode `turns` each point is refused with another errno.
Figures stay blank: they are files here, not pictures. Built on tests/faults/fault.c, which needs gcc and Linux.
"""

from __future__ import annotations

import argparse
import ctypes
import errno
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from tests.faults import commands
from tests.faults.judge import HANGS, KILLED, Sound, faults, lost_by_power_cut, timeless

ROOT = Path(__file__).parents[2]
LIMIT = 120.0
"""Seconds after which a command hangs."""
ERRORS = ("EIO", "ENOSPC", "EDQUOT", "EFBIG", "EROFS", "ENOLCK", "EMFILE")
LONG = ("audit", "identify", "hw-run")
"""Commands of seconds and hundreds of points."""


class Fault(NamedTuple):
    """The operation number `at` of a command fails with `number`, or kills where that is 0; `log` lists operations."""

    at: int
    number: int
    log: str = ""


class Tries(NamedTuple):
    """Points of one command in one mode, tried by one worker in a scratch folder of its own."""

    name: str
    mode: str
    operations: dict[int, str]
    sound: Sound


def library() -> Path:
    """The compiled fault.c."""
    built = Path(tempfile.mkdtemp(prefix="wristctl-faults-")) / "fault.so"
    source = Path(__file__).with_name("fault.c")
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", str(built), str(source), "-ldl"], check=True)
    return built


def main() -> None:
    """Start again with the library before all others, and try every point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(commands.COMMANDS), help="commands, by commas")
    parser.add_argument("--modes", help="kill, turns, or names of errno; all, but of long commands kill and turns")
    parser.add_argument("--every", type=int, default=1, help="each K-th point")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    given = parser.parse_args()
    if "WRISTCTL_FAULTS" not in os.environ:
        built = str(library())
        environment = {**os.environ, "LD_PRELOAD": built, "WRISTCTL_FAULTS": built, "PYTHONPATH": str(ROOT)}
        code = subprocess.run([sys.executable, "-m", "tests.faults.run", *sys.argv[1:]], env=environment).returncode
        shutil.rmtree(Path(built).parent)
        sys.exit(code)
    Figure.draw = lambda self, renderer: None  # type: ignore[method-assign]
    Figure.get_layout_engine = lambda self: None  # type: ignore[method-assign]
    commands.warm()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="wristctl-faults-") as scratch:
        base = Path(scratch) / "base"
        base.mkdir()
        names = given.only.split(",")
        commands.prepare(base, {word for name in names for word in commands.COMMANDS[name]})
        for name in names:
            modes = given.modes.split(",") if given.modes else ["kill", *(["turns"] if name in LONG else ERRORS)]
            wrong += command(base, name, modes, given.every, given.jobs)
    print(f"{wrong} wrong")
    sys.exit(bool(wrong))


def command(base: Path, name: str, modes: list[str], every: int, jobs: int) -> int:
    """How much is wrong with one command, a line printed for each mode."""
    log, work = base.parent / "log", base.parent / "work"
    log.unlink(missing_ok=True)
    _place(base, work, name)
    commands.run(work, commands.COMMANDS[name])  # compiled here, and not in each process forked from this one
    code, said = _once(base, work, name, Fault(0, 0, str(log)))
    operations = [line.split("\t") for line in log.read_text().splitlines()]
    before = {each.id for each in commands.runs(base)}
    sound = Sound(frozenset(before), {timeless(each.id): each.result_hash for each in commands.runs(work)})
    chosen = {
        at: f"{at}: {operations[at - 1][0]} {Path(operations[at - 1][1]).relative_to(work)}"
        for at in list(_chosen(operations))[::every]
    }
    wrong = [] if code == 0 else [f"undisturbed: exit {code}: {said[-300:]}"]
    wrong += [f"after a power cut: {each}" for each in lost_by_power_cut(work, operations)]
    print(f"{name}: {len(operations)} operations, {len(chosen)} points", *wrong, flush=True)
    for mode in modes:
        began = time.monotonic()
        shares = [dict(list(chosen.items())[share::jobs]) for share in range(jobs)]
        tries = [Tries(name, mode, share, sound) for share in shares]
        with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("fork")) as workers:
            done = list(workers.map(_points, [base] * jobs, tries))
        outcomes = sum((each for each, _ in done), Counter[str]())
        found = [each for _, wrongs in done for each in wrongs]
        seen = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
        print(f"  {mode:7} {time.monotonic() - began:5.0f} s  {seen}", flush=True)
        for each in found:
            print(f"    WRONG {each}", flush=True)
        wrong += found
    return len(wrong)


def _chosen(operations: list[list[str]]) -> Iterator[int]:
    """Numbers of the operations, from 1; of writes to one file the first, second, middle and last."""
    writes = defaultdict(list)
    for at, (kind, path, _) in enumerate(operations, start=1):
        if kind == "write":
            writes[path].append(at)
    kept = {at for each in writes.values() for at in (*each[:2], each[len(each) // 2], each[-1])}
    yield from (at for at, (kind, *_) in enumerate(operations, start=1) if kind != "write" or at in kept)


def _points(base: Path, tries: Tries) -> tuple[Counter[str], list[str]]:
    """Outcomes with their counts, and what was wrong."""
    outcomes, wrong = Counter[str](), []
    with tempfile.TemporaryDirectory(prefix="wristctl-fault-") as scratch:
        work = Path(scratch) / "work"
        for at, what in tries.operations.items():
            refusal = ERRORS[at % len(ERRORS)] if tries.mode == "turns" else tries.mode
            ended = _once(base, work, tries.name, Fault(at, 0 if refusal == "kill" else getattr(errno, refusal)))
            states = [each.state for each in commands.runs(work) if each.id not in tries.sound.before]
            code = {HANGS: "hangs", KILLED: "killed"}.get(ended[0], f"exit {ended[0]}")
            outcomes[" ".join([code, *sorted(states)])] += 1
            wrong += [f"{what}: {each}" for each in faults(work, tries.name, tries.mode, ended, tries.sound)]
    return outcomes, wrong


def _place(base: Path, work: Path, name: str) -> None:
    """A fresh copy of what a command reads."""
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(base, work)
    if name == "gc":
        commands.leave(work)


def _once(base: Path, work: Path, name: str, fault: Fault) -> tuple[int, str]:
    """Exit code (of a signal, minus its number) of one try in a fresh folder, and what it said on stderr."""
    _place(base, work, name)
    child = os.fork()
    if child == 0:
        armed = ctypes.CDLL(os.environ["WRISTCTL_FAULTS"])
        armed.arm(str(work / "results").encode(), ctypes.c_long(fault.at), fault.number, 0, fault.log.encode())
        os._exit(commands.run(work, commands.COMMANDS[name]))
    until = time.monotonic() + LIMIT
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > until:
            os.kill(child, 9)
            os.waitpid(child, 0)
            return HANGS, ""
        time.sleep(0.005)
    return os.waitstatus_to_exitcode(ended[1]), (work / "err").read_text(errors="replace")


if __name__ == "__main__":
    main()
