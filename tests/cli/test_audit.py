"""`audit`: every claim of the paper has a verdict, and a run that shows it."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest
import yaml

from tests.cli.conftest import Call
from wristctl.comparison.paper import T2, Ends
from wristctl.comparison.verdicts import of_sample
from wristctl.config.audit import VerdictName
from wristctl.records import open_run
from wristctl.study_files.load import load_study

VERDICTS = get_args(VerdictName)
LEDGER = Path(__file__).parents[2] / "experiments" / "claims.yaml"


def test_ledger_holds_every_table_and_every_gap_of_the_paper() -> None:
    ids = {claim.id for claim in load_study([LEDGER]).audit.claims}
    gaps = {name.split("-")[0] for name in ids if name.startswith("C")}
    assert gaps == {f"C{k}" for k in range(1, 18)}
    assert sum(name.startswith("T1-") for name in ids) == 28 + 4 + 1
    assert sum(name.startswith("T2-") for name in ids) == 15 + 1
    assert sum(name.startswith("X-") for name in ids) == 9 + 4
    assert sum(name.startswith("O-") for name in ids) == 3 * math.comb(5, 2) + 3


def test_ledger_orders_the_rows_of_t2_as_it_prints_them_and_judges_no_law_that_is_only_named() -> None:
    claims = load_study([LEDGER]).audit.claims
    assert sum(claim.evidence not in ("settings",) for claim in claims) >= 90
    fields = {"rmse": "rmse", "settling_after": "settling", "steady_state": "steady_state"}
    for claim in claims:
        laws = {claim.controller, (claim.than or "").partition("/")[0]} & set(T2)
        assert bool(claim.unspecified) == bool(laws - {"smc", "pid"}) or claim.id.startswith(("T1-", "X-sym")), claim.id
        if claim.id.startswith("O-") and not claim.id.endswith("-printed"):
            less, more = T2[str(claim.controller)], T2[str(claim.than).split("/")[0]]
            assert getattr(less, fields[str(claim.metric)]) < getattr(more, fields[str(claim.metric)])


@pytest.mark.painted
@pytest.mark.slow
def test_audit_judges_every_claim_on_each_loop_and_draws_one_figure(call: Call, tmp_path: Path) -> None:
    """On the ledger without the rivals, whose rollouts on the exact loop take long."""
    data = yaml.safe_load(LEDGER.read_text())
    claims = [
        claim for claim in data["audit"]["claims"]
        if claim.get("part_of") != "T2-named" and claim["id"] != "T2-named"
    ]  # fmt: skip
    (tmp_path / "claims.yaml").write_text(yaml.safe_dump({"audit": {"claims": claims}}))
    code, _, _ = call("audit", "claims.yaml")
    run = open_run("latest:audit")
    table = run.data("claims").set_index("claim")
    assert code == 0 and len(table) == len(claims)
    assert (table["verdict"].isna() == [claim["evidence"] == "settings" for claim in claims]).all()
    judged = table.to_dict("index")
    trade_off, exchanged, printed = (judged[name] for name in ("C15-trade-off", "C5-exchanged", "C5-printed"))
    assert trade_off["verdict"] == "open" and "--selection" in trade_off["reason"]
    assert printed["exact_verdict"] == "contradicted" and printed["default_verdict"] == "worse than the paper"
    for name in ("C5-printed", "C9", "O-rmse-printed", "O-steady-state-printed"):
        assert judged[name]["verdict"] == "contradicted", "what fails on every loop is one verdict"
    assert exchanged["exact_verdict"] == "reproduced" and exchanged["exact_mark"] == "not physical"
    assert exchanged["exact_low"] < 2.7e-4 < exchanged["exact_high"] and "1.07e+05 N on a step" in exchanged["reason"]
    steady = {law: judged[f"T2-{law}-steady-state"] for law in ("smc", "pid")}
    for law, found in steady.items():
        assert found["sampled_verdict"] == "reproduced" and found["exact_verdict"] == "better than the paper", law
        assert judged[f"T2-{law}-settling"]["sampled_verdict"] == "not specified enough"
    assert judged["X-soft-springs-smc"]["sampled_verdict"] == "does not hold", "what was there before is no gain"
    shown = json.loads((run.path / "evidence.json").read_text())
    assert list(shown)[:3] == ["exact", "sampled", "four-segments"]
    assert all(open_run(each).kind == "compare" for each in shown.values())
    pictures = [each.relative_to(run.path).as_posix() for each in (tmp_path / "results").resolve().rglob("*.png")]
    assert pictures == ["figures/ledger.png"], "one; others are drawn when somebody asks for them"


@pytest.mark.slow
def test_trainings_decide_the_claims_on_networks_and_are_cited(call: Call, tmp_path: Path) -> None:
    """On trainings far too short, whose numbers the verdicts must follow."""
    data = yaml.safe_load(LEDGER.read_text())
    claims = [claim for claim in data["audit"]["claims"] if claim["evidence"] in ("table1", "selection")]
    claims = [claim | {"part_of": ""} for claim in claims if "relu" not in claim["id"]]
    (tmp_path / "claims.yaml").write_text(yaml.safe_dump({"audit": {"claims": claims}}))
    form = "hidden: [4], epochs: 2"
    rows = "".join(
        f"    - {{name: {kind}-{name}, preset: t1-{name}, {form}{more}}}\n"
        for kind, more in (
            ("raw-coupled", ""),
            ("raw-decoupled", ", optimiser: adamw"),
            ("scaled-coupled", ", standardise: true"),
            ("scaled-decoupled", ", optimiser: adamw, standardise: true"),
        )
        for name in ("sigmoid", "tanh")
    )
    (tmp_path / "rows.yaml").write_text(f"gen-data: {{samples: 40}}\ntrain:\n  seeds: 2\n  workers: 1\n  rows:\n{rows}")
    call("train", "rows.yaml")
    table1 = open_run("latest:train")
    grid = "grid={depths: [1, 3], activations: [sigmoid], widths: [4], folds: 2}"
    call("train", "--search", "--epochs", "2", "--set", "workers=1", "--set", grid, "--set", "gen-data.samples=40")
    selection = open_run("latest:train")
    code, _, _ = call("audit", "claims.yaml", "--table1", table1.id, "--selection", selection.id)
    run = open_run("latest:audit")
    table = run.data("claims").set_index("claim")
    assert code == 0 and set(table["verdict"]) <= set(VERDICTS)
    assert json.loads((run.path / "evidence.json").read_text()) == {"table1": table1.id, "selection": selection.id}
    found = table1.metrics["raw-coupled-tanh_median_train_loss"]
    assert found["interval"] is None, "two seeds hold no median"
    loss = table.loc["T1-tanh-training-loss"]
    assert loss["low"] == loss["high"] == found["value"] and loss["shown_by"] == "table1"
    assert loss["verdict"] == "not specified enough" and "on what scale" in loss["reason"]
    ratio = table.loc["T1-tanh-validation-below-training"]
    beside = of_sample(Ends(0.3778, 0.4419), float(str(ratio["low"])), None).verdict
    assert ratio["verdict"] == "not specified enough" and beside.replace("reproduced", "holds") in ratio["reason"]
    depth = selection.metrics["c15_chosen_depth"]["value"]
    assert table.loc["C15-trade-off", "verdict"] == ("reproduced" if depth == 3 else "does not hold")
    assert table.loc["C16-raw-coupled", "verdict"] == "does not hold", "two seeds cannot support it"

    code, _, err = call("audit", "claims.yaml", "--table1", selection.id)
    assert code == 2 and "needs the metric 'raw-coupled-sigmoid_median_gradient_norm'" in err and "table1.yaml" in err

    (tmp_path / "claims.yaml").unlink()
    (tmp_path / "elsewhere").mkdir()
    replay = [sys.executable, "-P", "-m", "wristctl", "runs", "replay", str(run.path.resolve())]
    environment = {**os.environ, "PYTHONPATH": str(LEDGER.parents[1])}
    again = subprocess.run(replay, cwd=tmp_path / "elsewhere", env=environment, capture_output=True, text=True)
    assert again.returncode == 0 and again.stdout.endswith(f"{run.id}: identical\n"), again.stdout + again.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[{id: A, says: x, evidence: settings}, {id: A, says: y, evidence: settings}]", "claim A stands there twice"),
        ("[{id: A, says: x, evidence: text}]", "claim A by text needs verdict"),
        ("[{id: A, says: x, evidence: table1, metric: r2}]", "claim A by table1 needs value"),
        ("[{id: A, says: x, evidence: table1, metric: r2, value: 0}]", "no factor leads to 0"),
        (
            "[{id: A, says: x, evidence: ordering, controller: smc, gains: printed, than: pid, metric: rmse}]",
            "than: is",
        ),
        (
            "[{id: A, says: x, evidence: equation, value: 1, metric: chain_diference}]",
            "did you mean 'chain_difference'",
        ),
        ("[{id: A, says: x, evidnce: text}]", "did you mean 'evidence'"),
        ("[", "not valid YAML"),
        ("[]", "no claims to audit.*experiments/claims.yaml"),
    ],
)
def test_a_broken_ledger_is_refused_and_leaves_no_run(call: Call, tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "claims.yaml").write_text(f"audit:\n  claims: {text}\n")
    code, _, err = call("audit", "claims.yaml")
    assert code == 2 and re.search(said, err) and not (tmp_path / "results").exists()
