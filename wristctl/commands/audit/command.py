"""The paper's claims, one by one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.compare.command import Compared, compare
from wristctl.commands.inputs import EarlierRun, Given, Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure
from wristctl.commands.quantities import Quantity, documented, table_of
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.config.audit import Claim
from wristctl.config.loop import LOOPS
from wristctl.config.study import Study
from wristctl.errors import Argument, Call, UserError, meant, under
from wristctl.records import LiveRun, Run, start_run

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.comparison.claims import Judgement, Metrics, TrialsDone
    from wristctl.comparison.robust import Strip


@dataclass(frozen=True, repr=False, eq=False)
class Audited(StudyResult):
    """Every claim of the paper with its verdict, and the comparisons that show it."""

    kind = "audit"

    judgements: list[Judgement]
    comparisons: dict[str, Compared]
    """Comparisons by loop."""
    strips: list[Strip]
    """Verdicts of each claim over the box of unknowns; empty where the study names no box."""

    @property
    def answer(self) -> Answer:
        """What of the paper holds, for one screen."""
        from wristctl.commands.audit.answer import answer_of

        return answer_of(self.judgements, self.strips, self.study.wrist.tension_limit, self.place)

    def frame(self) -> pd.DataFrame:
        """One row per claim: the paper's value, verdict and reason, and on each loop our range, verdict and mark."""
        from wristctl.comparison.claims import ledger_frame

        return ledger_frame(self.judgements)


def plan(study: Study, inputs: Inputs) -> str:
    """Describe the run. Raises UserError without claims, or for a train run that cannot show them."""
    from wristctl.comparison.claims import TRAININGS, conditions_of
    from wristctl.simulation.closed_loop import Size, check_size

    claims = study.audit.claims
    if not claims:
        raise UserError("no claims to audit", "audit.claims", Call("paper audit", "experiments/claims.yaml"))
    _check_claims(claims)
    _check_trainings(claims, inputs)
    asked = dict.fromkeys(claim.evidence for claim in claims if claim.evidence in (*TRAININGS, "hardware"))
    shown = [f"{name}: {_name(inputs[name]) if name in inputs else 'open, for want of a run'}" for name in asked]
    rollouts = f"{len(conditions_of(claims))} comparisons on the built-in loops"
    box = study.audit.box
    with under("audit"):
        check_size(Size(list(LOOPS.values()), study.audit.horizon))
        if box.unknowns:
            with under("box"):
                _check_box(study)
    rollouts += f", and {box.draws + sum(box.continuous)} settings drawn" * bool(box.unknowns)
    return "\n".join([f"{len(claims)} claims; {rollouts}", *shown])


def _check_box(study: Study) -> None:
    """UserError where the box's settings are too many; their mean is that of a few of them."""
    from wristctl.comparison.robust import rows_in_box
    from wristctl.comparison.unknowns_sampling import CONTINUOUS, drawn_settings
    from wristctl.simulation.closed_loop import Size, check_steps

    box, rows = study.audit.box, len(rows_in_box(study.audit.claims))
    few = drawn_settings(box.model_copy(update={"draws": 8}), study.wrist, study.seed)
    mean_steps = sum(Size([sample.loop], sample.horizon).steps for sample in few) / len(few)
    count = box.draws + sum(box.continuous)
    check_steps(rows * (box.draws * mean_steps + sum(box.continuous) * box.horizon / CONTINUOUS), rows * count)


