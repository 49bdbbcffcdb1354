"""What a study is given from earlier ones: run directories, or results in memory."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from wristctl.commands.results import StudyResult
from wristctl.config.loop import Reference
from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.errors import Argument, Call, UserError
from wristctl.records import InputRun, Run, open_run, require
from wristctl.records.manifest import MANIFEST
from wristctl.study_files.resolved import sections_read

Given = Run | StudyResult
RunChoice = str | Path | Given
"""How an input may be named: path, id, beginning of an id or latest:<kind>; or the run or result itself."""

Read = TypeVar("Read")


@dataclass(frozen=True)
class EarlierRun:
    """An earlier run that a command reads: the leaf of its section that names it, and the kind it must be.

    `kind` None is any kind. With `unfinished` the run may have been stopped; its files are then not checked. A leaf
    that is a tuple names any number of runs.
    """

    leaf: str
    kind: str | None
    optional: bool = False
    unfinished: bool = False


class Inputs(Mapping[str, Given]):
    """Inputs by role: the leaf that names them, or `leaf[0]`, `leaf[1]`, ... Whatever is read of one is read once."""

    def __init__(self, given: Mapping[str, Given] | None = None) -> None:
        self._given = dict(given or {})
        self._read: dict[tuple[str, Any], Any] = {}

    def __getitem__(self, role: str) -> Given:
        return self._given[role]

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)

    def read(self, role: str, reader: Callable[[Any], Read]) -> Read | None:
        """What `reader` makes of this input, None where it is not given."""
        if role not in self._given:
            return None
        if (role, reader) not in self._read:
            self._read[role, reader] = reader(self._given[role])
        found: Read = self._read[role, reader]
        return found

    def runs(self) -> dict[str, Run]:
        """The run directories among them, by role."""
        found = {role: each if isinstance(each, Run) else each.run for role, each in self._given.items()}
        return {role: run for role, run in found.items() if run is not None}

    def recorded(self) -> list[InputRun]:
        """What the manifest of a run made from them names. Raises UserError where one is in memory only."""
        runs = self.runs()
        for role, each in self._given.items():
            if role not in runs and isinstance(each, StudyResult):
                fix = ("write it too: ", Call(each.kind, arguments=(Argument("out", metavar="DIR"),)))
                raise UserError("a run directory names what it was made from, and this is in memory only", role, fix)
        return [InputRun(role, run) for role, run in runs.items()]


def opened(
    kind: str,
    section: Any,
    needs: Iterable[EarlierRun],
    given: Mapping[str, Any],
    out: Path,
    beside: Sequence[Path] = (),
) -> Inputs:
    """The inputs that a command needs: as `given`, else as its section of a study names them; runs are in `out`.

    What is not there is looked for `beside`: in the folders of the runs whose configuration the study is. Raises
    UserError for a run that is missing, of another kind, or not as it was sealed.
    """
    found: dict[str, Given] = {}
    for need in needs:
        named, several = _here(getattr(section, need.leaf), out, beside), isinstance(getattr(section, need.leaf), tuple)
        chosen = named if given.get(need.leaf) is None else given[need.leaf]
        if several and chosen:
            each = chosen if isinstance(chosen, Sequence) and not isinstance(chosen, str) else (chosen,)
            found |= {f"{need.leaf}[{at}]": _one(one, need, out) for at, one in enumerate(each)}
        elif chosen:
            found[need.leaf] = _one(chosen, need, out)
        elif not need.optional:
            latest = Argument(need.leaf, f"latest:{need.kind}", positional=several)
            fix = (latest, f", or the path or id of a {need.kind} run")
            raise UserError(f"{kind} needs a {need.kind} run", f"{kind}.{need.leaf}", fix)
    return Inputs(found)


def named_for_good(inputs: Inputs, section: Any, out: Path) -> Any:
    """The section with its inputs named by id within `out`, else by path; one in memory only has no name."""
    within, runs = out.resolve(), inputs.runs()
    names: dict[str, Any] = dict.fromkeys(inputs)
    names |= {role: run.id if run.path.parent == within else str(run.path) for role, run in runs.items()}
    for leaf in dict.fromkeys(role.partition("[")[0] for role in names if role.endswith("]")):
        names[leaf] = tuple(names.pop(role) for role in inputs if role.startswith(f"{leaf}["))
    return section.model_copy(update=names)


def _here(named: Any, out: Path, beside: Sequence[Path]) -> Any:
    """The runs that a study names where they are: a run that was moved stands beside those that were made from it."""
    if isinstance(named, tuple):
        return tuple(_here(each, out, beside) for each in named)
    if not isinstance(named, str) or not named or Path(named).exists():
        return named
    there = (folder / Path(named).name for folder in (out, *beside))
    return next((str(path) for path in there if (path / MANIFEST).is_file()), named)


def _one(chosen: RunChoice, need: EarlierRun, out: Path) -> Given:
    if isinstance(chosen, StudyResult):
        if need.kind not in (None, chosen.kind):
            fix = ("for example ", Argument(need.leaf, f"latest:{need.kind}"))
            raise UserError(f"a {chosen.kind} result where a {need.kind} run is needed", need.leaf, fix)
        return chosen
    ref = chosen.path if isinstance(chosen, Run) else chosen
    return _stopped(ref, need, out) if need.unfinished else require(ref, need.kind, out)


def _stopped(ref: str | Path, wanted: EarlierRun, out: Path) -> Run:
    run = open_run(ref, out)
    if run.kind != wanted.kind:
        raise UserError(f"a {run.kind} run where a {wanted.kind} run is needed", str(run.path), "name another")
    if run.state == "running":
        raise UserError("that run is still going on", str(run.path), "wait for it, or stop it first")
    return run


def check_motions(study: Study, command: str) -> None:
    """See that every recording of the sections that a command reads is one, and within the wrist's range.

    Raises UserError with file and line.
    """
    for section in sections_read(command):
        for reference in _recordings(getattr(study, section)):
            _check(reference, study.wrist.range_deg)


def _recordings(section: Any) -> Iterator[Reference]:
    if isinstance(section, Reference):
        if section.file:
            yield section
    elif isinstance(section, Section):
        for name in type(section).model_fields:
            yield from _recordings(getattr(section, name))
    elif isinstance(section, dict | tuple):
        for each in section.values() if isinstance(section, dict) else section:
            yield from _recordings(each)


def _check(reference: Reference, range_deg: float) -> None:
    import numpy as np

    from wristctl.simulation.recording import recording_of

    angle = np.rad2deg(reference.value("scale") * recording_of(reference).arc[0])
    most = float(np.abs(angle).max())
    if most > range_deg:
        what = f"the recording bends by {most:.4g} deg, beyond the wrist's range of +-{range_deg:g} deg"
        fix = "scale it, see to the unit in its header, or widen wrist.range_deg"
        raise UserError(what, str(reference.file), fix)
