"""Errors of predictions with intervals by a bootstrap of their blocks, and ratios of two, paired by blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.identification.arc_robot import ArcRecording

_DRAWS, _SEED = 4000, 0


class Score(NamedTuple):
    """RMS error with its 95 % interval, and the number of blocks that were drawn for it."""

    error: float
    low: float
    high: float
    blocks: int


class Predicted(Protocol):
    """Whatever predicts a part of recordings."""

    @property
    def squares(self) -> tuple[Array, Array]:
        """Sum of squared errors and number of samples of each block of what was predicted."""
        ...


def score_of(fits: Sequence[Predicted]) -> Score:
    """RMS error of what was predicted, with an interval by a bootstrap of its blocks."""
    sums, counts = (np.concatenate(parts) for parts in zip(*(fit.squares for fit in fits), strict=True))
    drawn = _drawn(len(sums))
    low, high = np.quantile(np.sqrt(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)), [0.025, 0.975])
    return Score(math.sqrt(sums.sum() / counts.sum()), float(low), float(high), len(sums))


def ratio_of(fits: Sequence[Predicted], others: Sequence[Predicted]) -> Score:
    """Error of what was predicted over that of other fits of the same, paired by blocks."""
    mine, theirs = (np.concatenate([fit.squares[0] for fit in some]) for some in (fits, others))
    drawn = _drawn(len(mine))
    low, high = np.quantile(np.sqrt(mine[drawn].sum(axis=1) / theirs[drawn].sum(axis=1)), [0.025, 0.975])
    return Score(math.sqrt(mine.sum() / theirs.sum()), float(low), float(high), len(mine))


def squares_of_blocks(
    errors: Sequence[Array], recordings: Sequence[ArcRecording], centred: bool
) -> tuple[Array, Array]:
    """Sum of squared errors and number of samples of each block of what was predicted, of errors (T, d) each."""
    parts = [(e[r.asked], r.block[r.asked]) for e, r in zip(errors, recordings, strict=True)]
    wrong, block = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    if centred:
        wrong = wrong - wrong.mean(axis=0)
    squares, numbers = np.sum(wrong**2, axis=1), np.unique(block, return_inverse=True)[1]
    return np.bincount(numbers, squares).astype(float), np.bincount(numbers).astype(float)


def _drawn(blocks: int) -> NDArray[np.int64]:
    return np.random.default_rng(_SEED).integers(blocks, size=(_DRAWS, blocks))
