"""Optimisers behind one ask/tell face; a newcomer is one file, and one line in `wristctl.config.choices`."""

from wristctl.config.choices import OPTIMISERS as _TABLE
from wristctl.config.choices import Choices
from wristctl.tuning.optimisers.base import Best, Optimiser

OPTIMISERS: Choices[type[Optimiser]] = _TABLE

__all__ = ["OPTIMISERS", "Best", "Optimiser"]
