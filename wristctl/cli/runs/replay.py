"""`wristctl runs replay`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from wristctl.cli.child import end_with_parent
from wristctl.cli.options import Debug, Json, Out, TrustCode
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.cli.trust_code import asked_to_trust
from wristctl.config.errors import UserError
from wristctl.config.foreign import check_trust
from wristctl.config.load import read_study
from wristctl.config.no_hardware import NO_HARDWARE
from wristctl.config.trust import asking
from wristctl.records import Run, list_runs, open_run
from wristctl.records.difference import leaves_of
from wristctl.records.leftovers import SCRATCH
from wristctl.records.lineage import input_run
from wristctl.records.lock import RunLock
from wristctl.records.manifest import CONFIG, Input, command_of
from wristctl.records.replay import ReplayVerdict, causes, changed_inputs, verdicts
from wristctl.report.printed_table import Table
from wristctl.studies.procedures import inputs_of, procedure_of

_SAME = ("identical", "within tolerance", "volatile")


def replay(
    ref: Ref,
    out: Out = RESULTS,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Repeat it with another setting.")
    ] = None,
    trust_code: TrustCode = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Run a run again in a scratch folder, and say of each file whether it came out the same (exit code 3 if not).

    The scratch folder is kept where something differs. A run on real hardware is refused: nothing here moves a motor.
    """
    with asking(partial(asked_to_trust, trust_code)):
        _replay(open_run(ref, out), override or [], as_json)


def _replay(run: Run, overrides: list[str], as_json: bool) -> None:
    if run.state != "ok":
        raise UserError(f"run is {run.state}, not ok", str(run.path), "repeat a run that ended ok")
    inputs = inputs_of(run)
    check_trust(leaves_of(run).values(), run.path / CONFIG)
    study, _ = read_study([run.path / CONFIG], overrides, run.kind)
    if getattr(getattr(study, run.kind.replace("-", "_")), "port", None) is not None:
        fix = "look at it: wristctl runs report; or do the experiment anew by its own command, with a person at the rig"
        raise UserError("a repetition never moves real motors", str(run.path), fix, exit_code=3)
    changed = changed_inputs(run)
    if changed:
        return _conclude(run, None, [], changed, as_json)
    scratch = Path(tempfile.mkdtemp(prefix=SCRATCH))
    lock = RunLock(scratch)  # a sign of life, for `runs gc`
    try:
        code = _again(run, scratch, [*_named(run, inputs), *overrides])
    except KeyboardInterrupt:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
    finally:
        lock.release()
    ended = list_runs(scratch)
    if code or not ended:
        why = causes(run, ended[0]) if ended else []
        said = f"the repetition ended with exit code {code} ({scratch})"
        return _conclude(run, scratch, [], [said, *why], as_json)
    found = verdicts(run, ended[0])
    alike = all(each.verdict in _SAME for each in found)
    _conclude(run, scratch, found, [] if alike else causes(run, ended[0]), as_json)


def _named(run: Run, inputs: Mapping[str, Input | list[Input]]) -> Iterator[str]:
    """What names a run's inputs where they are now, as overrides."""
    for leaf, named in inputs.items():
        paths = [str(input_run(run, each).path) for each in (named if isinstance(named, list) else [named])]
        yield f"{procedure_of(run).subject}.{leaf}={json.dumps(paths if isinstance(named, list) else paths[0])}"


def _again(run: Run, scratch: Path, settings: Sequence[str]) -> int:
    """The same command on the same configuration, in a process of its own; its messages pass through.

    Whatever its configuration says, it opens no board and no camera.
    """
    options = [part for text in settings for part in ("--set", text)]
    again = [*command_of(run.kind).split(), "--config", str(run.path / CONFIG), "--out", str(scratch)]
    command = [sys.executable, "-P", "-m", "wristctl", *again, *options, "--label", "replay"]
    alone = {**os.environ, NO_HARDWARE: "yes"}
    return subprocess.run(command, stdout=subprocess.DEVNULL, env=alone, preexec_fn=end_with_parent).returncode


def _conclude(run: Run, scratch: Path | None, found: list[ReplayVerdict], why: list[str], as_json: bool) -> None:
    """Print the verdicts; where there is a cause to name, fail and keep the scratch folder."""
    if as_json:
        files = [each._asdict() for each in found]
        kept = str(scratch) if why and scratch else None
        shown: dict[str, Any] = {"schema": "wristctl.replay/1", "run": run.id, "same": not why, "causes": why}
        print(json.dumps({**shown, "files": files, "scratch": kept}, indent=2))
    else:
        if found:
            print(Table("", ("file", "verdict", "where"), found).text(), end="\n\n")
        for cause in why:
            say(f"cause: {cause}")
    if why:
        kept = f"the repetition is in {scratch}" if scratch else "mend the input, or run its command again"
        raise UserError("the repetition differs" if found else "the run was not repeated", run.id, kept, exit_code=3)
    if scratch:
        shutil.rmtree(scratch)
    if not as_json:
        exact = all(each.verdict in ("identical", "volatile") for each in found)
        say(f"{run.id}: {'identical' if exact else 'the same within tolerance'}")
