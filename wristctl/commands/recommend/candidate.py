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
    """Error [rad] that 2.5, 50 and 97.5 of 100 rigs stay below."""
    import numpy as np

    low, median, high = np.percentile(errors, (2.5, 50.0, 97.5), method="nearest")
    return float(low), float(median), float(high)


def share_of(count: int) -> str:
    """How many of the simulated rigs an interval is of; of few the number alone."""
    return f"95 % of {count}" if count >= ENOUGH else f"{count}"
