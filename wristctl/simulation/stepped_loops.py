"""Closed loops that are run a sample at a time, with torques from outside in the place of a law.

They are the loops of `rollout`, in its kernel: the law there reads the torque that has been given. What a law would see
next is looked up between two samples by what the kernel itself calls; a frame is taken and fused once, whoever asks.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Limits, belief_in_lanes
from wristctl.control.law import NOW, Controller, Gain
from wristctl.control.response import Controlled, Seen, perceive, room_like
from wristctl.lanes.blocks import to_rows
from wristctl.lanes.compiled import kernel, spelled_out
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.named_tuples import block_of
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import drive_in_lanes
from wristctl.simulation.batch import Lanes, Start, batch
from wristctl.simulation.cases import Case
from wristctl.simulation.convergence import has_kinks, in_one_go
from wristctl.simulation.kernel import Span, gather_lanes, run_blocks
from wristctl.simulation.observer import Knowing, sense
from wristctl.simulation.rollout import outcome_of, worlds_of
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import bending_limit
from wristctl.wrist.plant import bend_of, kernel_of, parameters_of
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE, reach

_ALIVE = SUMS.index("alive")
_SIDE = float(TENDONS_PER_SIDE)
_TRUE, _WELL, _LIMIT = len(NOW), len(NOW) + 1, len(NOW) + 2
_ROWS = len(NOW) + 3


def _given(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque that stands in the place of a gain."""
    return gains.torque


GIVEN = Controller(
    name="given",
    law=_given,
    source="whoever steps the loops",
    gains={"torque": Gain("N m", "torque of the next sample", -100.0, 100.0)},
    presets={},
)


class Sight(NamedTuple):
    """Signals of `count` loops at a sample, as their laws see them, and the true angles."""

    signals: Array
    """(count, NOW): behind a camera the observer's."""
    theta: Array
    """Bending angle [rad], (count,)."""
    reference: Array
    """Reference of the bending angle [rad], (count,)."""
    failed: NDArray[np.bool_]
    """Whether a loop's wrist has left its range, (count,); it stays where it was."""
    limit: Array
    """Bending angle beyond which a wrist has failed [rad], (count,)."""


