"""What every study's result is: told in a line, equal to nothing but itself, with nan where a number is missing."""

from __future__ import annotations

import base64
import importlib
import math
import pkgutil
import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import wristctl
from tests.commands.conftest import repeated, session
from wristctl import commands
from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table
from wristctl.commands.results import StudyResult
from wristctl.commands.simulate.results import Simulated
from wristctl.errors import UserError
from wristctl.plotting.page_tables import tables


def test_every_result_is_told_in_a_line_and_is_a_thing_of_its_own() -> None:
    """Tables and arrays have no plain equality, and whole trajectories are nothing to print."""
    for module in pkgutil.walk_packages(commands.__path__, "wristctl.commands."):
        importlib.import_module(module.name)
    direct = StudyResult.__subclasses__()
    kinds = [kind for parent in direct for kind in (parent.__subclasses__() or [parent])]
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
    made = Simulated(study, findings, tables, repeated("one"))
    assert made.metrics["known"] == 2.0 and math.isnan(made.metrics["missing"]) and made.run is None
    assert str(made).endswith(f"\n\n{tables[0].text()}\n\n{tables[1].text()}")


def test_an_unknown_metric_or_figure_is_told_what_is_meant() -> None:
    study = wristctl.load_study(None)
    findings = session(study).findings
    findings.metric("rmse", 2.0)
    findings.figure("angle", Figure)
    made = Simulated(study, findings, [], repeated("one"))
    with pytest.raises(KeyError, match="did you mean 'rmse'"):
        made.metrics["rmsee"]
    with pytest.raises(KeyError, match="did you mean 'angle'"):
        made.figures["angel"]
    assert made.metrics == {"rmse": 2.0} and "rmsee" not in made.metrics


def test_a_notebook_shows_the_tables_or_the_answer_and_a_picture() -> None:
    study = wristctl.load_study(None)
    findings = session(study).findings
    made = Simulated(study, findings, [Table("One", ("a<b",), [(1,)])], repeated("one"))
    shown = made._repr_html_()
    assert ("a&lt;b" in shown) == (not made.summary) and "<img" not in shown and "a<b" not in shown
    findings.figure("angle", Figure)
    shown = made._repr_html_()
    (encoded,) = re.findall("base64,([^\"']+)", shown)
    assert base64.b64decode(encoded).startswith(b"\x89PNG")


def test_a_study_is_named_by_its_file_or_its_experiment(tmp_path: Path) -> None:
    file = tmp_path / "short.yaml"
    file.write_text("simulate: {horizon: 0.1, loop: {plant_segments: 1}}")
    for named in (file, str(file), wristctl.load_study(file)):
        assert wristctl.simulate(named).study.simulate.horizon == 0.1
    with pytest.raises(UserError, match="did you mean 'quick'"):
        wristctl.simulate("quik")


def test_the_answers_table_is_the_first_of_a_runs_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = Answer("It works.", Table("Answer", ("a",), [(7,)]))
    monkeypatch.setattr(Simulated, "answer", property(lambda made: answer))
    study = wristctl.load_study(None, "simulate={horizon: 0.1, loop: {plant_segments: 1}}")
    done = wristctl.simulate(study, out=tmp_path)
    assert done.run is not None
    first, *others = tables(done.run)
    assert first["title"] == "Answer" and first["rows"] == [[7]] and len(others) == len(done.tables)
