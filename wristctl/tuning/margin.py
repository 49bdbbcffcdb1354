"""What gains stand beside the loop that they are tuned for: more or less torque, a later one, other springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller, Gain
from wristctl.control.plain_law import named_gains
from wristctl.lanes.compiled import compiled, kept_nowhere
from wristctl.lanes.lane import where
from wristctl.simulation.cases import Case, Measured, measure


class Change(NamedTuple):
    """One change of a loop: a multiple of the controller's torque, or of the springs' stiffness, or frames late.

    No controller knows of it. Where no camera is, the torque acts later by as many control periods.
    """

    of: Literal["torque", "springs", "late"]
    size: float


# Changes that gains must stand, each alone.
CHANGES = (
    Change("torque", 0.67), Change("torque", 1.5), Change("late", 1), Change("springs", 0.6), Change("springs", 1.4),
)  # fmt: skip
# Growing changes by which it is told how much gains stand, of each kind to each side.
LADDERS = (
    tuple(Change("torque", size) for size in (0.67, 0.5, 0.33, 0.2)),
    tuple(Change("torque", size) for size in (1.5, 2.0, 3.0, 5.0)),
    tuple(Change("late", size) for size in (1, 2, 3, 4)),
    tuple(Change("springs", size) for size in (0.6, 0.4, 0.25)),
    tuple(Change("springs", size) for size in (1.4, 2.0, 3.0)),
)


class Stood(NamedTuple):
    """The largest change of each kind, of those in LADDERS, up to which gains stand each: 1, or 0 frames, for none."""

    least_torque: float
    most_torque: float
    late: float
    least_springs: float
    most_springs: float

    @property
    def enough(self) -> bool:
        """Whether they stand all of CHANGES."""
        return (
            self.least_torque < 1.0 < self.most_torque
            and self.late > 0
            and self.least_springs < 1.0 < self.most_springs
        )

    @property
    def words(self) -> str:
        """The changes in words."""
        late = f"{self.late:g} frame{'s' * (self.late != 1)} later"
        torque = f"torque x {self.least_torque:g} to x {self.most_torque:g}"
        return f"{torque}, springs x {self.least_springs:g} to x {self.most_springs:g}, {late}"


# Control periods by which a torque can be late, and metrics that tell of a swing.
_LATEST, _SWINGS = 4, ("oscillation", "sustained")
# Names of the gains that a changed controller has beside its own.
_FACTOR, _LATE = "margin_factor", "margin_late"


class OwnLoop:
    """Cases on the loop that gains are tuned for, and on it with each change; feedforward runs on them once."""

    def __init__(self, cases: Sequence[Case], wrist: WristParameters, yardstick: Controller) -> None:
        self._cases, self._wrist, self._yardstick = list(cases), wrist, yardstick
        self._without_feedback: dict[Change, Measured] = {}
        self._changed: dict[Change, list[Case]] = {}

    @property
    def count(self) -> int:
        """Number of cases."""
        return len(self._cases)

    def lost(self, law: Controller, gains: Array, changes: Sequence[Change] = CHANGES) -> NDArray[np.bool_]:
        """Whether gains (P, g) fail, swing or chatter on each case under each change, (P, changes, C).

        At the default integration step: what swings at that step is not simulated again with shorter ones.
        """
        if unknown := [change for change in changes if change not in self._without_feedback]:
            self._without_feedback |= self._measured(self._yardstick, np.zeros((1, 0)), unknown)
        measured = self._measured(law, gains, changes)
        lost = [measured[change].failed | self._swings(measured[change], change) for change in changes]
        return np.stack(lost, axis=1)

    def _swings(self, measured: Measured, change: Change) -> NDArray[np.bool_]:
        return measured.swings_beside(self._without_feedback[change])

    def stood(self, law: Controller, gains: Array) -> Stood:
        """How much gains (g,) stand without failing, swinging or chattering on any case."""
        lost = self.lost(law, gains[None], [change for ladder in LADDERS for change in ladder])[0].any(axis=1)
        last, begin = [], 0
        for ladder in LADDERS:
            steps = next((k for k in range(len(ladder)) if lost[begin + k]), len(ladder))
            last.append(ladder[steps - 1].size if steps else 1.0 - (ladder[0].of == "late"))
            begin += len(ladder)
        return Stood(*last)

    def _measured(self, law: Controller, gains: Array, changes: Sequence[Change]) -> dict[Change, Measured]:
        """What gains (P, g) do under each change: those of the world are lanes of one batch, the others of another."""
        of_law = [change for change in changes if self._is_of_law(change)]
        of_world = [change for change in changes if change not in of_law]
        rows, columns = len(gains), self.count
        found = dict[Change, Measured]()
        if of_world:
            cases = [case for change in of_world for case in self._cases_under(change)]
            whole = measure(law, gains, cases, self._wrist, _SWINGS, converge=False)
            for number, change in enumerate(of_world):
                found[change] = whole.part(slice(None), slice(number * columns, (number + 1) * columns))
        if of_law:
            added = np.array([(change.size, 0.0) if change.of == "torque" else (1.0, change.size) for change in of_law])
            values = np.column_stack([np.tile(gains, (len(of_law), 1)), np.repeat(added, rows, axis=0)])
            whole = measure(changed_law(law), values, self._cases, self._wrist, _SWINGS, converge=False)
            for number, change in enumerate(of_law):
                found[change] = whole.part(slice(number * rows, (number + 1) * rows), slice(None))
        return found

    def _is_of_law(self, change: Change) -> bool:
        """Whether it is a change of the controller's torque: without a camera lateness is."""
        camera = all(case.loop.sensor.level == "camera" for case in self._cases)
        return change.of == "torque" or (change.of == "late" and not camera)

    def _cases_under(self, change: Change) -> list[Case]:
        """The cases with a change of the world."""
        if change not in self._changed:
            loops = {id(case.loop): _changed(case.loop, change) for case in self._cases}
            self._changed[change] = [case._replace(loop=loops[id(case.loop)]) for case in self._cases]
        return self._changed[change]