class SteppedLoops:
    """`count` loops at their first sample, one for each case, at rest where `start` says or straight.

    A step is a sample: a control period, or as many as are in 1 ms, over which the torques are held. The cases' worlds
    have one structure (ValueError where they do not) and their motions one length.
    """

    def __init__(self, cases: Sequence[Case], wrist: WristParameters, start: Start | None = None) -> None:
        motions = list({id(case.motion): case.motion for case in cases}.values())
        numbers = {id(followed): number for number, followed in enumerate(motions)}
        which = np.array([numbers[id(case.motion)] for case in cases], np.int64)
        loops, count = [case.loop for case in cases], len(cases)
        one = all(loop is loops[0] for loop in loops)
        worlds, world = worlds_of(loops[0] if one else loops, wrist, count)
        lanes = Lanes(which, world, [case.stream for case in cases])
        model = PLANTS[loops[0].plant.model]
        self.count, self.sample, self.samples = count, 0, len(motions[0].time)
        self._loop, self._kinked = loops[0], np.array([has_kinks(loop) for loop in loops])
        self._bears = np.full(count, wrist.tension_range)
        self._run: Callable[..., None] = kernel_of(run_blocks, model)
        self._look: Callable[..., None] = kernel_of(_look_blocks, model)
        self._batch = batch(GIVEN, np.zeros((count, 1)), motions, worlds, lanes, model, start, 0)
        self._scratch = self._batch.scratch()
        self._found: Array = np.empty((self._batch.blocks, _ROWS, *self._batch.wide))

    @property
    def done(self) -> bool:
        """Whether the last sample of the motions has come."""
        return self.sample + 1 >= self.samples

    def step(self, torques: Array) -> None:
        """Hold torques (count,) [N m] until the next sample."""
        rollouts = self._batch
        values = rollouts.world.gains.reshape(-1)
        values[: self.count] = torques
        values[self.count :] = torques[-1]
        span = Span(0, rollouts.blocks, self.sample, self.sample + 1)
        self._run(rollouts.setup, rollouts.course, rollouts.world, rollouts.state, self._scratch, span)
        self.sample += 1

    def doubts(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Loops whose integration step may be too long for the torques so far, and the steps in a control period that
        are likely to be enough, (count,) each."""
        outcome = outcome_of(self._batch, self.count, self._loop)
        return in_one_go(outcome, self._kinked, self._bears)

    def look(self) -> Sight:
        """Signals that laws see now, before they answer, and the true angles."""
        rollouts = self._batch
        self._look(
            rollouts.setup, rollouts.course, rollouts.world, rollouts.state, self._scratch, self.sample, self._found
        )
        rows = to_rows(self._found, self.count)
        signals = rows[:, : len(NOW)]
        wanted = signals[:, NOW.index("theta_ref")]
        return Sight(signals, rows[:, _TRUE], wanted, rows[:, _WELL] <= 0.0, rows[:, _LIMIT])


def _look_blocks(setup: Any, course: Any, world: Any, state: Any, scratch: Any, sample: int, output: Any) -> None:
    for block in range(len(output)):
        _look_block(setup, course, block_of(world, block), block_of(state, block), scratch, sample, output[block])


@spelled_out
def _look_block(setup: Any, course: Any, world: Any, state: Any, scratch: Any, sample: int, output: Any) -> None:
    coordinates, period = setup.coordinates, setup.period
    n, count, planes = len(coordinates), len(setup.pulls), len(setup.bend)
    plant = parameters_of(setup.plant, rows_of(world.plant), setup.pulls)
    known, drive = belief_in_lanes(world.belief), drive_in_lanes(world.drive)
    control = Controlled(setup.law, scratch.now, world.belief.models, world.gains, state.memory, scratch.target)
    every, motor = rows_of(state.coordinates), rows_of(state.motors)
    q, rates = part(every, 0, coordinates), part(every, n, coordinates)
    bound, signals, out = rows_of(world.limits), rows_of(scratch.now[0]), rows_of(output)
    limits = Limits(part(bound, 0, setup.pulls), part(bound, count, setup.pulls))
    bend, speed = lanes_like(part(every, 0, setup.bend)), lanes_like(part(every, 0, setup.bend))
    room = room_like(bend, part(every, 0, setup.arms))
    rows = lanes_like(part(every, 0, setup.seen))
    seen = Seen(rows, part(motor, 2 * count, setup.bend), part(motor, 2 * count + planes, setup.bend))
    gather_lanes(course.references, state.which, sample, scratch.target.reshape(3 * planes, len(state.which)))
    bend_of(plant, q, rates, bend, speed)
    knowing = Knowing(known, drive, bend, limits.least, room.arms)
    sense(state.watch, world.schedule, knowing, sample * setup.ticks, bend, speed, period, rows)
    perceive(control, known, seen, limits, room, 0.0, period)
    for i in range(_TRUE):
        out[i] = signals[i]
    out[_TRUE] = bend[0]
    out[_WELL] = where(abs(bend[0]) < bound[2 * count], rows_of(state.sums)[_ALIVE], 0.0)
    out[_LIMIT] = bound[2 * count]


@kernel
def _reach_along(model: Any, theta: Any, low: float, high: float, output: Any) -> None:
    believed, angles, out = load_segments(rows_of(model)), rows_of(theta), rows_of(output)
    for k in range(theta.shape[0]):
        zero = zero_like(angles[k])
        out[2 * k], out[2 * k + 1] = reach(angles[k], believed, low + zero, high + zero)


def largest_torque(wrist: WristParameters) -> float:
    """Largest torque [N m] that the tendons of a wrist can give anywhere in its range, by the one-segment model."""
    angles = np.linspace(-1.0, 1.0, 101) * bending_limit(wrist)
    torques: Array = np.empty(2 * len(angles))
    _reach_along(segments(wrist, 1), angles, _SIDE * wrist.pretension, _SIDE * wrist.tension_limit, torques)
    return float(np.abs(torques).max())