def audit(session: Session) -> Audited:
    """Judge every claim of the paper by rollouts, its own words, or what is still open."""
    from wristctl.commands.audit.figures import ours_over_the_papers
    from wristctl.commands.audit.ledger import ledger_tables
    from wristctl.comparison.claims import TRAININGS, Grounds, conditions_of, evidence_study, judge_all, ledger_frame
    from wristctl.comparison.robust import strips_frame

    findings, inputs, study = session.findings, session.inputs, session.study
    claims, loadable = study.audit.claims, _loadable(study)
    compared = {}
    for loop, scale in conditions_of(loadable):
        name = loop if scale == 1.0 else f"{loop}-stiffness-{scale:g}"
        compared[name] = _evidence(session, evidence_study(study, loadable, (loop, scale)), f"audit-{name}")
    grounds = Grounds(
        dict(zip(conditions_of(loadable), (comparison.frame() for comparison in compared.values()), strict=True)),
        {role: metrics for role in TRAININGS if (metrics := inputs.read(role, _metrics)) is not None},
        inputs.read("hardware", _trials),
        study.wrist.tension_limit,
    )
    judged = judge_all(claims, grounds)
    boxed = judged_in_box(session)
    if not boxed and any(name for judgement in judged for name in judgement.found):
        findings.figure("ledger", ours_over_the_papers, judged)
    shown_by = {name: _name(source) for name, source in (*compared.items(), *inputs.items())}

    findings.table("data/claims.csv", ledger_frame(judged), *documented(_OF_CLAIMS))
    findings.plain("evidence.json", shown_by, volatile=True)
    theirs = [j for j in judged if j.claim.whose == "paper" and not j.claim.part_of]
    counted = [j.verdict for j in theirs if j.verdict is not None]
    for verdict, count in sorted(Counter(counted).items()):
        says = f"claims of the paper whose verdict is: {verdict}"
        findings.metric(verdict.replace(" ", "_"), count, n=len(counted), meaning=says)
    evidence = Table("Runs that show it", ("shown by", "run"), list(shown_by.items()))
    tables = [*ledger_tables(judged), *([box_table(boxed, strips_frame(boxed))] if boxed else []), evidence]
    return Audited(study, findings, tables, judged, compared, boxed)


# Columns of data/claims.csv that do not explain themselves.
_OF_CLAIMS = (
    Quantity("paper", meaning="the paper's value"),
    Quantity("verdict", meaning="of all loops: where it fails on all, the gravest; else where they differ, not "
             "specified enough; none: a setting"),
    Quantity("whose", meaning="paper, ours (a check of its auditors) or group (its authors elsewhere)"),
    Quantity("part_of", meaning="the statement that it is a detail of"),
)  # fmt: skip
# Columns of data/box.csv; those with a heading are in the table.
_OF_BOX = (
    Quantity("claim", heading="claim"),
    Quantity("draws", meaning="settings that were drawn"),
    Quantity("not_converged", meaning="of these, which are not counted", heading="not converged"),
    Quantity("reproduced", meaning="share in which the claim holds", heading="holds in"),
    Quantity("reproduced_low", meaning="lower end of its 95 % interval", heading="95 % low"),
    Quantity("reproduced_high", meaning="upper end of its 95 % interval", heading="high"),
    Quantity("better", meaning="share in which ours is less than the paper's", heading="better in"),
    Quantity("fails", meaning="share in which it fails", heading="fails in"),
    Quantity("decided", meaning="where it holds by the unknown that decides most", heading="decided by"),
    Quantity("leaf_1", meaning="unknown that decides most"),
    Quantity("explained_1", meaning="share of the verdicts' variance that it explains"),
    Quantity("leaf_2", meaning="the next one", heading="then by"),
    Quantity("explained_2", meaning="share of the variance that it explains"),
)

_METRICS = ("comparison", "ordering", "symmetry", "hardware")


def _check_claims(claims: Sequence[Claim]) -> None:
    """UserError for a claim that names a metric or an equation that there is not."""
    from wristctl.comparison.derived_claims import EQUATIONS
    from wristctl.simulation.metrics import METRICS

    loops: Iterable[str] = METRICS
    tables = {"equation": set(EQUATIONS)} | {kind: set(loops) for kind in _METRICS}
    for claim in claims:
        names = tables.get(claim.evidence)
        if names is not None and claim.metric not in names:
            kind = "equation" if claim.evidence == "equation" else "metric"
            reason = f"claim {claim.id} asks for the {kind} '{claim.metric}', which there is not"
            raise UserError(reason, "audit.claims", meant(str(claim.metric), names))


def _check_trainings(claims: Sequence[Claim], inputs: Inputs) -> None:
    """UserError where a training lacks a metric that a claim asks for."""
    from wristctl.comparison.claims import TRAININGS

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


def _loadable(study: Study) -> list[Claim]:
    """The claims whose controller, if they have one, there is."""
    from wristctl.control.table import CONTROLLERS

    return [claim for claim in study.audit.claims if claim.controller is None or claim.controller in CONTROLLERS]


