"""The paper's claims, one by one, judged by what was measured, on each loop by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.comparison.paper import Ends, rounded
from wristctl.comparison.verdicts import Finding, joint, of_numbers, of_ordering, of_sample, of_settling
from wristctl.config.audit import Claim, VerdictName
from wristctl.config.compare import CompareSettings
from wristctl.config.controller_row import Row
from wristctl.config.former_names import column_of_loop
from wristctl.config.loop import LOOPS, Reference
from wristctl.config.study import Study
from wristctl.simulation.arrival import SHORT
from wristctl.simulation.metrics import METRICS

if TYPE_CHECKING:
    import pandas as pd


# Evidence that a train run gives, and the experiment it is a run of.
TRAININGS = {"table1": "experiments/table1.yaml", "selection": "experiments/model_selection.yaml"}

# value, interval and n of a training's metrics, by name
Metrics = Mapping[str, Mapping[str, Any]]

# A loop's name, and the springs' stiffness over what the controller knows.
LoopCondition = tuple[str, float]

# Springs as stiff as the controller knows them; beside it stands what is asked of others.
NOMINAL = 1.0
_BY_LOOPS = ("comparison", "ordering", "arrival")


class TrialsDone(NamedTuple):
    """Trials of an experiment: a row each with the metrics of `hw-run`."""

    trials: pd.DataFrame
    motion: float
    """Duration of the reference's motion [s]; 0 for a step."""
    emulated: bool


@dataclass(frozen=True)
class Grounds:
    """Evidence for judging claims: loops, trainings and trials."""

    loops: Mapping[LoopCondition, pd.DataFrame] = field(default_factory=dict)
    trainings: Mapping[str, Metrics] = field(default_factory=dict)
    hardware: TrialsDone | None = None
    tension_limit: float = np.inf
    """Tension limit of the wrist [N]. A loop without limits may pass it."""


def conditions_of(claims: Sequence[Claim]) -> list[LoopCondition]:
    """On what the claims ask for rollouts."""
    scales = dict.fromkeys(claim.stiffness_scale for claim in claims if claim.evidence in _BY_LOOPS)
    return [(loop, scale) for scale in dict.fromkeys((NOMINAL, *scales)) for loop in LOOPS] if scales else []


def rows_of(claims: Sequence[Claim], scale: float) -> list[Row]:
    """The controllers with their gains that the claims ask for, each once."""
    return rows_asked(c for c in claims if c.evidence in _BY_LOOPS and scale in (NOMINAL, c.stiffness_scale))


def rows_asked(claims: Iterable[Claim]) -> list[Row]:
    """The rows that claims speak of, each once."""
    labels = dict.fromkeys(label for claim in claims for label in (claim.label, claim.than) if label)
    return [Row(controller=name, gains=gains) for name, gains in (label.split("/") for label in labels)]


def evidence_study(study: Study, claims: Sequence[Claim], condition: LoopCondition) -> Study:
    """The comparison under one condition that the claims ask for: their rows on both minimum-jerk moves."""
    name, scale = condition
    loop = LOOPS[name]
    softened = loop.model_copy(update={"plant": loop.plant.model_copy(update={"stiffness_scale": scale})})
    compared = CompareSettings(
        rows=tuple(rows_of(claims, scale)),
        loops={name: softened},
        references=(Reference(kind="step"), Reference(duration=1.0), Reference(duration=2.0)),
        inverses=("none",),
        horizon=study.audit.horizon,
    )
    return study.model_copy(update={"compare": compared})


# The loop on which the paper's equations are solved as they stand: exact model, continuous time, no limits.
DERIVED_ON = "exact"
# So many parts are told one by one, more are counted.
_FEW = 4


