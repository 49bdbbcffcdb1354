"""`wristctl runs verify`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.completion import run_ids
from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.records import Run, list_runs, open_run
from wristctl.records.manifest import SIGNATURE
from wristctl.records.signature import RunSignature, is_signed, signature

_UNSIGNED = RunSignature("", "", "run is not signed")


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

    With --signed each must have a signature over those hashes, and with --signers one by somebody named there.
    """
    runs = [open_run(ref, out) for ref in refs] if refs else list_runs(out)
    found = {run.id: _problems(run) for run in runs}
    vouched = (
        {run.id: signature(run, signers) if is_signed(run) else _UNSIGNED for run in runs} if signed or signers else {}
    )
    for name, each in vouched.items():
        found[name] += [(SIGNATURE, each.fault)] if each.fault else []
    if as_json:
        shown = {name: [{"file": file, "problem": what} for file, what in each] for name, each in found.items()}
        print(json.dumps({"schema": "wristctl.verify/1", "runs": shown}, indent=2))
    else:
        for name, problems in found.items():
            say(f"{name}  {'changed' if problems else 'as sealed'}{_by(vouched.get(name))}")
            for file, what in problems:
                say(f"  {file}: {what}")
    changed = sum(bool(problems) for problems in found.values())
    if changed:
        fix = "restore the files named, or run the command again"
        raise UserError(f"{changed} of {len(found)} runs are not as they were sealed", str(out), fix, exit_code=3)


def _by(found: RunSignature | None) -> str:
    """Who signed a run, as far as that is known."""
    if found is None or not found.key:
        return ""
    return (
        f", signed by {found.signer} with {found.key}"
        if found.signer
        else f", signed with {found.key}; --signers says whose it is"
    )


def _problems(run: Run) -> list[tuple[str, str]]:
    """What is wrong with a run; one that is still running has nothing to be checked."""
    if run.state == "running":
        return []
    try:
        return run.problems()
    except UserError:
        return [("SHA256SUMS", f"missing: the run is {run.state}")]
