"""The paper's claims, one by one, judged by what was measured, on each loop by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.comparison.paper import Ends, rounded
from wristctl.comparison.verdicts import Finding, joint, of_numbers, of_ordering, of_sample, of_settling
from wristctl.config.audit import Claim, VerdictName
from wristctl.config.controllers import CompareSettings, Row
from wristctl.config.loop import LOOPS, Reference
from wristctl.config.study import Study
from wristctl.simulation.arrival import SHORT

if TYPE_CHECKING:
    import pandas as pd


TRAININGS = {"table1": "experiments/table1.yaml", "selection": "experiments/model_selection.yaml"}
"""Evidence that a train run gives, and the experiment it is a run of."""

Metrics = Mapping[str, Mapping[str, Any]]
"""value, interval and n of a training's metrics, by name"""

LoopCondition = tuple[str, float]
"""A loop's name, and the springs' stiffness over what the controller knows."""

NOMINAL = 1.0
"""Springs as stiff as the controller knows them; beside it stands what is asked of others."""
_BY_LOOPS = ("comparison", "ordering", "arrival")


class TrialsDone(NamedTuple):
    """Trials of an experiment: a row each with the metrics of `hw-run`."""

    trials: pd.DataFrame
    motion: float
    """How long their reference moves [s]; 0 for a step."""
    emulated: bool


@dataclass(frozen=True)
class Grounds:
    """What there is to judge by."""

    loops: Mapping[LoopCondition, pd.DataFrame] = field(default_factory=dict)
    trainings: Mapping[str, Metrics] = field(default_factory=dict)
    hardware: TrialsDone | None = None
    tension_limit: float = np.inf
    """Of the wrist [N], which a loop without limits may pass."""


def conditions_of(claims: Sequence[Claim]) -> list[LoopCondition]:
    """On what the claims ask for rollouts."""
    scales = dict.fromkeys(claim.stiffness_scale for claim in claims if claim.evidence in _BY_LOOPS)
    return [(loop, scale) for scale in dict.fromkeys((NOMINAL, *scales)) for loop in LOOPS] if scales else []


def rows_of(claims: Sequence[Claim], scale: float) -> list[Row]:
    """The controllers with their gains that the claims ask for, each once."""
    own = [each for each in claims if each.evidence in _BY_LOOPS and scale in (NOMINAL, each.stiffness_scale)]
    labels = dict.fromkeys(label for each in own for label in (each.label, each.than) if label)
    pairs = [label.split("/") for label in labels]
    return [Row(controller=name, gains=gains) for name, gains in pairs]


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


DERIVED_ON = "exact"
"""The loop on which the paper's equations are solved as they stand: exact model, continuous time, no limits."""
_FEW = 4
"""So many parts are told one by one, more are counted."""


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
        return joint(each.verdict for each in self.found.values())

    @property
    def reason(self) -> str:
        """Why, over all loops."""
        by_loop = [
            f"{name}: {each.reason}" if name else each.reason for name, each in self.found.items() if each.reason
        ]
        differ = len({each.verdict for each in self.found.values()}) > 1 and self.verdict == "not specified enough"
        parts = ("the loop decides" if differ else "", self.claim.unspecified, self.claim.reason, *by_loop)
        return "; ".join(part for part in parts if part)


def judge_all(claims: Sequence[Claim], shown: Grounds) -> list[Judgement]:
    """Judge every claim by what is shown, and each statement that has parts by these; in the order of the claims."""
    whole = {claim.id for claim in claims if claim.evidence == "parts"}
    single = {claim.id: judge(claim, shown) for claim in claims if claim.id not in whole}
    of = {name: [single[each.id] for each in claims if each.part_of == name] for name in whole}
    return [_by_parts(claim, of[claim.id]) if claim.id in whole else single[claim.id] for claim in claims]


