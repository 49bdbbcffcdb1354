"""The paper's claims over the box of what it leaves open: in which share each verdict holds, and what decides it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.claims import NOMINAL, printed, rows_asked
from wristctl.comparison.paper import T2, rounded
from wristctl.comparison.tie_groups import Share, share
from wristctl.comparison.unknowns_sampling import Reactions
from wristctl.comparison.verdicts import FAILING, of_numbers, of_ordering
from wristctl.config.audit import Claim, VerdictName
from wristctl.config.controller_row import Row
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
    leaves = [Leaf(name, _explained(yes.astype(float), _bins(column))) for name, column in values.items()]
    return sorted(leaves, key=lambda leaf: -leaf.share)


def _bins(values: Sequence[Any]) -> NDArray[np.int64]:
    """Bin number of every value: one bin a value for few values, equally full bins for many; infinity has its own."""
    if isinstance(values[0], str) or len(set(values)) <= _BINS:
        known = {value: number for number, value in enumerate(dict.fromkeys(values))}
        return np.array([known[value] for value in values])
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
    finite = np.isfinite(x)
    order = np.argsort(x[finite], kind="stable")
    x, y = x[finite][order], yes[finite][order]
    threshold = _threshold(x, y)
    if threshold is None:
        return None
    rng = np.random.default_rng(seed)
    drawn = [np.sort(rng.integers(0, len(x), len(x))) for _ in range(_RESAMPLES)]
    again = [cut for cut in (_threshold(x[indices], y[indices]) for indices in drawn) if cut is not None]
    low, high = np.quantile(again, (0.025, 0.975))
    under = x < threshold
    return Threshold(threshold, float(low), float(high), float(y[under].mean()), float(y[~under].mean()))


def _threshold(x: Array, y: NDArray[np.bool_]) -> float | None:
    """Between two of the sorted values, halfway in their logarithm where they are positive."""
    before, k = np.cumsum(y)[:-1].astype(float), np.arange(1.0, len(y))
    gain = before**2 / k + (y.sum() - before) ** 2 / (len(y) - k)
    possible = x[1:] > x[:-1]
    if not possible.any() or y.all() or not y.any():
        return None
    best = int(np.where(possible, gain, -1.0).argmax())
    one, upper = float(x[best]), float(x[best + 1])
    return float(np.sqrt(one * upper)) if one > 0.0 else 0.5 * (one + upper)


# Evidence that draws give.
IN_BOX = ("comparison", "ordering", "arrival", "together", "symmetry")
# Share of the variance below which no unknown decides.
_LEAST = 0.01


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
    """Threshold of the first leaf, where it is a number."""
    told: str
    """Description of where the claim holds by the first leaf."""

    def share(self, *verdicts: VerdictName) -> Share:
        """Share of the draws with one of these verdicts, among those that have a verdict."""
        return share(np.array([verdict in verdicts for verdict in self.verdicts if verdict is not None], bool))

    @property
    def uncounted(self) -> int:
        """Draws that have none, since they did not converge."""
        return sum(verdict is None for verdict in self.verdicts)


def rows_in_box(claims: Sequence[Claim]) -> list[Row]:
    """The rows that the claims need, each once; those of a symmetry are run to both sides."""
    return rows_asked(_boxed(claims))


def _boxed(claims: Sequence[Claim]) -> list[Claim]:
    return [claim for claim in claims if claim.evidence in IN_BOX and claim.stiffness_scale == NOMINAL]


def strips(claims: Sequence[Claim], drawn: Reactions, mirrored: Reactions | None = None) -> list[Strip]:
    """Every claim that draws can judge, by those of its rows."""
    values = {name: np.array(drawn.values(name), object) for name in drawn.settings[0].values}
    found = []
    for claim in _boxed(claims):
        if claim.label not in drawn.found or (claim.than and claim.than not in drawn.found):
            continue
        ratios, judged = _judged(claim, drawn, mirrored)
        sound = _converged(claim, drawn, mirrored)
        verdicts = [verdict if counts else None for verdict, counts in zip(judged, sound, strict=True)]
        yes = np.array([verdict == "reproduced" for verdict in judged])[sound]
        counted = {name: column[sound].tolist() for name, column in values.items()}
        leaves, cut, description = deciding(yes, counted) if sound.any() else [], None, ""
        if leaves and leaves[0].share >= _LEAST:
            first = counted[leaves[0].name]
            cut = None if isinstance(first[0], str) else split(yes, first)
            description = _worded(leaves[0].name, yes, first, cut)
        found.append(Strip(claim, ratios, verdicts, leaves, cut, description))
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
    """Description of where a claim holds by one unknown, with the shares there and elsewhere."""
    kept = np.array(values, object)
    if cut is None:
        shares = {value: float(yes[kept == value].mean()) for value in dict.fromkeys(values)}
        best = max(shares, key=lambda value: shares[value])
        other_share = float(yes[kept != best].mean())
        return f"{100 * shares[best]:.0f} % where {name} is {best}, {100 * other_share:.0f} % elsewhere"
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
        return missing / SHORT, [of_numbers(SHORT, [shortfall], "at most").verdict for shortfall in missing]
    metric = "settling" if claim.metric == "settling_after" else str(claim.metric)
    ours = drawn.found[claim.label][metric]
    if claim.evidence == "symmetry":
        assert mirrored is not None
        than_metric = mirrored.found[claim.label][metric]
        orders = [of_ordering([a], [b]) for a, b in zip(ours, than_metric, strict=True)]
        alike = [order.reason.startswith("alike") for order in orders]
        return than_metric / ours, ["reproduced" if tied else "does not hold" for tied in alike]
    if claim.than is not None:
        than_metric = drawn.found[claim.than][metric]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = than_metric / ours
        return ratios, [of_ordering([a], [b]).verdict for a, b in zip(ours, than_metric, strict=True)]
    assert claim.value is not None
    return ours / claim.value, [of_numbers(printed(claim), [value], claim.sense).verdict for value in ours]


def _together(claim: Claim, ours: Mapping[str, NDArray[np.float64]]) -> tuple[NDArray[np.float64], list[VerdictName]]:
    """All numbers of a row of T2 at once: the largest ratio to one of them, either way, and whether all come out."""
    row = T2[str(claim.controller)]._asdict()
    with np.errstate(divide="ignore"):
        ratios = np.exp(np.max([np.abs(np.log(ours[name] / value)) for name, value in row.items()], axis=0))
    single = [[of_numbers(rounded(value), [number]).verdict for number in ours[name]] for name, value in row.items()]
    held = [set(verdict_names) == {"reproduced"} for verdict_names in zip(*single, strict=True)]
    return ratios, ["reproduced" if reproduced else "does not hold" for reproduced in held]


def strips_frame(found: Sequence[Strip]) -> pd.DataFrame:
    """One row per claim: shares of the box's settings that converged, with 95 % intervals, and the two unknowns that
    decide most."""
    import pandas as pd

    rows = []
    for strip in found:
        row: dict[str, Any] = {"claim": strip.claim.id, "draws": len(strip.verdicts), "not_converged": strip.uncounted}
        for key, proportion in (
            ("reproduced", strip.share("reproduced")),
            ("better", strip.share("better than the paper")),
            ("fails", strip.share(*FAILING)),
        ):
            row |= {key: proportion.value, f"{key}_low": proportion.low, f"{key}_high": proportion.high}
        for rank, leaf in enumerate(strip.leaves[:2], start=1):
            row |= {f"leaf_{rank}": leaf.name, f"explained_{rank}": leaf.share}
        rows.append(row | {"decided": strip.told})
    return pd.DataFrame(rows)


def draws_frame(drawn: Reactions) -> pd.DataFrame:
    """Every draw: what each unknown is, every reading of every row, and whether these have converged."""
    import pandas as pd

    columns: dict[str, Any] = {name: drawn.values(name) for name in drawn.settings[0].values}
    readings: Mapping[str, Any] = {
        f"{row} {name}": values for row, metrics in drawn.found.items() for name, values in metrics.items()
    }
    converged: Mapping[str, Any] = {f"{row} converged": flags for row, flags in drawn.converged.items()}
    return pd.DataFrame(columns | dict(readings) | dict(converged))