@dataclass(frozen=True)
class Judgement:
    """A claim with what was found on each loop; under "" where no loop is asked for."""

    claim: Claim
    found: Mapping[str, Finding]
    """Empty for a setting that is taken over, which has no verdict."""
    shown_by: tuple[str, ...] = ()

    @property
    def verdict(self) -> VerdictName | None:
        """The one of all loops; where these differ, the loop decides, which the paper does not give.

        What fails on all of them is one verdict, whatever the word on each.
        """
        return joint(finding.verdict for finding in self.found.values())

    @property
    def reason(self) -> str:
        """Why, over all loops."""
        by_loop = [(f"{name}: " if name else "") + each.reason for name, each in self.found.items() if each.reason]
        verdicts = {finding.verdict for finding in self.found.values()}
        differ = len(verdicts) > 1 and self.verdict == "not specified enough"
        return _all("the loop decides" * differ, self.claim.unspecified, self.claim.reason, *by_loop)


def judge_all(claims: Sequence[Claim], shown: Grounds) -> list[Judgement]:
    """Judge every claim by what is shown, and each statement that has parts by these; in the order of the claims."""
    divided = {claim.id for claim in claims if claim.evidence == "parts"}
    single = {claim.id: judge(claim, shown) for claim in claims if claim.id not in divided}
    of = {name: [single[claim.id] for claim in claims if claim.part_of == name] for name in divided}
    return [_by_parts(claim, of[claim.id]) if claim.id in divided else single[claim.id] for claim in claims]


def _by_parts(claim: Claim, parts: Sequence[Judgement]) -> Judgement:
    """Judge a claim by its parts. Parts that disagree depend on a detail that the paper does not give."""
    findings = {}
    for place in dict.fromkeys(name for part in parts for name in part.found):
        on_loop = [(part.claim, part.found[place]) for part in parts if place in part.found]
        verdict = joint(finding.verdict for _, finding in on_loop)
        assert verdict is not None
        if len(on_loop) <= _FEW:
            reason = "; ".join(
                f"{part.says}: {worded(part, finding.beside or finding.verdict)}" for part, finding in on_loop
            )
        else:
            counted = Counter(finding.beside or finding.verdict for _, finding in on_loop)
            beside = "with ours " * any(finding.beside for _, finding in on_loop)
            reason = beside + ", ".join(f"{count} of {len(on_loop)} {name}" for name, count in counted.most_common())
        if verdict == "open":
            reason = next(finding.reason for _, finding in on_loop if finding.verdict == "open")
        findings[place] = Finding(verdict, reason=reason)
    return Judgement(claim, findings, tuple(dict.fromkeys(name for part in parts for name in part.shown_by)))


def worded(claim: Claim, verdict: str) -> str:
    """A verdict in words: a check of ours holds, and is nothing of the paper's to be reproduced."""
    return "holds" if claim.whose == "ours" and verdict == "reproduced" else verdict


def judge(claim: Claim, shown: Grounds) -> Judgement:
    """Judge one claim by what is shown; what nothing shows is open."""
    if claim.evidence == "settings":
        return Judgement(claim, {})
    if claim.evidence == "text":
        assert claim.verdict is not None
        return _judgement(claim, {"": Finding(claim.verdict)})
    if claim.evidence in ("symmetry", "together"):
        return Judgement(claim, {"": Finding("not specified enough")})
    if claim.evidence == "equation":
        return _judgement(claim, {"": _by_equation(claim)}, "equation")
    if claim.evidence == "hardware":
        return _judgement(claim, {"": _by_trials(claim, shown.hardware)}, "hardware")
    if claim.evidence in TRAININGS:
        return _judgement(claim, {"": _by_training(claim, shown.trainings.get(claim.evidence))}, claim.evidence)
    loops = [loop for loop, scale in shown.loops if scale == claim.stiffness_scale]
    findings = {loop: _on_loop(claim, loop, shown) for loop in loops}
    judged = {loop: finding for loop, finding in findings.items() if finding is not None}
    if not judged:
        return Judgement(claim, {"": Finding("open", reason=f"no controller '{claim.controller}' to run")})
    return _judgement(claim, judged, *judged)


