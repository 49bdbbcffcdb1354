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
    tunings = {
        ("camera", "mpc/tuned"): (math.radians(0.09), math.radians(0.12)),
        ("camera", "ct-dob/tuned"): (0.1, 0.2),
    }
    lines = script.decision({"camera": ROWS, "hard": [row("pid/tuned", math.nan, 0.1, 1.0, 0.5)]}, tunings)[2:]
    assert lines[0] == "| camera | **mpc** | 0.1 [0.09, 0.11] | 0.09 to 0.12 | ct-dob | lqi 0.2 | 2,000 | 1 of 4 |"
    assert lines[1] == "| hard | none | - | - | - | - | - | 1 of 1 |"


def test_of_one_tuning_each_those_whose_tunings_overlap_the_lowests_are_not_told_from_it(script: ModuleType) -> None:
    ends = {
        "mpc": (0.09, 0.19),
        "ct-dob": (0.1, 0.12),
        "lqi": (0.18, 0.3),
        "smc": (0.05, 0.3),
        "pid": (0.2, 0.3),
        "nc": (0.01, 0.08),
    }
    tunings = {("camera", f"{name}/tuned"): (math.radians(a), math.radians(b)) for name, (a, b) in ends.items()}
    ranked = [
        *ROWS,
        row("pid/tuned", 3, 0.25, 1.0),
        row("nc/tuned", 2, 0.2, 1.0),
        row("smc/tuned", math.nan, 0.1, 1.0, 0.5),
    ]
    found = {each["row"]: each["group"] for each in script.by_tunings(ranked, tunings)}
    assert [label for label, number in found.items() if number == 1] == ["mpc/tuned", "ct-dob/tuned", "lqi/tuned"]
    assert found["pid/tuned"] == 3 and found["nc/tuned"] == 2 and math.isnan(found["smc/tuned"])
    assert script.by_tunings(ROWS, {}) == ROWS


def test_what_has_no_group_must_not_be_used_however_small_its_error(script: ModuleType) -> None:
    assert script.unusable({"camera": ROWS}) == ["- camera: smc/exchanged 50 %"]
    assert script.ranking(ROWS)[-1].startswith("| - | smc/exchanged | 0.05")


def term(times: float, low: float, high: float, with_term: str = "mpc/tuned") -> dict[str, Any]:
    """A line of the values of terms, on one rig."""
    return {
        "term": "prediction", "family": "camera", "without": "lqi/tuned", "with": with_term, "times": times, "low": low,
        "high": high,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        (term(1.284, 1.21, 1.35), "1.28 [1.21, 1.35]"),
        (term(0.8, 0.5, 0.96), "1.25 times more [1.04, 2]"),
        (term(0.998, 0.99, 1.01), "none shown: 0.998 [0.99, 1.01]"),
        (term(1.2, 0.5, 4.0), "unknown: 1.2 [0.5, 4]"),
        (term(1.2, 0.0, math.inf), "unknown: 1.2"),
        (term(1.004, 1.0004, 1.008), "1.004 [1.0004, 1.01]"),
        (term(1.3, 1.2, 1.4, "pid/tuned"), "1.3 [1.2, 1.4] *"),
        (term(1.3, 1.2, 1.4, "smc/exchanged"), "lost"),
    ],
)
def test_the_value_of_a_term_says_whether_it_is_shown_and_whether_its_controller_may_be_used(
    script: ModuleType, value: dict[str, Any], cell: str
) -> None:
    rows = [*ROWS[:-1], row("smc/exchanged", math.nan, 0.05, 1.0, 0.7), row("pid/tuned", math.nan, 0.3, 1.0, 0.05)]
    assert script.bought([value], {"camera": rows})[-1].split(" | ")[-1] == f"{cell} |"


def test_what_to_use_says_what_is_lower_somewhere_and_what_is_as_little_distinguished(script: ModuleType) -> None:
    other = [row("ct-dob/tuned", 1, 0.3, 1.0, 0.01), row("mpc/tuned", 1, 0.4, 1.0)]
    text = " ".join(script.use({"camera": ROWS, "uneven": other}, "Rigs").split())
    assert "use ct-dob: RMSE 0.11 [0.099, 0.121] deg in camera (there mpc has 0.1) and 0.3 [0.27, 0.33] deg in" in text
    assert (
        "On each of these none is shown to be better than mpc either" in text
        and "lqi" not in text
        and "1 % of the worlds of uneven" in text
    )
    unlike = [row("mpc/tuned", 1, 1.0, 1.0), row("nc/tuned", 1, 2.0, 1.0)]
    assert "Too uncertain to be told from it: nc (2 [1.8, 2.2])" in " ".join(
        script.use({"steps": unlike}, "Steps").split()
    )
    assert "have lqi in steps" in " ".join(script.use({"steps": unlike}, "Steps", {"steps": "lqi"}).split())
    assert "not settled" not in script.use({"steps": unlike}, "Steps", {"ideal": "lqi"})
    assert "none may be used" in script.use({"camera": ROWS[-1:]}, "Rigs")


@pytest.mark.parametrize("rig", ["camera", "handling", "uneven", "ideal", "ideal (steps)", "steps"])
def test_the_first_screen_of_the_page_agrees_with_its_tables(rig: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    (advised,) = re.findall(rf"^\| {re.escape(rig)} \| \*\*(\S+)\*\* \| (\S+) \[", text, re.MULTILINE)
    table = text.partition(f"\n## {rig}\n")[2].partition("\n## ")[0]
    first = [line.split(" | ") for line in table.splitlines() if line.startswith("| 1 |")]
    assert (first[0][1], first[0][2].split()[0]) == advised
