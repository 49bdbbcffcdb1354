"""A controller with gains that is tested, and the spread of its error over simulated rigs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.kept_studies import file_of

if TYPE_CHECKING:
    from wristctl.arrays import Array

# Rigs from which 95 % of them are told: of fewer, the ends would be the least and the largest error.
ENOUGH = 40


class Candidate(NamedTuple):
    """A controller with gains that are tested."""

    controller: str
    origin: str
    """`tuned`, or `scaled preset`."""
    gains: dict[str, float]

    @property
    def label(self) -> str:
        """Controller and origin."""
        return f"{self.controller} ({self.origin})" if self.gains else self.controller

    @property
    def file(self) -> str:
        """Its study file in the run: data/controllers/ct-dob-tuned.yaml."""
        return file_of(self.label)


def spread(errors: Array) -> tuple[float, float, float]:
    """Ends of the range in which another rig errs with a probability of 95 % [rad], and the median between them.

    Of n rigs drawn alike another one stays below the k-th smallest with a probability of k/(n + 1). Of fewer than 39
    rigs the ends are the least and the largest error.
    """
    import numpy as np

    ordered = np.sort(errors)
    first = max(0, int(0.025 * (len(ordered) + 1)) - 1)
    return float(ordered[first]), float(np.median(ordered)), float(ordered[-1 - first])


def share_of(count: int) -> str:
    """How many of the simulated rigs an interval is of; of few the number alone."""
    return f"95 % of {count}" if count >= ENOUGH else f"{count}"