def _judgement(claim: Claim, findings: Mapping[str, Finding], *shown_by: str) -> Judgement:
    """Keep a claim open where the paper does, with the verdict under our choice beside it."""
    if all(finding.verdict == "open" and np.isnan(finding.low) for finding in findings.values()):
        return Judgement(claim, findings)
    if claim.unspecified or claim.assuming:
        choice = f"assuming {claim.assuming}:" if claim.assuming else "with ours"
        findings = {
            name: finding._replace(
                verdict="not specified enough",
                beside=finding.verdict,
                reason=_all(f"{choice} {worded(claim, finding.verdict)}", finding.reason),
            )
            for name, finding in findings.items()
        }
    return Judgement(claim, findings, shown_by)


def _on_loop(claim: Claim, loop: str, shown: Grounds) -> Finding | None:
    """None where the loop's table has no row of it."""
    table = shown.loops[loop, claim.stiffness_scale]
    moves = _moves(table, claim.label)
    metric = "missing" if claim.evidence == "arrival" else str(claim.metric)
    than_moves = _moves(table, claim.than) if claim.than else moves
    if moves.empty or than_moves.empty:
        return None
    ours = moves[metric].to_numpy(float)
    if claim.evidence == "arrival":
        finding = of_numbers(SHORT, ours, "at most")
    elif claim.than is not None:
        finding = of_ordering(ours, than_moves[metric].to_numpy(float))
    elif claim.stiffness_scale != NOMINAL:
        before = _moves(shown.loops[loop, NOMINAL], claim.label)[metric].to_numpy(float)
        finding = _explained(of_numbers(printed(claim), np.maximum(ours - before, 0.0)))
    elif metric == "settling_after":
        durations = [float(label.split()[2]) for label in moves["reference"]]  # of minimum-jerk motions [s]
        finding = of_settling(printed(claim), ours, durations)
    else:
        finding = of_numbers(printed(claim), ours, claim.sense)
    if claim.derived and loop == DERIVED_ON and finding.verdict in ("worse than the paper", "does not hold"):
        finding = finding._replace(verdict="contradicted")
    marks = {
        "not physical": _unphysical(table, (claim.label, claim.than), shown.tension_limit),
        "not converged": _unconverged((moves, than_moves)),
    }
    mark = ", ".join(mark for mark, reason in marks.items() if reason)
    return finding._replace(mark=mark, reason=_all(finding.reason, *marks.values()))


def _all(*reasons: str) -> str:
    return "; ".join(filter(None, reasons))


def _unphysical(table: pd.DataFrame, labels: Sequence[str | None], limit: float) -> str:
    """Largest tension above the wrist's limit and its motion; empty where no tension passes the limit."""
    if "peak_tension" not in table:
        return ""
    selected = table[(table["controller"] + "/" + table["gains"]).isin(labels)]
    peaks = selected["peak_tension"].to_numpy(float)
    peak = int(peaks.argmax())
    return "" if peaks[peak] <= limit * (1.0 + 1e-9) else f"{peaks[peak]:.3g} N on a {selected['reference'].iloc[peak]}"


def _unconverged(moves: Sequence[pd.DataFrame]) -> str:
    """Largest change of the motions' numbers with the integration step; empty where all of them have converged."""
    largest = max(float(np.nanmax(table["drift"], initial=0.0)) for table in moves) if "drift" in moves[0] else 0.0
    return f"its numbers change by up to {largest:.2g} rad with the integration step" * bool(largest)


def _moves(table: pd.DataFrame, label: str) -> pd.DataFrame:
    """A row's smooth motions; what has failed has no numbers."""
    name, gains = label.split("/")
    selected = table[(table["controller"] == name) & (table["gains"] == gains)]
    moves = selected[~selected["reference"].str.startswith("step")]
    if "failed" not in moves:
        return moves
    metrics = [column for column in moves.columns if column in METRICS and METRICS[column].of_error]
    return moves.assign(**{column: moves[column].mask(moves["failed"]) for column in metrics})


def printed(claim: Claim) -> Ends:
    """Between which the claim's value lies, by the digits that are printed; of a threshold of ours just that."""
    assert claim.value is not None
    if claim.ends is not None:
        return Ends(*claim.ends)
    return rounded(claim.value) if claim.printed and claim.sense != "exactly" else Ends(claim.value, claim.value)


