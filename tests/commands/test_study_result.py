"""What every study's result is: told in a line, equal to nothing but itself, with nan where a number is missing."""

from __future__ import annotations

import importlib
import math
import pkgutil

import wristctl
from tests.commands.conftest import repeated, session
from wristctl import commands
from wristctl.commands.printed_table import Table
from wristctl.commands.results import StudyResult
from wristctl.commands.simulate.command import Simulated


def test_every_result_is_told_in_a_line_and_is_a_thing_of_its_own() -> None:
    """Tables and arrays have no plain equality, and whole trajectories are nothing to print."""
    for module in pkgutil.walk_packages(commands.__path__, "wristctl.commands."):
        importlib.import_module(module.name)
    kinds = StudyResult.__subclasses__()
    assert len(kinds) >= 11
    study = wristctl.load_study(None)
    for kind in kinds:
        if not kind.__module__.startswith("wristctl."):
            continue
        first, second = object.__new__(kind), object.__new__(kind)
        for made in (first, second):
            vars(made).update(dict.fromkeys(kind.__dataclass_fields__), findings=session(study).findings)
        assert len({first, second}) == 2 and first != second
        assert repr(first) == f"<{kind.__name__}: in memory; 0 metrics; figures >"


def test_numbers_that_are_missing_are_nan_and_tables_stand_apart() -> None:
    study = wristctl.load_study(None)
    findings = session(study).findings
    findings.metric("known", 2.0)
    findings.metric("missing", None)
    tables = [Table("One", ("a",), [(1,)]), Table("Two", ("b",), [(2,)])]
    made = Simulated(study, findings, tables, repeated("one"), False)
    assert made.metrics["known"] == 2.0 and math.isnan(made.metrics["missing"]) and made.run is None
    assert str(made) == f"{tables[0].text()}\n\n{tables[1].text()}"
