"""Comparison of trainings: means with intervals, and tests between rows paired by seed or fold."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from wristctl.arrays import Array
from wristctl.config.learning import NetworkSettings

# Significance level, after Holm's correction over all pairs of a group.
LEVEL = 0.05


@dataclass(frozen=True)
class Pair:
    """Two rows, the better one first."""

    better: str
    worse: str
    difference: float
    """median over the seeds of worse minus better"""
    p: float
    """Wilcoxon's signed-rank test, two-sided, corrected by Holm (Scand. J. Statist. 6 (1979) 65)"""


@dataclass(frozen=True)
class Ranking:
    """Rows by their mean, least first, with a test of the whole and one of every pair."""

    order: tuple[str, ...]
    friedman_p: float
    """p value of Friedman's test that all rows are alike; nan for fewer than three rows"""
    pairs: tuple[Pair, ...]

    def supports_best(self, name: str) -> bool:
        """Whether this row is better than every other at LEVEL."""
        beaten = [pair for pair in self.pairs if pair.better == name and pair.p < LEVEL]
        return len(beaten) == len(self.order) - 1

    def supports_better(self, name: str) -> bool:
        """Whether some other row is better than this one at LEVEL."""
        return any(pair.worse == name and pair.p < LEVEL for pair in self.pairs)


def mean_interval(values: Sequence[float] | Array) -> tuple[float, float, float]:
    """Mean and ends of its 95 % interval (Student's t); the ends are nan for fewer than two values."""
    array = np.asarray(values, float)
    mean = float(array.mean())
    if len(array) < 2:
        return mean, np.nan, np.nan
    from scipy.stats import t

    half = float(t.ppf(0.975, len(array) - 1) * array.std(ddof=1) / np.sqrt(len(array)))
    return mean, mean - half, mean + half


def rank(errors: Mapping[str, Sequence[float] | Array]) -> Ranking:
    """Rank rows by errors (less is better), one for each seed, the same seeds in every row; at least two rows."""
    from scipy.stats import friedmanchisquare, wilcoxon

    columns = {name: np.asarray(values, float) for name, values in errors.items()}
    order = tuple(sorted(columns, key=lambda name: columns[name].mean()))
    comparisons = []
    for better, worse in combinations(order, 2):
        difference = columns[worse] - columns[better]
        p = float(wilcoxon(difference).pvalue) if np.any(difference != 0.0) else 1.0
        comparisons.append((better, worse, float(np.median(difference)), p))
    friedman_p = float(friedmanchisquare(*columns.values()).pvalue) if len(columns) > 2 else np.nan
    corrected = holm([p for *_, p in comparisons])
    pairs = tuple(Pair(a, b, difference, p) for (a, b, difference, _), p in zip(comparisons, corrected, strict=True))
    return Ranking(order, friedman_p, pairs)


def holm(p: Sequence[float]) -> list[float]:
    """p-values corrected for being several, in their order."""
    corrected, least = [0.0] * len(p), 0.0
    for place, index in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        least = max(least, min(1.0, (len(p) - place) * p[index]))
        corrected[index] = least
    return corrected


def trained_alike(networks: Mapping[str, NetworkSettings]) -> dict[str, list[str]]:
    """Names of networks by how they were trained, `adamw-standardised` for one: only these can be ranked.

    A network that was trained as no other was is left out.
    """
    groups: dict[str, list[str]] = {}
    for name, settings in networks.items():
        label = f"{settings.optimiser}-{'standardised' if settings.standardise else 'raw'}"
        groups.setdefault(label, []).append(name)
    return {label: names for label, names in groups.items() if len(names) > 1}
