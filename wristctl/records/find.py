"""Find runs by path, id, the beginning of an id, or `latest:<kind>`."""

from __future__ import annotations

import logging
from pathlib import Path

from wristctl.config.errors import UserError, meant, nearest
from wristctl.config.wording import OUT, Call, Phrase
from wristctl.records.index import RESULTS, indexed, run_names
from wristctl.records.manifest import MANIFEST, command_of
from wristctl.records.run import NAME_A_RUN, Run

_log = logging.getLogger(__name__)


def list_runs(results: Path = RESULTS) -> list[Run]:
    """All runs of a results folder, oldest first; broken ones are among them and raise nothing."""
    return [Run(results / name) for name in run_names(results)]


def open_run(ref: str | Path, results: Path = RESULTS) -> Run:
    """The run that `ref` names: a path, an id in `results` or its beginning, `latest:<kind>` (that ended ok).

    `latest:<kind>:<label>` is the latest with that label.

    Raises UserError where there is none, more than one, or what is there is not a run. A run whose manifest was
    changed after sealing is one still; reading the manifest raises.
    """
    if str(ref).startswith("latest:"):
        return _latest(str(ref), results)
    path = Path(ref)
    if path.name == MANIFEST:
        path = path.parent
    if str(ref) and path.exists():
        return _readable(path)
    if len(path.parts) != 1:
        raise UserError("no such run", repr(str(ref)), NAME_A_RUN)
    runs = {run.id: run for run in list_runs(results)}
    if path.name in runs:
        return _readable(runs[path.name].path)
    match [run for run in runs.values() if run.id.startswith(path.name)]:
        case []:
            alike = nearest(path.name, runs)
            fix: Phrase = f"did you mean {alike!r}?" if alike else NAME_A_RUN
            raise UserError(
                "no such run", f"{ref} in {results}", fix if runs else ("name a path, or the results folder with ", OUT)
            )
        case [one]:
            return _readable(one.path)
        case several:
            raise UserError(
                f"{len(several)} runs begin like this",
                str(ref),
                f"write more of it: {', '.join(run.id for run in several[:3])}",
            )


def require(ref: str | Path, kind: str | None, results: Path = RESULTS) -> Run:
    """The run `ref` if it is of the kind (None: any), has ended ok, and holds the very files sealed; else UserError."""
    run = open_run(ref, results)
    found = run.manifest.kind  # raises where the manifest was changed, and with it perhaps kind and state
    if kind not in (None, found):
        raise UserError(f"a {found} run where a {kind} run is needed", str(run.path), f"for example latest:{kind}")
    if run.state != "ok":
        again = ("run `", Call(command_of(found)), "` again")
        raise UserError(f"run is {run.state}, not ok", str(run.path), again)
    run.check()
    return run


def _readable(path: Path) -> Run:
    run = Run(path)
    if not run.sealed:
        run.manifest  # noqa: B018 - reading it tells a run from a foreign folder
    return run


def _latest(ref: str, results: Path) -> Run:
    kind, _, label = ref.removeprefix("latest:").partition(":")
    entries = indexed(results, renew=False)
    ended = [run for run in entries if run.state == "ok"]
    fitting = [run for run in ended if run.kind == kind and label in ("", run.label)]
    latest = max(fitting, key=lambda run: run.started, default=None)
    for run in (Run(results / each.id) for each in entries if each.state == "broken"):
        stamp, _, rest = run.id.partition("-")
        if (
            rest.startswith(f"{kind}-{label}")
            and run.sealed
            and (latest is None or stamp >= latest.id.partition("-")[0])
        ):
            return run  # whoever reads it is told what is wrong; an older one in its place would go unnoticed
    if latest is None:
        kinds, labels = {run.kind for run in ended}, {run.label for run in ended if run.kind == kind}
        if labels:
            raise UserError(f"no {kind} run with the label {label!r}", f"{ref} in {results}", meant(label, labels))
        fix = meant(kind, kinds) if kinds else ("run `", Call(command_of(kind)), "` first")
        raise UserError(f"no {kind} run that ended ok", f"{ref} in {results}", fix)
    return Run(results / latest.id)
