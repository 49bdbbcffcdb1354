"""Ancestors and descendants of a run, read from the manifests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from wristctl.errors import UserError
from wristctl.records.index import indexed
from wristctl.records.manifest import Input
from wristctl.records.run import Run


@dataclass(frozen=True)
class Ancestor:
    """A run and what it was made from; `role` is the part it plays in the run it was read by."""

    id: str
    kind: str
    state: str
    role: str = ""
    inputs: tuple[Ancestor, ...] = field(default=())

    def lines(self, first_indent: str = "", indent: str = "") -> Iterator[str]:
        """The tree as text, the run itself first."""
        role = f"{self.role}: " if self.role else ""
        yield f"{first_indent}{role}{self.id} ({self.state})"
        for number, ancestor in enumerate(self.inputs, 1):
            last = number == len(self.inputs)
            yield from ancestor.lines(indent + ("└─ " if last else "├─ "), indent + ("   " if last else "│  "))


def ancestry(run: Run, role: str = "", state: str = "", users: tuple[Path, ...] = ()) -> Ancestor:
    """The tree of runs behind a run; inputs that are gone, broken or not what was read say so as their state.

    `users` are the runs on the way here: one that is its own ancestor, which only a damaged manifest says, ends there.
    """
    inputs = []
    for record in run.manifest.inputs:
        try:
            ancestor = input_run(run, record)
            if ancestor.path in (run.path, *users):
                inputs.append(Ancestor(record.run, record.kind, "its own ancestor: that cannot be", record.role))
                continue
            changed = ancestor.result_hash != record.result_sha256
            state_then = "another result than was read" if changed else ""
            inputs.append(ancestry(ancestor, record.role, state_then, (run.path, *users)))
        except UserError:
            state_now = "broken" if _path_of(run, record) else "gone"
            inputs.append(Ancestor(record.run, record.kind, state_now, record.role))
    return Ancestor(run.id, run.kind, state or run.state, role, tuple(inputs))


def input_run(run: Run, record: Input) -> Run:
    """The run behind an input: beside the run that read it, or else where it was then.

    Raises UserError where it is gone, or its manifest is not as it was sealed.
    """
    path = _path_of(run, record)
    if path is None:
        raise UserError(f"the {record.role} run is gone", record.path, "bring it back beside the run that read it")
    ancestor = Run(path)
    ancestor.manifest  # noqa: B018 - reading it tells a run from a foreign folder
    return ancestor


def _path_of(run: Run, record: Input) -> Path | None:
    """The folder of an input, None where it is gone."""
    beside = [run.path.parent / record.run] if record.run == Path(record.run).name else []
    return next((path for path in (*beside, Path(record.path)) if path.is_dir()), None)


def dependents(run: Run, results: Path) -> list[str]:
    """Ids of the runs in `results` that read this one."""
    return [entry.id for entry in indexed(results) if run.id in entry.inputs]