def _changed(loop: Loop, change: Change) -> Loop:
    """The loop with a change that is the world's; as it is where the change is its controller's."""
    plant = loop.plant
    if change.of == "springs":
        plant = plant.model_copy(update={"stiffness_scale": plant.stiffness_scale * change.size})
    elif change.of == "late" and loop.sensor.level == "camera":
        delay = plant.sensor.of(loop.sensor).delay_frames + change.size
        plant = plant.model_copy(update={"sensor": plant.sensor.model_copy(update={"delay_frames": delay})})
    return loop if plant is loop.plant else loop.model_copy(update={"plant": plant})


def changed_law(law: Controller) -> Controller:
    """The controller with two gains more: a factor of its torque, and by how many control periods that acts later."""
    made = {(False, 1): _compiled, (False, 2): _compiled_of_both_planes, (True, 1): _plain, (True, 2): _plain}
    changed = made[law.plain, law.planes](law.law, law.memory)
    added = {_FACTOR: Gain("", "multiple of the torque", 0.01, 100.0), _LATE: Gain("", "periods late", 0.0, _LATEST)}
    return replace(
        law, law=changed, gains={**law.gains, **added}, presets={}, notes={}, conditions={}, surface=None,
        memory=law.memory + _LATEST,
    )  # fmt: skip


@compiled
def late_torque(torque: Any, late: Any, kept: Any, first: int, latest: int) -> Any:
    """The torque of `late` periods ago, 0 to `latest`; those of before are kept from `first` on, the newest first."""
    found = torque
    for k in range(latest):
        found = where(abs(late - (k + 1.0)) < 0.5, kept[first + k], found)
    for k in range(latest - 1, 0, -1):
        kept[first + k] = kept[first + k - 1]
    kept[first] = torque
    return found


@compiled
def _changed_torque(gains: Any, kept: Any, first: int, torque: Any) -> Any:
    return late_torque(gains.margin_factor * torque, gains.margin_late, kept, first, _LATEST)


@cache
def _compiled(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        return _changed_torque(gains, memory, last, inner(now, wrist, gains, memory))

    return kept_nowhere(law)


@cache
def _compiled_of_both_planes(base: Any, last: int) -> Any:
    inner = compiled(base)

    def law(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
        inner(now, wrist, gains, memory, tendons, torque)
        for p in range(len(torque)):
            torque[p] = _changed_torque(gains, memory[p], last, torque[p])

    return kept_nowhere(law)


@cache
def _plain(base: Any, last: int) -> Any:
    class Changed:
        """A plain law, of a plane or of both, whose torque is multiplied and late."""

        def __init__(self) -> None:
            self._law = base() if isinstance(base, type) else base

        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any, *of_both: Any) -> float | None:
            own = named_gains(type(gains)._fields[:-2])(*gains[:-2])
            if not of_both:
                return _plainly_later(gains, memory[last:], float(self._law(now, wrist, own, memory[:last])))
            tendons, torque = of_both
            self._law(now, wrist, own, tuple(kept[:last] for kept in memory), tendons, torque)
            torque[:] = [_plainly_later(gains, kept[last:], float(torque[p])) for p, kept in enumerate(memory)]
            return None

    return Changed


def _plainly_later(gains: Any, kept: Any, torque: float) -> float:
    before = [gains.margin_factor * torque, *kept]
    kept[:] = before[:-1]
    return float(before[round(gains.margin_late)])
