"""The one place that wraps a command: configuration, earlier runs, dry run, run directory, output."""

from __future__ import annotations

import inspect
import json
import re
import shutil
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_origin

import typer

from wristctl.cli.completion import controllers, run_ids
from wristctl.cli.options import Options, Own, signature
from wristctl.cli.progress import PLAIN, Done, Terminal, listening, progress
from wristctl.cli.tables import Table
from wristctl.config.errors import UserError
from wristctl.config.explain import located
from wristctl.config.keys import section_keys
from wristctl.config.load import read_study
from wristctl.config.resolved import resolved_yaml
from wristctl.config.study import Study
from wristctl.records import InputRun, LiveRun, Run, open_run, require, start_run
from wristctl.records.journal import jsonable
from wristctl.records.manifest import TABLES, Manifest

__all__ = ["EarlierRun", "Session", "Table", "study_command"]


@dataclass(frozen=True)
class EarlierRun:
    """An earlier run that a command reads: the leaf of a section that names it, and the kind it must be.

    `kind` None is any kind. With `unfinished` the run may have been stopped; its files are then not checked. A leaf
    that is a tuple names any number of runs.
    """

    leaf: str
    kind: str | None
    optional: bool = False
    unfinished: bool = False


@dataclass(frozen=True)
class Session:
    """What a command works with; `settings` is its own section of the study."""

    study: Study
    settings: Any
    inputs: dict[str, Run]
    run: LiveRun
    console: Terminal
    quiet: bool
    flags: frozenset[str] = frozenset()
    """Of the command's flags those that were given."""

    def progress(self, what: str, total: int | None = None, unit: str = "") -> AbstractContextManager[Done]:
        """Show how far `what` has come: a context manager that yields `done(count, **figures)`."""
        return progress(self.console, self.run.event, what, total, unit, self.quiet)


Work = Callable[[Session], Table | Sequence[Table] | None]
Plan = Callable[[Study, dict[str, Run]], str]


@dataclass(frozen=True)
class _Command:
    kind: str
    work: Work
    plan: Plan | None
    inputs: Sequence[EarlierRun]

    def section(self, study: Study) -> Any:
        return getattr(study, self.kind.replace("-", "_"))


def study_command(
    kind: str,
    work: Work,
    plan: Plan | None = None,
    inputs: Sequence[EarlierRun] = (),
    shortcuts: Sequence[str] = (),
    flags: Mapping[str, str] = MappingProxyType({}),
    examples: Sequence[str] = (),
    argument: str | None = None,
) -> typer.Typer:
    """The command `kind`, which runs `work` on its section of the study in a run directory of its own.

    `plan` says what will be done and raises UserError for what can be known before anything is written.
    Each of the `inputs` becomes an option that names an earlier run, each of the `shortcuts` (leaves of the
    section) an option for `--set`. The leaf `argument` is what stands first, without an option, in place of study
    files. `flags` (name and help) are switches of this call that are no settings. The docstring of `work` is the help.
    """
    command = _Command(kind, work, plan, inputs)
    named = [each.leaf for each in inputs if each.leaf != argument]
    first = (argument,) if argument else ()

    def call(**given: Any) -> None:
        own = {leaf: given.pop(leaf) for leaf in (*first, *named, *shortcuts)}
        raised = frozenset(name for name in flags if given.pop(name))
        typed = {leaf: json.dumps(own[leaf]) if leaf in quoted else own[leaf] for leaf in own}
        set_ = [f"{leaf}={typed[leaf]}" for leaf in own if own[leaf] is not None]
        _execute(command, Options(**given), set_, raised)

    keys = section_keys(kind)
    switches = {leaf for leaf in shortcuts if keys[leaf].annotation is bool}
    texts = {leaf for leaf in shortcuts if keys[leaf].annotation in (str, str | None)}
    quoted = {*first, *named, *switches, *texts}
    kinds: dict[str, Any] = dict.fromkeys(switches, bool)
    kinds |= {leaf: list[str] for leaf in (*first, *named) if get_origin(keys[leaf].annotation) is tuple}
    completed = {"controller": controllers} | {each.leaf: run_ids for each in inputs}
    own = [
        Own(leaf, keys[leaf].description or "", kinds.get(leaf, str), completed.get(leaf))
        for leaf in (*first, *named, *shortcuts)
    ]
    own += [Own(name, text, bool) for name, text in flags.items()]
    call.__signature__ = signature(own, argument)  # type: ignore[attr-defined]
    app = typer.Typer(add_completion=False)
    epilog = "\n\n".join(["Examples:", *examples]) if examples else None
    app.command(kind, help=inspect.getdoc(work), epilog=epilog)(call)
    return app


