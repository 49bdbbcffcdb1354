"""The paper's claims, one by one, judged by what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from wristctl.benchmark.paper import FACTOR
from wristctl.config.audit import Claim, Ledger, Outcome
from wristctl.config.control import CompareSettings, Row
from wristctl.config.errors import UserError
from wristctl.config.explain import explained
from wristctl.config.loop import LOOPS, Reference
from wristctl.config.strict_yaml import parse_yaml
from wristctl.config.study import Study

if TYPE_CHECKING:
    import pandas as pd

_TO_COME = {"network": "wristctl train on experiments/table1.yaml", "hardware": "trials on the wrist"}


@dataclass(frozen=True)
class Judgement:
    """A claim with what was found: the range of our values, the verdict, the reason, and the loop that shows it."""

    claim: Claim
    low: float
    high: float
    verdict: Outcome
    reason: str
    loops: tuple[str, ...] = ()


def read_claims(path: Path) -> tuple[Claim, ...]:
    """The ledger; UserError where it cannot be read, is not valid, or names a claim twice."""
    try:
        document = parse_yaml(path.read_bytes(), str(path))
    except OSError as error:
        raise UserError(f"cannot read the claims: {error.strerror}", str(path), "--set claims=FILE") from error
    origins = {key: f"{path}:{line}" for key, line in document.lines.items()}
    try:
        data = document.data or {}
        ledger = Ledger.model_validate({**data, "claims": tuple(data.get("claims", ()))})
    except ValidationError as error:
        wrong = explained(error, origins)
        raise UserError(wrong.what, wrong.where, f"a claim has {', '.join(Claim.model_fields)}") from error
    ids = [claim.id for claim in ledger.claims]
    for number, name in enumerate(ids):
        if name in ids[:number]:
            raise UserError(f"claim {name} stands there twice", str(path), "give each claim an id of its own")
    return ledger.claims


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


def judge(claim: Claim, found: Mapping[str, pd.DataFrame]) -> Judgement:
    """Judge one claim by the comparisons of each loop."""
    if claim.evidence == "text":
        assert claim.verdict is not None
        return Judgement(claim, np.nan, np.nan, claim.verdict, claim.reason)
    if claim.evidence == "settings":
        return Judgement(claim, np.nan, np.nan, "taken over", claim.reason)
    if claim.evidence != "comparison":
        reason = f"{claim.reason}: {_TO_COME[claim.evidence]}"
        return Judgement(claim, np.nan, np.nan, "open", reason)
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


def _by_loops(claim: Claim, ranges: Mapping[str, tuple[float, float]]) -> Judgement:
    assert claim.value is not None
    if not ranges:
        return Judgement(claim, np.nan, np.nan, "open", f"no controller '{claim.controller}' to run")
    holding = [loop for loop, values in ranges.items() if _holds(claim, *values)]
    shown = ", ".join(f"{loop} {interval(*values)}" for loop, values in ranges.items())
    verdict: Outcome = "reproduced" if len(holding) == len(ranges) else "not reproduced"
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
                "reason": j.reason,
            }
            for j in judged
        ]
    )
