"""Outcome of rollouts: metrics, failures, how finely they were integrated, and what was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.simulation.kernel import columns_of_sample, parts_of_sample
from wristctl.simulation.motion import DERIVATIVES


class KeptSamples(NamedTuple):
    """Samples of rollouts, of a batch or of several."""

    parts: Sequence[Array]
    """Samples of each batch (blocks, T, columns, lanes)."""
    places: NDArray[np.int64]
    """Batch of each rollout and its number within the batch, (count, 2)."""

    @classmethod
    def of(cls, record: Array, count: int) -> Self:
        """A batch's record, (blocks, T, columns, LANES), or (1, T, columns) of a rollout alone."""
        places = np.stack([np.zeros(count, np.int64), np.arange(count)], axis=1)
        return cls([record if record.ndim == 4 else record[..., None]], places)

    @classmethod
    def joined(cls, kept: Sequence[KeptSamples], order: NDArray[np.int64]) -> Self:
        """Samples of all `kept` after each other, in this order."""
        before = np.cumsum([0, *(len(samples.parts) for samples in kept)])
        places = [samples.places + np.array([first, 0]) for first, samples in zip(before.tolist(), kept, strict=False)]
        return cls([part for samples in kept for part in samples.parts], np.concatenate(places)[order])

    def rows(self, rollouts: NDArray[np.int64]) -> KeptSamples:
        """Some of the rollouts, in this order; nothing is copied."""
        return KeptSamples(self.parts, self.places[rollouts])

    def column(self, number: int) -> Array:
        """One column of every rollout, (count, T)."""
        values = np.empty((len(self.places), self.parts[0].shape[1]))
        for part, blocks in enumerate(self.parts):
            indices = np.flatnonzero(self.places[:, 0] == part)
            block, lane = np.divmod(self.places[indices, 1], blocks.shape[3])
            values[indices] = blocks[block, :, number, lane]
        return values

    def rollout(self, number: int) -> Array:
        """A view of one rollout's samples, (T, columns)."""
        part, index = self.places[number]
        blocks = self.parts[part]
        samples: Array = blocks[index // blocks.shape[3], :, :, index % blocks.shape[3]]
        return samples

    def all(self) -> Array:
        """Everything, (count, T, columns)."""
        return np.array([self.rollout(number) for number in range(len(self.places))])


@dataclass(frozen=True)
class Outcome:
    """Metrics of each rollout, shape (count,), and, where recorded, its samples."""

    metrics: dict[str, Array]
    failed: NDArray[np.bool_]
    """Rollouts whose wrist left its range, or bent to no number at all."""
    until: Array
    """When they were last within it [s]: where they have failed."""
    references: Array
    """References, bend with rate and acceleration in each plane, (motions, 3 P, T)."""
    steps: NDArray[np.int64]
    """Integration steps in a control period, (count,)."""
    step_error: Array
    """Sum of the estimated errors of all steps, as an angle, (count,) [rad]."""
    drift: Array
    """Change of RMSE or error at the end at the shortest steps tried, (count,) [rad]; 0: converged."""
    kept: KeptSamples | None = None
    places: int = 2
    """Places of tendons."""

    @property
    def unconverged(self) -> NDArray[np.bool_]:
        """Rollouts whose numbers depend on the integration step, (count,)."""
        changing: NDArray[np.bool_] = self.drift > 0.0
        return changing

    @property
    def planes(self) -> int:
        """Planes that the wrists bend in."""
        return int(self.references.shape[1]) // DERIVATIVES

    @property
    def samples(self) -> Array | None:
        """All that was recorded of all, (count, T, columns)."""
        return None if self.kept is None else self.kept.all()

    def column(self, name: str, rollout: int) -> Array:
        """One recorded column of one rollout, (T,)."""
        assert self.kept is not None
        return self.kept.rollout(rollout)[:, self._names.index(name)].copy()

    def columns(self, name: str) -> Array:
        """One recorded column of all, (count, T)."""
        assert self.kept is not None
        return self.kept.column(self._names.index(name))

    def each(self, kind: str) -> list[Array]:
        """Recorded columns of a kind of `parts_of_sample`, (count, T) of each plane or place."""
        assert self.kept is not None
        part = parts_of_sample(self.planes, self.places)[kind]
        return [self.kept.column(number) for number in range(part.start, part.stop)]

    def part(self, kind: str, rollout: int) -> Array:
        """What one rollout's samples have of a kind of `parts_of_sample`, (T, planes, places or coordinates)."""
        assert self.kept is not None
        return self.kept.rollout(rollout)[:, parts_of_sample(self.planes, self.places)[kind]].copy()

    def coordinates(self, rollout: int) -> Array:
        """The plant's coordinates, the angles of its segments, (T, q) [rad]."""
        return self.part("coordinates", rollout)

    @property
    def _names(self) -> tuple[str, ...]:
        return columns_of_sample(self.planes, self.places)

    def rows(self, rollouts: NDArray[np.int64]) -> Outcome:
        """Some of the rollouts, in this order."""
        return replace(
            self,
            metrics={name: values[rollouts] for name, values in self.metrics.items()},
            failed=self.failed[rollouts],
            until=self.until[rollouts],
            steps=self.steps[rollouts],
            step_error=self.step_error[rollouts],
            drift=self.drift[rollouts],
            kept=None if self.kept is None else self.kept.rows(rollouts),
        )

    @classmethod
    def joined(cls, parts: Sequence[Outcome], order: NDArray[np.int64]) -> Outcome:
        """The rollouts of all parts after each other, in this order; references are the first part's."""

        def together(values: Sequence[NDArray[Any]]) -> NDArray[Any]:
            return np.concatenate(values)[order]

        kept = [part.kept for part in parts if part.kept is not None]
        return cls(
            {name: together([part.metrics[name] for part in parts]) for name in parts[0].metrics},
            together([part.failed for part in parts]),
            together([part.until for part in parts]),
            parts[0].references,
            together([part.steps for part in parts]),
            together([part.step_error for part in parts]),
            together([part.drift for part in parts]),
            KeptSamples.joined(kept, order) if kept else None,
            parts[0].places,
        )

    def replaced(self, rollouts: NDArray[np.int64], replacements: Outcome) -> Outcome:
        """Outcome with `replacements` in the place of these rollouts."""
        order = np.arange(len(self.failed))
        order[rollouts] = len(order) + np.arange(len(rollouts))
        return Outcome.joined([self, replacements], order) if len(rollouts) else self
