"""The paper's claims over the box of what it leaves open: in which share each verdict holds, and what decides it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.claims import printed
from wristctl.comparison.paper import T2, rounded
from wristctl.comparison.tie_groups import Share, share
from wristctl.comparison.unknowns_sampling import Reactions
from wristctl.comparison.verdicts import FAILING, of_numbers, of_ordering
from wristctl.config.audit import Claim, VerdictName
from wristctl.config.controllers import Row
from wristctl.simulation.arrival import SHORT

if TYPE_CHECKING:
    import pandas as pd


_BINS = 12
_RESAMPLES = 200


class Leaf(NamedTuple):
    """An unknown and the share of the variance that it explains alone."""

    name: str
    share: float


class Threshold(NamedTuple):
    """One threshold of a number, with its 95 % interval by bootstrap, and the shares of yes below and above it."""

    at: float
    low: float
    high: float
    below: float
    above: float


def deciding(yes: NDArray[np.bool_], values: Mapping[str, Sequence[Any]]) -> list[Leaf]:
    """Unknowns by the share of the variance of `yes` (N,) that each explains alone, the largest first.

    It is omega squared over bins, an estimate of the first-order Sobol index that is 0 on average where there is
    nothing to explain (Hays, Statistics (1963); Sobol', Math. Comput. Simul. 55 (2001) 271).
    """
    found = [Leaf(name, _explained(yes.astype(float), _bins(each))) for name, each in values.items()]
    return sorted(found, key=lambda leaf: -leaf.share)


def _bins(values: Sequence[Any]) -> NDArray[np.int64]:
    """Which bin each is in: of few values each its own, of many as many in each; infinity has its own."""
    if isinstance(values[0], str) or len(set(values)) <= _BINS:
        known = {value: number for number, value in enumerate(dict.fromkeys(values))}
        return np.array([known[each] for each in values])
    numbers = np.array(values, float)
    finite = np.isfinite(numbers)
    edges = np.quantile(numbers[finite], np.linspace(0.0, 1.0, _BINS + 1)[1:-1])
    return np.where(finite, np.searchsorted(edges, numbers), _BINS)


def _explained(y: Array, bins: NDArray[np.int64]) -> float:
    counts = np.bincount(bins)
    kept = counts > 0
    means = np.bincount(bins, y)[kept] / counts[kept]
    total, k = float(((y - y.mean()) ** 2).sum()), int(kept.sum())
    if total == 0.0 or k < 2 or len(y) <= k:
        return 0.0
    between = float((counts[kept] * (means - y.mean()) ** 2).sum())
    within = (total - between) / (len(y) - k)
    return max(0.0, (between - (k - 1) * within) / (total + within))


def split(yes: NDArray[np.bool_], values: Sequence[float], seed: int = 0) -> Threshold | None:
    """The one threshold of a number that leaves least variance on its sides (a tree's first split), of finite draws.

    None where all say the same.
    """
    x = np.array(values, float)
    known = np.isfinite(x)
    order = np.argsort(x[known], kind="stable")
    x, y = x[known][order], yes[known][order]
    at = _threshold(x, y)
    if at is None:
        return None
    rng = np.random.default_rng(seed)
    drawn = [np.sort(rng.integers(0, len(x), len(x))) for _ in range(_RESAMPLES)]
    again = [each for each in (_threshold(x[own], y[own]) for own in drawn) if each is not None]
    low, high = np.quantile(again, (0.025, 0.975))
    under = x < at
    return Threshold(at, float(low), float(high), float(y[under].mean()), float(y[~under].mean()))


def _threshold(x: Array, y: NDArray[np.bool_]) -> float | None:
    """Between two of the sorted values, halfway in their logarithm where they are positive."""
    before, k = np.cumsum(y)[:-1].astype(float), np.arange(1.0, len(y))
    gain = before**2 / k + (y.sum() - before) ** 2 / (len(y) - k)
    possible = x[1:] > x[:-1]
    if not possible.any() or y.all() or not y.any():
        return None
    best = int(np.where(possible, gain, -1.0).argmax())
    one, other = float(x[best]), float(x[best + 1])
    return float(np.sqrt(one * other)) if one > 0.0 else 0.5 * (one + other)


IN_BOX = ("comparison", "ordering", "arrival", "together", "symmetry")
"""Evidence that draws give."""
_LEAST = 0.01
"""Share of the variance below which no unknown decides."""


@dataclass(frozen=True)
class Strip:
    """One claim over the box: our value over the paper's in each draw (an ordering: the ratio), and its verdicts."""

    claim: Claim
    ratios: NDArray[np.float64]
    verdicts: Sequence[VerdictName | None]
    """None where our value depends on the integration step: there is no verdict, and nothing counts it."""
    leaves: Sequence[Leaf]
    """Unknowns by what they explain of whether the claim holds."""
    split: Threshold | None
    """Of the first of them, where it is a number."""
    told: str
    """Where the claim holds by the first of them, in words."""

    def share(self, *verdicts: VerdictName) -> Share:
        """Of the draws that have a verdict, those with one of these."""
        return share(np.array([each in verdicts for each in self.verdicts if each is not None], bool))

    @property
    def uncounted(self) -> int:
        """Draws that have none, since they did not converge."""
        return sum(each is None for each in self.verdicts)


def rows_in_box(claims: Sequence[Claim]) -> list[Row]:
    """The rows that the claims need, each once; those of a symmetry are run to both sides."""
    own = [claim for claim in claims if claim.evidence in IN_BOX and claim.stiffness_scale == 1.0]
    labels = dict.fromkeys(label for claim in own for label in (claim.label, claim.than) if label)
    return [Row(controller=name, gains=gains) for name, gains in (label.split("/") for label in labels)]


def strips(claims: Sequence[Claim], drawn: Reactions, mirrored: Reactions | None = None) -> list[Strip]:
    """Every claim that draws can judge, by those of its rows."""
    own = [claim for claim in claims if claim.evidence in IN_BOX and claim.stiffness_scale == 1.0]
    values = {name: drawn.values(name) for name in drawn.settings[0].values}
    found = []
    for claim in own:
        if claim.label not in drawn.found or (claim.than and claim.than not in drawn.found):
            continue
        ratios, judged = _judged(claim, drawn, mirrored)
        sound = _converged(claim, drawn, mirrored)
        verdicts = [each if counts else None for each, counts in zip(judged, sound, strict=True)]
        yes = np.array([each == "reproduced" for each in judged])[sound]
        counted = {
            name: [each for each, counts in zip(own, sound, strict=True) if counts] for name, own in values.items()
        }
        leaves = deciding(yes, counted) if sound.any() else []
        first = counted[leaves[0].name] if leaves and leaves[0].share >= _LEAST else []
        cut = split(yes, first) if first and not isinstance(first[0], str) else None
        told = _worded(leaves[0].name, yes, first, cut) if first else ""
        found.append(Strip(claim, ratios, verdicts, leaves, cut, told))
    return found


def _converged(claim: Claim, drawn: Reactions, mirrored: Reactions | None) -> NDArray[np.bool_]:
    """In which draws none of the numbers that a claim is judged by depends on the integration step."""
    rows = [drawn.converged[label] for label in (claim.label, claim.than) if label]
    if claim.evidence == "symmetry":
        assert mirrored is not None
        rows.append(mirrored.converged[claim.label])
    sound: NDArray[np.bool_] = np.logical_and.reduce(rows)
    return sound


def _worded(name: str, yes: NDArray[np.bool_], values: Sequence[Any], cut: Threshold | None) -> str:
    """Where it holds by one unknown, with the shares there and elsewhere."""
    kept = np.array(values, object)
    if cut is None:
        shares = {each: float(yes[kept == each].mean()) for each in dict.fromkeys(values)}
        best = max(shares, key=lambda each: shares[each])
        other = float(yes[kept != best].mean())
        return f"{100 * shares[best]:.0f} % where {name} is {best}, {100 * other:.0f} % elsewhere"
    parts = [f"{100 * cut.below:.0f} % where {name} < {cut.at:.3g}", f"{100 * cut.above:.0f} % above"]
    none = yes[kept == np.inf]
    return ", ".join([*parts, f"{100 * float(none.mean()):.0f} % where there is none"] if len(none) else parts)


def _judged(
    claim: Claim, drawn: Reactions, mirrored: Reactions | None
) -> tuple[NDArray[np.float64], list[VerdictName]]:
    """In the box the reference is drawn too: settling counts from its beginning, as the paper's does."""
    if claim.evidence == "together":
        return _together(claim, drawn.found[claim.label])
    if claim.evidence == "arrival":
        missing = drawn.found[claim.label]["missing"]
        return missing / SHORT, [of_numbers(SHORT, [each], "at most").verdict for each in missing]
    metric = "settling" if claim.metric == "settling_after" else str(claim.metric)
    ours = drawn.found[claim.label][metric]
    if claim.evidence == "symmetry":
        assert mirrored is not None
        other = mirrored.found[claim.label][metric]
        orders = [of_ordering([a], [b]) for a, b in zip(ours, other, strict=True)]
        alike = [each.reason.startswith("alike") for each in orders]
        return other / ours, ["reproduced" if each else "does not hold" for each in alike]
    if claim.than is not None:
        other = drawn.found[claim.than][metric]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = other / ours
        return ratios, [of_ordering([a], [b]).verdict for a, b in zip(ours, other, strict=True)]
    assert claim.value is not None
    return ours / claim.value, [of_numbers(printed(claim), [each], claim.sense).verdict for each in ours]


def _together(claim: Claim, ours: Mapping[str, NDArray[np.float64]]) -> tuple[NDArray[np.float64], list[VerdictName]]:
    """All numbers of a row of T2 at once: the largest ratio to one of them, either way, and whether all come out."""
    row = T2[str(claim.controller)]._asdict()
    with np.errstate(divide="ignore"):
        ratios = np.exp(np.max([np.abs(np.log(ours[name] / value)) for name, value in row.items()], axis=0))
    single = [[of_numbers(rounded(value), [each]).verdict for each in ours[name]] for name, value in row.items()]
    held = [set(each) == {"reproduced"} for each in zip(*single, strict=True)]
    return ratios, ["reproduced" if each else "does not hold" for each in held]


def strips_frame(found: Sequence[Strip]) -> pd.DataFrame:
    """One row per claim: shares of the box's settings that converged, with 95 % intervals, and the two unknowns that
    decide most."""
    import pandas as pd

    rows = []
    for each in found:
        row: dict[str, Any] = {"claim": each.claim.id, "draws": len(each.verdicts), "not_converged": each.uncounted}
        for key, own in (
            ("reproduced", each.share("reproduced")),
            ("better", each.share("better than the paper")),
            ("fails", each.share(*FAILING)),
        ):
            row |= {key: own.value, f"{key}_low": own.low, f"{key}_high": own.high}
        for at, leaf in enumerate(each.leaves[:2], start=1):
            row |= {f"leaf_{at}": leaf.name, f"explained_{at}": leaf.share}
        rows.append(row | {"decided": each.told})
    return pd.DataFrame(rows)


def draws_frame(drawn: Reactions) -> pd.DataFrame:
    """Every draw: what each unknown is, every reading of every row, and whether these have converged."""
    import pandas as pd

    columns: dict[str, Any] = {name: drawn.values(name) for name in drawn.settings[0].values}
    readings: Mapping[str, Any] = {
        f"{row} {name}": values for row, each in drawn.found.items() for name, values in each.items()
    }
    converged: Mapping[str, Any] = {f"{row} converged": each for row, each in drawn.converged.items()}
    return pd.DataFrame(columns | dict(readings) | dict(converged))