def _execute(command: _Command, options: Options, shortcuts: Sequence[str], flags: frozenset[str]) -> None:
    files = [*(options.files or ()), *(options.config or ())]
    seed = [f"seed={options.seed}"] if options.seed is not None else []
    study, origins = read_study(files, [*(options.override or ()), *shortcuts, *seed], command.kind)
    with listening(options.quiet, options.verbose) as console:
        inputs = _opened(command, study, options.out)
        study = _naming(inputs, study, command, options.out)
        try:
            plan = command.plan(study, inputs) if command.plan else ""
        except UserError as error:
            raise located(error, origins) from error
        if options.dry_run:
            return _print_plan(command.kind, study, plan, options)
        label = options.label or re.sub(r"[^A-Za-z0-9_.-]", "-", files[-1].stem if files else "")[:60]
        read = [InputRun(role, run) for role, run in inputs.items()]
        run = None
        try:
            argv = ["wristctl", *sys.argv[1:]]
            with start_run(command.kind, study, label, options.out, argv, read, _page) as run:
                session = Session(study, command.section(study), inputs, run, console, options.quiet, flags)
                tables = _worked(command, session)
        except KeyboardInterrupt:
            console.print(f"interrupted; what was found is in {run.path}" if run else "interrupted", **PLAIN)
            raise
    _print_result(run.path, tables, options.as_json)


def _opened(command: _Command, study: Study, out: Path) -> dict[str, Run]:
    runs: dict[str, Run] = {}
    for each in command.inputs:
        ref = getattr(command.section(study), each.leaf)
        if isinstance(ref, tuple) and ref:
            runs |= {f"{each.leaf}[{at}]": require(one, each.kind, out) for at, one in enumerate(ref)}
        elif ref:
            runs[each.leaf] = _stopped(ref, each, out) if each.unfinished else require(ref, each.kind, out)
        elif not each.optional:
            option = "" if isinstance(ref, tuple) else f"--{each.leaf.replace('_', '-')} "
            fix = f"{option}latest:{each.kind}, or the path or id of a {each.kind} run"
            raise UserError(f"{command.kind} needs a {each.kind} run", f"{command.kind}.{each.leaf}", fix)
    return runs


def _stopped(ref: str, wanted: EarlierRun, out: Path) -> Run:
    run = open_run(ref, out)
    if run.kind != wanted.kind:
        raise UserError(f"a {run.kind} run where a {wanted.kind} run is needed", str(run.path), "name another")
    if run.state == "running":
        raise UserError("that run is still going on", str(run.path), "wait for it, or stop it first")
    return run


def _naming(inputs: dict[str, Run], study: Study, command: _Command, out: Path) -> Study:
    """The study with the inputs named for good: by id within `out`, else by path."""
    within = out.resolve()
    names: dict[str, Any] = {
        role: run.id if run.path.parent == within else str(run.path) for role, run in inputs.items()
    }
    for leaf in dict.fromkeys(role.partition("[")[0] for role in names if role.endswith("]")):
        names[leaf] = tuple(names.pop(role) for role in inputs if role.startswith(f"{leaf}["))
    section = command.section(study).model_copy(update=names)
    return study.model_copy(update={command.kind.replace("-", "_"): section})


def _worked(command: _Command, session: Session) -> Sequence[Table]:
    run = session.run
    try:
        found = command.work(session)
    except UserError as error:
        run.console(f"error: {error}")
        raise
    except Exception as error:
        run.console(traceback.format_exc())
        error.add_note(f"the traceback is in {run.path / 'console.log'}")
        raise
    tables = [found] if isinstance(found, Table) else list(found or ())
    text = "\n\n".join(table.text() for table in tables)
    if text:
        run.console(text)
        run.summary(f"```\n{text}\n```")
    run.file(TABLES).write_text(json.dumps(_as_data(tables), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return tables


def _as_data(tables: Sequence[Table]) -> Any:
    return jsonable([{"title": each.title, "columns": each.columns, "rows": each.rows} for each in tables])


def _page(path: Path, manifest: Manifest) -> str:
    from wristctl.report.page import page

    return page(Run(path), manifest)


def _print_plan(kind: str, study: Study, plan: str, options: Options) -> None:
    resolved = resolved_yaml(study, kind)
    if options.as_json:
        shown = {"schema": "wristctl.plan/1", "kind": kind, "config": resolved, "plan": plan}
        print(json.dumps(shown, indent=2))
        return
    print(resolved, end="")
    for line in [*plan.splitlines(), f"would write a {kind} run under {options.out}; nothing is written now"]:
        print(f"# {line}")


def _print_result(path: Path, tables: Sequence[Table], as_json: bool) -> None:
    if as_json:
        run = Run(path)
        result = {
            "schema": "wristctl.result/1",
            "kind": run.kind,
            "id": run.id,
            "run": str(path),
            "state": run.state,
            "result_sha256": run.result_hash,
            "metrics": run.metrics,
            "tables": _as_data(tables),
        }
        print(json.dumps(jsonable(result), indent=2, allow_nan=False))
        return
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for table in tables:
        print(table.text(width), end="\n\n")
    print(path)
