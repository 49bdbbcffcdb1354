"""Whether three hidden layers are better than any other number of them (C15), by cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wristctl.config.learning import Activation
from wristctl.learning.ranking import LEVEL, holm
from wristctl.learning.selection import CrossValidated

THREE = 3
"""Hidden layers of the paper's network."""


@dataclass(frozen=True)
class Depth:
    """The network of least error of one depth, beside that of three layers."""

    best: CrossValidated
    p: float
    """paired t-test over the folds against three layers, corrected by Holm; nan for three itself"""
    than_three: Literal["better", "worse", "no difference shown", ""]
    """empty for three layers, and where there are none of three"""


@dataclass(frozen=True)
class DepthComparison:
    """The depths of one activation, fewest layers first."""

    activation: Activation
    depths: tuple[Depth, ...]
    three_is_best: bool | None
    """whether three layers are better than every other depth at LEVEL; None where there are none of three"""


def compare_depths(found: Sequence[CrossValidated]) -> list[DepthComparison]:
    """Every activation of a grid, in its order; all networks were judged on the same folds."""
    activations = dict.fromkeys(each.settings.activation for each in found)
    return [_compared(name, [each for each in found if each.settings.activation == name]) for name in activations]


def _compared(activation: Activation, found: Sequence[CrossValidated]) -> DepthComparison:
    from scipy.stats import ttest_rel

    least: dict[int, CrossValidated] = {}
    for each in found:
        if each.depth not in least or each.mean < least[each.depth].mean:
            least[each.depth] = each
    three, others = least.get(THREE), [depth for depth in least if depth != THREE]
    if three is None:
        return DepthComparison(activation, tuple(Depth(each, np.nan, "") for _, each in sorted(least.items())), None)
    p = [
        float(ttest_rel(least[depth].rmse, three.rmse).pvalue)
        if np.isfinite([least[depth].mean, three.mean]).all()
        else np.nan
        for depth in others
    ]
    corrected = dict(zip(others, holm(p), strict=True))
    depths = [_beside(each, three, corrected.get(depth, np.nan)) for depth, each in sorted(least.items())]
    best = all(least[depth].mean > three.mean and corrected[depth] < LEVEL for depth in others)
    return DepthComparison(activation, tuple(depths), best)


def _beside(each: CrossValidated, three: CrossValidated, p: float) -> Depth:
    if each is three:
        return Depth(each, p, "")
    if not p < LEVEL:
        return Depth(each, p, "no difference shown")
    return Depth(each, p, "better" if each.mean < three.mean else "worse")
