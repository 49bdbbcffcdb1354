"""The one place that makes a command of a study: its options, its dry run, its run directory, what it prints."""

import inspect
import json
import re
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from importlib import import_module
from typing import Any, get_origin

import typer
from pydantic.fields import FieldInfo

from wristctl.board.board_errors import HARDWARE, SAFETY_STOP
from wristctl.cli.commands import TUNE, Entry
from wristctl.cli.json_output import Interrupted
from wristctl.cli.options import Options, Own, StudyCommand, controllers, references, run_ids, signature
from wristctl.commands.procedure import Procedure
from wristctl.errors import Setting, UserError
from wristctl.plugins.trust import asking
from wristctl.study_files.keys import field_at, section_keys, unit_of, whole_key
from wristctl.study_files.typed_controllers import TAKE_CONTROLLERS, parted


def trusting(trust: bool) -> AbstractContextManager[None]:
    """Within the block code of a run may be loaded where --trust-code was given, or where yes is typed at a terminal.

    What would run is shown before.
    """

    def ask(shown: str) -> bool:
        from wristctl.cli.operator import idle, typed_line

        typer.echo(shown, err=True)
        if trust or not sys.stdin.isatty():
            return trust
        typer.echo("Read it. Type yes to let it run: ", nl=False, err=True)
        return typed_line(idle) == "yes"

    return asking(ask)


_SWEEP = "One setting at many values: KEY=1,2,3, KEY=0..3:20, KEY=8e3..4e4 log:20, KEY=~0..3:100; repeat for more."
_MORE_OPTIONS = "More options: --help --all"
_EXECUTOR = "Who does the work: serial, processes[:N], dask://host:port or module:factory."


def study_command(procedure: Procedure[Any], entry: Entry) -> typer.Typer:
    """The command of a study, which performs it on its section of the study files in a run directory of its own.

    Each of the procedure's needs becomes an option that names an earlier run, each of the entry's shortcuts an option
    for `--set`. The docstring of what the procedure performs is the help.
    """
    shortcuts, flags, argument = entry.shortcuts, entry.flags, entry.argument
    named = [need.leaf for need in procedure.needs if need.leaf != argument]
    first = (argument,) if argument else ()

    def call(**arguments: Any) -> None:
        if entry.listing is not None and arguments.pop("list"):
            from wristctl.cli.output import print_table

            module, _, name = entry.listing[0].partition(":")
            return print_table(getattr(import_module(module), name)(), arguments["as_json"])
        leaves = {leaf: arguments.pop(_option_of(leaf)) for leaf in (*first, *named, *shortcuts)}
        raised = frozenset(name for name in flags if arguments.pop(name))
        sweeps = arguments.pop("sweep") if procedure.sweeps else None
        executor = (procedure.in_units and arguments.pop("executor")) or "serial"
        given = {leaf: value for leaf, value in leaves.items() if value is not None}
        set_ = [_setting(leaf, value, leaf in quoted, leaf == argument) for leaf, value in given.items()]
        set_ += [_setting("sweep", sweeps, True)] if sweeps else []
        options = Options(**arguments)
        with trusting(options.trust_code):
            _perform(procedure, options, set_, raised | ({"force"} if options.force else set()), executor)

    keys = section_keys(procedure.kind)
    for leaf in shortcuts:
        _, field = field_at((procedure.kind, *leaf.split(".")))
        if field is not None:
            keys[leaf] = field
    switches = {leaf for leaf in shortcuts if keys[leaf].annotation is bool}
    texts = {leaf for leaf in shortcuts if keys[leaf].annotation in (str, str | None)}
    quoted = {*first, *named, *switches, *texts}
    kinds: dict[str, Any] = dict.fromkeys(switches, bool)
    kinds |= {leaf: list[str] for leaf in (*first, *named) if get_origin(keys[leaf].annotation) is tuple}
    completed: dict[str, Callable[..., list[str]]] = {"controller": controllers, "reference.kind": references}
    completed |= {need.leaf: run_ids for need in procedure.needs}
    parameters = [
        Own(_option_of(leaf), _help_of(keys[leaf]), kinds.get(leaf, str), completed.get(leaf), leaf in entry.advanced)
        for leaf in (*first, *shortcuts, *named)
    ]
    parameters += [Own(name, text, bool) for name, text in flags.items()]
    parameters += [Own("list", entry.listing[1], bool)] if entry.listing else []
    parameters += [Own("sweep", _SWEEP, list[str])] * procedure.sweeps
    parameters += [Own("executor", _EXECUTOR, str, advanced=True)] * procedure.in_units
    call.__signature__ = signature(parameters, argument, procedure.kind in TAKE_CONTROLLERS)  # type: ignore[attr-defined]
    app = typer.Typer(add_completion=False)
    epilog = "\n".join(["Examples:", *map(_shown, entry.examples), _MORE_OPTIONS])
    app.command(procedure.kind, cls=StudyCommand, help=inspect.getdoc(procedure.perform), epilog=epilog)(call)
    return app


