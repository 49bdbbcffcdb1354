"""A loop in many lanes at once, whose ticks are taken from any state: its compiled code, differentiated."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.errors import UserError
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.simulation.batch import Batch, Lanes, batch
from wristctl.simulation.frames import schedule
from wristctl.simulation.kernel import Span, parts_of_sample, run_blocks
from wristctl.simulation.motion import resting
from wristctl.simulation.observer import Schedule, Watch
from wristctl.simulation.simulated_drives import SIDES, IdealDrive, ServoDrive, SpoolDrive, commands_of
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import World
from wristctl.stability.smooth_loop import cycle_of
from wristctl.wrist.dahl import InnerFriction, InnerFrictionInSpace
from wristctl.wrist.plant import kernel_of, plant_in
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import CREPT, OF_A_TENDON, WRAPPED, PulledTendons, RealTendons, X, Z

# Typical sizes [rad, rad/s, N, m, m/s], by which small changes are measured.
_ANGLE, _RATE, _PULL, _LENGTH, _SPEED = 1.0, 10.0, 10.0, 1e-3, 1e-2


class StatePart(NamedTuple):
    """Some of the variables: the array that holds them by block, which of its flat rows, and their typical sizes."""

    name: str
    array: Array
    rows: NDArray[np.int64]
    sizes: Array


class Remembered(NamedTuple):
    """Length of a loop's memory: ticks of its motors' delivered lengths, and frames under way."""

    ticks: int
    frames: int


def state_parts(batch: Batch, law: Controller, tick: int, back: Remembered) -> Iterator[StatePart]:
    """The parts of the state before a tick, in the same order at every tick; of each, what changes.

    What was delivered and the frames under way come as they are counted back from the tick. What a law learns over
    repetitions does not change within one.
    """
    state, drive, k = batch.state, batch.world.drive, len(batch.setup.coordinates)
    planes, places = len(batch.setup.bend), len(batch.setup.pulls)
    kept = state.memory.shape[2] * np.arange(planes) + law.learned
    memory = law.memory - law.learned
    yield StatePart("memory", state.memory, _beside(kept, memory), np.ones(planes * memory))
    yield StatePart("angle", state.coordinates, np.arange(k), np.full(k, _ANGLE))
    yield StatePart("rate", state.coordinates, np.arange(k, 2 * k), np.full(k, _RATE))
    size = _LENGTH if isinstance(drive, SpoolDrive | ServoDrive) else _PULL
    if not isinstance(drive, IdealDrive):
        yield StatePart("motor", state.motors, np.arange(0, 2 * places, 2), np.full(places, size))
    if isinstance(drive, SpoolDrive | ServoDrive):
        sent = np.arange(2 * (places + planes), (2 + commands_of(drive)) * places + 2 * planes)
        further = np.concatenate([np.arange(1, 2 * places, 2), sent])
        name, unit = ("motor rate", _SPEED) if isinstance(drive, SpoolDrive) else ("motor target", _LENGTH)
        yield StatePart(name, state.motors, further, np.full(len(further), unit))
    if isinstance(state.tendons, RealTendons):
        rows, per_tendon = state.tendons.state, len(OF_A_TENDON)
        first = per_tendon * np.arange(places)
        wrapped = first[: len(state.tendons.path) - places]
        path = np.concatenate([first + X, wrapped + WRAPPED])
        yield StatePart("path", rows, path, np.array([_LENGTH] * places + [_ANGLE] * len(wrapped)))
        yield StatePart("bristle", rows, first + Z, np.ones(places))
        yield StatePart("tendon creep", rows, first + CREPT, np.full(places, _LENGTH))
    if isinstance(state.tendons, PulledTendons | RealTendons):
        rows = state.tendons.state
        yield StatePart("spring creep", rows, np.arange(rows.shape[1] - k, rows.shape[1]), np.full(k, _ANGLE))
        if isinstance(state.tendons.inner, (InnerFriction, InnerFrictionInSpace)):
            sizes = np.concatenate([np.ones(k), np.full(k, _ANGLE)])
            yield StatePart("inner friction", state.tendons.inner.state, np.arange(2 * k), sizes)
    if isinstance(state.watch, Watch):
        observer, taken = state.watch.observer, int(state.watch.turn[0, 0, 0])
        sizes = np.tile([_ANGLE, _RATE, _ANGLE], planes)
        yield StatePart("estimate", observer.now, np.arange(len(sizes)), sizes)
        yield StatePart("estimate at the frame", observer.fused, np.arange(len(sizes)), sizes)
        sent = _beside(places * (np.arange(tick - back.ticks, tick) % observer.delivered.shape[1]), places)
        yield StatePart("delivered", observer.delivered, sent, np.full(len(sent), size))
        frames = _beside(planes * np.arange(taken - back.frames, taken), planes)
        yield StatePart("frame", state.watch.pictures, frames, np.full(len(frames), _ANGLE))


def _beside(first: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """So many rows from each of some first ones on."""
    return np.asarray(first[:, None] + np.arange(count)).ravel()


def read_state(parts: Iterator[StatePart], count: int) -> Array:
    """The state of each rollout, (count, variables)."""
    columns = [to_rows(np.ascontiguousarray(_flat(part)[:, part.rows]), count) for part in parts if len(part.rows)]
    return np.concatenate(columns, axis=1)


def write_state(parts: Iterator[StatePart], states: Array) -> None:
    """Put the states (count, variables) where they stand."""
    column = 0
    for part in parts:
        if len(part.rows):
            _flat(part)[:, part.rows] = to_blocks(states[:, column : column + len(part.rows)])
            column += len(part.rows)


def _flat(part: StatePart) -> Array:
    """A view of its array, (blocks, rows, lanes)."""
    return part.array.reshape(len(part.array), -1, part.array.shape[-1])


# Difference quotients are over so many times a variable's typical size, to both sides; the smaller with bristles, which
# turn round within 20 um.
SMALL, SMALLER = 1e-6, 1e-8
# Ticks before the first guess of a resting point.
_WARM_UP = 200
# Ticks that an observer may look back: each is two variables more.
_LONGEST_MEMORY = 200


_ALIVE = SUMS.index("alive")
# Inputs of each plane by which a tick is differentiated beside its state, in the order of their lanes.
_OTHERS = ("by_frame", "by_acceleration", "by_reference")


class TickSlopes(NamedTuple):
    """One tick from a state: the next one, what is recorded, and their derivatives by the state x.

    Columns of `recorded` are those of the kernel's `parts_of_sample`. `by_frame` is 0 but where a frame is taken
    (`seen`). Inputs have an entry for each plane: derivatives by them are (x,) in one plane, and (x, 2) in two.
    """

    after: Array
    """The next state, (x,); nan where the wrist has left what it can be."""
    recorded: Array
    transition: Array
    """(x, x)"""
    outputs: Array
    """Derivative of the recorded values by the state, (columns, x)."""
    seen: bool
    by_frame: Array
    """Derivative of the next state by a bend added to the frame."""
    by_acceleration: Array
    """Derivative of the next state by the reference's acceleration."""
    by_reference: Array
    """Derivative of the next state by the reference bend."""


