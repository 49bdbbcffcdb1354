"""An audit over a box of settings has a figure of every claim, draw by draw, for whoever asks."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.commands.audit.command import AUDIT, box_table
from wristctl.commands.inputs import Inputs
from wristctl.comparison.robust import Leaf, Strip, strips_frame
from wristctl.config.audit import Claim
from wristctl.errors import UserError
from wristctl.records import list_runs

STUDY = """
audit:
  claims:
    - {id: own, says: it settles so, evidence: comparison, value: 2.7e-4, controller: smc, gains: exchanged,
       metric: steady_state, unit: rad}
  box:
    draws: 24
    continuous: [2, 1]
    horizon: 2.0
    unknowns:
      loop.control_period: {draw: [1.0e-3, 1.0e-2], why: a board's}
      wrist.tension_limit: {draw: 20..100 log, why: a motor's}
"""


@pytest.mark.slow
def test_each_claim_can_be_drawn_setting_by_setting_with_the_unit_of_what_decides_it(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(STUDY)
    found = wristctl.audit(wristctl.load_study(tmp_path / "own.yaml"), out=tmp_path / "results")
    (run,) = [each for each in list_runs(tmp_path / "results") if each.kind == "audit"]
    (one,) = found.strips
    assert {"box", "strip-own"} <= set(found.figures)
    assert not list((run.path / "figures").glob("strip-*")), "drawn when somebody asks"
    (panel,) = found.figures["strip-own"].axes
    unit = {"loop.control_period": "s", "wrist.tension_limit": "N"}[one.leaves[0].name]
    assert panel.get_xlabel() == f"{one.leaves[0].name} [{unit}]"
    marks = sum(len(np.asarray(line.get_xdata())) for line in panel.lines if line.get_marker() == "o")
    assert marks == len(one.verdicts) > 20


def plan_of(tmp_path: Path, **box: str) -> str:
    settings = {"draws": "8", "continuous": "[2, 1]", "horizon": "2.0", **box}
    text = STUDY
    for name, value in settings.items():
        text = re.sub(rf"{name}: .+", f"{name}: {value}", text)
    (tmp_path / "own.yaml").write_text(text)
    return AUDIT.plan(wristctl.load_study(tmp_path / "own.yaml"), Inputs())


def test_a_plan_counts_the_settings_drawn_with_those_in_nearly_continuous_time(tmp_path: Path) -> None:
    assert "11 settings drawn" in plan_of(tmp_path)


@pytest.mark.parametrize(
    ("within", "beyond"),
    [
        ({"continuous": "[100000, 100000]", "horizon": "40.0"}, {"continuous": "[100000, 100000]", "horizon": "60.0"}),
        ({"continuous": "[100000, 100000]", "horizon": "40.0"}, {"continuous": "[150000, 150000]", "horizon": "40.0"}),
        ({"draws": "1000000", "horizon": "2.0"}, {"draws": "1000000", "horizon": "100000.0"}),
    ],
)
def test_a_box_that_would_run_for_weeks_is_refused_at_once(
    tmp_path: Path, within: dict[str, str], beyond: dict[str, str]
) -> None:
    """In nearly continuous time a second has a million steps; 1e13 steps are too many."""
    plan_of(tmp_path, **within)
    with pytest.raises(UserError, match=r"steps of .* rollouts") as caught:
        plan_of(tmp_path, **beyond)
    assert "audit.box" in caught.value.where and "shorter horizon" in str(caught.value)


def test_the_table_of_shares_has_the_file_s_figures_and_a_second_unknown_only_beside_a_first_that_decides() -> None:
    claim = Claim.model_validate(
        {"id": "A", "says": "", "evidence": "arrival", "controller": "smc", "gains": "printed"}
    )
    verdicts: list[Any] = ["reproduced", "reproduced", "does not hold", None]
    leaves, ratios = [Leaf("limit", 0.5), Leaf("gravity", 0.3)], np.ones(4)
    boxed = [Strip(claim, ratios, verdicts, some, None, told)
             for some, told in ((leaves, "where limit < 50"), (leaves, ""), ([], ""))]  # fmt: skip
    for shown in (boxed, boxed[2:]):
        frame = strips_frame(shown)
        table = box_table(shown, frame)
        assert "of 4 settings" in table.title and "up to 1, are not counted" in table.title
        assert [row[2] for row in table.rows] == frame["reproduced"].tolist() == pytest.approx([2 / 3] * len(shown))
        assert [row[1] for row in table.rows] == [1] * len(shown) and table.columns[2] == "holds in"
    last = [row[-2:] for row in box_table(boxed, strips_frame(boxed)).rows]
    assert last == [("where limit < 50", "gravity"), ("", ""), ("", "")]
