"""A loop in many lanes at once, whose ticks are taken from any state: its compiled code, differentiated."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.errors import UserError
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.simulation.actuator import IdealDrive, SpoolDrive
from wristctl.simulation.batch import Batch, Lanes, batch
from wristctl.simulation.frames import schedule
from wristctl.simulation.kernel import RECORDED, Span, run_blocks
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.observer import Schedule, Watch
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import World
from wristctl.stability.smooth_loop import cycle_of
from wristctl.wrist.dahl import InnerFriction
from wristctl.wrist.plant import kernel_of
from wristctl.wrist.tendon_mechanics import CREPT, OF_A_TENDON, WRAPPED, PulledTendons, RealTendons, X, Z

# Typical sizes [rad, rad/s, N, m], by which small changes are measured.
_ANGLE, _RATE, _PULL, _LENGTH = 1.0, 10.0, 10.0, 1e-3


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


def state_parts(batch: Batch, memory: int, tick: int, back: Remembered) -> Iterator[StatePart]:
    """The parts of the state before a tick, in the same order at every tick; of each, what changes.

    What was delivered and the frames under way come as they are counted back from the tick.
    """
    state, drive, k = batch.state, batch.world.drive, len(batch.setup.coordinates)
    yield StatePart("memory", state.memory, np.arange(memory), np.ones(memory))
    yield StatePart("angle", state.coordinates, np.arange(k), np.full(k, _ANGLE))
    yield StatePart("rate", state.coordinates, np.arange(k, 2 * k), np.full(k, _RATE))
    size = _LENGTH if isinstance(drive, SpoolDrive) else _PULL
    if not isinstance(drive, IdealDrive):
        yield StatePart("motor", state.motors, np.array([0, 2]), np.full(2, size))
    if isinstance(state.tendons, RealTendons):
        rows, per_tendon = state.tendons.state, len(OF_A_TENDON)
        count = (rows.shape[1] - k) // per_tendon
        first = per_tendon * np.arange(count)
        path = np.array([first[0] + X, first[1] + X, first[0] + WRAPPED])
        yield StatePart("path", rows, path, np.array([_LENGTH, _LENGTH, _ANGLE]))
        yield StatePart("bristle", rows, first + Z, np.ones(count))
        yield StatePart("tendon creep", rows, first + CREPT, np.full(count, _LENGTH))
    if isinstance(state.tendons, (PulledTendons, RealTendons)):
        rows = state.tendons.state
        yield StatePart("spring creep", rows, np.arange(rows.shape[1] - k, rows.shape[1]), np.full(k, _ANGLE))
        if isinstance(state.tendons.inner, InnerFriction):
            sizes = np.concatenate([np.ones(k), np.full(k, _ANGLE)])
            yield StatePart("inner friction", state.tendons.inner.state, np.arange(2 * k), sizes)
    if isinstance(state.watch, Watch):
        observer, taken = state.watch.observer, int(state.watch.turn[0, 0, 0])
        sizes = np.array([_ANGLE, _RATE, _ANGLE])
        yield StatePart("estimate", observer.now, np.arange(3), sizes)
        yield StatePart("estimate at the frame", observer.fused, np.arange(3), sizes)
        ring = np.arange(tick - back.ticks, tick) % observer.delivered.shape[1]
        sent = np.stack([2 * ring, 2 * ring + 1], axis=1).ravel()
        yield StatePart("delivered", observer.delivered, sent, np.full(len(sent), size))
        frames = np.arange(taken - back.frames, taken)
        yield StatePart("frame", state.watch.pictures, frames, np.full(len(frames), _ANGLE))


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
# Inputs by which a tick is differentiated beside its state, in the order of their lanes.
_OTHERS = ("by_frame", "by_gain", "by_reference")


class TickSlopes(NamedTuple):
    """One tick from a state: the next one, what is recorded, and their derivatives by the state x.

    Columns of `recorded` are the kernel's RECORDED. `by_frame` is 0 but where a frame is taken (`seen`).
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
    """Derivative of the next state by an angle added to the frame, (x,)."""
    by_gain: Array
    """Derivative of the next state by the law's first gain, (x,)."""
    by_reference: Array
    """Derivative of the next state by the reference angle, (x,)."""


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

    `sizes` (x,) are the typical sizes of the state's variables and `names` what they are. Raises UserError where the
    observer would have to look back too far.
    """

    def __init__(
        self, law: Controller, gains: Sequence[float], loop: Loop, wrist: WristParameters, theta: float
    ) -> None:
        self.period = loop.control_period
        self.cycle, _ = cycle_of(loop)
        self._law, self._gains, self._world, self._theta = law, np.array([gains], float), World(loop, wrist), theta
        self._model = PLANTS[loop.plant.model]
        self._kernel = kernel_of(run_blocks, self._model)
        self._early, self._back = looks_back(loop)
        self._first = self._early + self.cycle * math.ceil(_WARM_UP / self.cycle)
        self._make(2)
        parts = list(self._parts(0))
        self.sizes = np.concatenate([part.sizes for part in parts])
        self.names = [part.name for part in parts for _ in part.rows]
        self._make(2 * (len(self.sizes) + len(_OTHERS)) + 1)

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
        n, changes = len(state), small * self.sizes
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
        steps = np.append(changes, [SMALL, self._gain_step(), SMALL])[:, None]
        by, outputs = ((values[:-1:2] - values[1:-1:2]) / (2.0 * steps) for values in (after, recorded))
        input_slopes = dict(zip(_OTHERS, by[n:], strict=True))
        return TickSlopes(after[-1], recorded[-1], by[:n].T, outputs[:n].T, seen=frame_taken, **input_slopes)

    def _shift_frame(self, tick: int, lane: int) -> bool:
        """Add a little to the frame that is taken at this tick, in its two lanes; whether one is."""
        watch = self._batch.state.watch
        if not isinstance(watch, Watch):
            return False
        taken = int(watch.turn[0, 0, 0])
        if self._frames().captures[taken] != tick:
            return False
        added = np.zeros((self._count, 1))
        added[lane : lane + 2, 0] = SMALL, -SMALL
        watch.readings[:, taken, :1] = to_blocks(added)
        return True

    def _gain_step(self) -> float:
        return SMALL * max(1.0, abs(float(self._gains[0, 0]))) if self._gains.size else SMALL

    def _make(self, count: int) -> None:
        """A batch of so many lanes; the last is as it is, before it those of the reference and the first gain."""
        samples = self._first + 2 * self.cycle + 1
        motions = [_at_rest(self._theta + shift, samples, self.period) for shift in (0.0, SMALL, -SMALL)]
        which, gains = np.zeros(count, np.int64), np.tile(self._gains, (count, 1))
        if count > 2:
            which[-3:-1] = 1, 2
            gains[-5:-3, :1] += self._gain_step() * np.array([[1.0], [-1.0]])
        k = self._model.coordinates(self._world.loop.plant_segments)
        lanes = Lanes(which, np.zeros(count, np.int64), [(0,)] * count)
        lanes_batch = batch(
            self._law, gains, motions, [self._world], lanes, self._model,
            lambda plant: np.full(k, self._theta / k), len(RECORDED) + k,
        )  # fmt: skip
        self._count, self._batch = count, lanes_batch._replace(setup=lanes_batch.setup._replace(ticks=1))
        self._scratch = lanes_batch.scratch()

    def _frames(self) -> Schedule:
        """Ticks of the frames, the same in all lanes, (F,); none where sensors are ideal."""
        never = np.zeros((1, 0, 1), np.int64), *np.zeros((2, 1, 1), np.int64)
        schedule = self._batch.world.schedule
        schedule = schedule if isinstance(schedule, Schedule) else Schedule(*never)
        return Schedule(*(ticks[0, ..., 0] for ticks in schedule))

    def _parts(self, tick: int) -> Iterator[StatePart]:
        return state_parts(self._batch, self._law.memory, tick, self._back)

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


def _at_rest(theta: float, samples: int, period: float) -> Motion:
    time = period * np.arange(samples, dtype=np.float64)
    rows = np.zeros((3, samples))
    rows[0] = theta
    return Motion(time, Angles.of(rows), np.zeros((samples, 2)), 0.0, 0.0, 0.0, samples * period)
