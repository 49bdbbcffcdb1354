"""Settings drawn from what the paper leaves open, and what each controller does in them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from threading import Event
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.controller_row import Row
from wristctl.config.loop import Reference, sample_period
from wristctl.config.unknowns_box import STRATA, Box, PaperSetting
from wristctl.config.wrist import WristParameters
from wristctl.control.differenced import differenced
from wristctl.control.table import controller, gains_of
from wristctl.lanes.types import LANES
from wristctl.processes import cores, stoppable
from wristctl.seeds import stream
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout, structure

READINGS = ("rmse", "rmse_move", "settling", "settling_after", "steady_state", "missing")
# About the final reference, over the move.
BAND = 0.02


class Courses(NamedTuple):
    """Recorded courses, sampled every `period` [s]."""

    theta: Array
    """(N, T), nan from where one has failed"""
    wanted: Array
    """(N, T)"""
    rests: Array
    """When each reference rests, (N,) [s]"""
    horizons: Array
    """Horizon of every course, (N,) [s]"""
    period: float
    converged: NDArray[np.bool_]
    """Courses whose numbers do not depend on the integration step, (N,)"""


class _Seen:
    """Courses within their horizons: what all readings have in common."""

    def __init__(self, of: Courses) -> None:
        self._of = of
        self.time: Array = np.arange(of.theta.shape[1], dtype=np.float64) * of.period
        self.inside: NDArray[np.bool_] = np.array(self.time < of.horizons[:, None] - 0.5 * of.period, bool)
        self.alive: NDArray[np.bool_] = np.array(np.isfinite(np.where(self.inside, of.theta, 0.0)).all(axis=1), bool)
        theta = np.where(self.alive[:, None], of.theta, 0.0)
        self.size, self.away = (
            np.where(self.inside, np.abs(theta - aim), 0.0) for aim in (of.wanted, of.wanted[:, -1:])
        )
        self.rmse: Array = np.sqrt((self.size**2).sum(axis=1) / self.inside.sum(axis=1))

    def late(self, since: Array) -> Array:
        """Mean size of the error from these times [s] on, (N,)."""
        late = self.inside & (self.time >= since[:, None] - 1e-9)
        mean: Array = (self.size * late).sum(axis=1) / late.sum(axis=1)
        return mean

    def last(self, away: Array, band: float) -> tuple[Array, NDArray[np.bool_]]:
        """When a distance (N, T) was last beyond a share of the final reference [s], 0: never; and who then rests."""
        of, outside = self._of, np.array(away > band * np.abs(self._of.wanted[:, -1:]), bool)
        place = len(self.time) - 1 - outside[:, ::-1].argmax(axis=1)
        last = np.where(outside.any(axis=1), self.time[place], 0.0)
        return last, np.array((of.rests < of.horizons) & (last < of.horizons - 1.5 * of.period), bool)


def readings(of: Courses) -> dict[str, Array]:
    """READINGS by name, (N,) each.

    They are the metrics of these names (wristctl.simulation.metrics) on the samples: RMSE of e over the horizon and
    over the motion, last time outside +-2 % of the final reference, from the start and from when the reference rests,
    and the mean |e| of the last 10 %. What has failed, or never settles, is nan.
    """
    seen, rests = _Seen(of), of.rests
    moving = seen.inside & (seen.time <= rests[:, None])
    of_move = np.sqrt((seen.size**2 * moving).sum(axis=1) / np.maximum(moving.sum(axis=1), 1))
    last, settled = seen.last(seen.away, BAND)
    settling = np.where(settled, last, np.nan)
    steady = seen.late(0.9 * of.horizons)
    metrics = {
        "rmse": seen.rmse,
        "rmse_move": np.where(rests <= 0.0, seen.rmse, of_move),
        "settling": settling,
        "settling_after": np.maximum(settling - rests, 0.0),
        "steady_state": steady,
        "missing": steady / np.abs(np.where(seen.inside, of.wanted, 0.0)).max(axis=1),
    }
    return {name: np.where(seen.alive, values, np.nan) for name, values in metrics.items()}


def usual(of: Courses) -> tuple[list[str], Array]:
    """RMSE, settling time and steady-state error in every usual reading: their names, and (N, readings, 3).

    The RMSE is over the horizon; settling is the last exit from 1, 2 or 5 % of the angle about its final reference, or
    of the error about none; the steady-state error the mean |e| of the last 10 % or of the last second. No reading is
    of one sample: of a loop that swings it would be what the swing happens to pass.
    """
    seen = _Seen(of)
    lasting = {"last 10 %": 0.1 * of.horizons, "last second": np.minimum(1.0, of.horizons)}
    steady = {name: seen.late(of.horizons - span) for name, span in lasting.items()}
    names, columns = [], []
    for reading, away in (("angle", seen.away), ("error", seen.size)):
        for band in (0.01, 0.02, 0.05):
            last, settled = seen.last(away, band)
            for name, error in steady.items():
                names.append(f"{reading} within {100 * band:.0f} %, {name}")
                sound = (settled & seen.alive)[:, None]
                columns.append(np.where(sound, np.stack([seen.rmse, last, error], axis=1), np.nan))
    return names, np.stack(columns, axis=1)


# Control period that counts as none [s].
CONTINUOUS = 1e-6


@dataclass(frozen=True)
class Reactions:
    """Readings of every row in every setting: (settings,) for each of READINGS, by the row's name."""

    settings: Sequence[PaperSetting]
    found: Mapping[str, Mapping[str, Array]]
    converged: Mapping[str, NDArray[np.bool_]]
    """Settings in which a row's numbers do not depend on the integration step; the others decide nothing."""

    def values(self, unknown: str) -> list[Any]:
        """Value of an unknown in every setting."""
        return [setting.values[unknown] for setting in self.settings]


