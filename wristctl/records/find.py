"""Runs found by path, id, the beginning of an id or `latest`, and chosen by state, tag, age and metrics."""

import logging
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from operator import eq, ge, gt, le, lt, ne
from pathlib import Path
from typing import Any, NamedTuple, get_args

from wristctl.errors import OUT, Argument, Call, Phrase, UserError, meant, nearest
from wristctl.reader_units import in_degrees
from wristctl.records.index import RESULTS, IndexEntry, indexed, run_names
from wristctl.records.manifest import MANIFEST
from wristctl.records.run import NAME_A_RUN, Run, RunState
from wristctl.records.tags import known_tags
from wristctl.study_files.keys import command_of, is_command

_log = logging.getLogger(__name__)


_OF_CSV = (
    "for samples of tip and angle: wristctl gen-data --source csv --set 'files=[FILE]', then latest:gen-data; for a "
    "loop of torque or tension over angle: wristctl identify FILE --model hysteresis"
)


def list_runs(results: Path = RESULTS) -> list[Run]:
    """All runs of a results folder, oldest first; broken ones are among them and raise nothing."""
    return [Run(results / name) for name in run_names(results)]


def open_run(ref: str | Path, results: Path = RESULTS) -> Run:
    """The run that `ref` names: a path, an id in `results` or its beginning, `latest:<kind>` (that ended ok).

    `latest:<kind>:<label>` is the latest with that label, `latest` alone the latest of all kinds.

    Raises UserError where there is none, more than one, or what is there is not a run. A run whose manifest was
    changed after sealing is one still; reading the manifest raises.
    """
    if _is_latest(ref):
        return _latest(str(ref), results)
    path = Path(ref)
    if path.name == MANIFEST:
        path = path.parent
    if path.suffix.lower() == ".csv" and not path.is_dir():
        raise UserError("a CSV file where a run is needed", str(ref), _OF_CSV)
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


class Content(NamedTuple):
    """File of a run that other runs of its kind may lack, and what it is: for sentences."""

    file: str
    what: str
    instead: str = ""
    """Another file that will do."""
    fits: Callable[[Path], bool] = lambda file: True
    """Whether its file is what is wanted."""

    @property
    def named(self) -> str:
        """Its file, or both of which one will do."""
        return " or ".join(filter(None, (self.file, self.instead)))

    def of(self, run: Path) -> bool:
        """Whether the run in this folder has it."""
        files = (run / name for name in (self.file, self.instead) if name)
        return any(file.is_file() and self.fits(file) for file in files)


def a_run(kind: str | None, what: str = "run") -> str:
    """A run of this kind, or what else there is of it, as sentences have it: an identify run."""
    return f"{'an' if str(kind)[0] in 'aeiou' else 'a'} {kind} {what}"


def require(ref: str | Path, kind: str | None, results: Path = RESULTS, content: Content | None = None) -> Run:
    """The run `ref` if it is of the kind (None: any), has ended ok, and holds the very files sealed; else UserError.

    It must have the content too; `latest:` passes over runs without.
    """
    run = _latest(str(ref), results, content) if _is_latest(ref) else open_run(ref, results)
    actual_kind = run.manifest.kind  # raises where the manifest was changed, and with it perhaps kind and state
    if kind not in (None, actual_kind):
        raise UserError(
            f"{a_run(actual_kind)} where {a_run(kind)} is needed", str(run.path), f"for example latest:{kind}"
        )
    again = ("run `", Call(command_of(actual_kind), kept=True), "` again")
    if run.state != "ok":
        why = f": {run.manifest.error.what}" if run.manifest.error else ""
        raise UserError(f"run is {run.state}, not ok{why}", str(run.path), again)
    run.check()
    if content and not content.of(run.path):
        raise UserError(f"the run holds no {content.what} ({content.named})", str(run.path), again)
    return run


def _readable(path: Path) -> Run:
    run = Run(path)
    if not run.sealed:
        run.manifest  # noqa: B018 - reading it tells a run from a foreign folder
    return run


def _is_latest(ref: str | Path) -> bool:
    """Whether it names the latest of a kind, or, where no such file is there, of all."""
    return str(ref).startswith("latest:") or (str(ref) == "latest" and not Path(ref).exists())


