"""How a study is performed: inputs opened and named, a plan, then the doing, in a run directory or in memory."""

from __future__ import annotations

import json
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic

from wristctl.config.errors import UserError
from wristctl.config.foreign import Foreign
from wristctl.config.given_files import with_files
from wristctl.config.study import Study
from wristctl.records import LiveRun, Run, start_run
from wristctl.records.foreign_code import sealed_references
from wristctl.records.journal import jsonable
from wristctl.records.manifest import MANIFEST, TABLES, Manifest
from wristctl.records.overview import Overview
from wristctl.report.printed_table import Table
from wristctl.studies.adopted import adopted, with_places
from wristctl.studies.findings import Findings
from wristctl.studies.given_motions import check_motions
from wristctl.studies.inputs import Inputs, named_for_good, opened
from wristctl.studies.procedure import Found, Procedure
from wristctl.studies.session import Operator, Session, ShowProgress
from wristctl.studies.study_result import StudyResult

_NAMED = 2
"""Laws that a listing names."""


@dataclass(frozen=True)
class Prepared(Generic[Found]):
    """A study that can be performed: its inputs are open, and named for good in it, its laws loaded and tried."""

    procedure: Procedure[Found]
    study: Study
    inputs: Inputs
    foreign: tuple[Foreign, ...] = ()
    """Where those of its laws are from that are not this package's."""

    def plan(self) -> str:
        """What would be done. Raises UserError for what can be known before."""
        return self.procedure.plan(self.study, self.inputs)


def prepare(
    procedure: Procedure[Found],
    study: Study,
    out: Path,
    given: Mapping[str, Any] | None = None,
    files: Sequence[Path] = (),
) -> Prepared[Found]:
    """Open the inputs: those `given` by name, else those that the study names, runs in `out`; load laws from elsewhere.

    Where one of the study's `files` is the configuration of a run, its inputs may also be beside that. Raises
    UserError.
    """
    section = procedure.section(study)
    beside = [file.absolute().parent.parent for file in files if (file.parent / MANIFEST).is_file()]
    inputs = opened(procedure.kind, section, procedure.needs, given or {}, out, beside)
    if inputs:
        own = {procedure.subject.replace("-", "_"): named_for_good(inputs, section, out)}
        study = study.model_copy(update=own)
    check_motions(study, procedure.kind)
    study, foreign = adopted(study, procedure.kind)
    return Prepared(procedure, study, inputs, foreign)


@contextmanager
def recording(prepared: Prepared[Any], out: Path, label: str, argv: Sequence[str]) -> Iterator[LiveRun]:
    """A run directory in `out` for a prepared study, sealed with a report at the block's end, however it ends."""
    read, study = prepared.inputs.recorded(), with_places(prepared.study, sealed_references(prepared.foreign))
    kind, about = prepared.procedure.kind, _about(prepared.procedure.section(prepared.study))
    with start_run(kind, study, label, out, argv, read, _page, prepared.foreign, about) as run:
        yield run


def _about(section: Any) -> str:
    """What tells a study from others of its kind: its laws with their gains."""
    rows = [section] if hasattr(section, "controller") else getattr(section, "rows", ())
    names = [_law(row) for row in rows] or list(getattr(section, "controllers", ()))
    return ", ".join(names[:_NAMED]) + f" and {len(names) - _NAMED} more" * (len(names) > _NAMED)


def _law(row: Any) -> str:
    if not hasattr(row, "controller"):
        return str(row.name)
    return f"{row.controller}/{row.gains if isinstance(row.gains, str) else 'given'}"


def perform(
    prepared: Prepared[Found],
    run: LiveRun | None,
    show: ShowProgress,
    operator: Operator,
    executor: str = "serial",
    typed: Sequence[str] = (),
) -> Found:
    """Do it, into `run` where there is one: what fails is noted there, and the tables in the end."""
    work, findings, study = prepared.procedure.perform, Findings(prepared.study.seed, run), prepared.study
    if run is not None and run.files:  # what is read is what was sealed
        study = with_files(
            study, lambda name: str(run.path.absolute() / run.files[name]) if name in run.files else name
        )
    session = Session(study, prepared.inputs, findings, show, operator, executor, typed)
    if run is None:
        return work(session)
    try:
        found = work(session)
        findings.overview.answer[:] = found.summary
        findings.overview.marks[:] = found.marks
    except UserError as error:
        run.console(f"error: {error}")
        raise
    except Exception as error:
        run.console(traceback.format_exc())
        error.add_note(f"the traceback is in {run.path / 'console.log'}")
        raise
    finally:
        with suppress(OSError, UserError):  # what went wrong is told by another error
            findings.keep_overview()
    run.console(str(found))
    run.summary(_summary(found, findings.overview), first=bool(found.summary))
    content = json.dumps(plain_tables(found.tables), indent=2, allow_nan=False)
    run.file(TABLES).write_text(content + "\n", encoding="utf-8")
    if found.fault is not None:
        run.exit_code = found.fault.exit_code
    return found


def _summary(found: StudyResult, overview: Overview) -> str:
    """A result for README.md: the answer with its figure, then the tables, folded where there is an answer."""
    tables = "\n\n".join(table.text() for table in found.tables)
    if not overview.answer:
        return f"```\n{tables}\n```" if tables else ""
    picture = f"\n\n![{overview.captions[overview.figure]}](figures/{overview.figure}.png)" if overview.figure else ""
    lines = "\n".join(overview.answer)
    return f"```\n{lines}\n```{picture}\n\n<details><summary>All tables</summary>\n\n```\n{tables}\n```\n\n</details>"


def plain_tables(tables: Sequence[Table]) -> Any:
    """Tables for JSON."""
    return jsonable([{"title": each.title, "columns": each.columns, "rows": each.rows} for each in tables])


def _page(path: Path, manifest: Manifest) -> str:
    from wristctl.report.page import page

    return page(Run(path), manifest)
