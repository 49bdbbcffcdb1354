"""An audit and a comparison say the same of the same gains on the same loops and motions."""

from __future__ import annotations

import pytest

import wristctl
from wristctl.comparison import claims
from wristctl.config.loop import LOOPS

ROWS = ("smc/printed", "smc/exchanged", "pid/printed", "feedforward/default")
CLAIMS = ", ".join(
    f"{{id: A{k}, says: it arrives, evidence: arrival, controller: {law}, gains: {gains}}}"
    for k, (law, gains) in enumerate(label.split("/") for label in ROWS)
)


@pytest.mark.slow
def test_what_arrives_in_an_audit_arrives_in_a_comparison(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the loops at 1 kHz, each judged by its own command; some rows arrive there and some do not."""
    monkeypatch.setattr(claims, "LOOPS", {name: loop for name, loop in LOOPS.items() if name != "exact"})
    audited = wristctl.audit(wristctl.load_study(None, f"audit={{horizon: 3.0, claims: [{CLAIMS}]}}"))
    rows = ", ".join(f"{{controller: {a}, gains: {b}}}" for a, b in (label.split("/") for label in ROWS))
    moves = "[{duration: 1.0}, {duration: 2.0}]"
    loops = "{sampled: {}, four-segments: {}}"
    study = f"compare={{controllers: [{rows}], loops: {loops}, references: {moves}, inverses: [none], "
    compared = wristctl.compare(wristctl.load_study(None, f"{study}horizon: 3.0}}"))
    verdicts = set()
    for judged in audited.judgements:
        assert set(judged.found) == {"sampled", "four-segments"}
        for loop, finding in judged.found.items():
            own = [each for each in compared.rows if (each.label, each.loop) == (judged.claim.label, loop)]
            there = [each.repeated.arrives for each in own]
            assert len(there) == 2
            some = "not specified enough" if any(there) else "does not hold"
            assert finding.verdict == ("reproduced" if all(there) else some)
            verdicts.add(finding.verdict)
    assert {"reproduced", "does not hold"} <= verdicts, "else the rows tell nothing"