def looks_back(loop: Loop) -> tuple[int, Remembered]:
    """A tick, at the start of a cycle, from which on a smooth loop repeats, and how far back it remembers then.

    Raises UserError where that is too far.
    """
    if loop.sensor.level == "ideal":
        return 0, Remembered(0, 0)
    period, (cycle, _), sensor = loop.control_period, cycle_of(loop), loop.plant.sensor.of(loop.sensor)
    late = schedule(sensor, period, 3.0 * cycle * period, loop.sensor).arrivals[0]
    early = cycle * (2 + math.ceil(2.0 * late / cycle))
    frames = schedule(sensor, period, (early + 2 * cycle) * period, loop.sensor)
    ticks = np.arange(early, early + cycle)
    taken, arrived = (np.searchsorted(grid, ticks) for grid in (frames.captures, frames.arrivals))
    back = int((ticks - frames.dated[arrived - 1]).max())
    if back > _LONGEST_MEMORY:
        problem = f"the observer looks back over {back} control periods, more than {_LONGEST_MEMORY} can be analysed"
        shortest = 1e3 * period * back / _LONGEST_MEMORY
        raise UserError(problem, "loop.control_period", f"at least {shortest:.2g} ms behind this camera")
    return early, Remembered(back, int((taken - arrived).max()))


