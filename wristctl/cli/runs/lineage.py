"""`wristctl runs lineage`."""

from __future__ import annotations

import json
from dataclasses import asdict

from wristctl.cli.options import Debug, Json, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run
from wristctl.records.lineage import ancestry, dependents


def lineage(ref: Ref, out: Out = RESULTS, as_json: Json = False, debug: Debug = False) -> None:
    """Show the runs that a run was made from, and those made from it."""
    run = open_run(ref, out)
    tree, users = ancestry(run), dependents(run, run.path.parent)
    if as_json:
        shown = {"schema": "wristctl.lineage/1", "lineage": asdict(tree), "dependents": users}
        print(json.dumps(shown, indent=2))
        return
    for line in tree.lines():
        say(line)
    for user in users:
        say(f"used by {user}")
