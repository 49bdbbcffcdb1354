"""What must hold of a results folder wherever a command was killed or refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.faults.commands import LOST, runs
from wristctl.board.board_errors import SAFETY_STOP
from wristctl.records.manifest import SUMS
from wristctl.records.removal import clear, clear_tags, leftovers, lost_tags
from wristctl.records.tags import known_tags

HANGS, KILLED = -1, -9


@dataclass(frozen=True)
class Sound:
    """The runs that were there before, and the result hashes of an undisturbed command by the names without times."""

    before: frozenset[str]
    results: dict[str, str] = field(default_factory=dict)


def timeless(run: str) -> str:
    """A run's id without its time."""
    return run.partition("-")[2]


def faults(work: Path, name: str, mode: str, ended: tuple[int, str], sound: Sound) -> Iterator[str]:
    """What is wrong with what a command has left that ended with this code and these words; gc is tried as well."""
    yield from _of_the_end(name, mode, *ended)
    yield from _of_the_runs(work, mode, ended[0], sound)
    if name != "gc" and LOST not in known_tags(work / "results"):
        yield "another run's tags are gone"
    yield from _after_gc(work)
    outside = {each.name for each in work.iterdir()} - {"results", "pictures", "out", "err"}
    if outside:
        yield f"outside results: {outside}"


def lost_by_power_cut(work: Path, operations: list[list[str]]) -> Iterator[str]:
    """What would not be on the disk if the power went right after a run was sealed, by the operations that made it.

    A file counts where it was synced after its last write, a name in a folder where the folder was synced after it.
    """
    written, synced, named = _dates(operations)
    for run in runs(work):
        if str(run.path / SUMS) not in written:
            continue  # made before
        for name in (SUMS, *(line.partition("  ")[2] for line in run.file(SUMS).read_text().splitlines())):
            file = str(run.path / name)
            if synced.get(file, -1) < written.get(file, -1):
                yield f"{run.id}: {name} is not on the disk"
        for below in (run.path.parent, run.path, *(each for each in run.path.rglob("*") if each.is_dir())):
            if synced.get(str(below), -1) < named.get(str(below), -1):
                yield f"{run.id}: not every name in {below.relative_to(work)} is on the disk"


def _dates(operations: list[list[str]]) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    """When a path was last written, last synced, and a folder last given a new name, as numbers of operations."""
    written: dict[str, int] = {}
    synced: dict[str, int] = {}
    named: dict[str, int] = {}
    for at, (kind, path, other) in enumerate(operations):
        if kind == "fsync":
            synced[path] = at
        elif kind == "rename":
            for dates in (written, synced):
                if path in dates:
                    dates[other] = dates.pop(path)
            named[str(Path(other).parent)] = at
        elif kind == "write":
            written[path] = at
        elif kind == "mkdir" or (kind == "open" and path not in written and not Path(path).name.startswith(".")):
            written.setdefault(path, at)
            named[str(Path(path).parent)] = at
    return written, synced, named


def _of_the_end(name: str, mode: str, code: int, said: str) -> Iterator[str]:
    if "bug in wristctl" in said or "Traceback" in said:
        yield f"a bug: {said[-300:]}"
    if mode == "kill" and code != KILLED:
        yield f"was not killed: {code}"
    if mode != "kill" and code not in (0, 2, *([SAFETY_STOP] if name == "hw-run" else [])):
        yield f"exit {code}: {said[-300:]}"
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    if code == 2 and len(errors) != 1:
        yield f"{len(errors)} errors told"


def _of_the_runs(work: Path, mode: str, code: int, sound: Sound) -> Iterator[str]:
    for run in runs(work):
        state = run.state
        if state in ("ok", "failed", "interrupted") and run.problems():
            yield f"{run.id} is {state}, and {run.problems()}"
        if state == "ok" and run.result_hash != sound.results.get(timeless(run.id), run.result_hash):
            yield f"{run.id} is ok, and has another result"
        if state == "ok" and run.id not in sound.before and "audit-" not in run.id and code not in (0, KILLED):
            yield f"{run.id} is ok, and the exit code {code}"
        if state == "running" or (mode == "kill" and state in ("failed", "interrupted")):
            yield f"{run.id} is {state}"
        if state in ("crashed", "broken") and mode != "kill" and code == 0:
            yield f"{run.id} is {state}, and the exit code 0"


def _after_gc(work: Path) -> Iterator[str]:
    results = work / "results"
    for each in list(leftovers(results)):
        clear(each)
    clear_tags(results, lost_tags(results))
    if known_tags(results).keys() - {each.id for each in runs(work)}:
        yield "tags of lost runs after gc"
    hidden = [each.name for each in results.rglob(".*") if each.name not in (".index.json", ".tags.lock")]
    if hidden:
        yield f"left after gc: {hidden}"
    if broken := [run.id for run in runs(work) if run.state == "broken"]:
        yield f"broken after gc: {broken}"
