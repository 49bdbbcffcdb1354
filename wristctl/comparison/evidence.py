"""What claims are judged by, and what has to be run for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.config.audit import Claim
from wristctl.config.control import CompareSettings, Row
from wristctl.config.loop import LOOPS, Reference
from wristctl.config.study import Study

if TYPE_CHECKING:
    import pandas as pd

TRAININGS = {"table1": "experiments/table1.yaml", "selection": "experiments/model_selection.yaml"}
"""Evidence that a train run gives, and the experiment it is a run of."""

Metrics = Mapping[str, Mapping[str, Any]]
"""value, interval and n of a training's metrics, by name"""

LoopCondition = tuple[str, float]
"""A loop's name, and the springs' stiffness over what the controller knows."""

NOMINAL = 1.0
"""Springs as stiff as the controller knows them; beside it stands what is asked of others."""
_BY_LOOPS = ("comparison", "ordering", "arrival")


class TrialsDone(NamedTuple):
    """Trials of an experiment: a row each with the metrics of `hw-run`."""

    trials: pd.DataFrame
    motion: float
    """How long their reference moves [s]; 0 for a step."""
    emulated: bool


@dataclass(frozen=True)
class Grounds:
    """What there is to judge by."""

    loops: Mapping[LoopCondition, pd.DataFrame] = field(default_factory=dict)
    trainings: Mapping[str, Metrics] = field(default_factory=dict)
    hardware: TrialsDone | None = None
    tension_limit: float = np.inf
    """Of the wrist [N], which a loop without limits may pass."""


def conditions_of(claims: Sequence[Claim]) -> list[LoopCondition]:
    """On what the claims ask for rollouts."""
    scales = dict.fromkeys(claim.stiffness_scale for claim in claims if claim.evidence in _BY_LOOPS)
    return [(loop, scale) for scale in dict.fromkeys((NOMINAL, *scales)) for loop in LOOPS] if scales else []


def rows_of(claims: Sequence[Claim], scale: float) -> list[Row]:
    """The controllers with their gains that the claims ask for, each once."""
    own = [each for each in claims if each.evidence in _BY_LOOPS and scale in (NOMINAL, each.stiffness_scale)]
    labels = dict.fromkeys(label for each in own for label in (each.label, each.than) if label)
    pairs = [label.split("/") for label in labels]
    return [Row(controller=name, gains=gains) for name, gains in pairs]


def evidence_study(study: Study, claims: Sequence[Claim], condition: LoopCondition) -> Study:
    """The comparison under one condition that the claims ask for: their rows on both minimum-jerk moves."""
    name, scale = condition
    loop = LOOPS[name]
    softened = loop.model_copy(update={"plant": loop.plant.model_copy(update={"stiffness_scale": scale})})
    compared = CompareSettings(
        rows=tuple(rows_of(claims, scale)),
        loops={name: softened},
        references=(Reference(kind="step"), Reference(duration=1.0), Reference(duration=2.0)),
        inverses=("none",),
        horizon=study.audit.horizon,
    )
    return study.model_copy(update={"compare": compared})
