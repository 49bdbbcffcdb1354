"""A command as it can be called for: the earlier runs that it reads, what it would do, and the doing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from wristctl.commands.inputs import EarlierRun, Inputs, check_sides
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.records.manifest import KINDS, MANIFEST, Input
from wristctl.records.run import NAME_A_RUN
from wristctl.study_files.keys import SUBJECTS

if TYPE_CHECKING:
    from wristctl.simulation.closed_loop import Size


Found = TypeVar("Found", bound=StudyResult)


@dataclass(frozen=True)
class Procedure(Generic[Found]):
    """Plan and computation of a command. `perform` carries the command's docstring."""

    kind: str
    """The command's name, and its runs' kind."""
    plan: Callable[[Study, Inputs], str]
    """Says what will be done; raises UserError for what can be known before anything is computed or written."""
    perform: Callable[[Session], Found]
    """Computes; writes what it finds where the session's findings have a run directory."""
    needs: tuple[EarlierRun, ...] = ()
    in_units: bool = False
    """Whether it works in units, which other processes and machines may do."""
    doubts: Callable[[Study, Inputs], None] | None = None
    """Raises UserError for what the command does not do without `--force`."""
    size: Callable[[Study], Size] | None = None
    """The rollouts that it asks for, where it can be done at many values of its settings."""

    completed: Callable[[Study], Study] | None = None
    """Settings that follow from others, filled in before anything is written. Raises UserError."""
    in_one_plane: Callable[[Study], bool] = lambda study: True
    """Whether it pulls a wrist in one plane, by two tendons alike on either side."""
    works_on: str = ""
    """The section in which its runs find what they are about, where that is another than the command's."""
    mode: Callable[[Study], Procedure[Any] | None] | None = None
    """The procedure of the same command that a study asks for in place of this one."""

    @property
    def sweeps(self) -> bool:
        """Whether it can be done at many values of its settings."""
        return self.size is not None

    def section(self, study: Study) -> Any:
        """The section of a study that names what it reads."""
        return getattr(study, self.subject.replace("-", "_"))

    @property
    def subject(self) -> str:
        """The command in whose section that is: its own, or that of the one it works on."""
        return self.works_on or SUBJECTS.get(self.kind, self.kind)


def no_tendons(study: Study) -> bool:
    """`in_one_plane` of a command that pulls no tendons, or those of any layout."""
    return False


def check_tendons(study: Study, procedure: Procedure[Any]) -> None:
    """UserError where the wrist's tendons are none that a command can bend it by."""
    if study.wrist.tendons != "four":
        from wristctl.wrist.tendon_layout import TendonLayout

        TendonLayout.of(study.wrist)
        if procedure.in_one_plane(study):
            check_sides(study.wrist, procedure.kind)


_PLACES = {kind: f"{kind.replace('-', '_')}.command:{kind.replace('-', '_').upper()}" for kind in KINDS}
_PLACES |= {
    "calibrate-camera": "calibrate.camera:CALIBRATE_CAMERA",
    "calibrate-wrist": "calibrate.wrist:CALIBRATE_WRIST",
}
_PLACES |= {"study": "study.command:FAIR_STUDY"}
"""Module, below this package, and name of the procedure behind each kind of run."""


def procedure_of(run: Run) -> Procedure[Any]:
    """Procedure that made a run. Raises UserError for a kind that no command makes."""
    if run.kind_today not in _PLACES:
        raise UserError(f"no command of wristctl makes a {run.kind!r} run", str(run.path), NAME_A_RUN)
    return procedure_named(run.kind_today)


def procedure_named(kind: str) -> Procedure[Any]:
    """Procedure of a command by its name."""
    module, _, name = _PLACES[kind].partition(":")
    procedure: Procedure[Any] = getattr(import_module(f"wristctl.commands.{module}"), name)
    return procedure


def inputs_of(run: Run) -> dict[str, Input | list[Input]]:
    """The inputs of a run by the leaf that names each, a list where it may name several.

    Raises UserError where its manifest has one play a part that the run's command knows nothing of.
    """
    procedure, by_role = procedure_of(run), dict[str, Input | list[Input]]()
    defaults = procedure.section(Study())
    several = {need.leaf: isinstance(getattr(defaults, need.leaf), tuple) for need in procedure.needs}
    for recorded in run.manifest.inputs:
        leaf = recorded.role.partition("[")[0]
        before = by_role.setdefault(leaf, []) if several.get(leaf) else None
        if isinstance(before, list) and recorded.role == f"{leaf}[{len(before)}]":
            before.append(recorded)
        elif before is None and recorded.role in several and leaf not in by_role:
            by_role[leaf] = recorded
        else:
            reason = f"{run.kind} has no place for a run as its {recorded.role!r}"
            raise UserError(reason, str(run.path / MANIFEST), NAME_A_RUN, exit_code=3)
    return by_role
