"""Ctrl-C at moments spread over a command: it ends within a second of processor time, and its run says so.

`python -m tests.faults.interrupts [--only COMMAND] [--moments 20]` starts each command in a session of its own and
sends SIGINT to all of it, as a terminal does; a line for each command, exit code 1 where anything was wrong. With
`--kill` the first process alone gets SIGKILL: no other of its session may outlive it by more than a moment.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tests.faults import commands

ROOT = Path(__file__).parents[2]
LIMIT = 1.0
"""Seconds of processor time, of all its processes, from the signal to the end."""
BEGUN = 0.1
"""Seconds of processor time in which it is the interpreter itself that starts, and says so with a traceback."""
OUTLIVES = {signal.SIGINT: 1.0, signal.SIGKILL: 10.0}
"""Seconds that a process may outlive the one that began it."""
LARGE = {
    "gen-data-1e6": ("gen-data", "--samples", "1000000"),
    "train-1e6": ("train", "--data", "LARGE", "--epochs", "1"),
    "train-search": (
        "train", "--search", "--data", "DATA", "--epochs", "5",
        "--set", "grid={depths: [1, 2], activations: [tanh], widths: [8]}"
    ),
    "simulate-poses": ("simulate", "--set", "repetitions=2000"),
    "replay": ("runs", "replay", "DATA"),
}  # fmt: skip
"""Besides the short ones of each kind."""


class Ended(NamedTuple):
    """How an interrupted command ended; processor time before and after the signal [s]."""

    code: int
    before: float
    cpu: float
    said: str


def main() -> None:
    """Interrupt every command."""
    every = commands.COMMANDS | LARGE
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(every), help="commands, by commas")
    parser.add_argument("--moments", type=int, default=20, help="of each command")
    parser.add_argument("--kill", action="store_true", help="instead of Ctrl-C")
    given = parser.parse_args()
    number = signal.SIGKILL if given.kill else signal.SIGINT
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="wristctl-interrupts-") as scratch:
        base = Path(scratch) / "base"
        base.mkdir()
        names = given.only.split(",")
        commands.prepare(base, {word for name in names for word in every[name]})
        for name in names:
            if "LARGE" in every[name]:
                commands.run(base, (*LARGE["gen-data-1e6"], "--label", "large"))
            wrong += command(base, every[name], name, given.moments, number)
    print(f"{wrong} wrong")
    sys.exit(bool(wrong))


def command(base: Path, arguments: tuple[str, ...], name: str, moments: int, number: signal.Signals) -> int:
    """How much is wrong with one command."""
    _ended(base, arguments, 600.0, number)  # compiles
    began = time.monotonic()
    undisturbed = _ended(base, arguments, 600.0, number)
    whole = time.monotonic() - began
    wrong = [] if undisturbed.code == 0 else [f"undisturbed: exit {undisturbed.code}: {undisturbed.said[-300:]}"]
    outcomes, longest = Counter[str](), 0.0
    for k in range(1, moments + 1):
        at = whole * k / (moments + 1)
        ended = _ended(base, arguments, at, number)
        work = base.parent / "work"
        before = {each.id for each in commands.runs(base)}
        states = [each.state for each in commands.runs(work) if each.id not in before]
        outcomes[" ".join([f"exit {ended.code}", *sorted(states)])] += 1
        judged = _of_the_killed if number == signal.SIGKILL else _of_the_interrupted
        longest = max(longest, ended.cpu)
        wrong += [f"after {at:.2f} s: {each}" for each in judged(ended, states)]
    seen = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common())
    print(f"{name:16} {whole:6.1f} s  at most {longest:.2f} s of processor time  {seen}", flush=True)
    for each in wrong:
        print(f"    WRONG {each}", flush=True)
    return len(wrong)


def _of_the_interrupted(ended: Ended, states: Sequence[str]) -> Iterator[str]:
    if ended.before < BEGUN and not states:
        return
    # killed by the signal: also where it fell into an exec of the interpreter's, which a shell tells as 130 too
    if ended.code not in (0, 130, -signal.SIGINT):
        yield f"exit {ended.code}: {ended.said[-300:]}"
    if ended.cpu > LIMIT:
        yield f"{ended.cpu:.2f} s of processor time"
    if "bug in wristctl" in ended.said or "Traceback" in ended.said:
        yield f"a bug: {ended.said[-300:]}"
    if ended.code == 0 and any(state != "ok" for state in states):
        yield f"exit 0, and {states}"
    if any(state not in ("ok", "interrupted") for state in states):
        yield f"{states}"


def _of_the_killed(ended: Ended, states: Sequence[str]) -> Iterator[str]:
    if "bug in wristctl" in ended.said or "Traceback" in ended.said:
        yield f"a bug: {ended.said[-300:]}"
    if any(state not in ("ok", "crashed", "broken") for state in states):
        yield f"{states}"


def _ended(base: Path, arguments: tuple[str, ...], after: float, number: signal.Signals) -> Ended:
    """A command in a fresh folder that gets a signal so long after its start."""
    work = base.parent / "work"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(base, work)
    words = [sys.executable, "-P", "-m", "wristctl", *commands.named(work, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with (work / "err").open("wb") as told:
        child = subprocess.Popen(
            words, cwd=work, env=environment, stdout=told, stderr=told, stdin=subprocess.DEVNULL, start_new_session=True
        )
        until, spent = time.monotonic() + after, 0.0
        while child.poll() is None and time.monotonic() < until:
            time.sleep(0.002)
        if child.returncode is not None:
            return Ended(child.returncode, 0.0, 0.0, (work / "err").read_text(errors="replace"))
        spent = _processor_time(child.pid)
        (os.kill if number == signal.SIGKILL else os.killpg)(child.pid, number)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    until = time.monotonic() + OUTLIVES[number]
    while _session(child.pid) and time.monotonic() < until:
        time.sleep(0.1)
    said = (work / "err").read_text(errors="replace")
    if left := _session(child.pid):
        said += f"\nbug in wristctl: processes {left} go on"
        os.killpg(child.pid, signal.SIGKILL)
    return Ended(child.returncode, spent, usage.ru_utime + usage.ru_stime - spent, said)


def _session(leader: int) -> list[int]:
    """The processes of a session that have not ended."""
    found = []
    for each in Path("/proc").glob("[0-9]*"):
        try:
            fields = (each / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == leader and fields[0] != "Z":
            found.append(int(each.name))
    return found


def _processor_time(leader: int) -> float:
    """What the processes of a session have used by now, with those that they have waited for [s]."""
    ticks = 0
    for each in _session(leader):
        try:
            fields = Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        ticks += sum(int(field) for field in fields[11 : 15 if each == leader else 13])
    return ticks / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
