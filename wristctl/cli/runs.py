"""`wristctl runs`: what earlier commands have left."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from wristctl.cli.tables import Table
from wristctl.config.errors import UserError
from wristctl.runs import Run, list_runs, open_run
from wristctl.runs.journal import plain

app = typer.Typer(help="List and show run directories.", no_args_is_help=True, add_completion=False)

Out = Annotated[Path, typer.Option("--out", help="Folder of run directories.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show tracebacks.")]

_RESULTS = Path("results")


@app.command("ls")
def ls(
    out: Out = _RESULTS,
    kind: Annotated[str | None, typer.Option("--kind", help="Only runs of this command.")] = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List runs, oldest first."""
    listed = [entry for entry in map(_listed, list_runs(out)) if kind in (None, entry["kind"])]
    if as_json:
        print(json.dumps({"schema": "wristctl.runs/1", "runs": listed}, indent=2))
    elif listed:
        columns = ("id", "kind", "state", "wall [s]", "note")
        print(
            Table(
                "",
                columns,
                [[entry[key] for key in ("id", "kind", "state", "wall_s", "note")] for entry in listed],
            ).text()
        )
    else:
        print(f"no runs in {out}")


@app.command("show")
def show(
    ref: Annotated[str, typer.Argument(metavar="RUN", help="Path, id, beginning of an id, or latest:KIND.")],
    out: Out = _RESULTS,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Show one run: command, state, inputs, metrics and files."""
    run = open_run(ref, out)
    if as_json:
        manifest = json.loads(run.manifest.model_dump_json(by_alias=True))
        print(
            json.dumps(
                plain({**manifest, "state": run.state, "metrics": run.metrics, "run": str(run.path)}),
                indent=2,
            )
        )
        return
    print("\n\n".join(table.text() for table in _tables(run)), end="\n\n")
    print(run.path)


def _listed(run: Run) -> dict[str, Any]:
    entry: dict[str, Any] = {"id": run.id, "kind": "-", "state": run.state, "wall_s": None, "note": ""}
    try:
        manifest = run.manifest
    except UserError as error:
        return {**entry, "note": error.what}
    note = manifest.error.what if manifest.error else ""
    return {**entry, "kind": manifest.kind, "wall_s": manifest.timing.wall_s, "note": note}


def _tables(run: Run) -> list[Table]:
    manifest = run.manifest
    commit = (manifest.code.commit or "")[:12]
    dirty = "with uncommitted changes" if manifest.code.dirty else ""
    facts = [
        ("state", run.state),
        ("command", shlex.join(manifest.argv)),
        ("seed", str(manifest.seed)),
        ("started", manifest.timing.started),
        ("code", " ".join(part for part in (manifest.code.version, commit, dirty) if part)),
        ("result hash", manifest.result_sha256 or "-"),
        *((f"input {each.role}", f"{each.kind} run {each.run}") for each in manifest.inputs),
        *([("error", manifest.error.what)] if manifest.error else []),
    ]
    metrics = [
        (name, each["value"], each["unit"], each["better"], each["n"]) for name, each in run.metrics.items()
    ]
    files = [(each.path, each.bytes, each.sha256[:12]) for each in manifest.outputs]
    return [
        Table("", ("run", run.id), facts),
        *([Table("Metrics", ("metric", "value", "unit", "better", "n"), metrics)] if metrics else []),
        *([Table("Files", ("path", "bytes", "sha256"), files)] if files else []),
    ]
