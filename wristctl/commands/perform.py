"""Execution of a study: inputs opened and named, a plan, then the computation, in a run directory or in memory."""

import json
import math
import shlex
import traceback
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic

from wristctl.commands.adoption import adopted, with_places, with_presets
from wristctl.commands.identified_wrist import beside_identified
from wristctl.commands.inputs import Inputs, check_motions, named_for_good, opened
from wristctl.commands.plain_python import warn_of_plain
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Found, Procedure, check_tendons, procedure_of
from wristctl.commands.progress import Watch, watched
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Operator, Session, ShowProgress, Unattended
from wristctl.config.foreign import Foreign
from wristctl.config.given_files import with_files
from wristctl.config.study import Study
from wristctl.errors import Phrase, UserError
from wristctl.records import LiveRun, Run, start_run
from wristctl.records.copied_inputs import sealed_references
from wristctl.records.journal import jsonable
from wristctl.records.manifest import MANIFEST, TABLES, Manifest, Overview
from wristctl.records.run_writer import Undrawn
from wristctl.study_files.error_messages import located
from wristctl.study_files.keywords import function_of
from wristctl.study_files.load import read_study
from wristctl.study_files.strict_yaml import KeyPath
from wristctl.study_files.sweeps import check_all_sizes
from wristctl.work.executors import Workers

# Laws that a listing names.
_NAMED = 2


@dataclass(frozen=True)
class Prepared(Generic[Found]):
    """A study that can be performed: its inputs are open, and named for good in it, its laws loaded and tried."""

    procedure: Procedure[Found]
    study: Study
    inputs: Inputs
    foreign: tuple[Foreign, ...] = ()
    """Origins of the laws that are not this package's."""

    def plan(self) -> str:
        """Describe the computation. Raises UserError for a fault that is known beforehand."""
        return self.procedure.plan(self.study, self.inputs)


def prepare(
    procedure: Procedure[Found],
    study: Study,
    out: Path,
    named_inputs: Mapping[str, Any] | None = None,
    files: Sequence[Path] = (),
    origins: Mapping[KeyPath, Phrase] = MappingProxyType({}),
) -> Prepared[Found]:
    """Open the inputs of a study, and load its laws from elsewhere. Raises UserError.

    `named_inputs` come before those of the study, by leaf, and runs are in the folder `out`; where one of the study's
    `files` is the configuration of a run, inputs may also be beside that run. `origins` are as `read_study` has them.
    """
    if procedure.completed is not None:
        study = procedure.completed(study)
    if procedure.mode is not None:
        procedure = procedure.mode(study) or procedure
    section = procedure.section(study)
    beside = [file.absolute().parent.parent for file in files if (file.parent / MANIFEST).is_file()]
    inputs = opened(procedure.kind, section, procedure.needs, named_inputs or {}, out, beside)
    if inputs:
        named = {procedure.subject.replace("-", "_"): named_for_good(inputs, section, out)}
        study = study.model_copy(update=named)
    study = beside_identified(study, procedure.subject, inputs, origins)
    check_tendons(study, procedure)
    check_motions(study, procedure.kind)
    study, foreign = adopted(study, procedure.kind)
    study = with_presets(study, procedure.kind)
    warn_of_plain(procedure, study)
    return Prepared(procedure, study, inputs, foreign)


@contextmanager
def recording(prepared: Prepared[Any], out: Path, label: str, argv: Sequence[str]) -> Iterator[LiveRun]:
    """A run directory in `out` for a prepared study, sealed with a report at the block's end, however it ends."""
    read, study = prepared.inputs.recorded(), with_places(prepared.study, sealed_references(prepared.foreign))
    kind, section = prepared.procedure.kind, prepared.procedure.section(prepared.study)
    about = _about(section) or prepared.procedure.works_on
    with start_run(kind, study, label, out, argv, read, _page, prepared.foreign, about) as run:
        yield run


def _about(section: Any) -> str:
    """Laws of a study with their gains, which distinguish it from others of its kind."""
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
    """Perform a prepared study; a failure is noted in `run`, and the tables in the end.

    Without a run the result is in memory only. `typed` are files and settings of the study as the command line had
    them.
    """
    work, findings, study = prepared.procedure.perform, Findings(prepared.study.seed, run), prepared.study
    if run is not None and run.files:  # what is read is what was sealed
        study = with_files(
            study, lambda name: str(run.path.absolute() / run.files[name]) if name in run.files else name
        )
    session = Session(study, prepared.inputs, findings, show, operator, executor, typed)
    if run is None:
        return work(session)
    try:
        result = work(session)
        findings.overview.answer[:] = result.summary
        findings.overview.marks[:] = result.marks
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
    run.console(str(result))
    run.summary(_summary(result, findings.overview, run.lacking), first=bool(result.summary))
    answer = result.answer
    answered = [answer.table] if answer is not None and answer.table is not None else []
    content = json.dumps(plain_tables([*answered, *result.tables]), indent=2, allow_nan=False)
    run.file(TABLES).write_text(content + "\n", encoding="utf-8")
    if result.fault is not None:
        run.exit_code = result.fault.exit_code
    return result


def _summary(result: StudyResult, overview: Overview, undrawn: Container[str]) -> str:
    """A result for README.md: the answer with its figure, then the tables, folded where there is an answer."""
    tables = "\n\n".join(table.text() for table in result.tables)
    if not overview.answer:
        return f"```\n{tables}\n```" if tables else ""
    drawn = overview.figure in overview.captions and f"figure {overview.figure}" not in undrawn
    picture = f"\n\n![{overview.captions[overview.figure]}](figures/{overview.figure}.png)" if drawn else ""
    lines = "\n".join(overview.answer)
    return f"```\n{lines}\n```{picture}\n\n<details><summary>All tables</summary>\n\n```\n{tables}\n```\n\n</details>"


