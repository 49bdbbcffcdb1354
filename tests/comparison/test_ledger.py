"""Claims of the paper judged by hand-made evidence: where each verdict begins and ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from wristctl.comparison.ledger import Judgement, evidence_study, interval, judge, ledger_frame
from wristctl.config.audit import Claim
from wristctl.config.load import load_study

HAIR = 1e-9


def claim(value: float | None = 2.0, metric: str = "rmse", **more: Any) -> Claim:
    given = {"id": "T", "says": "so", "evidence": "comparison", "controller": "smc", "gains": "printed", "unit": "rad"}
    return Claim.model_validate(given | {"value": value, "metric": metric} | more)


def moves(one: float, other: float, metric: str = "rmse") -> pd.DataFrame:
    """What compare found on one loop, beside a step, other gains and another controller that must not count."""
    rows = [
        ("smc", "printed", "minimum jerk 1 s 30 deg", one),
        ("smc", "printed", "minimum jerk 2 s 30 deg", other),
        ("smc", "printed", "step 30 deg", 2e3),
        ("smc", "exchanged", "minimum jerk 1 s 30 deg", 3e3),
        ("pid", "printed", "minimum jerk 1 s 30 deg", 1e-4),
    ]
    return pd.DataFrame(rows, columns=["controller", "gains", "reference", metric])


def said(asked: Claim, one: float, other: float) -> str:
    return judge(asked, {"exact": moves(one, other, str(asked.metric))}, {}).verdict


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        (1.0, 5.0, "reproduced"),  # the paper's 2 lies between the two moves
        (5.0, 1.0, "reproduced"),  # whichever of them is the larger
        (2.0, 9.0, "reproduced"),
        (0.5, 2.0, "reproduced"),
        (0.1, 2.0 / 1.5 * (1.0 + HAIR), "reproduced"),  # one of them is within a factor of 1.5
        (0.1, 2.0 / 1.5 * (1.0 - HAIR), "not reproduced"),
        (3.0 * (1.0 - HAIR), 99.0, "reproduced"),
        (3.0 * (1.0 + HAIR), 99.0, "not reproduced"),
        (0.1, 0.2, "not reproduced"),
        (1.0, np.nan, "reproduced"),  # never is above everything
        (3.1, np.nan, "not reproduced"),
        (np.nan, np.nan, "not reproduced"),
    ],
)
def test_a_number_is_reproduced_between_two_moves_or_within_a_factor_of_one(
    one: float, other: float, verdict: str
) -> None:
    assert said(claim(2.0), one, other) == verdict


def test_a_steady_state_error_is_reproduced_where_neither_move_is_above_the_factor() -> None:
    asked = claim(0.2, "steady_state")
    assert said(asked, 0.0, 0.3 * (1.0 - HAIR)) == "reproduced"
    assert said(asked, 0.1, 0.3 * (1.0 + HAIR)) == "not reproduced"


def test_a_claim_of_nothing_is_reproduced_below_a_millionth() -> None:
    for metric in ("rmse", "steady_state", "overshoot"):
        assert said(claim(0.0, metric), 0.0, 0.99e-6) == "reproduced"
        assert said(claim(0.0, metric), 0.0, 1e-6) == "not reproduced"


def test_a_claim_must_hold_on_every_loop_and_the_reason_says_on_which_it_does() -> None:
    holds, fails = moves(1.0, 5.0), moves(10.0, np.nan)
    both = judge(claim(reason="C5"), {"exact": holds, "sampled": holds}, {})
    assert (both.verdict, both.shown_by) == ("reproduced", ("exact", "sampled"))
    assert both.reason == "C5; exact 1 to 5, sampled 1 to 5"
    one = judge(claim(reason="C5"), {"sampled": fails, "exact": holds, "default": holds}, {})
    assert one.verdict == "not reproduced" and (one.low, one.high) == (1.0, 5.0)
    assert one.reason == "holds on exact and default only; C5; sampled 10 to never, exact 1 to 5, default 1 to 5"
    none = judge(claim(), {"sampled": fails, "exact": moves(20.0, 30.0)}, {})
    assert none.verdict == "not reproduced" and none.reason == "sampled 10 to never, exact 20 to 30"
    assert (none.low, none.high) == (10.0, np.inf), "where none holds, the first loop's range is shown"


def test_what_was_not_run_is_open() -> None:
    stranger = judge(claim(controller="lqr"), {"exact": moves(1.0, 2.0)}, {})
    assert stranger.verdict == "open" and stranger.reason == "no controller 'lqr' to run" and stranger.shown_by == ()
    assert stranger.claim.controller == "lqr" and np.isnan([stranger.low, stranger.high]).all()
    some = judge(claim(), {"exact": moves(1.0, 2.0), "other": moves(1.0, 2.0).iloc[2:]}, {})
    assert (some.verdict, some.shown_by) == ("reproduced", ("exact",)), "a loop without the row says nothing"
    for evidence, experiment in (("table1", "table1"), ("selection", "model_selection")):
        missing = judge(claim(evidence=evidence), {"exact": moves(2.0, 2.0)}, {})
        assert missing.verdict == "open" and np.isnan([missing.low, missing.high]).all()
        assert f"needs --{evidence} " in missing.reason and f"experiments/{experiment}.yaml" in missing.reason


def test_texts_settings_and_hardware_are_judged_by_what_they_are() -> None:
    for evidence, verdict in (("text", "contradictory"), ("settings", "taken over"), ("hardware", "open")):
        found = judge(claim(evidence=evidence, reason="why", verdict="contradictory"), {"exact": moves(2.0, 2.0)}, {})
        assert (found.verdict, found.reason, found.shown_by) == (verdict, "why", ())
        assert np.isnan([found.low, found.high]).all()


def trained(asked: Claim, **found: Any) -> Judgement:
    return judge(asked, {}, {"table1": {"rmse": {"value": 1.0} | found, "accuracy": {"value": 7.0}}})


def test_a_training_reproduces_what_lies_within_a_factor_of_its_interval() -> None:
    for value, verdict in (
        (1.0, "reproduced"),
        (6.0, "reproduced"),
        (0.99, "not reproduced"),
        (6.01, "not reproduced"),
    ):
        found = trained(claim(value, evidence="table1"), value=2.0, interval=[1.5, 4.0], n=10)
        assert found.verdict == verdict and (found.low, found.high) == (1.5, 4.0)
        assert found.reason == "rmse is 2 (n = 10)" and found.shown_by == ("table1",)
    alone = trained(claim(1.5, evidence="table1", reason="C8"), value=1.0, interval=None)
    assert alone.verdict == "reproduced" and (alone.low, alone.high) == (1.0, 1.0)
    assert alone.reason == "C8; rmse is 1"


def test_an_exact_claim_is_reproduced_by_its_own_value_only() -> None:
    for value, verdict in ((1.5, "reproduced"), (4.0, "reproduced"), (1.4, "not reproduced"), (4.1, "not reproduced")):
        assert trained(claim(value, evidence="table1", exact=True), interval=[1.5, 4.0]).verdict == verdict


def test_a_training_without_the_number_does_not_reproduce_it() -> None:
    found = trained(claim(1.0, evidence="table1"), value=None)
    assert found.verdict == "not reproduced" and np.isnan(found.low)


def test_a_range_is_told_in_two_digits_and_never_in_words() -> None:
    assert interval(0.12345, 0.56789) == "0.12 to 0.57" and interval(0.1231, 0.1229) == "0.12"
    assert interval(1.0, np.inf) == "1 to never" and interval(np.inf, np.inf) == "never"


def test_the_evidence_is_what_the_claims_need_on_one_loop_and_no_more() -> None:
    study = load_study([], ["horizon=3.5"], "audit")
    claims = [claim(), claim(metric="settling"), claim(controller="pid"), claim(gains="exchanged")]
    claims.append(claim(evidence="table1", controller="mrac"))
    asked = evidence_study(study, claims, "sampled").compare
    assert [row.label for row in asked.rows] == ["smc/printed", "pid/printed", "smc/exchanged"]
    assert list(asked.loops) == ["sampled"] and asked.loops["sampled"] == study.compare.loops["sampled"]
    assert asked.horizon == 3.5 and asked.inverses == ("none",)
    assert [(each.kind, each.duration) for each in asked.references[1:]] == [
        ("minimum-jerk", 1.0),
        ("minimum-jerk", 2.0),
    ]
    assert asked.references[0].kind == "step"


def test_the_ledgers_table_has_a_line_a_claim_with_both_numbers() -> None:
    judged = [judge(claim(), {"exact": moves(1.0, 5.0), "sampled": moves(1.0, 4.0)}, {})]
    judged.append(judge(claim(None, evidence="text", verdict="open", reason="why"), {}, {}))
    one, other = ledger_frame(judged).to_dict("records")
    assert one == {
        "claim": "T", "says": "so", "paper": 2.0, "ours_low": 1.0, "ours_high": 5.0, "unit": "rad",
        "verdict": "reproduced", "shown_by": "exact, sampled", "reason": "exact 1 to 5, sampled 1 to 4",
    }  # fmt: skip
    assert np.isnan(other["paper"]) and other["verdict"] == "open" and other["shown_by"] == ""
