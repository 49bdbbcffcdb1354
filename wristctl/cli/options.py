"""The options that every command has, and how a command's own ones join them."""

import inspect
import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import wraps
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperOption

from wristctl.config.choices import CONTROLLERS, REFERENCES
from wristctl.study_files.shipped import shipped_names

# Runs offered: of many thousands nobody reads the list, and a shell asks at every key.
MOST = 200


def run_ids(context: typer.Context, incomplete: str) -> list[str]:
    """Run directories of the folder given with --out, the newest first, and latest:KIND."""
    out = Path(context.params.get("out") or "results")
    try:
        names = sorted((name for name in os.listdir(out) if not name.startswith(".")), reverse=True)
    except OSError:
        return []
    kinds = {f"latest:{kind}" for kind in _commands() if any(f"-{kind}-" in name for name in names)}
    fitting = (name for name in names if name.startswith(incomplete) and (out / name / "run.json").is_file())
    return [*islice(fitting, MOST), *(name for name in sorted(kinds) if name.startswith(incomplete))]


def study_files(incomplete: str) -> list[str]:
    """Folders and YAML files, those of experiments/ where nothing is typed yet; else names of experiments."""
    typed = Path(incomplete or "experiments/")
    folder = typed if incomplete.endswith("/") or not incomplete else typed.parent
    try:
        paths = [path for path in folder.iterdir() if path.suffix in (".yaml", ".yml") or path.is_dir()]
    except OSError:
        paths = []
    names = sorted(f"{path}/" if path.is_dir() else str(path) for path in paths)
    fitting = [name for name in names if name.startswith(incomplete)]
    return fitting or [name for name in shipped_names() if name.startswith(incomplete)]


def controllers(incomplete: str) -> list[str]:
    """Names of the table of controllers."""
    return sorted(name for name in CONTROLLERS if name.startswith(incomplete))


def controllers_and_studies(incomplete: str) -> list[str]:
    """Names of controllers, and study files."""
    return [*controllers(incomplete), *study_files(incomplete)]


def references(incomplete: str) -> list[str]:
    """Names of the table of references."""
    return sorted(name for name in REFERENCES if name.startswith(incomplete))


def _commands() -> list[str]:
    from wristctl.cli.commands import COMMANDS

    return list(COMMANDS)


# Panel of the options that few need. The help shows it with `--all` only.
ADVANCED = "Advanced"


def everything() -> bool:
    """Whether the help is to show all options: `--help --all`."""
    return "--all" in sys.argv


class StudyCommand(TyperCommand):
    """A command whose help shows advanced options with `--all` only."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The help on one screen, or with --all whole."""
        for parameter in self.params:
            if isinstance(parameter, TyperOption) and parameter.rich_help_panel == ADVANCED:
                parameter.hidden = not everything()
        super().format_help(ctx, formatter)


Out = Annotated[Path, typer.Option("--out", help="Folder of run directories.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=ADVANCED)]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Warnings and errors only.", rich_help_panel=ADVANCED)]
TrustCode = Annotated[
    bool,
    typer.Option(
        "--trust-code",
        help="Let code run that a run carries, and ask nobody: read it first.",
        rich_help_panel=ADVANCED,
    ),
]
Debug = Annotated[bool, typer.Option("--debug", help="Show tracebacks.", rich_help_panel=ADVANCED)]


def with_debug(command: Callable[..., Any]) -> Callable[..., Any]:
    """The command with the option --debug, for which the end of the program looks by itself."""

    @wraps(command)
    def call(*arguments: Any, debug: bool = False, **options: Any) -> Any:
        return command(*arguments, **options)

    own = inspect.signature(command, eval_str=True)
    debug = inspect.Parameter("debug", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Debug)
    call.__signature__ = own.replace(parameters=[*own.parameters.values(), debug])  # type: ignore[attr-defined]
    return call


def set_option(help_: str) -> Any:
    """The option --set with this help."""
    return typer.Option("--set", metavar="KEY=VALUE", help=help_)


def config_option(help_: str) -> Any:
    """The option --config of a command that makes no run, with this help."""
    return typer.Option("--config", "-c", metavar="FILE", help=help_)