def _evidence(session: Session, study: Study, label: str) -> Compared:
    """The comparison of a study, in a run directory of its own beside that of the audit."""

    def compared(run: LiveRun | None) -> Compared:
        return compare(replace(session, study=study, inputs=Inputs(), findings=Findings(study.seed, run, draws=False)))

    if session.findings.run is None:
        return compared(None)
    with start_run(
        "compare", study, label, session.findings.run.path.parent, ["wristctl", "paper", "audit"], []
    ) as run:
        return compared(run)


def _metrics(earlier: Given) -> Metrics:
    return earlier.metrics if isinstance(earlier, Run) else earlier.findings.metrics


def _trials(earlier: Given) -> TrialsDone:
    from wristctl.comparison.claims import TrialsDone
    from wristctl.config.loop import sample_period
    from wristctl.simulation.reference import motion

    study = earlier.config if isinstance(earlier, Run) else earlier.study
    table = earlier.data("trials") if isinstance(earlier, Run) else earlier.frame()
    settings = study.hw_run
    moving = motion(settings.reference, study.wrist, settings.horizon, sample_period(settings.control_period))
    return TrialsDone(table, min(moving.rest, settings.horizon), settings.port is None)


def _name(earlier: Given) -> str:
    run = earlier if isinstance(earlier, Run) else earlier.run
    return run.id if run else "in memory"


def judged_in_box(session: Session) -> list[Strip]:
    """Every claim that draws can judge; none where the study names no unknowns."""
    from wristctl.commands.audit.figures import shares, strip
    from wristctl.comparison.robust import draws_frame, rows_in_box, strips, strips_frame
    from wristctl.comparison.unknowns_sampling import continuous_settings, drawn_settings, react
    from wristctl.study_files.sweeps import unit_at

    study, findings, box = session.study, session.findings, session.study.audit.box
    claims = _loadable(study)
    rows = rows_in_box(claims)
    if not box.unknowns or not rows:
        return []
    turned = {claim.label for claim in claims if claim.evidence == "symmetry"}
    settings = [*drawn_settings(box, study.wrist, study.seed), *continuous_settings(box, study.wrist, study.seed)]
    with session.progress("drawing settings from the box", total=100, unit="%") as report:
        share = len(rows) / (len(rows) + len(turned))
        drawn = react(rows, settings, lambda part: report(round(100 * share * part)))
        symmetric, rest = [row for row in rows if row.label in turned], 1.0 - share
        mirrored = react(symmetric, settings, lambda part: report(round(100 * (share + rest * part))), mirrored=True)
    in_box = strips(claims, drawn, mirrored)
    findings.table("data/box.csv", strips_frame(in_box), *documented(_OF_BOX))
    findings.table("data/draws.csv", draws_frame(drawn))
    specified = [one for one in in_box if not one.claim.unspecified or one.claim.evidence == "symmetry"]
    heading = "In which of the settings that the paper may have had its claims hold"
    findings.figure("box", shares, specified or in_box, heading)
    for row_strip in in_box:
        if row_strip.leaves:
            name = row_strip.leaves[0].name
            within = study if name.startswith("wrist.") else study.simulate
            unit = unit_at(within, name.split("."))
            findings.figure(f"strip-{row_strip.claim.id}", strip, row_strip, drawn.values(name), unit, later=True)
    return in_box


def box_table(boxed: Sequence[Strip], frame: pd.DataFrame) -> Table:
    """Table of the shares of drawn settings in which each claim holds, with the unknowns that decide it."""
    records = [
        record | {"leaf_2": record.get("leaf_2", "") if record["decided"] else ""}
        for record in frame.fillna(dict.fromkeys(frame.columns.intersection(["leaf_2"]), "")).to_dict("records")
    ]
    draws, most = len(boxed[0].verdicts), max(strip.uncounted for strip in boxed)
    left = f"; those that did not converge, up to {most}, are not counted" * bool(most)
    title = f"Shares of {draws} settings drawn from what the paper leaves open{left}"
    return table_of(title, [quantity for quantity in _OF_BOX if quantity.heading], records)


AUDIT = Procedure(
    "audit",
    plan,
    audit,
    (
        EarlierRun("table1", kind="train", optional=True),
        EarlierRun("selection", kind="train", optional=True),
        EarlierRun("hardware", kind="hw-run", optional=True),
    ),
)