def _explained(growth: Finding) -> Finding:
    """An explanation of an error fails where what it adds is less, or more, than what it is to explain."""
    wording = {"better than the paper": "explains too little", "worse than the paper": "explains too much"}
    if growth.verdict not in wording:
        return growth
    return growth._replace(verdict="does not hold", reason=growth.reason or wording[growth.verdict])


def _by_equation(claim: Claim) -> Finding:
    from wristctl.comparison.derived_claims import EQUATIONS

    finding = of_numbers(printed(claim), EQUATIONS[str(claim.metric)].ends(), claim.sense)
    if finding.verdict == "not specified enough":
        return finding._replace(reason="within the rounding of what is printed")
    return finding._replace(verdict="reproduced" if finding.verdict == "reproduced" else "contradicted")


def _by_training(claim: Claim, metrics: Metrics | None) -> Finding:
    if metrics is None:
        missing = f"needs --{claim.evidence} with a run of `wristctl train {TRAININGS[claim.evidence]}`"
        return Finding("open", reason=missing)
    metric = metrics[str(claim.metric)]
    middle = np.nan if metric["value"] is None else float(metric["value"])
    ends = metric.get("interval")
    finding = of_sample(printed(claim), middle, tuple(ends) if ends else None, claim.sense)
    measured = f"{claim.metric} is {middle:.3g}" + (f" (n = {metric['n']})" if metric.get("n") else "")
    return finding._replace(reason=_all(finding.reason, measured))


def _by_trials(claim: Claim, trials_done: TrialsDone | None) -> Finding:
    if trials_done is None:
        return Finding("open", reason="needs --hardware with a run of `wristctl hw-run`")
    trials = trials_done.trials
    selected = trials[
        (trials["controller"] == "smc") & (trials["outcome"] == "ok") & ((trials["push"] != 0.0) == claim.pushed)
    ]
    if claim.direction is not None:
        selected = selected[selected["direction"] == claim.direction]
    if selected.empty:
        toward = f" {'pushed ' * claim.pushed}toward {claim.direction}"
        where = toward if claim.direction else " with a push" * claim.pushed
        return Finding("open", reason=f"no trial of the paper's law{where} in this run")
    values = selected[str(claim.metric)].to_numpy(float)
    if claim.metric == "settling_after":
        finding = of_settling(printed(claim), [float(np.mean(values))], [trials_done.motion])
    else:
        finding = of_numbers(printed(claim), [float(np.mean(values))])
    rig = "an emulated rig" if trials_done.emulated else "a rig"
    gains = ", ".join(f"smc/{preset}" for preset in dict.fromkeys(selected["gains"]))
    measured = f"mean of {len(selected)} trials of {gains} on {rig}"
    return finding._replace(reason=_all(measured, finding.reason), mark="emulated" * trials_done.emulated)


def interval(low: float, high: float) -> str:
    """A range as text."""
    if np.isnan(low):
        return "never"
    first, second = (f"{v:.2g}" for v in (low, high))
    return first if first == second else f"{first} to {second}"


def ledger_frame(judged: Sequence[Judgement]) -> pd.DataFrame:
    """Every claim with the paper's value, verdict and reason; on each loop our range, verdict and mark."""
    import pandas as pd

    loops = list(dict.fromkeys(name for j in judged for name in j.found if name))
    rows = []
    for j in judged:
        row: dict[str, object] = {
            "claim": j.claim.id,
            "says": j.claim.says,
            "whose": j.claim.whose,
            "part_of": j.claim.part_of,
            "paper": np.nan if j.claim.value is None else j.claim.value,
            "unit": j.claim.unit,
            "verdict": j.verdict or "",
        }
        for name in loops or [""]:
            finding = j.found.get(name) or j.found.get("")
            shown = finding._asdict() if finding else {"verdict": "", "low": np.nan, "high": np.nan, "mark": ""}
            begin = f"{column_of_loop(name)}_" if name else ""
            row |= {f"{begin}{key}": shown[key] for key in ("verdict", "low", "high", "mark")}
        rows.append(row | {"shown_by": ", ".join(j.shown_by), "reason": j.reason})
    return pd.DataFrame(rows)
