"""`wristctl runs ls`, `show`, `diff`, `lineage` and `tag`."""

import json
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from typing import Annotated, Any

import typer

from wristctl.cli.json_output import print_json
from wristctl.cli.options import RESULTS, Json, Out, Ref, run_ids
from wristctl.cli.output import say
from wristctl.commands.printed_table import COLUMNS, Table, number
from wristctl.escape import printable
from wristctl.reader_units import in_degrees
from wristctl.records import Run, open_run
from wristctl.records.difference import Change, difference
from wristctl.records.find import check_choice, condition, entries, in_order, select
from wristctl.records.index import IndexEntry
from wristctl.records.lineage import ancestry, dependents
from wristctl.records.manifest import read_overview
from wristctl.records.tags import change_tags, known_tags

_LISTED_HEADS = {"wall_s": "wall [s]", "chief": "chief metric"}


def ls(
    out: Out = RESULTS,
    kind: Annotated[str | None, typer.Option("--kind", help="Only runs of this command.")] = None,
    label: Annotated[str | None, typer.Option("--label", help="Only runs with this label; * stands for any.")] = None,
    state: Annotated[str | None, typer.Option("--state", help="Only runs in this state: ok, failed, ...")] = None,
    tagged: Annotated[str | None, typer.Option("--tag", help="Only runs with this tag.")] = None,
    where: Annotated[
        list[str] | None, typer.Option("--where", help="Only runs with such a metric: 'rmse<0.5deg'; repeatable.")
    ] = None,
    newer: Annotated[str | None, typer.Option("--newer", help="Only runs started within: 30m, 12h, 2d.")] = None,
    older: Annotated[str | None, typer.Option("--older", help="Only runs started before: 30m, 12h, 2d.")] = None,
    sort: Annotated[
        str, typer.Option("--sort", help="By started, id, kind, label, state, wall_s or a metric.")
    ] = "started",
    reverse: Annotated[bool, typer.Option("--reverse", help="Largest or newest first.")] = False,
    columns: Annotated[
        str | None, typer.Option("--columns", help="Fields and metrics to show: id,about,rmse,settling.")
    ] = None,
    as_json: Json = False,
) -> None:
    """List runs, oldest first: what each was about, and the metric that heads its page.

    Notes are cut to the width of the terminal; --columns id,note and --json have them whole.
    """
    where = where or []
    indexed = entries(out)
    listed = in_order(select(indexed, kind, label, state, tagged, where, newer, older, typed=True), sort)
    listed = listed[::-1] if reverse else listed
    if as_json:
        print_json({"schema": "wristctl.runs/1", "runs": list(map(asdict, listed))})
    elif listed:
        asked = [sort, *(condition(text)[0] for text in where)]
        print((_chosen(listed, columns) if columns else _table(listed, asked)).text())
    else:
        say(f"no runs in {out}" + " that meet this" * any((kind, label, state, tagged, where, newer, older)))


def _table(listed: list[IndexEntry], asked: list[str]) -> Table:
    """The listing, with the metrics that were asked for and the columns that hold something, as wide as the terminal.

    It is wider where all but the notes are.
    """
    metrics = sorted({name for entry in listed for name in entry.metrics} & set(asked))
    rows = [replace(entry, chief="") if entry.chief in metrics else entry for entry in listed]  # it has its column
    held = [name for name in ("about", "chief") if any(getattr(entry, name) for entry in rows)]
    columns = ["id", "kind", "state", "wall_s", *held, *metrics]
    columns += [name for name in ("tags", "note") if any(getattr(entry, name) for entry in rows)]
    beyond = len(_rule(_of_columns(rows, columns))) - _terminal()
    room = max(_NOTE, max(len(printable(entry.note)) for entry in rows) - beyond)
    return _of_columns([replace(entry, note=_cut(entry.note, room)) for entry in rows], columns)


# Letters of a note that are shown, at least.
_NOTE = 48


def _terminal() -> int:
    return shutil.get_terminal_size((COLUMNS, 0)).columns


def _rule(table: Table) -> str:
    """The line under the heads of a table without a title."""
    return table.text().split("\n")[1]


def _cut(text: str, room: int) -> str:
    whole = printable(text)
    return text if len(whole) <= room else f"{whole[: room - 3]}..."


