"""The options that every command has, and how a command's own ones join them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from wristctl.cli.completion import study_files

Out = Annotated[Path, typer.Option("--out", help="Folder of run directories.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Warnings and errors only.")]
TrustCode = Annotated[
    bool, typer.Option("--trust-code", help="Let code run that a run carries, and ask nobody: read it first.")
]
Debug = Annotated[bool, typer.Option("--debug", help="Show tracebacks.")]


@dataclass(frozen=True, kw_only=True)
class Options:
    """The shared options; each field's annotation is the option as typed."""

    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE", help="Study files (YAML); later ones win.", autocompletion=study_files),
    ] = None
    config: Annotated[
        list[Path] | None,
        typer.Option(
            "--config", "-c", metavar="FILE", help="Study file, after the others.", autocompletion=study_files
        ),
    ] = None
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Override one setting: a.b=value."),
    ] = None
    seed: Annotated[int | None, typer.Option("--seed", help="Root of every random stream.")] = None
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Go on with lengths hardly meant in metres; tune: beyond what tendons hold; hw-run: with gains that "
            "may swing.",
        ),
    ] = False
    trust_code: TrustCode = False
    out: Out = Path("results")
    label: Annotated[
        str | None, typer.Option("--label", help="Part of the run's name; by default the study file's.")
    ] = None
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the resolved study and the plan; write nothing.")
    ] = False
    as_json: Json = False
    all_: Annotated[bool, typer.Option("--all", help="Print every table, where the answer alone would be.")] = False
    quiet: Quiet = False
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Details too.")] = False
    debug: Debug = False


class Own(NamedTuple):
    """An option of one command."""

    leaf: str
    help: str
    kind: Any
    """Its type."""
    completed: Callable[..., list[str]] | None = None
    """What the shell completes it with."""


def signature(own: Iterable[Own], argument: str | None = None) -> inspect.Signature:
    """The parameters of a command: the shared ones, then its own.

    One of its own may be the `argument` that stands first, in place of study files.
    """
    shared = [
        each
        for name, each in inspect.signature(Options, eval_str=True).parameters.items()
        if argument is None or name != "files"
    ]
    named = [
        inspect.Parameter(
            each.leaf,
            inspect.Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[each.kind | None, _parameter(each, each.leaf == argument)],
        )
        for each in own
    ]
    return inspect.Signature([*shared, *named])


def _parameter(own: Own, first: bool) -> Any:
    if first:
        return typer.Argument(metavar=own.leaf.upper(), help=own.help, autocompletion=own.completed)
    return typer.Option(f"--{own.leaf.replace('_', '-')}", help=own.help, autocompletion=own.completed)
