"""What the study's page says of other motions: each of its statements comes out either way."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import pytest

from tests.documented import DOCS, script_of_docs

# Controllers that share a first group, in the order of their RMSE.
ALIKE = ("adrc", "ct-dob", "lqi", "mpc", "mrac", "nc", "pid-ff")


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(DOCS)
    return script_of_docs("other_motions")


def rows(rmse: Mapping[str, float], first: int, lost: tuple[str, ...] = ()) -> list[dict[str, Any]]:
    """A ranking of controllers with their RMSE [deg], 5 % sure; so many of the first are alike."""
    labels = sorted((label for label in rmse if label not in lost), key=lambda label: rmse[label])
    groups = {label: 1.0 if place < first else 2.0 for place, label in enumerate(labels)}
    return [
        {
            "row": f"{label}/tuned", "group": groups.get(label, math.nan), "rmse": math.radians(value),
            "rmse_low": math.radians(value) / 1.05, "rmse_high": math.radians(value) * 1.05,
        }
        for label, value in rmse.items()
    ]  # fmt: skip


def near(order: tuple[str, ...]) -> dict[str, float]:
    return {label: 0.2 + 0.001 * place for place, label in enumerate(order)}


def section(script: ModuleType, first: list[dict[str, Any]], second: list[dict[str, Any]]) -> str:
    return "\n".join(script.asked_again({"camera": first}, {"camera": second}, "`wristctl compare`"))


def cells(text: str) -> list[str]:
    """The line of the rig in the first table."""
    (line, *_) = re.findall(r"^\| camera \|(.*)\|$", text, re.MULTILINE)
    return [cell.strip() for cell in line.split("|")]


def test_a_ranking_that_comes_out_the_same_agrees_in_all(script: ModuleType) -> None:
    ranking = rows(near(ALIKE) | {"smc": 0.4, "pid": 0.1}, 7, lost=("pid",))
    text = section(script, ranking, ranking)
    assert cells(text) == ["7", "0, 0", "adrc yes, adrc yes", "7, 0, 0", "1, 0"]
    words = " ".join(text.split())
    assert f"in both first groups {', '.join(ALIKE)}; their order comes out again (Kendall's tau 1.00)." in words
    assert "In one alone" not in text


def test_an_order_that_does_not_come_out_again_is_not_to_be_read(script: ModuleType) -> None:
    text = section(script, rows(near(ALIKE), 7), rows(near(ALIKE[::-1]), 7))
    assert "the order within them does not, and is not to be read (Kendall's tau -1.00)" in " ".join(text.split())
    assert cells(text)[:3] == ["7", "0, 0", "adrc yes, pid-ff yes"]


def test_controllers_that_only_one_of_the_two_has_first_are_not_settled(script: ModuleType) -> None:
    text = section(script, rows(near(ALIKE), 3), rows(near(ALIKE[1:] + ALIKE[:1]), 3))
    assert cells(text)[:3] == ["2", "1, 1", "adrc no, ct-dob yes"]
    assert "in both first groups ct-dob, lqi; of so few an order" in text
    assert "In one alone, so not settled: adrc, mpc." in " ".join(text.split())


def test_rankings_that_contradict_each_other_settle_nothing(script: ModuleType) -> None:
    text = section(script, rows({"mpc": 0.1, "pid": 0.2}, 1), rows({"mpc": 0.2, "pid": 0.1}, 1))
    assert "the first groups share no controller (mpc; pid): of this rig nothing is settled." in text
    assert cells(text) == ["0", "1, 1", "mpc no, pid no", "0, 0, 1", "0, 0"]


def test_what_the_second_finds_lost_counts_as_behind_and_is_told(script: ModuleType) -> None:
    text = section(script, rows({"mpc": 0.1, "pid": 0.2}, 1), rows({"mpc": 0.1, "pid": 0.2}, 1, lost=("mpc",)))
    assert cells(text)[2:] == ["mpc no, pid no", "0, 0, 1", "0, 1"]


def test_what_other_motions_confirm_is_what_both_first_groups_have(script: ModuleType) -> None:
    one = {"camera": rows(near(ALIKE), 3), "uneven": rows(near(ALIKE), 2), "ideal": rows(near(ALIKE), 1)}
    other = {"camera": rows(near(ALIKE[1:]), 5), "uneven": rows(near(ALIKE[2:]), 2)}
    first = {
        name: [row["row"] for row in found if row["group"] == 1] for name, found in script.confirmed(one, other).items()
    }
    assert first == {
        "camera": ["ct-dob/tuned", "lqi/tuned"], "uneven": ["adrc/tuned", "ct-dob/tuned"], "ideal": ["adrc/tuned"]
    }  # fmt: skip
    assert script.unsettled(one, other) == {"uneven": "lqi, mpc"}
