"""The paper's claims, one by one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from wristctl.config.audit import Claim
from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.config.wording import Argument, Call
from wristctl.records import LiveRun, Run, start_run
from wristctl.report.printed_table import Table
from wristctl.studies.compare import Compared, compare
from wristctl.studies.findings import Findings
from wristctl.studies.inputs import EarlierRun, Given, Inputs
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.comparison.ledger import Judgement, Metrics


@dataclass(frozen=True, repr=False, eq=False)
class Audited(StudyResult):
    """Every claim of the paper with its verdict, and the comparisons that show it."""

    kind = "audit"

    judgements: list[Judgement]
    comparisons: dict[str, Compared]
    """by loop"""

    def frame(self) -> pd.DataFrame:
        """One row per claim: the paper's value, the range of ours, verdict and reason."""
        from wristctl.comparison.ledger import ledger_frame

        return ledger_frame(self.judgements)


def plan(study: Study, inputs: Inputs) -> str:
    """What will be run; no claims, or a train run that cannot show them, are errors here."""
    from wristctl.comparison.ledger import TRAININGS
    from wristctl.config.loop import LOOPS

    claims = study.audit.claims
    if not claims:
        raise UserError("no claims to audit", "audit.claims", Call("audit", "experiments/claims.yaml"))
    _check_trainings(claims, inputs)
    asked = dict.fromkeys(claim.evidence for claim in claims if claim.evidence in TRAININGS)
    shown = [f"{name}: {_name(inputs[name]) if name in inputs else 'open, for want of a run'}" for name in asked]
    return "\n".join([f"{len(claims)} claims; one comparison on each of the loops {', '.join(LOOPS)}", *shown])


def audit(session: Session) -> Audited:
    """Judge every claim of the paper by rollouts, its own words, or what is still open."""
    from wristctl.comparison.ledger import evidence_study, judge, ledger_frame
    from wristctl.config.loop import LOOPS
    from wristctl.control.table import CONTROLLERS

    findings, inputs, claims = session.findings, session.inputs, session.study.audit.claims
    known = [claim for claim in claims if claim.controller is None or claim.controller in CONTROLLERS]
    compared = {}
    for loop in LOOPS if any(claim.evidence == "comparison" for claim in claims) else ():
        compared[loop] = _evidence(session, evidence_study(session.study, known, loop), f"audit-{loop}")
    tables = {loop: each.frame() for loop, each in compared.items()}
    trainings = {role: found for role in inputs if (found := inputs.read(role, _metrics)) is not None}
    judged = [judge(claim, tables, trainings) for claim in claims]
    shown_by = {name: _name(each) for name, each in (*compared.items(), *inputs.items())}

    units = {"paper": "", "ours_low": "", "ours_high": ""}
    meaning = {"paper": "the paper's value", "ours_low": "least of ours", "ours_high": "largest of ours"}
    findings.table("data/claims.csv", ledger_frame(judged), units, meaning)
    findings.plain("evidence.json", shown_by, volatile=True)
    for verdict, count in sorted(Counter(j.verdict for j in judged).items()):
        findings.metric(verdict.replace(" ", "_"), count, n=len(judged), meaning=f"claims that are {verdict}")
    evidence = Table("Runs that show it", ("shown by", "run"), list(shown_by.items()))
    return Audited(session.study, findings, [*_tables(judged), evidence], judged, compared)


def _check_trainings(claims: Sequence[Claim], inputs: Inputs) -> None:
    """UserError where a training lacks a metric that a claim asks for."""
    from wristctl.comparison.ledger import TRAININGS

    for claim in claims:
        metrics = inputs.read(claim.evidence, _metrics)
        if metrics is not None and claim.metric not in metrics:
            run = inputs.runs().get(claim.evidence)
            give = Argument(claim.evidence, metavar="")
            raise UserError(
                f"claim {claim.id} needs the metric '{claim.metric}', which this run does not have",
                str(run.path) if run else claim.evidence,
                ("give ", give, " a run of `", Call("train", TRAININGS[claim.evidence]), "`"),
            )


def _evidence(session: Session, study: Study, label: str) -> Compared:
    """The comparison of a study, in a run directory of its own beside that of the audit."""

    def compared(run: LiveRun | None) -> Compared:
        return compare(replace(session, study=study, inputs=Inputs(), findings=Findings(study.seed, run, draws=False)))

    if session.findings.run is None:
        return compared(None)
    with start_run("compare", study, label, session.findings.run.path.parent, ["wristctl", "audit"], []) as run:
        return compared(run)


def _metrics(given: Given) -> Metrics:
    return given.metrics if isinstance(given, Run) else given.findings.metrics


def _name(given: Given) -> str:
    run = given if isinstance(given, Run) else given.run
    return run.id if run else "in memory"


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


AUDIT = Procedure(
    "audit",
    plan,
    audit,
    (EarlierRun("table1", kind="train", optional=True), EarlierRun("selection", kind="train", optional=True)),
)
