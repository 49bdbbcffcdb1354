"""Gains measured on a range of held-out worlds, as a unit of work; and the pieces put together again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wristctl.comparison.world_ranking import RANKED, RankedRow
from wristctl.config.families import Family
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.simulation.cases import Measured, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.oscillation import LIMIT_CYCLE, chatter
from wristctl.work.unit import Unit

_ROLLOUTS = 8_000
"""Of one unit, at most: some ten seconds of one core."""


def judge_units(
    study: Study, family: str, law: str, gains: Mapping[str, float], worlds: int, noises: int
) -> list[Unit]:
    """Gains of a law on so many held-out worlds of a family, each motion there with as many streams of noise.

    A family whose sensors have no noise is measured once.
    """
    needed = study.model_copy(update={"families": {family: study.families[family]}})
    content = json.loads(needed.model_dump_json(by_alias=True, include={"seed", "wrist", "families"}))
    times = noises_of(study.families[family], noises)
    each = len(study.families[family].references) * times
    together = max(1, _ROLLOUTS // each)
    units = []
    for first in range(0, worlds, together):
        many = min(together, worlds - first)
        spec = {
            "study": content, "family": family, "law": law, "gains": dict(gains), "first": first, "worlds": many,
            "noises": times,
        }  # fmt: skip
        name = f"{law} on worlds {first} to {first + many - 1} of {family}"
        units.append(Unit("wristctl.comparison.judge_unit:judged", spec, name, many * each))
    return units


def noises_of(family: Family, noises: int) -> int:
    """How often a motion in a world is worth running: once where no camera adds noise."""
    return noises if family.loop.sensor.level == "camera" else 1


def judged(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """What `judge_units` asks for: metrics (worlds, motions, noises) by name, and which have failed."""
    study, law = Study.model_validate_json(json.dumps(spec["study"])), controller(spec["law"])
    name, noises, worlds = spec["family"], spec["noises"], spec["worlds"]
    family = study.families[name]
    cases = drawn_cases(
        family, name, "test", study.seed, worlds, study.wrist, first=spec["first"], noises=noises
    )  # fmt: skip
    found = measure(law, np.array([law.values(spec["gains"])]), cases, study.wrist, RANKED)
    shape = worlds, len(family.references), noises
    arrays = {metric: values.reshape(shape) for metric, values in found.metrics.items()}
    return arrays | {
        "failed": found.failed.reshape(shape),
        "lasted": found.lasted.reshape(shape),
        "rests": found.rests.reshape(shape),
    }


def row_of(
    label: str,
    pieces: Sequence[Mapping[str, np.ndarray]],
    tension_range: float,
    motions: Sequence[int] | None = None,
    noises: int | None = None,
) -> RankedRow:
    """A row of a ranking from its ranges of worlds in order; of these motions and so many of the noises, or of all.

    It swings in a world where it does in the middle one of its noises, on any motion that rests, where it chatters on
    any in the middle one, or where a motion depends on the integration step however short. `tension_range` is the
    wrist's, from pretension to limit [N].
    """
    chosen = slice(None) if motions is None else list(motions)
    whole = {name: np.concatenate([each[name] for each in pieces])[:, chosen, :noises] for name in pieces[0]}
    failed, worlds = whole["failed"], len(whole["failed"])
    rmse = np.where(failed, np.inf, whole["rmse"])
    scores = np.exp(np.log(rmse).reshape(worlds, -1).mean(axis=1))
    left = np.median(np.where(np.isnan(whole["oscillation"]), 0.0, whole["oscillation"]), axis=2)
    chatters = chatter(np.median(whole["chattering"], axis=2), tension_range) > 0.0
    unsound = ((left > LIMIT_CYCLE) & whole["rests"][:, :, 0]) | chatters | (whole["drift"] > 0.0).any(axis=2)
    metrics = {name: whole[name].reshape(1, -1) for name in RANKED}
    lasted, rests = whole["lasted"].reshape(1, -1), whole["rests"].ravel()
    measured = Measured(metrics, failed.reshape(1, -1), lasted, rests, tension_range)
    return RankedRow(label, scores, unsound.any(axis=1), measured)
