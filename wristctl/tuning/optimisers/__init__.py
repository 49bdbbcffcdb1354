"""Optimisers behind one ask/tell face; a newcomer is one file and one entry here."""

from __future__ import annotations

from wristctl.tuning.optimisers.base import Best, Optimiser
from wristctl.tuning.optimisers.differential_evolution import DifferentialEvolution
from wristctl.tuning.optimisers.pso import ParticleSwarm
from wristctl.tuning.optimisers.random_search import RandomSearch

OPTIMISERS: dict[str, type[Optimiser]] = {
    chosen.name: chosen for chosen in (ParticleSwarm, DifferentialEvolution, RandomSearch)
}

__all__ = ["OPTIMISERS", "Best", "Optimiser"]
