"""A run and its repetition: a verdict on each file, and what may have caused a difference."""

from __future__ import annotations

from typing import Literal, NamedTuple

from wristctl.config.errors import UserError
from wristctl.records.difference import Change, difference
from wristctl.records.file_comparison import compare_files
from wristctl.records.lineage import input_run
from wristctl.records.manifest import CONFIG, MANIFEST
from wristctl.records.run import Run
from wristctl.records.seal import CHANGED


class ReplayVerdict(NamedTuple):
    """What became of one file; volatile ones (wall times) are not compared."""

    path: str
    verdict: Literal["identical", "within tolerance", "differs", "missing", "added", "volatile"]
    detail: str = ""


def verdicts(original: Run, again: Run) -> list[ReplayVerdict]:
    """A verdict on each output of either run."""
    before = {each.path: each for each in original.manifest.outputs}
    after = {each.path: each for each in again.manifest.outputs}
    found = []
    for path in dict.fromkeys([*before, *after]):
        if (before.get(path) or after[path]).volatile:
            found.append(ReplayVerdict(path, "volatile", "not compared"))
        elif path not in after:
            found.append(ReplayVerdict(path, "missing", "not written this time"))
        elif path not in before:
            found.append(ReplayVerdict(path, "added", "not written then"))
        else:
            found.append(ReplayVerdict(path, *compare_files(original.path / path, again.path / path)))
    return found


def changed_inputs(run: Run) -> list[str]:
    """What is wrong with the inputs as they are now; empty where each is sealed as it was read."""
    found = []
    for each in run.manifest.inputs:
        try:
            now = input_run(run, each)
            problems = now.problems()
        except UserError as error:
            found.append(f"input: {each.role}: {error.what} ({error.where})")
            continue
        readable = (MANIFEST, CHANGED) not in problems
        if readable and now.result_hash != each.result_sha256:
            found.append(f"input: {each.role}: another result than was read ({now.path})")
        found += [f"input: {each.role}: {what} ({now.path / path})" for path, what in problems]
    return found


def causes(original: Run, again: Run) -> list[str]:
    """What differs between the run and its repetition, as likely causes; nondeterminism where nothing does."""
    changed = difference(original, again)
    found = [f"input: {each.name}" for each in changed.inputs]
    found += [f"config: {_change_text(each)}" for each in changed.config]
    if any(path == CONFIG for path, _ in original.problems()):
        found.append("config: config.yaml was changed after the run")
    found += _causes_of("code", changed.code)
    found += _causes_of("environment", changed.environment)
    return found or ["nondeterminism: configuration, code, inputs and environment are the same"]


def _causes_of(what: str, changed: list[Change], most: int = 6) -> list[str]:
    """The first of what changed, one line each, and how many more there are."""
    more = [f"{what}: and {len(changed) - most} more"] if len(changed) > most else []
    return [f"{what}: {_change_text(each)}" for each in changed[:most]] + more


def _change_text(change: Change) -> str:
    before, after = ("absent" if value is None else value for value in change[1:])
    return f"{change.name}: {before} -> {after}"