def _chosen(listed: list[IndexEntry], columns: str) -> Table:
    """The columns that were named, each once."""
    names = list(dict.fromkeys(name.strip() for name in columns.split(",") if name.strip()))
    available = {
        *(field.name for field in fields(IndexEntry)),
        *(metric for entry in listed for metric in entry.metrics),
    }
    for name in names:
        check_choice("columns", name, available)
    return _of_columns(listed, names)


def _of_columns(listed: list[IndexEntry], names: list[str]) -> Table:
    units = {name: {entry.units.get(name, "") for entry in listed if name in entry.metrics} for name in names}
    heads = []
    for name in names:
        (unit,) = units[name] if len(units[name]) == 1 else ("",)
        heads.append(_LISTED_HEADS.get(name, name) + f" [{unit}]" * bool(unit and not name.endswith(f"_{unit}")))
    return Table("", heads, [[_cell(entry, name, len(units[name]) > 1) for name in names] for entry in listed])


def _cell(entry: IndexEntry, name: str, with_unit: bool) -> Any:
    if name == "chief":
        value = _with_unit(entry, entry.chief)
        return f"{entry.chief} {value}" if value else ""
    if with_unit:
        return _with_unit(entry, name) or None
    value = entry.value(name)
    return ", ".join(value) if isinstance(value, list) else value


def _with_unit(entry: IndexEntry, name: str) -> str:
    """A metric as people read it; empty where there is none."""
    value, unit = in_degrees(entry.metrics.get(name), entry.units.get(name, ""))
    return f"{number(value)} {unit}".rstrip() if isinstance(value, int | float) else ""


def show(
    ref: Ref,
    metrics: Annotated[bool, typer.Option("--metrics", help="Print every metric too.")] = False,
    out: Out = RESULTS,
    as_json: Json = False,
) -> None:
    """Show one run: its answer, command, state, inputs and files; metrics too where it has no answer."""
    run = open_run(ref, out)
    tags = known_tags(run.path.parent).get(run.id, [])
    if as_json:
        manifest = json.loads(run.manifest.model_dump_json(by_alias=True))
        shown = {**manifest, "state": run.state, "tags": tags, "metrics": run.metrics, "run": str(run.path)}
        return print_json(shown)
    answer = read_overview(run.path).answer
    for line in answer:
        say(line)
    print("\n" * bool(answer), end="")
    shown_tables = _run_tables(run, tags, metrics or not answer)
    rule = _rule(shown_tables[0])  # as wide as the longest command
    print("\n\n".join(table.text() for table in shown_tables).replace(rule, rule[: _terminal()], 1), end="\n\n")
    if answer and not metrics and run.metrics:
        say(f"{len(run.metrics)} metrics: wristctl runs show {shlex.quote(str(run.path))} --metrics")
    say(run.path)


def _run_tables(run: Run, tags: list[str], with_metrics: bool) -> list[Table]:
    manifest = run.manifest
    commit = (manifest.code.commit or "")[:12]
    dirty = "with uncommitted changes" if manifest.code.dirty else ""
    facts = [
        ("state", run.state),
        ("command", shlex.join(manifest.argv)),
        ("seed", str(manifest.seed)),
        ("started", manifest.timing.started),
        ("code", " ".join(part for part in (manifest.code.version, commit, dirty) if part)),
        *([("tags", ", ".join(tags))] if tags else []),
        ("result hash", manifest.result_sha256 or "-"),
        *((f"input {record.role}", f"{record.kind} run {record.run}") for record in manifest.inputs),
        *([("error", manifest.error.what)] if manifest.error else []),
        *(("not drawn", f"{name}: {reason}") for name, reason in manifest.undrawn.items()),
    ]
    metrics = [
        (name, metric["value"], metric["unit"], metric["better"], metric["n"]) for name, metric in run.metrics.items()
    ]
    files = [(output.path, output.bytes, output.sha256[:12]) for output in manifest.outputs]
    return [
        Table("", ("run", run.id), facts),
        *([Table("Metrics", ("metric", "value", "unit", "better", "n"), metrics)] if metrics and with_metrics else []),
        *([Table("Files", ("path", "bytes", "sha256"), files)] if files else []),
    ]


