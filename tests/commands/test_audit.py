"""The claims with their verdicts, sorted into tables; which runs show them, and what a plan asks for."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, session
from wristctl.commands.audit import command as module
from wristctl.commands.audit.command import AUDIT, Audited
from wristctl.commands.inputs import Inputs
from wristctl.config.loop import LOOPS
from wristctl.errors import UserError
from wristctl.records import Run, list_runs, start_run

LAW = "evidence: comparison, controller: smc, gains: printed, metric: rmse, value: 0.5"
CLAIMS = (
    "audit={horizon: 1.5, claims: ["
    "{id: T, says: a sign is wrong, evidence: text, verdict: contradicted, reason: by hand}, "
    "{id: S, says: a period, evidence: settings, value: 0.005, unit: s, reason: set}, "
    "{id: H, says: a push, evidence: hardware, value: 2.5, metric: rmse, reason: needs a rig}, "
    "{id: C, says: an error, evidence: comparison, controller: smc, gains: printed, metric: rmse, value: 0.5}, "
    "{id: U, says: another, evidence: comparison, controller: lqg, gains: printed, metric: rmse, value: 0.5}, "
    "{id: R, says: a fit, evidence: table1, metric: r2, value: 0.5, unit: '1'}, "
    "{id: P, says: both, evidence: parts}, "
    f"{{id: P1, says: one, part_of: P, {LAW}}}, "
    "{id: P2, says: two, part_of: P, evidence: table1, metric: r2, value: 5.0}, "
    f"{{id: O, says: ours, whose: ours, {LAW}}}, "
    "{id: G, says: another law, whose: group, source: a journal, evidence: text, verdict: open, reason: none here}]}"
)  # fmt: skip
PLAIN = "audit.claims=[{id: T, says: a sign, evidence: text, verdict: contradicted, reason: by hand}]"


class Comparison:
    """On each loop the paper's controller has an RMSE from 0.4 to 0.6."""

    kind = "compare"

    def __init__(self, made: Any) -> None:
        self.run = None if made.findings.run is None else Run(made.findings.run.path)

    def frame(self) -> pd.DataFrame:
        columns = {"controller": "smc", "gains": "printed", "reference": ["step", "1 s", "2 s"]}
        return pd.DataFrame({**columns, "rmse": [9.0, 0.4, 0.6]})


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The sessions of the comparisons that were made."""
    found: list[Any] = []

    def compare(made: Any) -> Comparison:
        found.append(made)
        return Comparison(made)

    monkeypatch.setattr(module, "compare", compare)
    return found


def trials(tmp_path: Path) -> Run:
    """One trial of the paper's law on the emulated rig."""
    row = {"controller": "smc", "gains": "hardware", "outcome": "ok", "push": 0.0, "rmse": 2.5}
    with start_run("hw-run", wristctl.load_study(None), "", tmp_path) as live:
        live.table("data/trials.csv", pd.DataFrame([row]))
    return Run(live.path)


def training(tmp_path: Path, **metrics: float) -> Run:
    with start_run("train", wristctl.load_study(None), "", tmp_path) as live:
        for name, value in metrics.items():
            live.metric(name, value, interval=(0.375, 0.625), n=5)
    return Run(live.path)


def audit(*settings: str, run: Any = None, **inputs: Any) -> Audited:
    return AUDIT.perform(session(wristctl.load_study(None, "seed=9", *settings), run, inputs))


def test_claims_are_listed_with_what_was_found_and_counted_by_verdict(tmp_path: Path, asked: list[Any]) -> None:
    table1 = training(tmp_path, r2=0.5)
    done = audit(CLAIMS, table1=table1)
    tables = {each.title: each for each in done.tables}
    rolled, others = tables["Claims of the paper that rollouts decide"], tables["Other claims of the paper"]
    parts = [part for loop in LOOPS for part in (f"ours, {loop}", f"verdict, {loop}")]
    assert rolled.columns == ("claim", "says", "paper", "unit", "verdict", *parts)
    within = ["0.4 to 0.6", "reproduced"] * len(LOOPS)
    assert rolled.rows[0] == ("C", "an error", "0.5", "", "reproduced", *within)
    assert [row[0] for row in rolled.rows] == ["C", "P"]
    assert others.columns == ("claim", "says", "paper", "unit", "ours", "verdict", "shown by")
    assert others.rows == [
        ("T", "a sign is wrong", "", "", "", "contradicted", ""),
        ("H", "a push", "2.5", "", "", "open", ""),
        ("U", "another", "0.5", "", "", "open", ""),
        ("R", "a fit", "0.5", "1", "0.38 to 0.62", "reproduced", "table1"),
    ]
    assert [row[0] for row in tables["Details that rollouts decide"].rows] == ["P1"]
    assert [(row[0], row[5]) for row in tables["Other details"].rows] == [("P2", "better than the paper")]
    checks = tables["Our own checks that rollouts decide"]
    assert checks.rows == [("O", "ours", "0.5", "", "holds", *(["0.4 to 0.6", "holds"] * len(LOOPS)))], (
        "what we wrote is not reproduced"
    )
    assert tables["What the paper's authors say elsewhere"].rows == [
        ("G", "another law", "", "", "", "open", "", "a journal")
    ]
    assert tables["Settings taken over as printed"].rows == [("S", "a period", "0.005", "s")]
    why, still = tables["Why"], tables["Still open"]
    assert why.columns == ("claim", "verdict", "reason")
    assert {("T", "contradicted", "by hand")} <= set(why.rows)
    assert still.columns == ("claim", "what would decide it")
    assert still.rows == [
        ("H", "needs a rig; needs --hardware with a run of `wristctl hw-run`"), ("U", "no controller 'lqg' to run"),
        ("G", "none here"),
    ]  # fmt: skip
    counts = {"contradicted": 1, "not specified enough": 1, "open": 2, "reproduced": 2}
    assert tables["Verdicts on the claims of the paper"].rows == list(counts.items()), "P is one, and O none of them"
    evidence = tables["Runs that show it"]
    assert evidence.columns == ("shown by", "run")
    assert evidence.rows == [*((loop, "in memory") for loop in LOOPS), ("table1", table1.id)]
    assert done.metrics == {name.replace(" ", "_"): count for name, count in counts.items()}
    assert known_of(done.findings, "reproduced") == [("", "", 6)], "a setting is no claim"
    assert list(done.comparisons) == list(LOOPS)
    frame = done.frame().set_index("claim")
    assert (frame.loc["C", "exact_low"], frame.loc["C", "exact_high"]) == (0.4, 0.6)
    assert (frame.loc["O", "whose"], frame.loc["P1", "part_of"], frame.loc["G", "whose"]) == ("ours", "P", "group")