def _shown(text: str) -> str:
    """Text as help shows it: a bracket begins rich's markup."""
    return text.replace("[", r"\[")


def _help_of(field: FieldInfo) -> str:
    """Meaning of a leaf with its unit, as help shows it."""
    unit = unit_of(field)
    return _shown(f"{field.description or ''}{f' [{unit}]' * bool(unit)}")


def _option_of(leaf: str) -> str:
    """Name of the option for a leaf: `reference` for `reference.kind`."""
    return leaf.partition(".")[0]


def _setting(leaf: str, value: Any, quoted: bool, positional: bool = False) -> Setting:
    """What an option sets, or what stands without a name: its value is data where it is quoted, else YAML."""
    option = f"--{_option_of(leaf).replace('_', '-')}"
    values = [option] if isinstance(value, bool) else map(shlex.quote, value if isinstance(value, list) else [value])
    typed = " ".join(each if positional or each is option else f"{option} {each}" for each in values)
    return Setting(f"{leaf}={json.dumps(value) if quoted else value}", option=typed)


def _perform(
    procedure: Procedure[Any], options: Options, shortcuts: Sequence[Setting], flags: frozenset[str], executor: str
) -> None:
    from wristctl.cli.operator import TerminalOperator  # here, where a completion does not wait for them
    from wristctl.cli.output import print_plan, print_result
    from wristctl.cli.progress import PLAIN, Bar, listening
    from wristctl.commands.perform import check_executor, perform, prepare, recording
    from wristctl.study_files.error_messages import located
    from wristctl.study_files.load import read_study
    from wristctl.study_files.sweeps import check_all_sizes

    typed_controllers, named_files = parted(options.files or (), procedure.kind)
    files = [*named_files, *(options.config or ())]
    seed = [f"seed={options.seed}"] if options.seed is not None else []
    overrides = [*(options.override or ()), *shortcuts, *seed]
    study, origins = read_study(files, overrides, procedure.kind, controllers=typed_controllers, tune=TUNE in flags)
    if not options.force:
        check_all_sizes(study, origins, procedure.kind)
    with listening(options.quiet, options.verbose) as console:
        try:
            prepared = prepare(procedure, study, options.out, files=files, origins=origins)
            plan = prepared.plan()
            if procedure.doubts and not options.force:
                procedure.doubts(prepared.study, prepared.inputs)
        except UserError as error:
            raise located(error, origins) from error
        if options.dry_run:
            return print_plan(procedure.kind, prepared.study, plan, options.out, options.as_json, options.all_)
        if procedure.in_units:
            check_executor(executor)
        label = options.label or re.sub(r"[^A-Za-z0-9_.-]", "-", files[-1].stem if files else "")[:60]
        settings = [whole_key(override, procedure.kind) for override in (*(options.override or ()), *seed)]
        typed = [*map(str, files), *(word for setting in settings for word in ("--set", setting))]
        run = None
        try:
            command = ["wristctl", *sys.argv[1:]]
            with Bar(console, options.quiet) as show, recording(prepared, options.out, label, command) as run:
                outcome = perform(prepared, run, show, TerminalOperator(console, options.quiet, flags), executor, typed)
        except KeyboardInterrupt as interruption:
            if not run:
                console.print("interrupted", **PLAIN)
                raise
            place, resumes = shlex.quote(str(run.path)), any(need.leaf == "resume" for need in procedure.needs)
            go_on = f"go on: wristctl {procedure.kind} {place}/config.yaml --resume {place}"
            anew = f"nothing was found: the same command begins anew; delete this: wristctl runs rm {place}"
            found = f"what was found: wristctl runs show {place}" if run.has_found else anew
            remark = go_on if resumes else found
            console.print(f"interrupted; {remark}", **PLAIN)
            raise Interrupted(str(run.path), remark) from interruption
        except UserError as error:
            if run and error.exit_code in (HARDWARE, SAFETY_STOP):
                console.print(f"what was recorded: wristctl runs show {shlex.quote(str(run.path))}", **PLAIN)
            raise
    print_result(run.path, outcome.tables, options.as_json, outcome.summary, options.all_, outcome.fault)