@dataclass(frozen=True, kw_only=True)
class Options:
    """The shared options; each field's annotation is the option as typed."""

    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="FILE", help="Study files (YAML); later ones override earlier ones.", autocompletion=study_files
        ),
    ] = None
    config: Annotated[
        list[Path] | None,
        typer.Option(
            "--config",
            "-c",
            metavar="FILE",
            help="Study file, after the others.",
            autocompletion=study_files,
            rich_help_panel=ADVANCED,
        ),
    ] = None
    override: Annotated[list[str] | None, set_option("Override one setting: a.b=value.")] = None
    seed: Annotated[
        int | None, typer.Option("--seed", help="Root of every random stream.", rich_help_panel=ADVANCED)
    ] = None
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Go on with sizes that are hardly meant, as a length of 80 m; tune: beyond what tendons hold; "
            "hw-run: with gains that may swing.",
            rich_help_panel=ADVANCED,
        ),
    ] = False
    trust_code: TrustCode = False
    out: Out = Path("results")
    label: Annotated[
        str | None,
        typer.Option("--label", help="Part of the run's name; by default the study file's.", rich_help_panel=ADVANCED),
    ] = None
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print changed settings and the plan; write nothing. With --all every setting."),
    ] = False
    as_json: Json = False
    all_: Annotated[bool, typer.Option("--all", help="Print every table, not the answer alone.")] = False
    quiet: Quiet = False
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Details too.", rich_help_panel=ADVANCED)] = False
    debug: Debug = False


class Own(NamedTuple):
    """An option of one command."""

    leaf: str
    help: str
    kind: Any
    """Type of the parameter."""
    completed: Callable[..., list[str]] | None = None
    """Completions of the parameter in a shell."""
    advanced: bool = False


_CONTROLLERS_TOO = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="CONTROLLER|FILE",
        help="NAME, NAME/PRESET or file.py:NAME; study files (YAML).",
        autocompletion=controllers_and_studies,
    ),
]


def signature(
    parameters: Iterable[Own], argument: str | None = None, takes_controllers: bool = False
) -> inspect.Signature:
    """The parameters of a command: its own, then the shared ones.

    One of its own may be the `argument` that stands first, in place of study files; controllers may be among these.
    """
    shared = [
        parameter.replace(annotation=_CONTROLLERS_TOO) if takes_controllers and name == "files" else parameter
        for name, parameter in inspect.signature(Options, eval_str=True).parameters.items()
        if argument is None or name != "files"
    ]
    named = [
        inspect.Parameter(
            parameter.leaf,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[parameter.kind | None, _parameter(parameter, parameter.leaf == argument)],
        )
        for parameter in parameters
    ]
    return inspect.Signature([*named, *shared])


def _parameter(parameter: Own, first: bool) -> Any:
    if first:
        return typer.Argument(metavar=parameter.leaf.upper(), help=parameter.help, autocompletion=parameter.completed)
    return typer.Option(
        f"--{parameter.leaf.replace('_', '-')}",
        help=parameter.help,
        autocompletion=parameter.completed,
        rich_help_panel=ADVANCED if parameter.advanced else None,
    )


RESULTS = Path("results")

Ref = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="Path, id, beginning of an id, latest, latest:KIND or latest:KIND:LABEL.",
        autocompletion=run_ids,
    ),
]
Refs = Annotated[
    list[str],
    typer.Argument(
        metavar="RUN...",
        help="Paths, ids, beginnings of ids, latest, latest:KIND or latest:KIND:LABEL.",
        autocompletion=run_ids,
    ),
]


Port = Annotated[
    str | None,
    typer.Option("--port", help="Serial port, socket://host:port, or emulated; without it the only board found."),
]
Baud = Annotated[int, typer.Option("--baud", help="Of the serial line.")]
Image = Annotated[Path | None, typer.Option("--image", help="Another program than the packaged firmware (Intel hex).")]

BAUD = 250_000


def facts_of(values: dict[str, Any]) -> dict[str, Any]:
    """Names for states, faults and flags; why the board started in words; the dictionary in hex."""
    from wristctl.board.layout import RESET_MEANING
    from wristctl.board.messages import Reset

    named = {key: value.name or "none" if hasattr(value, "name") else value for key, value in values.items()}
    if isinstance(cause := values.get("reset_cause"), Reset):
        why = [RESET_MEANING[cause_bit] for cause_bit in cause & ~Reset.WARM] or ["hidden by the boot loader"]
        named["reset_cause"] = "; ".join(why + [RESET_MEANING[Reset.WARM]] * (Reset.WARM in cause))
    return {**named, "dictionary": f"{values['dictionary']:08x}", "firmware": ".".join(map(str, values["firmware"]))}
