"""Ancestors and descendants of a run, read from the manifests."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from wristctl.errors import UserError
from wristctl.records.index import indexed
from wristctl.records.manifest import Input
from wristctl.records.run import Run

Node = TypeVar("Node")


def each_once(
    start: Node, name: Callable[[Node], Hashable], inputs: Callable[[Node], Iterable[Node]]
) -> dict[Hashable, Node]:
    """A node and all that are behind it by name, each once and after its inputs, however deep and however they share.

    `inputs` is asked once of each. What is its own ancestor, as only a damaged manifest says, comes before one of its
    inputs.
    """
    ordered, entered = dict[Hashable, Node](), {name(start)}
    way = [(start, iter(inputs(start)))]
    while way:
        node, further = way[-1]
        fresh = next((one for one in further if name(one) not in entered), None)
        if fresh is None:
            ordered[name(node)] = node
            way.pop()
        else:
            entered.add(name(fresh))
            way.append((fresh, iter(inputs(fresh))))
    return ordered


@dataclass(frozen=True)
class Ancestor:
    """A run and what it was made from; `role` is the part it plays in the run it was read by."""

    id: str
    kind: str
    state: str
    role: str = ""
    inputs: tuple[Ancestor, ...] = field(default=())

    def runs(self) -> list[Ancestor]:
        """This run and all behind it, each once and after its inputs."""
        return list(each_once(self, lambda one: one.id, lambda one: one.inputs).values())

    def lines(self) -> Iterator[str]:
        """The tree as text, the run itself first; the inputs of one that comes again stand where it came first."""
        known, waiting = set[str](), [(self, "", "")]
        while waiting:
            one, first_indent, indent = waiting.pop()
            again = " - as above" if one.inputs and one.id in known else ""
            yield f"{first_indent}{f'{one.role}: ' if one.role else ''}{one.id} ({one.state}){again}"
            if again:
                continue
            known.add(one.id)
            for number, ancestor in reversed(list(enumerate(one.inputs, 1))):
                last = number == len(one.inputs)
                waiting.append((ancestor, indent + ("└─ " if last else "├─ "), indent + ("   " if last else "│  ")))

    def plain(self) -> list[dict[str, Any]]:
        """For JSON: this run and all behind it, each once, with the roles and ids of its inputs."""
        return [
            {
                "id": one.id,
                "kind": one.kind,
                "state": one.state,
                "inputs": [{"role": ancestor.role, "id": ancestor.id} for ancestor in one.inputs],
            }
            for one in reversed(self.runs())
        ]


def ancestry(run: Run, state: str = "") -> Ancestor:
    """The tree of runs behind a run; inputs that are gone, broken or not what was read say so as their state.

    One that is its own ancestor, which only a damaged manifest says, ends there.
    """
    sources: dict[Path, list[tuple[Input, Run | None]]] = {}

    def inputs(one: Run) -> list[Run]:
        sources[one.path] = [(record, _source(one, record)) for record in one.manifest.inputs]
        return [source for _, source in sources[one.path] if source is not None]

    built: dict[Hashable, tuple[Ancestor, ...]] = {}
    for path, one in each_once(run, lambda one: one.path, inputs).items():
        built[path] = tuple(_ancestor(one, record, source, built) for record, source in sources[one.path])
    return Ancestor(run.id, run.kind, state or run.state, "", built[run.path])


def _source(run: Run, record: Input) -> Run | None:
    try:
        return input_run(run, record)
    except UserError:
        return None


def _ancestor(run: Run, record: Input, source: Run | None, built: dict[Hashable, tuple[Ancestor, ...]]) -> Ancestor:
    if source is None:
        state = "broken" if _path_of(run, record) else "gone"
        return Ancestor(record.run, record.kind, state, record.role)
    if source.path not in built:
        return Ancestor(record.run, record.kind, "its own ancestor: that cannot be", record.role)
    changed = source.result_hash != record.result_sha256
    state = "another result than was read" if changed else source.state
    return Ancestor(source.id, source.kind, state, record.role, built[source.path])


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
