"""What rollouts have recorded, as the kernel leaves it; columns are taken out of the blocks of lanes when asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array


class KeptSamples:
    """Samples of `count` rollouts out of (blocks, T, columns, LANES), or (1, T, columns) of one alone."""

    def __init__(self, blocks: Array, count: int) -> None:
        self._parts = [blocks if blocks.ndim == 4 else blocks[..., None]]
        self._places = np.stack([np.zeros(count, np.int64), np.arange(count)], axis=1)

    @classmethod
    def joined(cls, parts: Sequence[KeptSamples], order: NDArray[np.int64]) -> KeptSamples:
        """Of all parts after each other, in this order."""
        found = cls.__new__(cls)
        found._parts = [each for part in parts for each in part._parts]
        before = np.cumsum([0, *(len(part._parts) for part in parts)])
        places = [part._places + np.array([first, 0]) for first, part in zip(before[:-1].tolist(), parts, strict=True)]
        found._places = np.concatenate(places)[order]
        return found

    def column(self, number: int) -> Array:
        """One column of every rollout, (count, T)."""
        found = np.empty((len(self._places), self._parts[0].shape[1]))
        for part, blocks in enumerate(self._parts):
            own = np.flatnonzero(self._places[:, 0] == part)
            lanes = np.moveaxis(blocks[:, :, number], 1, 2).reshape(-1, blocks.shape[1])
            found[own] = lanes[self._places[own, 1]]
        return found

    def rollout(self, number: int) -> Array:
        """A view of one rollout's samples, (T, columns)."""
        part, lane = self._places[number]
        blocks = self._parts[part]
        found: Array = blocks[lane // blocks.shape[3], :, :, lane % blocks.shape[3]]
        return found

    def all(self) -> Array:
        """Everything, (count, T, columns)."""
        return np.array([self.rollout(each) for each in range(len(self._places))])
