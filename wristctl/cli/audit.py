"""`wristctl audit`: the paper's claims, one by one."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.comparison.ledger import Judgement


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What will be run; no claims, or a train run that cannot show them, are errors here."""
    from wristctl.comparison.ledger import TRAININGS, check_trainings
    from wristctl.config.loop import LOOPS

    claims = study.audit.claims
    if not claims:
        raise UserError("no claims to audit", "audit.claims", "wristctl audit experiments/claims.yaml")
    check_trainings(claims, inputs)
    asked = dict.fromkeys(claim.evidence for claim in claims if claim.evidence in TRAININGS)
    shown = [f"{name}: {inputs[name].id if name in inputs else 'open, for want of a run'}" for name in asked]
    return "\n".join([f"{len(claims)} claims; one comparison on each of the loops {', '.join(LOOPS)}", *shown])


def audit(session: Session) -> list[Table]:
    """Judge every claim of the paper by rollouts, its own words, or what is still open."""
    from wristctl.cli.compare import compare
    from wristctl.comparison.ledger import evidence_study, judge, ledger_frame
    from wristctl.config.loop import LOOPS
    from wristctl.control.table import CONTROLLERS
    from wristctl.records import open_run, start_run

    run, claims = session.run, session.settings.claims
    known = [claim for claim in claims if claim.controller is None or claim.controller in CONTROLLERS]
    shown_by = {}
    for loop in LOOPS if any(claim.evidence == "comparison" for claim in claims) else ():
        study = evidence_study(session.study, known, loop)
        with start_run("compare", study, f"audit-{loop}", run.path.parent, ["wristctl", "audit"], []) as evidence:
            compare(replace(session, study=study, settings=study.compare, inputs={}, run=evidence))
        shown_by[loop] = evidence.id
    found = {loop: open_run(run.path.parent / each).data("comparison") for loop, each in shown_by.items()}
    judged = [judge(claim, found, session.inputs) for claim in claims]
    shown_by |= {name: each.id for name, each in session.inputs.items()}

    units = {"paper": "", "ours_low": "", "ours_high": ""}
    meaning = {"paper": "the paper's value", "ours_low": "least of ours", "ours_high": "largest of ours"}
    run.table("data/claims.csv", ledger_frame(judged), units, meaning)
    run.file("evidence.json").write_text(json.dumps(shown_by, indent=2) + "\n")
    run.volatile("evidence.json")
    for verdict, count in sorted(Counter(j.verdict for j in judged).items()):
        run.metric(verdict.replace(" ", "_"), count, n=len(judged), meaning=f"claims that are {verdict}")
    return [*_tables(judged), Table("Runs that show it", ("shown by", "run"), list(shown_by.items()))]


def _tables(judged: Sequence[Judgement]) -> list[Table]:
    """The claims, then why each verdict that is not a setting taken over, then how many there are of each."""
    claims = [
        (j.claim.id, j.claim.says, _number(j.claim.value), _ours(j.low, j.high), j.claim.unit, j.verdict, *_shown(j))
        for j in judged
    ]
    why = [(j.claim.id, j.verdict, j.reason) for j in judged if j.verdict not in ("taken over", "open")]
    open_ = [(j.claim.id, j.reason) for j in judged if j.verdict == "open"]
    counts = sorted(Counter(j.verdict for j in judged).items())
    heads = ("claim", "the paper says", "paper", "ours", "unit", "verdict", "shown by")
    return [
        Table("The paper's claims", heads, claims),
        Table("Why", ("claim", "verdict", "reason"), why),
        Table("Still open", ("claim", "what would decide it"), open_),
        Table("Verdicts", ("verdict", "claims"), counts),
    ]


def _shown(judgement: Judgement) -> tuple[str]:
    return (", ".join(judgement.shown_by),)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


def _ours(low: float, high: float) -> str:
    from wristctl.comparison.ledger import interval

    return "" if low != low else interval(low, high)


app = study_command(
    "audit",
    work=audit,
    plan=plan,
    inputs=(EarlierRun("table1", kind="train", optional=True), EarlierRun("selection", kind="train", optional=True)),
    examples=(
        "wristctl audit experiments/claims.yaml",
        "wristctl audit experiments/claims.yaml --table1 RUN --selection RUN",
    ),
)
