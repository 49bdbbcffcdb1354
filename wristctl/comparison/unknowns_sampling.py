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


def readings(of: Courses) -> dict[str, Array]:
    """READINGS by name, (N,) each.

    They are the metrics of these names (wristctl.simulation.metrics) on the samples: RMSE of e over the horizon and
    over the motion, last time outside +-2 % of the final reference, from the start and from when the reference rests,
    and the mean |e| of the last 10 %. What has failed, or never settles, is nan.
    """
    theta, wanted, rests, horizons, period, _ = of
    time: Array = np.arange(theta.shape[1], dtype=np.float64) * period
    error, final = theta - wanted, wanted[:, -1:]
    inside: NDArray[np.bool_] = np.array(time[None, :] < horizons[:, None] - 0.5 * period, bool)
    alive: NDArray[np.bool_] = np.array(np.isfinite(np.where(inside, theta, 0.0)).all(axis=1), bool)
    kept = np.where(inside & alive[:, None], error, 0.0)
    count = inside.sum(axis=1)
    moving = inside & (time <= rests[:, None])
    late = inside & (time >= 0.9 * horizons[:, None] - 1e-9)
    away = np.abs(np.where(alive[:, None], theta, 0.0) - final)
    last = _last_exit(np.where(inside, away, 0.0), BAND * np.abs(final), time)
    settled = (rests < horizons) & (last < horizons - 1.5 * period)
    rmse = np.sqrt((kept**2).sum(axis=1) / count)
    of_move = np.sqrt((kept**2 * moving).sum(axis=1) / np.maximum(moving.sum(axis=1), 1))
    settling = np.where(settled, last, np.nan)
    metrics = {
        "rmse": rmse,
        "rmse_move": np.where(rests <= 0.0, rmse, of_move),
        "settling": settling,
        "settling_after": np.maximum(settling - rests, 0.0),
        "steady_state": (np.abs(kept) * late).sum(axis=1) / late.sum(axis=1),
    }
    metrics["missing"] = metrics["steady_state"] / np.abs(np.where(inside, wanted, 0.0)).max(axis=1)
    return {name: np.where(alive, values, np.nan) for name, values in metrics.items()}


def _last_exit(away: Array, band: Array, time: Array) -> Array:
    """The last time (N,) at which a distance (N, T) was beyond the band (N, 1); 0 where it never was."""
    outside: NDArray[np.bool_] = np.array(away > band, bool)
    return np.where(outside.any(axis=1), time[len(time) - 1 - outside[:, ::-1].argmax(axis=1)], 0.0)


def usual(of: Courses) -> tuple[list[str], Array]:
    """RMSE, settling time and steady-state error in every usual reading: their names, and (N, readings, 3).

    The RMSE is over the horizon; settling is the last exit from 1, 2 or 5 % of the angle about its final reference, or
    of the error about none; the steady-state error the mean |e| of the last 10 % or of the last second. No reading is
    of one sample: of a loop that swings it would be what the swing happens to pass.
    """
    time: Array = np.arange(of.theta.shape[1], dtype=np.float64) * of.period
    inside = time < of.horizons[:, None] - 0.5 * of.period
    alive: NDArray[np.bool_] = np.array(np.isfinite(np.where(inside, of.theta, 0.0)).all(axis=1), bool)
    theta, final = np.where(alive[:, None], of.theta, 0.0), of.wanted[:, -1:]
    size = np.where(inside, np.abs(theta - of.wanted), 0.0)
    rmse = np.sqrt((size**2).sum(axis=1) / inside.sum(axis=1))
    ends = {
        "last 10 %": 0.1 * of.horizons,
        "last second": np.minimum(1.0, of.horizons),
    }
    steady = {}
    for name, lasting in ends.items():
        late = inside & (time >= (of.horizons - lasting)[:, None] - 1e-9)
        steady[name] = (size * late).sum(axis=1) / late.sum(axis=1)
    names, columns = [], []
    for reading, away in (("angle", np.where(inside, np.abs(theta - final), 0.0)), ("error", size)):
        for band in (0.01, 0.02, 0.05):
            last = _last_exit(away, band * np.abs(final), time)
            settled = (of.rests < of.horizons) & (last < of.horizons - 1.5 * of.period) & alive
            for name, error in steady.items():
                names.append(f"{reading} within {100 * band:.0f} %, {name}")
                columns.append(np.where(settled[:, None], np.stack([rmse, last, error], axis=1), np.nan))
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
    settings = []
    for segments, count in zip((1, 4), box.continuous, strict=False):
        shares = {name: _latin(count, seed, f"{name}, continuous {segments}") for name in box.unknowns}
        for k in range(count):
            setting = box.setting(wrist, {name: float(share[k]) for name, share in shares.items()})
            plain = box.model_copy(update={"unknowns": {}}).setting(wrist, {})
            update = {"control_period": CONTINUOUS, "plant_segments": segments, "sensor": plain.loop.sensor}
            values = {**setting.values, "loop.control_period": CONTINUOUS, "loop.plant_segments": segments}
            settings.append(
                setting._replace(
                    loop=setting.loop.model_copy(update=update),
                    measured="ideal",
                    values={**values, "measured": "ideal"},
                )
            )
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
        return _ran(task[1], [settings[index] for index in task[0]], mirrored, stop)

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
    row: Row, settings: Sequence[PaperSetting], references: Sequence[Reference], threads: int | None = None,
    stop: Event | None = None,
) -> Courses:  # fmt: skip
    """Courses of one row in settings that can run in one batch, with one reference a setting."""
    law = controller(row.controller)
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


def _ran(row: Row, settings: Sequence[PaperSetting], mirrored: bool, stop: Event) -> Courses:
    """Courses of one row in a batch of settings."""
    references = [setting.reference.mirrored() if mirrored else setting.reference for setting in settings]
    return courses(row, settings, references, 1, stop)


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