def _by_parts(claim: Claim, parts: Sequence[Judgement]) -> Judgement:
    """Where all parts agree that is the verdict; else what tells them apart decides, which the paper does not give."""
    found = {}
    for place in dict.fromkeys(name for part in parts for name in part.found):
        own = [(part.claim, part.found[place]) for part in parts if place in part.found]
        verdict = joint(each.verdict for _, each in own)
        assert verdict is not None
        if len(own) <= _FEW:
            said = "; ".join(f"{part.says}: {worded(part, each.beside or each.verdict)}" for part, each in own)
        else:
            counted = Counter(each.beside or each.verdict for _, each in own)
            beside = "with ours " * any(each.beside for _, each in own)
            said = beside + ", ".join(f"{count} of {len(own)} {name}" for name, count in counted.most_common())
        if verdict == "open":
            said = next(each.reason for _, each in own if each.verdict == "open")
        found[place] = Finding(verdict, reason=said)
    return Judgement(claim, found, tuple(dict.fromkeys(name for part in parts for name in part.shown_by)))


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
    found = {loop: _on_loop(claim, loop, shown) for loop in loops}
    known = {loop: each for loop, each in found.items() if each is not None}
    if not known:
        return Judgement(claim, {"": Finding("open", reason=f"no controller '{claim.controller}' to run")})
    return _judgement(claim, known, *known)


def _judgement(claim: Claim, found: Mapping[str, Finding], *shown_by: str) -> Judgement:
    """What the paper leaves open stays so, with the verdict by our choice of it beside."""
    if all(each.verdict == "open" and np.isnan(each.low) for each in found.values()):
        return Judgement(claim, found)
    if claim.unspecified or claim.assuming:
        choice = f"assuming {claim.assuming}:" if claim.assuming else "with ours"
        found = {
            name: each._replace(
                verdict="not specified enough",
                beside=each.verdict,
                reason="; ".join(part for part in (f"{choice} {worded(claim, each.verdict)}", each.reason) if part),
            )
            for name, each in found.items()
        }
    return Judgement(claim, found, shown_by)


def _on_loop(claim: Claim, loop: str, shown: Grounds) -> Finding | None:
    """None where the loop's table has no row of it."""
    table = shown.loops[loop, claim.stiffness_scale]
    moves = _moves(table, claim.label)
    metric = "missing" if claim.evidence == "arrival" else str(claim.metric)
    others = _moves(table, claim.than) if claim.than else moves
    if moves.empty or others.empty:
        return None
    ours = moves[metric].to_numpy(float)
    if claim.evidence == "arrival":
        found = of_numbers(SHORT, ours, "at most")
    elif claim.than is not None:
        found = of_ordering(ours, others[metric].to_numpy(float))
    elif claim.stiffness_scale != NOMINAL:
        before = _moves(shown.loops[loop, NOMINAL], claim.label)[metric].to_numpy(float)
        found = _explained(of_numbers(printed(claim), np.maximum(ours - before, 0.0)))
    elif metric == "settling_after":
        found = of_settling(printed(claim), ours, _durations(moves))
    else:
        found = of_numbers(printed(claim), ours, claim.sense)
    if claim.derived and loop == DERIVED_ON and found.verdict in ("worse than the paper", "does not hold"):
        found = found._replace(verdict="contradicted")
    strongest = _unphysical(table, (claim.label, claim.than), shown.tension_limit)
    if not strongest:
        return found
    return found._replace(mark="not physical", reason="; ".join(part for part in (found.reason, strongest) if part))


def _unphysical(table: pd.DataFrame, labels: Sequence[str | None], limit: float) -> str:
    """What passes the wrist's tension limit, on whichever motion; empty where nothing does."""
    if "peak_tension" not in table:
        return ""
    own = table[(table["controller"] + "/" + table["gains"]).isin(labels)]
    peaks = own["peak_tension"].to_numpy(float)
    at = int(peaks.argmax())
    return "" if peaks[at] <= limit * (1.0 + 1e-9) else f"{peaks[at]:.3g} N on a {own['reference'].iloc[at]}"


def _moves(table: pd.DataFrame, label: str) -> pd.DataFrame:
    """A row's smooth motions; what has failed has no numbers."""
    name, gains = label.split("/")
    own = table[(table["controller"] == name) & (table["gains"] == gains)]
    moves = own[~own["reference"].str.startswith("step")]
    if "failed" not in moves:
        return moves
    metrics = [each for each in moves.columns if each in _of_error()]
    return moves.assign(**{each: moves[each].mask(moves["failed"]) for each in metrics})


