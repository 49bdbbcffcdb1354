"""Closed loops that are run a sample at a time, with torques or tensions from outside in the place of a law.

They are the loops of `rollout`, in its kernel: what is given stands there in the place of gains. What a law would see
next is looked up between two samples by what the kernel itself calls; a frame is taken and fused once, whoever asks.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Limits, belief_in_lanes
from wristctl.control.law import NOW, Controller
from wristctl.control.response import Controlled, GivenTensions, GivenTorques, Seen, perceive, room_like
from wristctl.lanes.blocks import spread, to_rows
from wristctl.lanes.compiled import kernel, spelled_out
from wristctl.lanes.functions import norm
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.named_tuples import block_of
from wristctl.lanes.rows import lanes_like, part, rows_at, rows_of
from wristctl.simulation.batch import Lanes, Start, batch
from wristctl.simulation.cases import Case
from wristctl.simulation.convergence import has_kinks, in_one_go
from wristctl.simulation.kernel import Span, gather_lanes, run_blocks
from wristctl.simulation.observer import Knowing, sense
from wristctl.simulation.rollout import check_two_planes, outcome_of, worlds_of
from wristctl.simulation.simulated_drives import SIDES, drive_in_lanes
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import bending_limit
from wristctl.wrist.plant import bend_of, kernel_of, parameters_of, plant_in
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE, reach

_ALIVE = SUMS.index("alive")
_SIDE = float(TENDONS_PER_SIDE)
# Directions of bends in two planes that a largest torque is looked for at [rad].
_ALL_AROUND = np.radians(np.arange(0.0, 360.0, 5.0))

Given = Literal["torques", "tensions"]
"""What comes from outside: the torque that is wanted in each plane [N m], or the tension of a tendon at each place [N].
"""


class _Outside(Controller):
    """A controller in whose place torques or tensions are given."""

    def compiled(self, count: int = 1, planes: int = 1, places: int = 2) -> GivenTorques | GivenTensions:
        """What the kernel takes for a law."""
        return GivenTorques() if self.name == "torques" else GivenTensions()


class Sight(NamedTuple):
    """Signals of `count` loops in P planes at a sample, as their laws see them, and the true bends."""

    signals: Array
    """(count, P, NOW): behind a camera the observer's."""
    bend: Array
    """Bend [rad], (count, P)."""
    reference: Array
    """Reference of the bend [rad], (count, P)."""
    failed: NDArray[np.bool_]
    """Whether a loop's wrist has left its range, (count,); it stays where it was."""
    limit: Array
    """Bend beyond which a wrist has failed [rad], (count,)."""


class SteppedLoops:
    """`count` loops at their first sample, one for each case, at rest where `start` says or straight.

    A step is a sample: a control period, or as many as are in 1 ms, over which what is `given` is held. The cases'
    worlds have one structure (ValueError where they do not) and their motions one length and one number of planes.
    """

    def __init__(
        self, cases: Sequence[Case], wrist: WristParameters, start: Start | None = None, given: Given = "torques"
    ) -> None:
        motions = list({id(case.motion): case.motion for case in cases}.values())
        numbers = {id(followed): number for number, followed in enumerate(motions)}
        which = np.array([numbers[id(case.motion)] for case in cases], np.int64)
        loops, count = [case.loop for case in cases], len(cases)
        one = all(loop is loops[0] for loop in loops)
        worlds, world = worlds_of(loops[0] if one else loops, wrist, count)
        lanes = Lanes(which, world, [case.stream for case in cases])
        model = plant_in(motions[0].planes, loops[0].plant.model)
        if model.planes == 2:
            check_two_planes(worlds)
        self.count, self.sample, self.samples = count, 0, len(motions[0].time)
        self._loop, self._kinked = loops[0], np.array([has_kinks(loop) for loop in loops])
        self._bears = np.full(count, wrist.tension_range)
        self._run: Callable[..., None] = kernel_of(run_blocks, model)
        self._look: Callable[..., None] = kernel_of(_look_blocks, model)
        places = places_of(wrist, model.planes)
        nothing = np.zeros((count, model.planes)) if given == "torques" else np.tile(wrist.pretension, (count, places))
        outside = _Outside(name=given, law=None, source="whoever steps the loops", gains={}, presets={})
        self._batch = batch(outside, nothing, motions, worlds, lanes, model, start, 0)
        self._scratch, self._planes = self._batch.scratch(), model.planes
        rows = model.planes * (len(NOW) + 1) + 2
        self._found: Array = np.empty((self._batch.blocks, rows, *self._batch.wide))

    @property
    def done(self) -> bool:
        """Whether the last sample of the motions has come."""
        return self.sample + 1 >= self.samples

    def step(self, values: Array) -> None:
        """Hold torques (count, P) [N m], or tensions (count, T) [N], until the next sample."""
        rollouts = self._batch
        rollouts.world.gains[:] = spread(values, self.count)
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
        rows, planes = to_rows(self._found, self.count), self._planes
        signals = rows[:, : planes * len(NOW)].reshape(self.count, planes, len(NOW))
        bend, well, limit = rows[:, planes * len(NOW) : -2], rows[:, -2], rows[:, -1]
        return Sight(signals, bend, signals[..., NOW.index("theta_ref")], well <= 0.0, limit)


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
    bound, out = rows_of(world.limits), rows_of(output)
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
    for p in range(planes):
        signals = rows_at(scratch.now, p)
        for i in range(len(NOW)):
            out[len(NOW) * p + i] = signals[i]
        out[len(NOW) * planes + p] = bend[p]
    last = (len(NOW) + 1) * planes
    out[last] = where(norm(bend) < bound[2 * count], rows_of(state.sums)[_ALIVE], 0.0)
    out[last + 1] = bound[2 * count]


@kernel
def _reach_along(model: Any, theta: Any, low: float, high: float, output: Any) -> None:
    believed, angles, out = load_segments(rows_of(model)), rows_of(theta), rows_of(output)
    for k in range(theta.shape[0]):
        zero = zero_like(angles[k])
        out[2 * k], out[2 * k + 1] = reach(angles[k], believed, low + zero, high + zero)


def places_of(wrist: WristParameters, planes: int) -> int:
    """Number of places of tendons in loops in so many planes: in one the + and the - side."""
    return len(SIDES) if planes == 1 else len(TendonLayout.of(wrist).places)


def largest_torque(wrist: WristParameters, planes: int = 1) -> float:
    """Largest torque [N m] that the tendons of a wrist can give in a plane anywhere in its range, by the one-segment
    model."""
    sizes = np.linspace(-1.0, 1.0, 101) * bending_limit(wrist)
    if planes == 1:
        torques: Array = np.empty(2 * len(sizes))
        _reach_along(segments(wrist, 1), sizes, _SIDE * wrist.pretension, _SIDE * wrist.tension_limit, torques)
        return float(np.abs(torques).max())
    layout = TendonLayout.of(wrist)
    bends = [size * np.array([np.cos(turn), np.sin(turn)]) for size in sizes[50:] for turn in _ALL_AROUND]
    arms = np.array([layout.moment_arms(bend, wrist.length, wrist.discs) for bend in bends])
    pulling = np.where(arms > 0.0, wrist.tension_limit, wrist.pretension) * layout.multiplicity[:, None]
    resting = np.where(arms < 0.0, wrist.tension_limit, wrist.pretension) * layout.multiplicity[:, None]
    return float(max((arms * pulling).sum(axis=1).max(), -(arms * resting).sum(axis=1).min()))
