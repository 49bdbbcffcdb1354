"""Rows ranked over the worlds of a family: groups of ties, what each is worth beside feedforward, how often it fails.

All rows meet the same worlds, motions and noise. A row's score in a world is the geometric mean of its RMSE over the
motions there; intervals are over worlds. Where a family has both, smooth motions are one ranking and steps another.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.combinations import within
from wristctl.comparison.controller_ranking import STREAM, Ranking, Traits, counted, time_at_limits
from wristctl.comparison.tie_groups import Comparisons, standing
from wristctl.config.controller_row import Row
from wristctl.config.families import TOLERATED, Family
from wristctl.config.study import Study
from wristctl.control.table import TunedGains, controller, gains_of
from wristctl.simulation.cases import Measured, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.oscillation import LIMIT_CYCLE, chatter
from wristctl.simulation.reference import jumps
from wristctl.tuning.objective import YARDSTICK
from wristctl.work.worker import Unit
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd


# Metrics that are kept of every row in every case.
RANKED = (
    "rmse",
    "steady_state",
    "oscillation",
    "sustained",
    "chattering",
    "peak_tension",
    "rms_tension",
    "saturation",
    "motor_limited",
    "energy",
    "drift",
)


def ranked_units() -> dict[str, str]:
    """Units of RANKED and of a ranking's errors, by name; what goes on swinging in motion is no metric by itself."""
    angles = dict.fromkeys(("sustained", "rmse_low", "rmse_high", "worst_rmse"), "rad")
    return {name: METRICS[name].unit or "1" for name in RANKED if name in METRICS} | angles


class RankedRow(NamedTuple):
    """A row's figures in every world, (W,) each, and all that was measured, (1, W motions)."""

    label: str
    rmse: Array
    """Geometric mean over the motions [rad]; inf where one failed."""
    swings: NDArray[np.bool_]
    """Whether on any motion it swings by more than 0.1 deg at rest, chatters, or depends on the integration step."""
    measured: Measured
    motions: int = 1
    """Number of motions that `measured` has in each world, each with as many streams of noise."""


@dataclass(frozen=True, kw_only=True)
class WorldRanking(Ranking):
    """A ranking over a family's worlds, with all that was measured there."""

    family: Family
    rows: list[RankedRow]

    def medians(self, metric: str) -> Array:
        """Median of a metric over all rollouts of each row, (R,); nan where no rollout has a finite value."""
        return np.array([_median(row.measured.metrics[metric]) for row in self.rows])


def kinds_of(family: Family) -> dict[bool, list[int]]:
    """The numbers of a family's references by whether they are steps, smooth ones first; no mean is of both."""
    numbers = range(len(family.references))
    kinds = {kind: [index for index in numbers if jumps(family.references[index]) == kind] for kind in (False, True)}
    return {kind: chosen for kind, chosen in kinds.items() if chosen}


