"""`wristctl runs verify`, `sign` and `replay`."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from wristctl.cli.command import trusting
from wristctl.cli.json_output import print_json
from wristctl.cli.options import RESULTS, Json, Out, Ref, TrustCode, run_ids, set_option
from wristctl.cli.output import say
from wristctl.cli.progress import listening, progress
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import inputs_of, procedure_of
from wristctl.config.former_names import OF_KINDS
from wristctl.config.loop import comes_live
from wristctl.errors import UserError
from wristctl.plain_files import UNREADABLE, unreadable
from wristctl.plugins.places import check_trust
from wristctl.processes import NO_HARDWARE, end_with_parent
from wristctl.records import Run, list_runs, open_run
from wristctl.records.difference import leaves_of
from wristctl.records.lineage import input_run
from wristctl.records.lock import RunLock
from wristctl.records.manifest import CONFIG, SIGNATURE, SUMS, Input
from wristctl.records.removal import SCRATCH
from wristctl.records.replay import ReplayVerdict, causes, changed_inputs, verdicts
from wristctl.records.signature import RunSignature, is_signed, signature
from wristctl.records.signature import sign as sign_run
from wristctl.study_files.keys import command_of
from wristctl.study_files.load import read_study

# Number of runs from which progress is shown.
_SHOWN = 50


class Verified(NamedTuple):
    """Faults of a run, and its signer where a signature was asked for."""

    problems: list[tuple[str, str]]
    signed: str = ""

    running: bool = False
    """The run is still running, and nothing of it is sealed yet."""

    unsealed: bool = False
    """The run was broken off before its end, and nothing of it was ever sealed."""

    @property
    def said(self) -> str:
        """The run in words."""
        if self.running:
            return "is running"
        if self.unsealed:
            return "did not end, and was never sealed"
        if all(file == SIGNATURE for file, _ in self.problems):
            return f"as sealed{', but nobody vouches for it' if self.problems else self.signed}"
        unread = [problem.startswith(UNREADABLE) for file, problem in self.problems if file != SIGNATURE]
        return "could not be checked" if all(unread) else "changed"

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
) -> None:
    """Hash every file of runs again and name each that is not as it was sealed (exit code 3).

    With --signed each must have a signature over those hashes, and with --signers one by somebody named there. A run
    that goes on is not sealed: it is named as running, and fails where it must be signed.
    """
    must = signed or signers is not None
    paths = [run.path for run in ([open_run(ref, out) for ref in refs] if refs else list_runs(out))]
    checked: dict[str, Verified] = {}
    quiet = len(paths) < _SHOWN
    with (
        listening(quiet, False) as console,
        progress(console, "verifying", quiet, len(paths), "runs") as advance,
    ):
        for count, path in enumerate(paths, start=1):
            run = Run(path)  # and forgotten again: the manifests of 20,000 runs are 400 MB
            checked[str(path) if run.id in checked else run.id] = _verified(run, must, signers)
            advance(count, changed=sum(verdict.fails(must) for verdict in checked.values()))
    failing = [verdict for verdict in checked.values() if verdict.fails(must)]
    error, unsealed = None, sum(verdict.unsealed for verdict in failing)
    if failing:
        changed = len(failing) - unsealed
        told = [f"{changed} of {len(checked)} runs are not as they were sealed{' and signed' * must}"] * bool(changed)
        told += [f"{unsealed} of {len(checked)} runs did not end, and were never sealed"] * bool(unsealed)
        fix = "restore the files named, or run the command again" if changed else "run the command again"
        error = UserError("; ".join(told), str(out), fix, exit_code=3)
    if as_json:
        shown = {
            name: [{"file": file, "problem": problem} for file, problem in verdict.problems]
            for name, verdict in checked.items()
        }
        return print_json({"schema": "wristctl.verify/1", "runs": shown}, error)
    width = max((len(name) for name in checked if os.sep not in name), default=0)  # paths of copies are much longer
    for name, verdict in checked.items():
        say(f"{name:{width}}  {verdict.said}")
        for file, problem in () if verdict.running or verdict.unsealed else verdict.problems:
            say(f"  {file}: {problem}")
    if error:
        raise error


def _verified(run: Run, signed: bool, signers: Path | None) -> Verified:
    """One run. What is sealed is hashed, whoever holds its lock: anybody can."""
    running = run.state == "running"  # asked first: a run that ends meanwhile is sealed before its lock is free
    try:
        problems = run.problems()
    except UserError as error:
        unreadable_seal = error.what.startswith(UNREADABLE)
        if running and not unreadable_seal:
            return Verified([(SUMS, "is not there yet: the run is running")], running=True)
        if not unreadable_seal and _was_broken_off(run):
            return Verified([(SUMS, "was never written: the run did not end")], unsealed=True)
        problems = [(SUMS, error.what if unreadable_seal else f"missing: the run is {run.state}")]
    except OSError as error:  # another user's, perhaps: the others are still checked
        problems = [(Path(error.filename or run.path).name, unreadable(error, run.path).what)]
    if not signed:
        return Verified(problems)
    if not is_signed(run):
        return Verified([*problems, (SIGNATURE, "run is not signed")])
    by = signature(run, signers)
    return Verified([*problems, (SIGNATURE, by.fault)] if by.fault else problems, _by(by))


def _was_broken_off(run: Run) -> bool:
    """Whether its manifest still has it running, as a process that was killed left it."""
    return run.state == "crashed" and run.manifest.state == "running"


def _by(run_signature: RunSignature) -> str:
    """Who signed a run, as far as that is known."""
    if not run_signature.key:
        return ""
    if run_signature.signer:
        return f", signed by {run_signature.signer} with {run_signature.key}"
    return f", signed with {run_signature.key}; --signers says whose it is"


KEY = Path("~/.ssh/id_ed25519")


def sign(
    ref: Ref,
    key: Annotated[
        Path, typer.Option("--key", help="Your private SSH key; where an agent holds it, the public one.")
    ] = KEY,
    out: Out = RESULTS,
) -> None:
    """Sign a run: with your SSH key, over the hashes of all its files. `verify --signed` checks it."""
    run = open_run(ref, out)
    run_signature = sign_run(run, key.expanduser())
    say(f"{run.id}  signed with {run_signature.key}")


_SAME = ("identical", "within tolerance", "drawn now", "undrawn", "volatile")


def replay(
    ref: Ref,
    out: Out = RESULTS,
    override: Annotated[list[str] | None, set_option("Repeat it with another setting.")] = None,
    trust_code: TrustCode = False,
    as_json: Json = False,
) -> None:
    """Run a run again in a scratch folder, and say of each file whether it came out the same (exit code 3 if not).

    The scratch folder is kept where something differs. A run on real hardware is refused: nothing here moves a motor.
    """
    with trusting(trust_code):
        _replay(open_run(ref, out), override or [], as_json)


def _replay(run: Run, overrides: list[str], as_json: bool) -> None:
    state = run.state
    run.manifest  # noqa: B018 - raises where it cannot be read
    if state != "ok":
        raise UserError(f"run is {state}, not ok", str(run.path), "repeat a run that ended ok")
    inputs, kind = inputs_of(run), run.kind_today
    check_trust(leaves_of(run), run.path / CONFIG)
    overrides = [OF_KINDS[run.kind], *overrides] if run.kind != kind == "analyse" else overrides
    study, _ = read_study([run.path / CONFIG], overrides, kind, note=False)  # the repetition notes former names
    section = getattr(study, kind.replace("-", "_"))
    if comes_live(getattr(section, "reference", None)):
        from wristctl.trial.trial_results import RECORD

        record = f"--set 'reference={{kind: live, file: {run.path / RECORD}}}'"
        fix = f"follow its record: wristctl {command_of(kind)} --config {run.path / CONFIG} {record}"
        raise UserError("nobody sends a live reference again", str(run.path), fix, exit_code=3)
    if getattr(section, "port", None) is not None:
        fix = "look at it: wristctl runs report; or do the experiment anew by its own command, with a person at the rig"
        raise UserError("a repetition never moves real motors", str(run.path), fix, exit_code=3)
    for output in run.manifest.outputs:
        run.file(output.path)
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
        failure = f"the repetition ended with exit code {code} ({scratch})"
        return _conclude(run, scratch, [], [failure, *why], as_json)
    compared = verdicts(run, ended[0])
    alike = all(verdict.verdict in _SAME for verdict in compared)
    _conclude(run, scratch, compared, [] if alike else causes(run, ended[0]), as_json)


def _named(run: Run, inputs: Mapping[str, Input | list[Input]]) -> Iterator[str]:
    """Overrides that name the inputs of a run at their present paths."""
    for leaf, named in inputs.items():
        paths = [str(input_run(run, record).path) for record in (named if isinstance(named, list) else [named])]
        yield f"{procedure_of(run).subject}.{leaf}={json.dumps(paths if isinstance(named, list) else paths[0])}"


def _again(run: Run, scratch: Path, settings: Sequence[str]) -> int:
    """The same command on the same configuration, in a process of its own; its messages pass through.

    It opens no board and no camera, for any configuration.
    """
    options = [part for text in settings for part in ("--set", text)]
    again = [*command_of(run.kind_today).split(), "--config", str(run.path / CONFIG), "--out", str(scratch)]
    command = [sys.executable, "-P", "-m", "wristctl", *again, *options, "--label", "replay"]
    alone = {**os.environ, NO_HARDWARE: "yes"}
    return subprocess.run(command, stdout=subprocess.DEVNULL, env=alone, preexec_fn=end_with_parent).returncode


def _conclude(run: Run, scratch: Path | None, compared: list[ReplayVerdict], why: list[str], as_json: bool) -> None:
    """Print the verdicts; where there is a cause to name, fail and keep the scratch folder."""
    error = None
    if why:
        kept = f"the repetition is in {scratch}" if scratch else "mend the input, or run its command again"
        problem = "the repetition differs" if compared else "the run was not repeated"
        error = UserError(problem, run.id, kept, exit_code=3)
    elif scratch:
        shutil.rmtree(scratch)
    if as_json:
        files = [verdict._asdict() for verdict in compared]
        shown = {"schema": "wristctl.replay/1", "run": run.id, "same": not why, "causes": why, "files": files}
        return print_json({**shown, "scratch": str(scratch) if why and scratch else None}, error)
    if compared:
        print(Table("", ("file", "verdict", "where"), compared).text(), end="\n\n")
    for cause in why:
        say(f"cause: {cause}")
    if error:
        raise error
    exact = all(verdict.verdict in ("identical", "undrawn", "volatile") for verdict in compared)
    say(f"{run.id}: {'identical' if exact else 'the same within tolerance'}")