# Differences printed without `--all`, and names of a summary's line.
_MANY, _FEW = 40, 3
_DIFF_TITLES = {
    "config": "Configuration", "metrics": "Metrics", "code": "Code", "environment": "Environment", "inputs": "Inputs",
}  # fmt: skip


def diff(
    before: Ref,
    after: Annotated[str, typer.Argument(metavar="OTHER", help="The run to compare it with.", autocompletion=run_ids)],
    all_: Annotated[bool, typer.Option("--all", help="Print every difference, not a summary of many.")] = False,
    out: Out = RESULTS,
    as_json: Json = False,
) -> None:
    """Show what differs between two runs: configuration, metrics, code, environment, inputs."""
    a, b = open_run(before, out), open_run(after, out)
    differences = difference(a, b)
    if as_json:
        changed = {
            name: {change.name: {"before": change.before, "after": change.after} for change in changes}
            for name, changes in vars(differences).items()
        }
        return print_json({"schema": "wristctl.diff/1", "before": a.id, "after": b.id, **changed})
    say(f"before  {a.id}")
    say(f"after   {b.id}")
    print()
    if a.kind != b.kind:
        say(f"The runs are of different kinds: {a.kind} and {b.kind}.")
    by_subject = [(title, changes) for name, title in _DIFF_TITLES.items() if (changes := getattr(differences, name))]
    if not all_ and (a.kind != b.kind or sum(map(len, vars(differences).values())) > _MANY):
        for title, changes in by_subject:
            names = ", ".join(change.name for change in changes[:_FEW])
            say(f"{title}: {names}" + f" and {len(changes) - _FEW} more" * (len(changes) > _FEW))
        say("every difference: --all")
        return
    tables = [
        _metrics_table(title, changes, a, b) if changes is differences.metrics else _diff_table(title, changes)
        for title, changes in by_subject
    ]
    print("\n\n".join(table.text() for table in tables) or "nothing differs")


def _metrics_table(title: str, changes: Sequence[Change], a: Run, b: Run) -> Table:
    """Changes of metrics as people read them; without their difference where the units differ."""
    rows: list[tuple[Any, ...]] = []
    runs = (a.metrics, b.metrics)
    for name, *values in changes:
        units = [run[name].get("unit") or "" if name in run else "" for run in runs]
        (before, unit), (after, other) = map(in_degrees, values, units)
        if unit and other and unit != other:
            rows.append((name, before, after, None, None, f"{unit}, {other}"))
        else:
            rows.append((name, before, after, *_change(before, after), unit or other))
    return Table(title, ("metric", "before", "after", "change", "change [%]", "unit"), rows)


def _diff_table(title: str, changes: Sequence[Change]) -> Table:
    return Table(title, ("what", "before", "after"), [(name, _text(a), _text(b)) for name, a, b in changes])


def _change(before: Any, after: Any) -> tuple[float | None, float | None]:
    if not isinstance(before, int | float) or not isinstance(after, int | float):
        return None, None
    return after - before, 100.0 * (after - before) / abs(before) if before else None


def _text(value: Any) -> str:
    return "-" if value is None else str(value)


def lineage(ref: Ref, out: Out = RESULTS, as_json: Json = False) -> None:
    """Show the runs that a run was made from, and those made from it."""
    run = open_run(ref, out)
    tree, users = ancestry(run), dependents(run, run.path.parent)
    if as_json:
        return print_json({"schema": "wristctl.lineage/2", "lineage": tree.plain(), "dependents": users})
    for line in tree.lines():
        say(line)
    for user in users:
        say(f"used by {user}")


def tag(
    ref: Ref,
    tags: Annotated[list[str] | None, typer.Argument(metavar="[TAG...]", help="Tags to add.")] = None,
    remove: Annotated[list[str] | None, typer.Option("--remove", help="A tag to take away; repeatable.")] = None,
    out: Out = RESULTS,
) -> None:
    """Add tags to a run, or take them away; they stand in tags.json beside the runs."""
    run = open_run(ref, out)
    say(f"{run.id}  {', '.join(change_tags(run.path.parent, run.id, tags or (), remove or ())) or 'no tags'}")
