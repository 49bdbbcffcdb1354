"""Settings drawn from what the paper leaves open, and what each controller does in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.readings import READINGS, Courses, readings
from wristctl.config.control import Row
from wristctl.config.loop import Reference
from wristctl.config.unstated import STRATA, Box, PaperSetting
from wristctl.config.wrist import WristParameters
from wristctl.control.differenced import differenced
from wristctl.control.table import controller, gains_of
from wristctl.lanes.cores import cores
from wristctl.lanes.stoppable_threads import stoppable
from wristctl.lanes.types import LANES
from wristctl.seeds import stream
from wristctl.simulation.batch import sample_period
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout, structure

CONTINUOUS = 1e-6
"""Control period that counts as none [s]."""


@dataclass(frozen=True)
class Reactions:
    """What each row did in each setting, (settings,) for each of READINGS by the row's name."""

    settings: Sequence[PaperSetting]
    found: Mapping[str, Mapping[str, Array]]
    converged: Mapping[str, NDArray[np.bool_]]
    """Where a row's numbers do not depend on the integration step; the others tell nothing."""

    def values(self, unknown: str) -> list[Any]:
        """What an unknown is in each setting."""
        return [each.values[unknown] for each in self.settings]


def drawn_settings(box: Box, wrist: WristParameters, seed: int) -> list[PaperSetting]:
    """The box's draws: every combination of the strata as often, all else a Latin hypercube over all of them."""
    strata = [name for name in box.unknowns if name in STRATA]
    cells = list(product(*(range(_alternatives(box, name)) for name in strata)))
    count = -(-box.draws // len(cells)) * len(cells)
    shares = {name: _latin(count, seed, name) for name in box.unknowns if name not in strata}
    for at, name in enumerate(strata):
        own = np.array([cell[at] for cell in cells])
        shares[name] = (np.tile(own, count // len(cells)) + 0.5) / _alternatives(box, name)
    return [box.setting(wrist, {name: float(each[k]) for name, each in shares.items()}) for k in range(count)]


def continuous_settings(box: Box, wrist: WristParameters, seed: int) -> list[PaperSetting]:
    """As many of them as asked for with ideal measurement in nearly continuous time: of one segment, then of four."""
    found = []
    for segments, count in zip((1, 4), box.continuous, strict=False):
        shares = {name: _latin(count, seed, f"{name}, continuous {segments}") for name in box.unknowns}
        for k in range(count):
            given = box.setting(wrist, {name: float(each[k]) for name, each in shares.items()})
            plain = box.model_copy(update={"unknowns": {}}).setting(wrist, {})
            update = {"control_period": CONTINUOUS, "plant_segments": segments, "sensor": plain.loop.sensor}
            values = {**given.values, "loop.control_period": CONTINUOUS, "loop.plant_segments": segments}
            found.append(
                given._replace(
                    loop=given.loop.model_copy(update=update), measured="ideal", values={**values, "measured": "ideal"}
                )
            )
    return found


def react(
    rows: Sequence[Row],
    settings: Sequence[PaperSetting],
    progress: Callable[[float], None] | None = None,
    mirrored: bool = False,
) -> Reactions:
    """Every row in every setting; `mirrored` turns the references to the other side."""
    found = {row.label: {name: np.full(len(settings), np.nan) for name in READINGS} for row in rows}
    converged = {row.label: np.zeros(len(settings), bool) for row in rows}
    work = [(own, row) for own in _alike(settings) for row in rows]

    done, stop = 0, Event()

    def ran(task: tuple[NDArray[np.intp], Row]) -> Courses:
        return _ran(task[1], [settings[each] for each in task[0]], mirrored, stop)

    with stoppable(cores(), stop) as pool:
        for (own, row), done_there in zip(work, pool.map(ran, work), strict=True):
            for name, each in readings(done_there).items():
                found[row.label][name][own] = each
            converged[row.label][own] = done_there.converged
            done += len(own)
            if progress is not None:
                progress(done / (len(settings) * len(rows)))
    return Reactions(settings, found, converged)


def courses(
    row: Row, settings: Sequence[PaperSetting], references: Sequence[Reference], threads: int | None = None,
    stop: Event | None = None,
) -> Courses:  # fmt: skip
    """What one row does in settings that can run in one batch, each with a reference of its own."""
    law = controller(row.controller)
    gains = np.tile(gains_of(law, row.gains, None), (len(settings), 1))
    if settings[0].measured == "differenced":
        law = differenced(law)
    period = sample_period(settings[0].loop.control_period)
    horizons = np.array([each.horizon for each in settings])
    motions = [motion(ref, each.wrist, horizons.max(), period) for ref, each in zip(references, settings, strict=True)]
    out = rollout(
        law, gains, motions, np.arange(len(settings)), [each.loop for each in settings],
        [each.wrist for each in settings], record="briefly", threads=threads, stop=stop,
    )  # fmt: skip
    rests = np.array([each.rest for each in motions])
    return Courses(out.columns("theta"), out.references[:, 0], rests, horizons, period, ~out.unconverged)


def _ran(row: Row, settings: Sequence[PaperSetting], mirrored: bool, stop: Event) -> Courses:
    """What one row does."""
    references = [each.reference.mirrored() if mirrored else each.reference for each in settings]
    return courses(row, settings, references, 1, stop)


def _alike(settings: Sequence[PaperSetting]) -> list[NDArray[np.intp]]:
    """Settings that can run in one batch, of horizons as alike as can be; the longest batches last."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for number in sorted(range(len(settings)), key=lambda each: settings[each].horizon):
        each = settings[number]
        groups.setdefault((*structure(each.loop), each.measured), []).append(number)
    # a core runs so many side by side, until the longest horizon among them
    found = [np.array(own[k : k + LANES]) for own in groups.values() for k in range(0, len(own), LANES)]
    return sorted(found, key=lambda own: -settings[own[0]].loop.control_period)


def _alternatives(box: Box, name: str) -> int:
    unknown = box.unknowns[name]
    return len(unknown.one_of or ()) or (1 if isinstance(unknown.draw, str) else len(unknown.draw or ()))


def _latin(count: int, seed: int, name: str) -> Array:
    """Shares in [0, 1), one in each of so many equal parts, in random order."""
    rng = np.random.default_rng(stream(seed, f"box: {name}"))
    return (rng.permutation(count) + rng.random(count)) / count
