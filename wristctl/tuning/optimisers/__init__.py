"""Optimisers behind one ask/tell face; a newcomer is one file, and one line in `wristctl.config.tables`."""

from __future__ import annotations

from wristctl.config.tables import OPTIMISERS as _TABLE
from wristctl.config.tables import Table
from wristctl.tuning.optimisers.base import Best, Optimiser

OPTIMISERS: Table[type[Optimiser]] = _TABLE

__all__ = ["OPTIMISERS", "Best", "Optimiser"]
