"""What rollouts have recorded, as the kernel leaves it; columns are taken out of the blocks of lanes when asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array


class KeptSamples(NamedTuple):
    """Samples of rollouts, of a batch or of several."""

    parts: Sequence[Array]
    """Of each batch (blocks, T, columns, lanes)."""
    places: NDArray[np.int64]
    """Of each rollout its batch and which of that one's it is, (count, 2)."""

    @classmethod
    def of(cls, record: Array, count: int) -> Self:
        """A batch's record, (blocks, T, columns, LANES), or (1, T, columns) of a rollout alone."""
        places = np.stack([np.zeros(count, np.int64), np.arange(count)], axis=1)
        return cls([record if record.ndim == 4 else record[..., None]], places)

    @classmethod
    def joined(cls, kept: Sequence[KeptSamples], order: NDArray[np.int64]) -> Self:
        """Of all after each other, in this order."""
        before = np.cumsum([0, *(len(each.parts) for each in kept)])
        places = [each.places + np.array([first, 0]) for first, each in zip(before.tolist(), kept, strict=False)]
        return cls([part for each in kept for part in each.parts], np.concatenate(places)[order])

    def rows(self, rollouts: NDArray[np.int64]) -> KeptSamples:
        """Some of the rollouts, in this order; nothing is copied."""
        return KeptSamples(self.parts, self.places[rollouts])

    def column(self, number: int) -> Array:
        """One column of every rollout, (count, T)."""
        found = np.empty((len(self.places), self.parts[0].shape[1]))
        for part, blocks in enumerate(self.parts):
            own = np.flatnonzero(self.places[:, 0] == part)
            block, lane = np.divmod(self.places[own, 1], blocks.shape[3])
            found[own] = blocks[block, :, number, lane]
        return found

    def rollout(self, number: int) -> Array:
        """A view of one rollout's samples, (T, columns)."""
        part, each = self.places[number]
        blocks = self.parts[part]
        found: Array = blocks[each // blocks.shape[3], :, :, each % blocks.shape[3]]
        return found

    def all(self) -> Array:
        """Everything, (count, T, columns)."""
        return np.array([self.rollout(each) for each in range(len(self.places))])
