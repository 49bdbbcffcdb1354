"""The paper's claims, one by one, judged by what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from wristctl.comparison.paper import FACTOR
from wristctl.config.audit import Claim, VerdictName
from wristctl.config.control import CompareSettings, Row
from wristctl.config.loop import LOOPS, Reference
from wristctl.config.study import Study

if TYPE_CHECKING:
    import pandas as pd

TRAININGS = {"table1": "experiments/table1.yaml", "selection": "experiments/model_selection.yaml"}
"""Evidence that a train run gives, and the experiment it is a run of."""

Metrics = Mapping[str, Mapping[str, Any]]
"""value, interval and n of a training's metrics, by name"""


@dataclass(frozen=True)
class Judgement:
    """A claim with what was found: the range of our values, the verdict, the reason, and what shows it."""

    claim: Claim
    low: float
    high: float
    verdict: VerdictName
    reason: str
    shown_by: tuple[str, ...] = ()
    """loops of a comparison, or a key of TRAININGS"""


def evidence_study(study: Study, claims: Sequence[Claim], loop: str) -> Study:
    """The comparison on one loop that the claims ask for: their controllers and gains on both minimum-jerk moves."""
    wanted = dict.fromkeys((c.controller, c.gains) for c in claims if c.evidence == "comparison")
    rows = tuple(Row(controller=name, gains=gains) for name, gains in wanted if name and gains)
    compared = CompareSettings(
        rows=rows,
        loops={loop: LOOPS[loop]},
        references=(Reference(kind="step"), Reference(duration=1.0), Reference(duration=2.0)),
        inverses=("none",),
        horizon=study.audit.horizon,
    )
    return study.model_copy(update={"compare": compared})


def judge(claim: Claim, found: Mapping[str, pd.DataFrame], trainings: Mapping[str, Metrics]) -> Judgement:
    """Judge one claim by the comparisons of each loop and by the trainings there are, by keys of TRAININGS."""
    if claim.evidence == "text":
        assert claim.verdict is not None
        return Judgement(claim, np.nan, np.nan, claim.verdict, claim.reason)
    if claim.evidence == "settings":
        return Judgement(claim, np.nan, np.nan, "taken over", claim.reason)
    if claim.evidence == "hardware":
        return Judgement(claim, np.nan, np.nan, "open", claim.reason)
    if claim.evidence in TRAININGS:
        metrics = trainings.get(claim.evidence)
        return _untrained(claim) if metrics is None else _by_training(claim, metrics)
    ranges = {loop: _range(claim, table) for loop, table in found.items()}
    known = {loop: values for loop, values in ranges.items() if values is not None}
    return _by_loops(claim, known)


def _range(claim: Claim, table: pd.DataFrame) -> tuple[float, float] | None:
    """Least and largest value over the minimum-jerk moves; inf where it diverges or never settles."""
    own = (table["controller"] == claim.controller) & (table["gains"] == claim.gains)
    moves = table[own & ~table["reference"].str.startswith("step")]
    if moves.empty:
        return None
    values = moves[str(claim.metric)].fillna(np.inf)
    return float(values.min()), float(values.max())


def _untrained(claim: Claim) -> Judgement:
    how = f"needs --{claim.evidence} with a run of `wristctl train {TRAININGS[claim.evidence]}`"
    return Judgement(claim, np.nan, np.nan, "open", how)


def _by_training(claim: Claim, metrics: Metrics) -> Judgement:
    """Whether the paper's value lies in the 95 % interval over the seeds, or within FACTOR of it."""
    assert claim.value is not None
    found = metrics[str(claim.metric)]
    ours = np.nan if found["value"] is None else float(found["value"])
    low, high = found.get("interval") or (ours, ours)
    slack = 1.0 if claim.exact else FACTOR
    verdict: VerdictName = "reproduced" if low / slack <= claim.value <= high * slack else "not reproduced"
    said = f"{claim.metric} is {ours:.3g}" + (f" (n = {found['n']})" if found.get("n") else "")
    reason = "; ".join(part for part in (claim.reason, said) if part)
    return Judgement(claim, low, high, verdict, reason, (claim.evidence,))


def _by_loops(claim: Claim, ranges: Mapping[str, tuple[float, float]]) -> Judgement:
    assert claim.value is not None
    if not ranges:
        return Judgement(claim, np.nan, np.nan, "open", f"no controller '{claim.controller}' to run")
    holding = [loop for loop, values in ranges.items() if _holds(claim, *values)]
    shown = ", ".join(f"{loop} {interval(*values)}" for loop, values in ranges.items())
    verdict: VerdictName = "reproduced" if len(holding) == len(ranges) else "not reproduced"
    where = f"holds on {' and '.join(holding)} only" if holding and verdict == "not reproduced" else ""
    best = holding[0] if holding else next(iter(ranges))
    reason = "; ".join(part for part in (where, claim.reason, shown) if part)
    return Judgement(claim, *ranges[best], verdict, reason, tuple(ranges))


def _holds(claim: Claim, low: float, high: float) -> bool:
    """The paper's value lies between our two moves or within FACTOR of one.

    A steady-state error holds where ours is not above FACTOR times the paper's; a claim of 0 means below 1e-6.
    """
    value = claim.value or 0.0
    if value == 0.0:
        return high < 1e-6
    if claim.metric == "steady_state":
        return high <= FACTOR * value
    return low <= value <= high or any(value / FACTOR <= ours <= value * FACTOR for ours in (low, high))


def interval(low: float, high: float) -> str:
    """A range as text; what never settles or diverges is inf."""
    first, second = ("never" if np.isinf(v) else f"{v:.2g}" for v in (low, high))
    return first if first == second else f"{first} to {second}"


def ledger_frame(judged: Sequence[Judgement]) -> pd.DataFrame:
    """Every claim with the paper's value, ours, verdict and reason."""
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "claim": j.claim.id,
                "says": j.claim.says,
                "paper": np.nan if j.claim.value is None else j.claim.value,
                "ours_low": j.low,
                "ours_high": j.high,
                "unit": j.claim.unit,
                "verdict": j.verdict,
                "shown_by": ", ".join(j.shown_by),
                "reason": j.reason,
            }
            for j in judged
        ]
    )
