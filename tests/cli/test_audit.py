"""`audit`: every claim of the paper has a verdict, and a run that shows it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.cli.conftest import Call
from wristctl.config.load import load_study
from wristctl.records import open_run

LEDGER = Path(__file__).parents[2] / "experiments" / "claims.yaml"


def test_ledger_holds_every_table_and_every_gap_of_the_paper() -> None:
    ids = {claim.id for claim in load_study([LEDGER]).audit.claims}
    gaps = {name.split("-")[0] for name in ids if name.startswith("C")}
    assert gaps == {f"C{k}" for k in range(1, 18)}
    assert sum(name.startswith("T1-") for name in ids) == 28
    assert sum(name.startswith("T2-") for name in ids) == 15
    assert sum(name.startswith("X-") for name in ids) == 9


def test_audit_judges_every_claim_and_cites_a_run_on_each_loop(call: Call, tmp_path: Path) -> None:
    """On the ledger without the rivals, whose rollouts on the exact loop take long."""
    data = yaml.safe_load(LEDGER.read_text())
    claims = [claim for claim in data["audit"]["claims"] if claim.get("controller", "smc") == "smc"]
    (tmp_path / "claims.yaml").write_text(yaml.safe_dump({"audit": {"claims": claims}}))
    code, out, _ = call("audit", "claims.yaml")
    run = open_run("latest:audit")
    table = run.data("claims").set_index("claim")
    assert code == 0 and len(table) == len(claims) and table["verdict"].notna().all()
    judged = table.to_dict("index")
    trade_off, exchanged = judged["C15-trade-off"], judged["C5-exchanged"]
    assert trade_off["verdict"] == "open" and "--selection" in trade_off["reason"]
    assert judged["C5-printed"]["verdict"] == "not reproduced"
    assert exchanged["reason"].startswith("holds on exact only")
    assert exchanged["ours_low"] < 2.7e-4 < exchanged["ours_high"]
    shown = json.loads((run.path / "evidence.json").read_text())
    assert set(shown) == {"exact", "sampled", "default"}
    assert all(open_run(each).kind == "compare" and each in out for each in shown.values())


def test_trainings_decide_the_claims_on_networks_and_are_cited(call: Call, tmp_path: Path) -> None:
    """On trainings far too short, whose numbers the verdicts must follow."""
    data = yaml.safe_load(LEDGER.read_text())
    claims = [claim for claim in data["audit"]["claims"] if claim["evidence"] in ("table1", "selection")]
    claims = [claim for claim in claims if "relu" not in claim["id"]]
    (tmp_path / "claims.yaml").write_text(yaml.safe_dump({"audit": {"claims": claims}}))
    form = "hidden: [4], epochs: 2"
    rows = "".join(
        f"    - {{name: {kind}-{name}, preset: t1-{name}, {form}{more}}}\n"
        for kind, more in (("printed", ""), ("scaled", ", optimiser: adamw, standardise: true"))
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
    assert code == 0 and set(table["verdict"]) == {"reproduced", "not reproduced"}
    assert json.loads((run.path / "evidence.json").read_text()) == {"table1": table1.id, "selection": selection.id}
    low, high = table1.metrics["printed-tanh_mean_train_loss"]["interval"]
    loss = table.loc["T1-tanh-training-loss"]
    assert (loss["ours_low"], loss["ours_high"]) == (low, high) and loss["shown_by"] == "table1"
    assert (loss["verdict"] == "reproduced") == (low / 1.5 <= 0.22 <= high * 1.5)
    depth = selection.metrics["c15_chosen_depth"]["value"]
    assert table.loc["C15-trade-off", "verdict"] == ("reproduced" if depth == 3 else "not reproduced")
    assert table.loc["C16-printed", "verdict"] == "not reproduced", "two seeds cannot support it"

    code, _, err = call("audit", "claims.yaml", "--table1", selection.id)
    assert code == 2 and "needs the metric 'printed-sigmoid_mean_gradient_norm'" in err and "table1.yaml" in err

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
        ("[{id: A, says: x, evidnce: text}]", "did you mean 'evidence'"),
        ("[", "not valid YAML"),
        ("[]", "no claims to audit.*experiments/claims.yaml"),
    ],
)
def test_a_broken_ledger_is_refused_and_leaves_no_run(call: Call, tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "claims.yaml").write_text(f"audit:\n  claims: {text}\n")
    code, _, err = call("audit", "claims.yaml")
    assert code == 2 and re.search(said, err) and not (tmp_path / "results").exists()