def _of_error() -> set[str]:
    from wristctl.simulation.metrics import METRICS

    return {name for name, metric in METRICS.items() if metric.of_error}


def _durations(moves: pd.DataFrame) -> list[float]:
    """Of minimum-jerk motions, by their names [s]."""
    return [float(each.split()[2]) for each in moves["reference"]]


def printed(claim: Claim) -> Ends:
    """Between which the claim's value lies, by the digits that are printed; of a threshold of ours just that."""
    assert claim.value is not None
    if claim.ends is not None:
        return Ends(*claim.ends)
    return rounded(claim.value) if claim.printed and claim.sense != "exactly" else Ends(claim.value, claim.value)


def _explained(growth: Finding) -> Finding:
    """An explanation of an error fails where what it adds is less, or more, than what it is to explain."""
    said = {"better than the paper": "explains too little", "worse than the paper": "explains too much"}
    if growth.verdict not in said:
        return growth
    return growth._replace(verdict="does not hold", reason=growth.reason or said[growth.verdict])


def _by_equation(claim: Claim) -> Finding:
    from wristctl.comparison.derived_claims import EQUATIONS

    found = of_numbers(printed(claim), EQUATIONS[str(claim.metric)].ends(), claim.sense)
    if found.verdict == "not specified enough":
        return found._replace(reason="within the rounding of what is printed")
    return found._replace(verdict="reproduced" if found.verdict == "reproduced" else "contradicted")


def _by_training(claim: Claim, metrics: Metrics | None) -> Finding:
    if metrics is None:
        how = f"needs --{claim.evidence} with a run of `wristctl train {TRAININGS[claim.evidence]}`"
        return Finding("open", reason=how)
    own = metrics[str(claim.metric)]
    middle = np.nan if own["value"] is None else float(own["value"])
    ends = own.get("interval")
    found = of_sample(printed(claim), middle, tuple(ends) if ends else None, claim.sense)
    said = f"{claim.metric} is {middle:.3g}" + (f" (n = {own['n']})" if own.get("n") else "")
    return found._replace(reason="; ".join(part for part in (found.reason, said) if part))


def _by_trials(claim: Claim, done: TrialsDone | None) -> Finding:
    if done is None:
        return Finding("open", reason="needs --hardware with a run of `wristctl hw-run`")
    trials = done.trials
    own = trials[
        (trials["controller"] == "smc") & (trials["outcome"] == "ok") & ((trials["push"] != 0.0) == claim.pushed)
    ]
    if claim.direction is not None:
        own = own[own["direction"] == claim.direction]
    if own.empty:
        where = (
            f" {'pushed ' * claim.pushed}toward {claim.direction}" if claim.direction else " with a push" * claim.pushed
        )
        return Finding("open", reason=f"no trial of the paper's law{where} in this run")
    values = own[str(claim.metric)].to_numpy(float)
    if claim.metric == "settling_after":
        found = of_settling(printed(claim), [float(np.mean(values))], [done.motion])
    else:
        found = of_numbers(printed(claim), [float(np.mean(values))])
    rig = "an emulated rig" if done.emulated else "a rig"
    gains = ", ".join(f"smc/{each}" for each in dict.fromkeys(own["gains"]))
    said = f"mean of {len(own)} trials of {gains} on {rig}"
    return found._replace(
        reason="; ".join(part for part in (said, found.reason) if part), mark="emulated" * done.emulated
    )


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
            each = j.found.get(name) or j.found.get("")
            row |= {
                f"{name}_verdict".strip("_"): each.verdict if each else "",
                "_".join(part for part in (name, "low") if part): each.low if each else np.nan,
                "_".join(part for part in (name, "high") if part): each.high if each else np.nan,
                "_".join(part for part in (name, "mark") if part): each.mark if each else "",
            }
        rows.append(row | {"shown_by": ", ".join(j.shown_by), "reason": j.reason})
    return pd.DataFrame(rows)
