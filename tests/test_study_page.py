"""The page of the study says what its rankings say: what to run, what is as good, and what must not be used."""

from __future__ import annotations

import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.documented import DOCS, script_of_docs

PAGE = Path(__file__).parents[1] / "docs" / "study.md"


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS)  # where what it shares with the second study's section lies
    return script_of_docs("study")


def row(label: str, group: float, rmse: float, chattering: float, swings: float = 0.0) -> dict[str, Any]:
    """A row of a ranking with an RMSE [deg]."""
    angle = math.radians(rmse)
    return {
        "row": label, "group": group, "rmse": angle, "rmse_low": 0.9 * angle, "rmse_high": 1.1 * angle,
        "times_better": 2000.0, "times_better_low": 1.0, "times_better_high": 3.0, "failures": 0.0, "swings": swings,
        "chattering": chattering,
    }  # fmt: skip


ROWS = [row("mpc/tuned", 1, 0.1, 9.0), row("ct-dob/tuned", 1, 0.11, 3.0), row("lqi/tuned", 2, 0.2, 1.0),
        row("smc/exchanged", math.nan, 0.05, 1.0, 0.5)]  # fmt: skip


def test_a_rigs_line_has_the_lowest_error_of_what_may_be_used_what_is_as_good_and_what_comes_next(
    script: ModuleType,
) -> None:
    lines = script.decision(
        {"camera": ROWS, "hard": [row("pid/tuned", math.nan, 0.1, 1.0, 0.5)]}, {"camera": "31 of 50, 2 of 5"}
    )[2:]
    assert (
        lines[0]
        == "| camera | **mpc/tuned** | 0.1 [0.09, 0.11] | 31 of 50, 2 of 5 | ct-dob | lqi 0.2 | 2,000 | 1 of 4 |"
    )
    assert lines[1] == "| hard | none | - | - | - | - | - | 1 of 1 |"


def test_what_has_no_group_must_not_be_used_however_small_its_error(script: ModuleType) -> None:
    assert script.unusable({"camera": ROWS}) == ["- camera: smc/exchanged 50 %"]
    assert script.ranking(ROWS)[-1].startswith("| - | smc/exchanged | 0.05")


def test_an_effect_whose_interval_holds_one_stands_in_parentheses(script: ModuleType) -> None:
    terms = [
        {
            "term": "an integral",
            "family": "camera",
            "without": "pd-ff/tuned",
            "with": "pid/printed",
            "times": 1.284,
            "low": 1.21,
            "high": 1.35,
        },
        {
            "term": "an integral",
            "family": "steps",
            "without": "pd-ff/tuned",
            "with": "pid/printed",
            "times": 0.998,
            "low": 0.99,
            "high": 1.01,
        },
    ]
    assert script.bought(terms, ["camera", "steps"])[-1] == (
        "| an integral: pd-ff to pid/printed | 1.28 [1.21, 1.35] | (0.998 [0.99, 1.01]) |"
    )


@pytest.mark.parametrize("rig", ["camera", "handling", "uneven", "ideal", "ideal, steps", "steps"])
def test_the_first_screen_of_the_page_agrees_with_its_tables(rig: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    (advised,) = re.findall(rf"^\| {rig} \| \*\*(\S+)\*\* \| (\S+) \[", text, re.MULTILINE)
    table = text.partition(f"\n## {rig}\n")[2].partition("\n## ")[0]
    first = [line.split(" | ") for line in table.splitlines() if line.startswith("| 1 |")]
    assert (first[0][1], first[0][2].split()[0]) == advised
