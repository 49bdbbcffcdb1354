"""`wristctl runs show`."""

from __future__ import annotations

import json
import shlex

from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import Run, open_run
from wristctl.records.journal import jsonable
from wristctl.records.tags import known_tags
from wristctl.report.printed_table import Table


def show(ref: Ref, out: Out = RESULTS, as_json: Json = False, debug: Debug = False) -> None:
    """Show one run: command, state, inputs, metrics and files."""
    run = open_run(ref, out)
    tags = known_tags(run.path.parent).get(run.id, [])
    if as_json:
        manifest = json.loads(run.manifest.model_dump_json(by_alias=True))
        shown = {**manifest, "state": run.state, "tags": tags, "metrics": run.metrics, "run": str(run.path)}
        print(json.dumps(jsonable(shown), indent=2))
        return
    print("\n\n".join(table.text() for table in _tables(run, tags)), end="\n\n")
    say(run.path)


def _tables(run: Run, tags: list[str]) -> list[Table]:
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
        *((f"input {each.role}", f"{each.kind} run {each.run}") for each in manifest.inputs),
        *([("error", manifest.error.what)] if manifest.error else []),
    ]
    metrics = [(name, each["value"], each["unit"], each["better"], each["n"]) for name, each in run.metrics.items()]
    files = [(each.path, each.bytes, each.sha256[:12]) for each in manifest.outputs]
    return [
        Table("", ("run", run.id), facts),
        *([Table("Metrics", ("metric", "value", "unit", "better", "n"), metrics)] if metrics else []),
        *([Table("Files", ("path", "bytes", "sha256"), files)] if files else []),
    ]