def _latest(ref: str, results: Path, content: Content | None = None) -> Run:
    kind, _, label = ref.removeprefix("latest").removeprefix(":").partition(":")
    entries = indexed(results, renew=False)
    asked = [run for run in entries if kind in ("", run.kind) and label in ("", run.label) and run.state != "broken"]
    fitting = [run for run in asked if run.state == "ok"]
    empty = [run for run in fitting if content and not content.of(results / run.id)]
    latest = max((run for run in fitting if run not in empty), key=lambda run: run.started, default=None)
    for run in (Run(results / entry.id) for entry in entries if entry.state == "broken"):
        stamp, _, name = run.id.partition("-")
        if (
            name.startswith(kind and f"{kind}-{label}")
            and run.sealed
            and (latest is None or stamp >= latest.id.partition("-")[0])
        ):
            return run  # whoever reads it is told what is wrong; an older one in its place would go unnoticed
    if latest is None and content and empty:
        problem = f"no {kind} run that ended ok holds a {content.what} ({content.named})"
        raise UserError(problem, f"{ref} in {results}", ("run `", Call(command_of(kind), kept=True), "` again"))
    if latest is None:
        if asked:
            last = max(asked, key=lambda run: run.started)
            problem = f"no {f'{kind} ' * bool(kind)}run{f' with the label {label!r}' if label else ''} that ended ok"
            why = f": {last.note}" if last.note else ""
            raise UserError(problem, f"{ref} in {results}", f"{last.id} (state: {last.state}{why})")
        ended = [run for run in entries if run.state == "ok"]
        kinds, labels = {run.kind for run in ended}, {run.label for run in ended if run.kind == kind and run.label}
        if labels:
            raise UserError(f"no {kind} run with the label {label!r}", f"{ref} in {results}", meant(label, labels))
        if not kind:
            raise UserError("no run that ended ok", f"{ref} in {results}", ("name the results folder with ", OUT))
        longest = max((one for one in kinds if kind.startswith(f"{one}-")), key=len, default="")
        if longest:
            labelled = f"latest:{longest}:{kind.removeprefix(f'{longest}-')}"
            raise UserError(f"no command makes {kind!r} runs", f"{ref} in {results}", f"did you mean {labelled}?")
        fix: Phrase = meant(kind, kinds)
        if is_command(kind) or not kinds:
            logs = (Argument("runs", "LOG", positional=True),) if kind == "identify" else ()
            fix = ("run `", Call(command_of(kind), arguments=logs, kept=True), "` first")
        raise UserError(f"no {kind} run that ended ok", f"{ref} in {results}", fix)
    later = [run for run in asked if run.started > latest.started]
    if later:
        last = max(later, key=lambda run: run.started)  # not by id, which has no more than the second
        why = f"holds no {content.what}" if content and last in empty else f"is {last.state}"
        note = f" ({last.note})" if last.note else ""
        _log.info("the last %s run, %s, %s%s: %s is taken", kind or last.kind, last.id, why, note, latest.id)
    return Run(results / latest.id)


_COMPARISONS = {"<=": le, ">=": ge, "!=": ne, "==": eq, "<": lt, ">": gt, "=": eq}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?inf"
_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}


def entries(results: Path = RESULTS) -> list[IndexEntry]:
    """All runs of a results folder, oldest first, with their tags."""
    tags = known_tags(results)
    return [replace(entry, tags=tags[entry.id]) if entry.id in tags else entry for entry in indexed(results)]


def check_choice(option: str, value: str | None, allowed: Collection[str]) -> None:
    """UserError for a value that is none of those allowed, and no pattern; where none are there is nothing to say."""
    if value is not None and allowed and "*" not in value and value not in allowed:
        raise UserError(f"unknown {option.removesuffix('s')} {value!r}", Argument(option, value), meant(value, allowed))


