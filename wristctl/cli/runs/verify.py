"""`wristctl runs verify`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from wristctl.cli.completion import run_ids
from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.progress import listening, progress
from wristctl.cli.runs.run_options import RESULTS
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.config.sha256sums import UNREADABLE, unreadable
from wristctl.records import Run, list_runs, open_run
from wristctl.records.manifest import SIGNATURE, SUMS
from wristctl.records.signature import RunSignature, is_signed, signature
from wristctl.studies.counting import no_event

_SHOWN = 50
"""Runs from which on it is shown how far it has come."""


class Verified(NamedTuple):
    """What is wrong with a run, and whose signature it has, where that was asked."""

    problems: list[tuple[str, str]]
    signed: str = ""

    running: bool = False
    """It goes on, and nothing of it is sealed yet."""

    @property
    def said(self) -> str:
        """The run in words."""
        if self.running:
            return "is running"
        if all(file == SIGNATURE for file, _ in self.problems):
            return f"as sealed{', but nobody vouches for it' if self.problems else self.signed}"
        return "could not be checked" if any(what.startswith(UNREADABLE) for _, what in self.problems) else "changed"

    def fails(self, must_be_signed: bool) -> bool:
        """Whether it is not what was asked for."""
        return must_be_signed if self.running else bool(self.problems)


def verify(
    refs: Annotated[
        list[str] | None,
        typer.Argument(metavar="[RUN...]", help="Runs to check; all where none is named.", autocompletion=run_ids),
    ] = None,
    signed: Annotated[bool, typer.Option("--signed", help="They must also be signed (`wristctl runs sign`).")] = False,
    signers: Annotated[
        Path | None,
        typer.Option("--signers", help="Whose keys count: a file of allowed signers, `NAME KEYTYPE KEY` a line."),
    ] = None,
    out: Out = RESULTS,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Hash every file of runs again and name each that is not as it was sealed (exit code 3).

    With --signed each must have a signature over those hashes, and with --signers one by somebody named there. A run
    that goes on is not sealed: it is named as running, and fails where it must be signed.
    """
    must = signed or signers is not None
    paths = [run.path for run in ([open_run(ref, out) for ref in refs] if refs else list_runs(out))]
    found: dict[str, Verified] = {}
    quiet = len(paths) < _SHOWN
    with (
        listening(quiet, False) as console,
        progress(console, no_event, "verifying", len(paths), "runs", quiet) as done,
    ):
        for count, path in enumerate(paths, start=1):
            run = Run(path)  # and forgotten again: the manifests of 20,000 runs are 400 MB
            found[str(path) if run.id in found else run.id] = _verified(run, must, signers)
            done(count, changed=sum(each.fails(must) for each in found.values()))
    if as_json:
        shown = {
            name: [{"file": file, "problem": what} for file, what in each.problems] for name, each in found.items()
        }
        print(json.dumps({"schema": "wristctl.verify/1", "runs": shown}, indent=2))
    else:
        for name, each in found.items():
            say(f"{name}  {each.said}")
            for file, what in () if each.running else each.problems:
                say(f"  {file}: {what}")
    changed = sum(each.fails(must) for each in found.values())
    if changed:
        fix = "restore the files named, or run the command again"
        asked = " and signed" if must else ""
        raise UserError(
            f"{changed} of {len(found)} runs are not as they were sealed{asked}", str(out), fix, exit_code=3
        )


def _verified(run: Run, signed: bool, signers: Path | None) -> Verified:
    """One run. What is sealed is hashed, whoever holds its lock: anybody can."""
    running = run.state == "running"  # asked first: a run that ends meanwhile is sealed before its lock is free
    try:
        problems = run.problems()
    except UserError as error:
        unreadable_seal = error.what.startswith(UNREADABLE)
        if running and not unreadable_seal:
            return Verified([(SUMS, "is not there yet: the run is running")], running=True)
        problems = [(SUMS, error.what if unreadable_seal else f"missing: the run is {run.state}")]
    except OSError as error:  # another user's, perhaps: the others are still checked
        problems = [(Path(error.filename or run.path).name, unreadable(error, run.path).what)]
    if not signed:
        return Verified(problems)
    if not is_signed(run):
        return Verified([*problems, (SIGNATURE, "run is not signed")])
    by = signature(run, signers)
    return Verified([*problems, (SIGNATURE, by.fault)] if by.fault else problems, _by(by))


def _by(found: RunSignature) -> str:
    """Who signed a run, as far as that is known."""
    if not found.key:
        return ""
    if found.signer:
        return f", signed by {found.signer} with {found.key}"
    return f", signed with {found.key}; --signers says whose it is"