def plain_tables(tables: Sequence[Table]) -> Any:
    """Tables for JSON."""
    return jsonable([{"title": table.title, "columns": table.columns, "rows": table.rows} for table in tables])


def _page(path: Path, manifest: Manifest, undrawn: Undrawn) -> str:
    from wristctl.plotting.page import page

    return page(Run(path), manifest, undrawn=undrawn)


Ref = str | Path | Run
Folder = str | Path
# A study, its file, or the name of an experiment.
StudyOrFile = Study | str | Path
# Folder of runs when none is named.
RESULTS = "results"


@contextmanager
def in_python() -> Iterator[None]:
    """Let errors speak of arguments and functions."""
    try:
        yield
    except UserError as error:
        error.in_python = True
        raise


def check_executor(named: str) -> None:
    """UserError for what names no executor."""
    Workers.of(named)


def study_with(
    study: StudyOrFile | None, command: str, settings: Mapping[str, Any]
) -> tuple[Study, Mapping[KeyPath, Phrase]]:
    """A study, or that of a file, with `settings` on top, and where each key is from. Raises UserError.

    Sizes that cannot well be meant are refused in a file and in settings; those of a study are meant.
    """
    if not isinstance(study, Study | str | Path | None):
        what = f"a {type(study).__name__} is no study"
        raise UserError(what, function_of(command), "a study, its file or name; settings by their names: wrist={...}")
    base, files = (study, []) if isinstance(study, Study) else (None, [Path(study)] if study is not None else [])
    overrides = base.overrides if base is not None else {}
    if base is not None and not settings:
        return base, overrides
    whole, origins = read_study(files, command=command, keywords=settings, base=base)
    check_all_sizes(whole, origins, command)
    return whole, {**overrides, **origins}


def carry_out(
    procedure: Procedure[Found], study: StudyOrFile | None, named_inputs: Mapping[str, Any], out: Folder | None,
    label: str, progress: Watch | None, executor: str = "serial", settings: Mapping[str, Any] = MappingProxyType({}),
) -> Found:  # fmt: skip
    """Plan and perform a procedure on a study, its file, the name of an experiment, or the defaults (None).

    `settings` are sections of a study, or keys of the command's own, that come on top of it, and `named_inputs` are by
    role. `out` is the folder in which a sealed run is left; without one the result is in memory.
    """
    whole, origins = study_with(study, procedure.kind, settings)
    folder, show = Path(RESULTS if out is None else out), watched(progress)
    try:
        prepared = prepare(procedure, whole, folder, named_inputs, origins=origins)
        prepared.plan()
    except UserError as error:
        raise located(error, origins) from error
    check_executor(executor)
    if out is None:
        return perform(prepared, None, show, Unattended(), executor)
    with recording(prepared, folder, label, [f"wristctl.{procedure.kind.replace('-', '_')}()"]) as run:
        return perform(prepared, run, show, Unattended(), executor)


# Kinds of runs whose repetition gives the same result.
AGAIN = ("gen-data", "train", "tune", "compare", "recommend", "simulate", "analyse", "identify", "audit")
# Relative difference of metrics up to which a repetition counts as the same result.
_ALIKE = 1e-6


def redrawn(run: Run, show: ShowProgress) -> StudyResult:
    """Repeat a run for its result with all figures, each drawn when it is asked for.

    UserError for a kind of run that cannot be had again, for one that did not end well, and where the repetition does
    not find what the run did: a figure of it would show something else.
    """
    if run.kind_today not in AGAIN:
        raise UserError(
            f"{run.kind} runs cannot be drawn again: they are no calculation",
            str(run.path),
            "take the PNG and SVG of the run's figures/",
        )
    if run.state != "ok":
        raise UserError(f"the run is {run.state}, not ok", str(run.path), "name one that ended ok")
    prepared = _prepared(run)
    result: StudyResult = perform(prepared, None, show, Unattended())
    again = {name: metric["value"] for name, metric in result.findings.metrics.items()}
    searched = run.kind == "compare" and run.config.compare.tuning is not None
    recorded = {name: metric["value"] for name, metric in run.metrics.items() if name in again or not searched}
    different = [name for name, value in recorded.items() if name not in again or not _alike(value, again[name])]
    if different:
        raise UserError(
            f"again it finds something else: {different[0]}{f' and {len(different) - 1} more' * (len(different) > 1)}",
            str(run.path),
            f"wristctl runs replay {shlex.quote(str(run.path))} says why",
            exit_code=3,
        )
    return result


def _prepared(run: Run) -> Prepared[Any]:
    """The run's study with its inputs; gains that a comparison searched for itself are those that it found."""
    procedure, study, out = procedure_of(run), run.config, run.path.parent
    prepared = prepare(procedure, study, out)
    if run.kind == "compare" and study.compare.tuning is not None:
        settled = study.compare.model_copy(update={"tuning": None})
        inputs = Inputs({**prepared.inputs, "tuned": run})
        return Prepared(procedure, study.model_copy(update={"compare": settled}), inputs)
    return prepared


def _alike(value: float | None, again: float | None) -> bool:
    finite = [metric for metric in (value, again) if metric is not None and math.isfinite(metric)]
    return not finite or (len(finite) == 2 and math.isclose(*finite, rel_tol=_ALIKE, abs_tol=1e-12))
