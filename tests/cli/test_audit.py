"""`audit`: every claim of the paper has a verdict, and a run that shows it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from wristctl.benchmark.audit import read_claims
from wristctl.config.errors import UserError
from wristctl.runs import open_run

LEDGER = Path(__file__).parents[2] / "experiments" / "claims.yaml"


def test_ledger_holds_every_table_and_every_gap_of_the_paper() -> None:
    ids = {claim.id for claim in read_claims(LEDGER)}
    gaps = {name.split("-")[0] for name in ids if name.startswith("C")}
    assert gaps == {f"C{k}" for k in range(1, 18)}
    assert sum(name.startswith("T1-") for name in ids) == 28
    assert sum(name.startswith("T2-") for name in ids) == 15
    assert sum(name.startswith("X-") for name in ids) == 9


def test_audit_judges_every_claim_and_cites_a_run_on_each_loop(call, tmp_path: Path) -> None:
    """On the ledger without the rivals, whose rollouts on the exact loop take long."""
    data = yaml.safe_load(LEDGER.read_text())
    data["claims"] = [claim for claim in data["claims"] if claim.get("controller", "smc") == "smc"]
    (tmp_path / "claims.yaml").write_text(yaml.safe_dump(data))
    code, out, _ = call("audit", "--set", "claims=claims.yaml")
    run = open_run("latest:audit")
    table = run.data("claims").set_index("claim")
    assert code == 0 and len(table) == len(data["claims"]) and table["verdict"].notna().all()
    assert table.loc["C5-printed", "verdict"] == "not reproduced"
    assert table.loc["C5-exchanged", "reason"].startswith("holds on exact only")
    assert table.loc["C5-exchanged", "ours_low"] < 2.7e-4 < table.loc["C5-exchanged", "ours_high"]
    shown = json.loads((run.path / "evidence.json").read_text())
    assert set(shown) == {"exact", "sampled", "default"}
    assert all(open_run(each).kind == "compare" and each in out for each in shown.values())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("claims: [{id: A, says: x, evidence: text}, {id: A, says: y, evidence: text}]", "claim A stands there twice"),
        ("claims: [{id: A, says: x, evidnce: text}]", "unknown key 'evidnce'.*claims.yaml:1.*evidence"),
        ("claims: [", "not valid YAML"),
    ],
)
def test_a_broken_ledger_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "claims.yaml").write_text(text)
    with pytest.raises(UserError, match=said):
        read_claims(tmp_path / "claims.yaml")
