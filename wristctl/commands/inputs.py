"""Inputs that a study takes from earlier ones: run directories, or results in memory."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from wristctl.board.messages import AXES
from wristctl.commands.results import StudyResult
from wristctl.config.loop import LIVE, Reference
from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import Argument, Call, Phrase, Setting, UserError
from wristctl.records import InputRun, Run, open_run, require
from wristctl.records.find import Content, a_run
from wristctl.records.manifest import MANIFEST
from wristctl.study_files.keys import command_of
from wristctl.study_files.resolved import sections_read

Given = Run | StudyResult
# Name of an input: path, id, beginning of an id or latest:<kind>; or the run or result itself.
RunChoice = str | Path | Given

Read = TypeVar("Read")


@dataclass(frozen=True)
class EarlierRun:
    """An earlier run that a command reads: the leaf of its section that names it, and the kind it must be.

    `kind` None is any kind. With `unfinished` the run may have been stopped; its files are then not checked. `content`
    is a file that it must have and other runs of its kind may lack, or says which by the section. A leaf that is a
    tuple names any number of runs.
    """

    leaf: str
    kind: str | None
    optional: bool = False
    unfinished: bool = False
    content: Content | Callable[[Any], Content] | None = None


# What several commands read: the network of a reference, gains that were tuned, and a wrist that was identified.
NETWORK, TUNED = EarlierRun("network", kind="train", optional=True), EarlierRun("tuned", kind="tune", optional=True)
IDENTIFIED, RATIOS = "data/identified.yaml", "data/ratios.json"
"""Files of an identify run with its wrist, as a study or by ratios; missing where too little was told."""
_WRIST = Content(IDENTIFIED, "wrist", RATIOS)
FROM_IDENTIFIED = EarlierRun("from_identified", kind="identify", optional=True, content=_WRIST)


class Inputs(dict[str, Given]):
    """Inputs by role: the leaf that names them, or `leaf[0]`, `leaf[1]`, ... Whatever is read of one is read once."""

    def __init__(self, by_role: Mapping[str, Given] | None = None) -> None:
        super().__init__(by_role or {})
        self._read: dict[tuple[str, Any], Any] = {}

    def read(self, role: str, reader: Callable[[Any], Read]) -> Read | None:
        """Content that `reader` makes of this input; None without the input."""
        if role not in self:
            return None
        if (role, reader) not in self._read:
            source = self[role]
            with source.reading() if isinstance(source, Run) else nullcontext():
                self._read[role, reader] = reader(source)
        content: Read = self._read[role, reader]
        return content

    def runs(self) -> dict[str, Run]:
        """The run directories among them, by role."""
        runs = {role: earlier if isinstance(earlier, Run) else earlier.run for role, earlier in self.items()}
        return {role: run for role, run in runs.items() if run is not None}

    def recorded(self) -> list[InputRun]:
        """Inputs as the manifest of a run names them. Raises UserError where one is in memory only."""
        runs = self.runs()
        for role, earlier in self.items():
            if role not in runs and isinstance(earlier, StudyResult):
                fix = ("write it too: ", Call(command_of(earlier.kind), arguments=(Argument("out", metavar="DIR"),)))
                raise UserError("a run directory names what it was made from, and this is in memory only", role, fix)
        return [InputRun(role, run) for role, run in runs.items()]


def opened(
    kind: str,
    section: Any,
    needs: Iterable[EarlierRun],
    named_inputs: Mapping[str, Any],
    out: Path,
    beside: Sequence[Path] = (),
) -> Inputs:
    """Inputs of a command by role: those that `named_inputs` has by leaf, else those that its section names.

    A run is looked for in the folder `out`, then in those `beside` it. Raises UserError for a run that is missing, of
    another kind, or not as it was sealed.
    """
    by_role: dict[str, Given] = {}
    for name in named_inputs.keys() - {need.leaf for need in needs}:
        if named_inputs[name] is not None:
            raise UserError(f"{kind} reads no earlier run here", Argument(name), "leave it out")
    for need in needs:
        content = need.content(section) if callable(need.content) else need.content
        named, several = _here(getattr(section, need.leaf), out, beside), isinstance(getattr(section, need.leaf), tuple)
        chosen = named if named_inputs.get(need.leaf) is None else named_inputs[need.leaf]
        if several and chosen:
            chosen_runs = chosen if isinstance(chosen, Sequence) and not isinstance(chosen, str) else (chosen,)
            for number, one in enumerate(chosen_runs):
                by_role[f"{need.leaf}[{number}]"] = _one(one, need, out, content)
        elif chosen:
            by_role[need.leaf] = _one(chosen, need, out, content)
        elif not need.optional:
            raise missing_run(kind, need, several)
    return Inputs(by_role)


def missing_run(kind: str, need: EarlierRun, several: bool) -> UserError:
    """Error for a command that was not told an earlier run that it needs."""
    latest = Argument(need.leaf, f"latest:{need.kind}", positional=several)
    fix = (latest, f", or the path or id of {a_run(need.kind)}")
    return UserError(f"{kind} needs {a_run(need.kind)}", f"{kind}.{need.leaf}", fix)


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
        return tuple(_here(name, out, beside) for name in named)
    if not isinstance(named, str) or not named or Path(named).exists():
        return named
    places = (folder / Path(named).name for folder in (out, *beside))
    return next((str(path) for path in places if (path / MANIFEST).is_file()), named)


def _one(chosen: RunChoice, need: EarlierRun, out: Path, content: Content | None) -> Given:
    if isinstance(chosen, StudyResult):
        if need.kind not in (None, chosen.kind):
            fix = ("for example ", Argument(need.leaf, f"latest:{need.kind}"))
            raise UserError(f"{a_run(chosen.kind, 'result')} where {a_run(need.kind)} is needed", need.leaf, fix)
        return chosen
    ref = chosen.path if isinstance(chosen, Run) else chosen
    if not need.unfinished:
        return require(ref, need.kind, out, content)
    run = open_run(ref, out)
    if run.kind != need.kind:
        raise UserError(f"{a_run(run.kind)} where {a_run(need.kind)} is needed", str(run.path), "name another")
    if run.state == "running":
        raise UserError("that run is still going on", str(run.path), "wait for it, or stop it first")
    return run


def check_wound(wrist: WristParameters, planes: int, command: str) -> None:
    """UserError unless a board's four axes wind this wrist's tendons in so many planes."""
    from wristctl.wrist.tendon_layout import wound_by

    if planes == 1:
        check_sides(wrist, command)
    else:
        wound_by(wrist, AXES)


def check_sides(wrist: WristParameters, command: str) -> None:
    """UserError, naming what takes this wrist, unless its tendons are the four at 45 deg from both planes."""
    from wristctl.wrist.tendon_layout import TendonLayout, key_of_tendon, off_both_sides, wound_by

    odd = off_both_sides(wrist)
    if odd is None:
        return
    rig = command.startswith(("hw", "calibrate-wrist"))
    does = "moves" if rig else "bends in one plane, by"
    if command == "audit":  # the claims of the paper alone
        does = "judges the claims of the paper, whose wrist has"
    elsewhere = f"tendon {odd} of this wrist is elsewhere"
    problem = f"{command_of(command)} {does} four tendons at 45 deg from both planes; {elsewhere}"
    wound = sum(place.multiplicity for place in TendonLayout.of(wrist).places if place.radius > 0.0)
    if rig and wound > AXES:
        problem = f"the motor board has {AXES} axes, and this wrist {wound} tendons off its axis"
    takes = " bends this wrist in two planes"
    others = " and others take it too (documentation: A wrist in two planes)"
    compares = ("; ", Call("compare"), ", ", Call("tune"), others)
    reads = ("; ", Call("identify"), " reads its robot's logs, ", Call("recommend"), " finds gains for it")
    fix: Phrase = (Call("simulate"), takes, *(reads if rig else compares))
    if command.startswith("hw") and wound <= AXES and TendonLayout.of(wrist).planes == 2:
        wound_by(wrist, AXES)
        problem = f"in one plane {problem}"
        fix = (Setting("planes=2", "hw-run"), ", with a camera for each plane")
    if TendonLayout.of(wrist).planes == 1:  # and in no other
        square = math.sqrt(2.0) * wrist.tendon_radius
        fix = f"two tendons at 0 and two at 180 deg bend as `tendons: four` with tendon_radius: {square:.4g}"
    raise UserError(problem, key_of_tendon(wrist, odd), fix)


def check_motions(study: Study, command: str) -> None:
    """See that every recording of the sections that a command reads is one, and within the wrist's range.

    Raises UserError with file and line.
    """
    for section in sections_read(command, study):
        for reference in _recordings(getattr(study, section)):
            _check(reference, study.wrist.range_deg)


def _recordings(section: Any) -> Iterator[Reference]:
    if isinstance(section, Reference):
        if section.file and section.kind != LIVE:  # the record of a live one is checked where it is read
            yield section
    elif isinstance(section, Section):
        for name in type(section).model_fields:
            yield from _recordings(getattr(section, name))
    elif isinstance(section, dict | tuple):
        for item in section.values() if isinstance(section, dict) else section:
            yield from _recordings(item)


def _check(reference: Reference, range_deg: float) -> None:
    import numpy as np

    from wristctl.simulation.recording import recording_of

    angle = np.rad2deg(reference.value("scale") * recording_of(reference).arc[0])
    most = float(np.abs(angle).max())
    if most > range_deg:
        reason = f"the recording bends by {most:.4g} deg, beyond the wrist's range of +-{range_deg:g} deg"
        fix = "scale it, see to the unit in its header, or widen wrist.range_deg"
        raise UserError(reason, str(reference.file), fix)
