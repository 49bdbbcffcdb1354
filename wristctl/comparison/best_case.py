"""Best case for the paper: the setting in the box that comes closest to all three numbers of a row of T2 at once.

A search that asks for nothing else finds stopped clocks: wrists that sag onto gravity and rest at 30 deg whatever is
asked of them. So a setting counts where the same wrist follows other angles too, both ways. One whose numbers depend on
the integration step never counts.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.paper import FACTOR, T2
from wristctl.comparison.unknowns_sampling import Courses, courses, readings, usual
from wristctl.config.controller_row import Row
from wristctl.config.unknowns_box import STRATA, Box, PaperSetting
from wristctl.config.wrist import WristParameters
from wristctl.control.smc import SMC
from wristctl.seeds import stream
from wristctl.tuning.optimisers.differential_evolution import DifferentialEvolution
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import shortfall

Reading = Literal["strict", "usual"]
# Further angles that the wrist must follow [deg]: to both sides, as "all movements were symmetrical", and less far.
GUARD_DEG = (-30.0, 15.0, -15.0, 20.0, -20.0)
_WITHIN_DEG = 1.5
# Share of the horizon that must be left after settling, and half a second.
_LEAST_REST = 0.1
_NEAR = 0.05
# A factor beyond which nobody asks what else a setting follows.
_HOPEFUL = 3.0


@dataclass(frozen=True)
class BestCase:
    """Best setting of one row of T2, with the factor that separates it from the paper."""

    row: str
    reading: Reading
    segments: int
    period: float
    seed: int
    factor: float
    """The largest ratio to one of the three printed numbers, either way; inf where nothing counts."""
    ours: tuple[float, float, float]
    """RMSE, settling time, steady-state error"""
    read_as: str
    setting: PaperSetting | None
    rollouts: int
    stopped_clocks: int
    """Settings within FACTOR of all three that follow nothing else."""
    near: float
    """Share of neighbours, every number moved by up to 5 %, within FACTOR of all three."""

    def values(self) -> Mapping[str, object]:
        """Value of each unknown at this setting; empty without a setting."""
        return {} if self.setting is None else self.setting.values


def closest(of: Courses, controller: str, reading: Reading) -> tuple[Array, Array, list[str]]:
    """The factor (N,) of each course in its best reading, its three numbers (N, 3), and how they are read."""
    printed = np.array(T2[controller])
    if reading == "strict":
        values = readings(of)
        names = ["strict"]
        numbers = np.stack([values[name] for name in ("rmse", "settling", "steady_state")], axis=1)[:, None, :]
    else:
        names, numbers = usual(of)
    left = of.horizons[:, None] - numbers[:, :, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.exp(np.abs(np.log(numbers / printed)).max(axis=2))
    rests = left >= np.maximum(0.5, _LEAST_REST * of.horizons)[:, None]
    factors = np.where(np.isfinite(factors) & rests & of.converged[:, None], factors, np.inf)
    best, every = factors.argmin(axis=1), np.arange(len(factors))
    return factors[every, best], numbers[every, best], [names[choice] for choice in best]


def follows(row: Row, settings: Sequence[PaperSetting]) -> NDArray[np.bool_]:
    """Whether each setting brings the wrist to other angles too, (settings,)."""
    kept = np.ones(len(settings), bool)
    for angle in GUARD_DEG:
        references = [setting.reference.model_copy(update={"angle_deg": angle}) for setting in settings]
        of = courses(row, settings, references)
        error = readings(of)["steady_state"]
        kept &= of.converged & (np.nan_to_num(error, nan=np.inf) < np.radians(_WITHIN_DEG))
    return kept


def search(
    box: Box,
    wrist: WristParameters,
    row: Row,
    reading: Reading,
    island: tuple[int, float],
    seed: int,
    generations: int = 60,
    candidates: int = 32,
    progress: Callable[[float], None] | None = None,
) -> BestCase:
    """Differential evolution on an island of so many segments and one control period, ideal measurement."""
    fixed = box.model_copy(
        update={"unknowns": {name: unknown for name, unknown in box.unknowns.items() if name not in STRATA}}
    )
    names = list(fixed.unknowns)
    rng = np.random.default_rng(stream(seed, f"best case: {row.label} {reading} {island}"))
    optimiser = DifferentialEvolution(len(names), candidates, rng.random(len(names)), rng)
    stopped, best = 0, (np.inf, np.full(3, np.nan), "", np.zeros(len(names)))
    for generation in range(generations):
        points = optimiser.ask()
        settings = [_at(fixed, wrist, names, point, island) for point in points]
        factors, numbers, read = closest(courses(row, settings), row.controller, reading)
        hopeful = np.flatnonzero(factors < min(_HOPEFUL, best[0]))  # only the best must be honest
        if len(hopeful):
            honest = follows(row, [settings[candidate] for candidate in hopeful])
            stopped += int((factors[hopeful[~honest]] < FACTOR).sum())
            factors[hopeful[~honest]] = np.inf
        least = int(factors.argmin())
        if factors[least] < min(best[0], _HOPEFUL):
            best = (float(factors[least]), numbers[least], read[least], points[least].copy())
        optimiser.tell(np.log(factors))
        if progress is not None:
            progress((generation + 1) / generations)
    factor, ours, read_as, point = best
    rmse, settling, steady = (float(number) for number in ours)
    found = BestCase(
        row.label, reading, *island, seed, factor, (rmse, settling, steady), read_as, None, generations * candidates,
        stopped, 0.0,
    )  # fmt: skip
    if not np.isfinite(factor):
        return found
    setting = _at(fixed, wrist, names, point, island)
    return replace(found, setting=setting, near=_near(fixed, wrist, row, reading, setting, rng))


def _at(
    box: Box, wrist: WristParameters, names: Sequence[str], point: Array, island: tuple[int, float]
) -> PaperSetting:
    drawn = box.setting(wrist, dict(zip(names, np.minimum(point, 1.0 - 1e-12).tolist(), strict=True)))
    loop = drawn.loop.model_copy(update={"plant_segments": island[0], "control_period": island[1]})
    return drawn._replace(loop=loop)


def _near(
    box: Box, wrist: WristParameters, row: Row, reading: Reading, setting: PaperSetting, rng: np.random.Generator
) -> float:
    """Share of neighbours within FACTOR: every number of wrist, reference and horizon moved by up to 5 % of itself."""
    moved = []
    for _ in range(64):
        parameters, motion = setting.wrist, setting.reference
        leaves = [name.partition(".")[2] for name in box.unknowns if name.startswith("wrist.")]
        leaves += ["stiffness", "damping"]
        changed = {leaf: getattr(parameters, leaf) * float(rng.uniform(1 - _NEAR, 1 + _NEAR)) for leaf in leaves}
        duration = motion.duration * float(rng.uniform(1 - _NEAR, 1 + _NEAR))
        moved.append(
            setting._replace(
                wrist=parameters.model_copy(update=changed), reference=motion.model_copy(update={"duration": duration})
            )
        )
    factors, _, _ = closest(courses(row, moved), row.controller, reading)
    return float((factors < FACTOR).mean())


def overshoot_of_a_tick(setting: PaperSetting, gains: str = "exchanged") -> float:
    """Ratio of the travel during one held control tick to the travel asked for; infinite without a tension limit."""
    wrist, loop, preset = setting.wrist, setting.loop, SMC.presets[gains]
    if not loop.limits:
        return math.inf
    n = loop.plant_segments
    arms = wrist.length * (n - np.arange(n) - 0.5) / n + wrist.hand_offset
    turned = 1.0 - float(arms.mean() ** 2 / (arms**2).mean())
    inertia = float(terms(segments(wrist, 1), [0.0], [0.0]).mass[0, 0])
    pull = 2.0 * wrist.tendon_offset * wrist.tension_limit
    return pull * (turned / wrist.damping + 0.5 * loop.control_period / inertia) / (preset["P3"] / preset["P1"])


def holds(setting: PaperSetting) -> bool:
    """Whether the tendons can hold 30 deg toward the reference's side."""
    theta = math.radians(setting.reference.end_deg)
    return not setting.loop.limits or shortfall(setting.wrist, theta, theta) is None


def arrives_by_rule(setting: PaperSetting, gains: str = "exchanged") -> bool:
    """Strong enough to hold, and no tick too far."""
    return holds(setting) and overshoot_of_a_tick(setting, gains) < 1.0