def drawn_settings(box: Box, wrist: WristParameters, seed: int) -> list[PaperSetting]:
    """The box's draws: every combination of the strata as often, all else a Latin hypercube over all of them."""
    strata = [name for name in box.unknowns if name in STRATA]
    cells = list(product(*(range(_alternatives(box, name)) for name in strata)))
    count = -(-box.draws // len(cells)) * len(cells)
    shares = {name: _latin(count, seed, name) for name in box.unknowns if name not in strata}
    for column, name in enumerate(strata):
        levels = np.array([cell[column] for cell in cells])
        shares[name] = (np.tile(levels, count // len(cells)) + 0.5) / _alternatives(box, name)
    return [box.setting(wrist, {name: float(share[k]) for name, share in shares.items()}) for k in range(count)]


def continuous_settings(box: Box, wrist: WristParameters, seed: int) -> list[PaperSetting]:
    """As many of them as asked for with ideal measurement in nearly continuous time: of one segment, then of four."""
    settings, sensor = [], box.model_copy(update={"unknowns": {}}).setting(wrist, {}).loop.sensor
    for segments, count in zip((1, 4), box.continuous, strict=False):
        shares = {name: _latin(count, seed, f"{name}, continuous {segments}") for name in box.unknowns}
        for k in range(count):
            setting = box.setting(wrist, {name: float(share[k]) for name, share in shares.items()})
            update = {"control_period": CONTINUOUS, "plant_segments": segments, "sensor": sensor}
            known = {"loop.control_period": CONTINUOUS, "loop.plant_segments": segments, "measured": "ideal"}
            loop, values = setting.loop.model_copy(update=update), {**setting.values, **known}
            settings.append(setting._replace(loop=loop, measured="ideal", values=values))
    return settings


def react(
    rows: Sequence[Row],
    settings: Sequence[PaperSetting],
    progress: Callable[[float], None] | None = None,
    mirrored: bool = False,
) -> Reactions:
    """Every row in every setting; `mirrored` turns the references to the other side."""
    metrics = {row.label: {name: np.full(len(settings), np.nan) for name in READINGS} for row in rows}
    converged = {row.label: np.zeros(len(settings), bool) for row in rows}
    work = [(batch, row) for batch in _alike(settings) for row in rows]
    finished, stop = 0, Event()

    def ran(task: tuple[NDArray[np.intp], Row]) -> Courses:
        own = [settings[index] for index in task[0]]
        references = [each.reference.mirrored() if mirrored else each.reference for each in own]
        return courses(task[1], own, references, 1, stop)

    with stoppable(cores(), stop) as pool:
        for (own, row), done_there in zip(work, pool.map(ran, work), strict=True):
            for name, values in readings(done_there).items():
                metrics[row.label][name][own] = values
            converged[row.label][own] = done_there.converged
            finished += len(own)
            if progress is not None:
                progress(finished / (len(settings) * len(rows)))
    return Reactions(settings, metrics, converged)


def courses(
    row: Row, settings: Sequence[PaperSetting], references: Sequence[Reference] | None = None,
    threads: int | None = None, stop: Event | None = None,
) -> Courses:  # fmt: skip
    """Courses of one row in settings that can run in one batch, with a reference for each, or its own."""
    law, references = controller(row.controller), references or [setting.reference for setting in settings]
    gains = np.tile(gains_of(law, row.gains, None), (len(settings), 1))
    if settings[0].measured == "differenced":
        law = differenced(law)
    period = sample_period(settings[0].loop.control_period)
    horizons = np.array([setting.horizon for setting in settings])
    motions = [
        motion(ref, setting.wrist, horizons.max(), period) for ref, setting in zip(references, settings, strict=True)
    ]
    out = rollout(
        law, gains, motions, np.arange(len(settings)), [setting.loop for setting in settings],
        [setting.wrist for setting in settings], record="briefly", threads=threads, stop=stop,
    )  # fmt: skip
    rests = np.array([move.rest for move in motions])
    return Courses(out.columns("theta"), out.references[:, 0], rests, horizons, period, ~out.unconverged)


def _alike(settings: Sequence[PaperSetting]) -> list[NDArray[np.intp]]:
    """Settings that can run in one batch, of horizons as alike as can be; the longest batches last."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for number in sorted(range(len(settings)), key=lambda each: settings[each].horizon):
        each = settings[number]
        groups.setdefault((*structure(each.loop), each.measured), []).append(number)
    # a core runs so many side by side, until the longest horizon among them
    batches = [np.array(group[k : k + LANES]) for group in groups.values() for k in range(0, len(group), LANES)]
    return sorted(batches, key=lambda own: -settings[own[0]].loop.control_period)


def _alternatives(box: Box, name: str) -> int:
    unknown = box.unknowns[name]
    return len(unknown.one_of or ()) or (1 if isinstance(unknown.draw, str) else len(unknown.draw or ()))


def _latin(count: int, seed: int, name: str) -> Array:
    """Shares in [0, 1), one in each of so many equal parts, in random order."""
    rng = np.random.default_rng(stream(seed, f"box: {name}"))
    return (rng.permutation(count) + rng.random(count)) / count
