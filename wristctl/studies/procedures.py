"""The procedure behind a run, and where that takes the earlier runs that the run was given.

A manifest may be anybody's: what is done with it comes from tables here, and what these do not know is refused.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run
from wristctl.records.manifest import KINDS, MANIFEST, Input
from wristctl.records.run import NAME_A_RUN
from wristctl.studies.procedure import Procedure

_NAMES = {kind: kind.replace("-", "_") for kind in KINDS} | {"study": "fair_study"}
"""Modules here, each with a procedure of its name."""


def procedure_of(run: Run) -> Procedure[Any]:
    """What made a run. Raises UserError for a kind that no command makes."""
    if run.kind not in _NAMES:
        raise UserError(f"no command of wristctl makes a {run.kind!r} run", str(run.path), NAME_A_RUN)
    name = _NAMES[run.kind]
    found: Procedure[Any] = getattr(import_module(f"wristctl.studies.{name}"), name.upper())
    return found


def inputs_of(run: Run) -> dict[str, Input | list[Input]]:
    """The inputs of a run by the leaf that names each, a list where it may name several.

    Raises UserError where its manifest has one play a part that the run's command knows nothing of.
    """
    procedure, found = procedure_of(run), dict[str, Input | list[Input]]()
    defaults = procedure.section(Study())
    several = {need.leaf: isinstance(getattr(defaults, need.leaf), tuple) for need in procedure.needs}
    for each in run.manifest.inputs:
        leaf = each.role.partition("[")[0]
        before = found.setdefault(leaf, []) if several.get(leaf) else None
        if isinstance(before, list) and each.role == f"{leaf}[{len(before)}]":
            before.append(each)
        elif before is None and each.role in several and leaf not in found:
            found[leaf] = each
        else:
            what = f"{run.kind} has no place for a run as its {each.role!r}"
            raise UserError(what, str(run.path / MANIFEST), NAME_A_RUN, exit_code=3)
    return found