def rank(
    study: Study,
    tuned: TunedGains | None = None,
    network: Inverse | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[WorldRanking]:
    """Rank the rows of the study's `compare` section on the worlds that it names; feedforward joins as the yardstick.

    A ranking of smooth motions, one of steps, or both. UserError for unknown gains.
    """
    worlds = study.compare.worlds
    family, name = study.families[worlds.family], worlds.family
    seed = study.seed if worlds.sealed is None else worlds.sealed
    cases = drawn_cases(family, name, worlds.split, seed, worlds.draws, study.wrist, network)
    rows = list(study.compare.rows)
    if not any(row.controller == YARDSTICK for row in rows):
        rows.append(Row(controller=YARDSTICK, gains="default"))
    kinds, every = kinds_of(family), list[Measured]()
    laws = [controller(row.controller) for row in rows]
    ends = np.cumsum([0, *(law.learning for law in laws)]) / sum(law.learning for law in laws)
    for law, row, begin, end in zip(laws, rows, ends[:-1], ends[1:], strict=True):
        gains = np.array([gains_of(law, row.gains, tuned, family.loop)])
        every.append(measure(law, gains, cases, study.wrist, RANKED, within(progress, begin, end)))
    rankings = []
    for kind, chosen in kinds.items():
        measured = [one.of_motions(chosen, len(family.references)) for one in every]
        open_loop = next(one for one, row in zip(measured, rows, strict=True) if row.controller == YARDSTICK)
        ranked = [
            measured_row(row.label, one, open_loop, worlds.draws) for one, row in zip(measured, rows, strict=True)
        ]
        rankings.append(ranking(name, family, ranked, steps=kind))
    return rankings


def measured_row(label: str, measured: Measured, open_loop: Measured, worlds: int) -> RankedRow:
    """A row of a ranking from what was measured of it, and of feedforward, on the motions of so many worlds."""
    swings = np.any(measured.swings_beside(open_loop).reshape(worlds, -1), axis=1)
    return RankedRow(label, world_scores(measured, worlds)[0], swings, measured, measured.failed.shape[1] // worlds)


def world_scores(measured: Measured, worlds: int) -> Array:
    """Geometric mean of the RMSE [rad] over all that was measured in each world, (P, worlds); inf where one failed."""
    rmse = np.where(measured.failed, np.inf, measured.metrics["rmse"])
    scores: Array = np.exp(np.log(rmse).reshape(len(rmse), worlds, -1).mean(axis=2))
    return scores


def ranking(
    name: str,
    family: Family,
    rows: Sequence[RankedRow],
    tolerated: float = TOLERATED,
    steps: bool | None = None,
    compared: Comparisons | None = None,
) -> WorldRanking:
    """The ranking of rows that were measured on the same worlds, of which each may fail, swing or chatter in a share.

    They were on those motions of the family that are steps, where `steps`, or on its others; of a family of one kind
    that need not be said. `compared` are their comparisons, where these are over more than worlds.
    """
    kinds = kinds_of(family)
    kind = next(iter(kinds)) if steps is None else steps
    scores, measured = np.array([row.rmse for row in rows]), [row.measured for row in rows]
    shape = len(rows), scores.shape[1], -1
    open_loop = next((row.measured for row in rows if row.label.split("/")[0] == YARDSTICK), None)
    flags = {
        "limit cycle": [one.limit_cycles | (one.swings_in_motion(open_loop or one)) for one in measured],
        "chatters": [one.chatter > 0.0 for one in measured],
        "not converged": [one.unconverged for one in measured],
    }
    swinging = np.array([row.swings for row in rows])  # of several noises the middle one counts, not any
    worlds = {name: np.reshape(holds, shape).any(axis=2) & swinging for name, holds in flags.items()}
    none = np.zeros(len(rows))
    return WorldRanking(
        name=f"{name}, steps" if kind and len(kinds) > 1 else name,
        unit="world",
        labels=[row.label for row in rows],
        scores=scores,
        standing=standing(scores, swinging, STREAM, tolerated, compared=compared),
        swing=np.array([one.largest_swing(open_loop or one) for one in measured]),
        chatter=np.array([one.chatter.max(initial=0.0) for one in measured]),
        unsound=counted(worlds, scores),
        peak=none,
        away=none.astype(int),
        motions=len(kinds[kind]),
        traits=_traits(family, kind),
        family=family,
        rows=list(rows),
        at_limit=time_at_limits([[one.metrics] for one in measured]),
    )


def _traits(family: Family, steps: bool) -> Traits:
    """What a family asks of a controller: its loop's, and what is drawn beside it."""
    loop, drawn = family.loop, list(family.draw)
    camera, tendons = loop.sensor.level == "camera", loop.actuator.level == "tendon"
    load = any(key.startswith("disturbances.") for key in drawn)
    unknown = any(key.startswith("plant.") for key in drawn)
    return Traits(camera or tendons, camera, tendons, steps, load, unknown, loop.plant.model == "hinges")


def ranking_frame(ranked: WorldRanking) -> pd.DataFrame:
    """A row for each, from best to worst, with intervals; angles in rad."""
    import pandas as pd

    lines = []
    for index in ranked.standing.order:
        row, gain, stands = ranked.rows[index], ranked.gains[index], ranked.standing
        failures, swings, lost = stands.failures[index], stands.swings[index], stands.lost[index]
        lines.append(
            ranked.line(index)
            | {
                "times_better": gain.value,
                "times_better_low": gain.low,
                "times_better_high": gain.high,
                "worst_rmse": row.rmse.max(),
                "failures": failures.value,
                "failures_high": failures.high,
                "swings": swings.value,
                "swings_high": swings.high,
                "lost": lost.value,
                "lost_low": lost.low,
                "lost_high": lost.high,
            }
            | {name: _median(row.measured.metrics[name]) for name in RANKED[1:]}
        )
    return pd.DataFrame(lines)


def _median(values: Array) -> float:
    """Median of the finite values; nan without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else np.nan


def worlds_frame(ranked: WorldRanking) -> pd.DataFrame:
    """Every row in every world and motion; motions by their number among the family's references."""
    import pandas as pd

    parts = []
    numbers = kinds_of(ranked.family)[ranked.jumps]
    for row in ranked.rows:
        where = {
            "row": row.label,
            "world": np.repeat(np.arange(ranked.count), ranked.motions),
            "motion": np.tile(numbers, ranked.count),
        }
        values = {name: values[0] for name, values in row.measured.metrics.items()}
        parts.append(pd.DataFrame(where | {"failed": row.measured.failed[0]} | values))
    return pd.concat(parts, ignore_index=True)


# Largest number of rollouts of one unit: some ten seconds of one core.
_ROLLOUTS = 8_000


def judge_units(
    study: Study, family: str, law: str, gains: Mapping[str, float], worlds: int, noises: int
) -> list[Unit]:
    """Gains of a law on so many held-out worlds of a family, each motion there with as many streams of noise.

    A family whose sensors have no noise is measured once.
    """
    needed = study.model_copy(update={"families": {family: study.families[family]}})
    content = json.loads(needed.model_dump_json(by_alias=True, include={"seed", "wrist", "families"}))
    times = noises_of(study.families[family], noises)
    rollouts = len(study.families[family].references) * times
    repetitions = controller(law).learning
    together = max(1, _ROLLOUTS // (rollouts * repetitions))
    units = []
    for first in range(0, worlds, together):
        many = min(together, worlds - first)
        spec = {
            "study": content, "family": family, "law": law, "gains": dict(gains), "first": first, "worlds": many,
            "noises": times,
        }  # fmt: skip
        name = f"{law} on worlds {first} to {first + many - 1} of {family}"
        units.append(Unit("wristctl.comparison.world_ranking:judged", spec, name, many * rollouts * repetitions))
    return units


def noises_of(family: Family, noises: int) -> int:
    """Number of noise streams for a motion in a world: once where no camera adds noise."""
    return noises if family.loop.sensor.level == "camera" else 1


def judged(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Result of one unit of `judge_units`: metrics (worlds, motions, noises) by name, and which have failed."""
    study, law = Study.model_validate_json(json.dumps(spec["study"])), controller(spec["law"])
    name, noises, worlds = spec["family"], spec["noises"], spec["worlds"]
    family = study.families[name]
    cases = drawn_cases(
        family, name, "test", study.seed, worlds, study.wrist, first=spec["first"], noises=noises
    )  # fmt: skip
    measured = measure(law, np.array([law.values(spec["gains"])]), cases, study.wrist, RANKED)
    shape = worlds, len(family.references), noises
    arrays = {metric: values.reshape(shape) for metric, values in measured.metrics.items()}
    return arrays | {name: getattr(measured, name).reshape(shape) for name in ("failed", "lasted", "rests")}


def row_of(
    label: str,
    pieces: Sequence[Mapping[str, np.ndarray]],
    tension_range: float,
    motions: Sequence[int] | None = None,
    noises: int | None = None,
    open_loop: Sequence[Mapping[str, np.ndarray]] | None = None,
    places: int = 2,
) -> RankedRow:
    """A row of a ranking from its ranges of worlds in order; of these motions and so many of the noises, or of all.

    It swings in a world where it does in the middle one of its noises: at rest, or, by more than twice what feedforward
    shows there (`open_loop`, its ranges of worlds), while its reference moves. It also counts as swinging where it
    chatters on any motion in the middle one, or where a motion depends on the integration step however short.
    `tension_range` is the wrist's, from pretension to limit [N], `places` the number of places of tendons.
    """
    chosen = slice(None) if motions is None else list(motions)

    def joined(name: str, of: Sequence[Mapping[str, np.ndarray]] = pieces) -> np.ndarray:
        return np.concatenate([piece[name] for piece in of])[:, chosen, :noises]

    failed, rests = joined("failed"), joined("rests")
    rests_at_end = rests[:, :, 0]
    moving = np.zeros(rests_at_end.shape, bool)
    if open_loop is not None:
        of_both = joined("sustained"), joined("sustained", open_loop)
        middle, allowed = (np.median(np.nan_to_num(of_row), axis=2) for of_row in of_both)
        moving = (middle > LIMIT_CYCLE + 2.0 * allowed) & ~rests_at_end
    metrics = {name: joined(name) for name in RANKED}
    oscillation = metrics["oscillation"]
    left = np.median(np.where(np.isnan(oscillation), 0.0, oscillation), axis=2)
    chatters = chatter(np.median(metrics["chattering"], axis=2), tension_range, places) > 0.0
    unsound = ((left > LIMIT_CYCLE) & rests_at_end) | moving | chatters | (metrics["drift"] > 0.0).any(axis=2)
    flat = {name: values.reshape(1, -1) for name, values in metrics.items()}
    lasted = joined("lasted").reshape(1, -1)
    measured = Measured(flat, failed.reshape(1, -1), lasted, rests.ravel(), tension_range, places)
    return RankedRow(label, world_scores(measured, len(failed))[0], unsound.any(axis=1), measured, failed.shape[1])