def test_trials_judge_the_experiment_and_say_that_the_rig_was_emulated(tmp_path: Path, asked: list[Any]) -> None:
    done = audit(CLAIMS, hardware=trials(tmp_path))
    (found,) = [j for j in done.judgements if j.claim.id == "H"]
    assert found.verdict == "reproduced" and found.found[""].mark == "emulated"
    assert found.reason == "needs a rig; mean of 1 trials of smc/hardware on an emulated rig"


def test_each_loop_is_compared_once_with_what_claims_ask_for(asked: list[Any]) -> None:
    audit(CLAIMS)
    assert [list(each.study.compare.loops) for each in asked] == [[loop] for loop in LOOPS]
    for each in asked:
        assert [(row.controller, row.gains) for row in each.study.compare.rows] == [("smc", "printed")]
        assert each.study.compare.horizon == 1.5 and each.findings.run is None and not each.inputs
    first, second, *_ = asked
    assert first.findings is not second.findings and first.findings.stream("a") == session(first.study).findings.stream(
        "a"
    )


def test_where_no_claim_asks_for_a_comparison_none_is_made(asked: list[Any]) -> None:
    done = audit(PLAIN)
    assert not asked and done.comparisons == {} and math.isnan(done.frame()["low"][0])


def test_comparisons_of_a_recorded_audit_are_runs_beside_it(tmp_path: Path, asked: list[Any]) -> None:
    with start_run("audit", wristctl.load_study(None), "", tmp_path) as live:
        done = audit(CLAIMS, run=live)
    run = Run(live.path)
    beside = [each for each in list_runs(tmp_path) if each.kind == "compare"]
    assert sorted(each.manifest.label for each in beside) == sorted(f"audit-{loop}" for loop in LOOPS)
    assert {each.config.compare.horizon for each in beside} == {1.5}
    shown = json.loads(run.file("evidence.json").read_text())
    assert shown == {loop: each.run.id for loop, each in done.comparisons.items() if each.run is not None}
    assert len(shown) == len(LOOPS)
    hashed = {each.path: each.volatile for each in run.manifest.outputs}
    assert hashed["evidence.json"] and not hashed["data/claims.csv"]
    assert columns_of(run, "data/claims.csv")["paper"] == ("", "the paper's value")


def test_a_plan_says_which_trainings_are_there(tmp_path: Path) -> None:
    study = wristctl.load_study(None, CLAIMS)
    begin = "11 claims; 3 comparisons on the built-in loops\nhardware: open, for want of a run"
    assert AUDIT.plan(study, Inputs()) == f"{begin}\ntable1: open, for want of a run"
    run = training(tmp_path, r2=0.5)
    assert AUDIT.plan(study, Inputs({"table1": run})) == f"{begin}\ntable1: {run.id}"
    with pytest.raises(UserError, match="no claims to audit"):
        AUDIT.plan(wristctl.load_study(None), Inputs())
    lacking = training(tmp_path, rmse=0.5)
    with pytest.raises(UserError) as caught:
        AUDIT.plan(study, Inputs({"table1": lacking}))
    assert caught.value.what == "claim R needs the metric 'r2', which this run does not have"
    assert caught.value.where == str(lacking.path)
    assert caught.value.fix == "give --table1 a run of `wristctl train experiments/table1.yaml`"
    assert [(need.leaf, need.kind, need.optional) for need in AUDIT.needs] == [
        ("table1", "train", True), ("selection", "train", True), ("hardware", "hw-run", True),
    ]  # fmt: skip