def select(
    listed: Iterable[IndexEntry],
    kind: str | None = None,
    label: str | None = None,
    state: str | None = None,
    tag: str | None = None,
    where: Sequence[str] = (),
    newer: str | None = None,
    older: str | None = None,
    typed: bool = False,
) -> list[IndexEntry]:
    """The entries that meet every condition: `where` like "rmse<0.5deg", ages like 30m, 12h, 2d; kind and label may be
    patterns with *; a kind that none has, or a state that there is none of, is an error.

    A number of `where` without a unit is in that of files (SI), or, if `typed`, in that which people read (deg). Raises
    UserError for a condition that cannot be read, a metric that no run has, or none in that unit.
    """
    listed = list(listed)
    if kind is not None and not is_command(kind):
        check_choice("kind", kind, {entry.kind for entry in listed})
    check_choice("state", state, get_args(RunState))
    chosen = [
        entry
        for entry in listed
        if fnmatchcase(entry.kind, kind or "*")
        and fnmatchcase(entry.label, label or "*")
        and state in (None, entry.state)
        and (tag is None or tag in entry.tags)
    ]
    for text in where:
        name, compare, bound, unit = condition(text)
        _check_metric(name, chosen, text)
        values = [_in_unit(entry, name, unit, typed) for entry in chosen]
        if unit and chosen and all(value is None for value in values):
            has = dict.fromkeys(each for entry in chosen for each in _units(entry, name) if each)
            fix = f"its unit: {' or '.join(has)}" if has else "it has no unit"
            raise UserError(f"no run has {name} in {unit}", Argument("where", text), fix)
        chosen = [
            entry for entry, value in zip(chosen, values, strict=True) if value is not None and compare(value, bound)
        ]
    if newer:
        since = _time_ago(newer, "newer")
        chosen = [entry for entry in chosen if entry.started and entry.started >= since]
    if older:
        until = _time_ago(older, "older")
        chosen = [entry for entry in chosen if entry.started and entry.started < until]
    return chosen


def in_order(listed: Sequence[IndexEntry], by: str) -> list[IndexEntry]:
    """Sorted by a field or metric; runs that have none come last."""
    _check_metric(by, listed, Argument("sort", by))

    def sort_key(entry: IndexEntry) -> tuple[bool, Any]:
        value = entry.value(by)
        return (True, "") if value in (None, "") else (False, value)

    return sorted(listed, key=sort_key)


def _check_metric(name: str, listed: Sequence[IndexEntry], where: Phrase) -> None:
    entry_fields = {"id", "kind", "label", "state", "started", "wall_s"}
    names = {metric for entry in listed for metric in entry.metrics} | entry_fields
    if listed and name not in names:
        raise UserError(f"no run has a metric {name!r}", where, meant(name, sorted(names)))


def _units(entry: IndexEntry, name: str) -> tuple[str, str]:
    """Unit of a metric in files, and the one that people read; empty: none."""
    unit = entry.units.get(name, "s" if name == "wall_s" else "")
    return unit, in_degrees(None, unit)[1]


def _in_unit(entry: IndexEntry, name: str, unit: str, typed: bool) -> float | None:
    """A metric in a unit; empty: in that of files, or, if `typed`, in that which people read. None: there is none."""
    value, (in_files, shown) = entry.value(name), _units(entry, name)
    if not isinstance(value, int | float) or isinstance(value, bool) or unit not in ("", in_files, shown):
        return None
    read: float = in_degrees(float(value), in_files)[0]
    return read if (unit or (shown if typed else in_files)) == shown else value


def condition(text: str) -> tuple[str, Any, float, str]:
    """The metric, comparison, bound and its unit of "rmse<0.5deg"; the unit may be left out.

    Raises UserError for a text that is no condition.
    """
    match = re.fullmatch(rf"(.+?)\s*(<=|>=|!=|==|<|>|=)\s*({_NUMBER})\s*([a-z%][^<>=!]*)?", text.strip(), re.IGNORECASE)
    if match:
        return match[1], _COMPARISONS[match[2]], float(match[3]), match[4] or ""
    example = Argument("where", "rmse<0.5deg", quoted=True)
    raise UserError("not a condition on a metric", Argument("where", text), ("for example ", example))


def _time_ago(age: str, option: str) -> str:
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([smhdw])", age, re.ASCII)
    try:
        if match:
            instant = datetime.now(UTC) - timedelta(seconds=float(match[1]) * _SECONDS[match[2]])
            return instant.isoformat(timespec="microseconds")
    except OverflowError:  # before the calendar begins
        pass
    raise UserError("not an age", Argument(option, age), "a number with s, m, h, d or w: 12h, 2d")