class LoopTicks:
    """The ticks of one cycle of a smooth loop (`smooth`) about a reference that rests at theta [rad].

    It bends in as many planes as theta has entries, a number or (2,), and so has `acceleration`, the reference's
    [rad/s^2]. `sizes` (x,) are the typical sizes of the state's variables and `names` what they are; `columns` says
    where recorded values have which kind. Raises UserError where the observer would have to look back too far.
    """

    def __init__(
        self,
        law: Controller,
        gains: Sequence[float],
        loop: Loop,
        wrist: WristParameters,
        theta: ArrayLike,
        acceleration: ArrayLike = 0.0,
    ) -> None:
        self.period = loop.control_period
        self.cycle, _ = cycle_of(loop)
        self._law, self._gains, self._world = law, np.array([gains], float), World(loop, wrist)
        self._theta = np.atleast_1d(np.asarray(theta, float))
        self._planes = len(self._theta)
        self._acceleration = np.broadcast_to(np.asarray(acceleration, float), self._planes)
        self._model = plant_in(self._planes, loop.plant.model)
        self._kernel = kernel_of(run_blocks, self._model)
        self._early, self._back = looks_back(loop)
        self._first = self._early + self.cycle * math.ceil(_WARM_UP / self.cycle)
        self._make(2)
        parts = list(self._parts(0))
        self.sizes = np.concatenate([part.sizes for part in parts])
        self.names = [part.name for part in parts for _ in part.rows]
        self.columns = parts_of_sample(self._planes, self._places)
        self._make(2 * (len(self.sizes) + len(_OTHERS) * self._planes) + 1)

    def guesses(self) -> list[Array]:
        """States (x,) from which a resting point may be looked for: the loop let go from rest, and a while later."""
        self._make(self._count)
        self._run(0, self._early)
        states = [self._states(self._early)[-1]]
        for begin, end in ((self._early, self._early + 1), (self._early + 1, self._first)):
            self._run(begin, end)
            states.append(self._states(end)[-1])
        return states

    def slopes(self, state: Array, times: float = 1.0) -> list[TickSlopes]:
        """Differentiate the ticks of a cycle from one state (x,), over `times` a small change.

        Ticks at which no frame is taken or arrives are all the same one.
        """
        between = None
        small = times * (SMALLER if "bristle" in self.names else SMALL)
        cycle = []
        for tick in range(self._first, self._first + self.cycle):
            frames = self._frames()
            plain = tick not in frames.captures and tick not in frames.arrivals
            slopes = between if plain and between is not None else self._tick(tick, state, small)
            between = slopes if plain else between
            cycle.append(slopes)
        return cycle

    def _tick(self, tick: int, state: Array, small: float) -> TickSlopes:
        n, planes, changes = len(state), self._planes, small * self.sizes
        states = np.tile(state, (self._count, 1))
        states[np.arange(0, 2 * n, 2), np.arange(n)] += changes
        states[np.arange(1, 2 * n, 2), np.arange(n)] -= changes
        self._count_to(tick)
        write_state(self._parts(tick), states)
        frame_taken = self._shift_frame(tick, 2 * n)
        self._batch.state.sums[:, _ALIVE] = 1.0
        self._run(tick, tick + 1)
        after, recorded = self._states(tick + 1), to_rows(self._batch.state.record[:, tick], self._count)
        after[to_rows(self._batch.state.sums, self._count)[:, _ALIVE] <= 0.0] = math.nan
        of_inputs = np.full(planes, SMALL), self._acceleration_step(), np.full(planes, SMALL)
        steps = np.concatenate([changes, *of_inputs])[:, None]
        by, outputs = ((values[:-1:2] - values[1:-1:2]) / (2.0 * steps) for values in (after, recorded))
        of_plane = by[n:].reshape(len(_OTHERS), planes, n)
        input_slopes = {name: rows[0] if planes == 1 else rows.T for name, rows in zip(_OTHERS, of_plane, strict=True)}
        return TickSlopes(after[-1], recorded[-1], by[:n].T, outputs[:n].T, seen=frame_taken, **input_slopes)

    def _shift_frame(self, tick: int, lane: int) -> bool:
        """Add a little to the frame that is taken at this tick, in two lanes for each plane; whether one is."""
        watch, planes = self._batch.state.watch, self._planes
        if not isinstance(watch, Watch):
            return False
        taken = int(watch.turn[0, 0, 0])
        if self._frames().captures[taken] != tick:
            return False
        added = np.zeros((self._count, planes))
        for plane in range(planes):
            added[lane + 2 * plane : lane + 2 * plane + 2, plane] = SMALL, -SMALL
        watch.readings[:, taken, :planes] = to_blocks(added)
        return True

    def _acceleration_step(self) -> Array:
        step: Array = SMALL * np.maximum(1.0, np.abs(self._acceleration))
        return step

    def _make(self, count: int) -> None:
        """A batch of so many lanes; the last is as it is, before it are those of the reference and its acceleration."""
        planes, samples = self._planes, self._first + 2 * self.cycle + 1
        sides, still, steps = np.array([1.0, -1.0]), np.zeros(planes), self._acceleration_step()
        faster = [(still, side * axis) for axis in np.diag(steps) for side in sides]
        further = [(side * SMALL * axis, still) for axis in np.eye(planes) for side in sides]
        motions = [
            resting(self._theta + shift, samples, self.period, self._acceleration + more)
            for shift, more in ((still, still), *faster, *further)
        ]
        which, gains = np.zeros(count, np.int64), np.tile(self._gains, (count, 1))
        if count > 2:
            which[-len(motions) : -1] = np.arange(1, len(motions))
        k = self._model.coordinates(self._world.loop.plant_segments)
        lanes = Lanes(which, np.zeros(count, np.int64), [(0,)] * count)
        recorded = parts_of_sample(planes, self._places)["coordinates"].start + k
        lanes_batch = batch(
            self._law, gains, motions, [self._world], lanes, self._model,
            lambda plant: np.tile(self._theta / (k // planes), k // planes), recorded,
        )  # fmt: skip
        self._count, self._batch = count, lanes_batch._replace(setup=lanes_batch.setup._replace(ticks=1))
        self._scratch = lanes_batch.scratch()

    @property
    def _places(self) -> int:
        return len(SIDES) if self._planes == 1 else len(TendonLayout.of(self._world.wrist).places)

    def _frames(self) -> Schedule:
        """Ticks of the frames, the same in all lanes, (F,); none where sensors are ideal."""
        never = np.zeros((1, 0, 1), np.int64), *np.zeros((2, 1, 1), np.int64)
        schedule = self._batch.world.schedule
        schedule = schedule if isinstance(schedule, Schedule) else Schedule(*never)
        return Schedule(*(ticks[0, ..., 0] for ticks in schedule))

    def _parts(self, tick: int) -> Iterator[StatePart]:
        return state_parts(self._batch, self._law, tick, self._back)

    def _states(self, tick: int) -> Array:
        return read_state(self._parts(tick), self._count)

    def _count_to(self, tick: int) -> None:
        """Set the camera's counters to what they are before a tick."""
        watch, frames = self._batch.state.watch, self._frames()
        if isinstance(watch, Watch):
            taken, arrived = (int(np.searchsorted(grid, tick)) for grid in (frames.captures, frames.arrivals))
            watch.turn[:, 0], watch.turn[:, 1] = taken, arrived
            watch.observer.at[:] = frames.dated[arrived - 1]

    def _run(self, begin: int, end: int) -> None:
        lot = self._batch
        self._kernel(lot.setup, lot.course, lot.world, lot.state, self._scratch, Span(0, lot.blocks, begin, end))
