"""A configured loop as a linear one, about a resting angle: its own compiled ticks, differentiated.

Between two ticks the wrist moves under what is held, and a tick's slopes are those of its integration step. The step is
halved until the plant's answer changes no more: its slopes are then those of the exact hold, the matrix exponential of
the linear plant, whatever steps the loop is simulated with.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.stability.loop_ticks import LoopTicks, TickSlopes
from wristctl.stability.sampled_loop import Complex, LinearTick, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading, smooth

# Change in one tick, in typical sizes, that is none, and with which Newton's method ends.
_STILL, _ENDED = 1e-7, 1e-11
_TRIES = 60
# Longest step of Newton's method, in typical sizes.
_FURTHEST = 0.3
# Directions in which the state may drift, in typical sizes: an integrator's that nothing drives.
_FREE = 1e-10
# Iterations that find the tendons' path at a position of the wrist.
_TURNS = 5
# Shares of the gains with which a loop that rests nowhere near is looked for, and by how much they are raised then.
_WEAKER, _STRONGER = (0.5, 0.25, 0.1, 0.03), 1.25
# Column of the first bend, which is nan where the wrist has failed.
_BEND = 0


class RestingPoint(NamedTuple):
    """A state (x,) that no tick changes, and the ticks about it."""

    state: Array
    ticks: list[TickSlopes]

    def recorded(self, columns: slice) -> Array:
        """Values that the kernel records at the resting point."""
        values: Array = self.ticks[0].recorded[columns]
        return values


def resting_point(loop: LoopTicks) -> RestingPoint | None:
    """Newton's method on all ticks of a cycle at once, stable or not; None where nothing rests nearby.

    All of them must leave the same state, so that a loop which grows fast within its cycle is found as well as another.
    """
    tried = [RestingPoint(state, loop.slopes(state)) for state in loop.guesses()]
    for point in sorted(tried, key=lambda candidate: change_in(loop, candidate)):
        rest = _newton(loop, point)
        if change_in(loop, rest) < _STILL:
            return rest
    return None


def with_relaxed_bristles(loop: LoopTicks, sliding: LoopTicks, point: RestingPoint) -> RestingPoint:
    """Resting point of a loop with friction and relaxed bristles: the resting point of the same loop without friction.

    `point` is that one's, in the state of its own loop, `sliding`.
    """
    state = np.zeros(len(loop.sizes))
    names, sliding_names = np.array(loop.names), np.array(sliding.names)
    for name in dict.fromkeys(sliding.names):
        state[names == name] = point.state[sliding_names == name]
    path = names == "path"
    for _ in range(_TURNS):
        state[path] = loop.slopes(state)[0].after[path]
    return _newton(loop, RestingPoint(state, loop.slopes(state)))


def rest_of(
    law: Controller, gains: Sequence[float], loop: Loop, wrist: WristParameters, theta: ArrayLike
) -> tuple[LoopTicks, RestingPoint | None]:
    """A loop's ticks and where it rests; None where it rests nowhere near.

    A loop that is far from stable runs off its course from where it is looked for. It is followed there from where the
    same loop rests with all gains smaller, which is raised step by step.
    """

    def at(share: float) -> LoopTicks:
        return LoopTicks(law, [share * gain for gain in gains], loop, wrist, theta)

    whole = at(1.0)
    if (point := resting_point(whole)) is not None:
        return whole, point
    found = ((share, resting_point(at(share))) for share in _WEAKER)
    share, point = next((one for one in found if one[1] is not None), (1.0, None))
    while point is not None and share < 1.0:
        share = min(1.0, _STRONGER * share)
        ticks = at(share)
        rest = _newton(ticks, RestingPoint(point.state, ticks.slopes(point.state)))
        point = rest if change_in(ticks, rest) < _STILL else None
    return whole, point


def change_in(loop: LoopTicks, point: RestingPoint) -> float:
    """The largest change of any variable in any tick, in typical sizes; inf where the wrist is not where it can be.

    What drifts and acts on nothing, as the integral of an error whose gain is 0, is left out.
    """
    if not all(math.isfinite(tick.recorded[_BEND]) for tick in point.ticks):
        return math.inf
    acting = _acting(loop, point)
    changes = [np.abs((tick.after - point.state) / loop.sizes)[acting] for tick in point.ticks]
    change = max(float(each.max(initial=0.0)) for each in changes)
    return change if math.isfinite(change) else math.inf


def _acting(loop: LoopTicks, point: RestingPoint) -> NDArray[np.bool_]:
    """Which variables (x,) are no memory of a controller, or one that changes another variable."""
    memory = np.array(loop.names) == "memory"
    others = ~np.eye(len(loop.sizes), dtype=bool)
    acts = np.zeros(len(loop.sizes), bool)
    for tick in point.ticks:
        acts |= np.any((tick.transition != 0.0) & others, axis=0)
    acting: NDArray[np.bool_] = acts | ~memory
    return acting


def _newton(loop: LoopTicks, point: RestingPoint) -> RestingPoint:
    sizes, identity = loop.sizes, np.eye(len(loop.sizes))
    best = point
    for _ in range(_TRIES):
        now = change_in(loop, point)
        if now < change_in(loop, best):
            best = point
        if not math.isfinite(now) or now < _ENDED:
            break
        ticks, acting = list({id(tick): tick for tick in point.ticks}.values()), _acting(loop, point)
        change = np.concatenate([((tick.after - point.state) / sizes)[acting] for tick in ticks])
        slopes = np.concatenate([(tick.transition * sizes / sizes[:, None] - identity)[acting] for tick in ticks])
        step = np.linalg.lstsq(slopes, change, rcond=_FREE)[0]
        state = point.state - min(1.0, _FURTHEST / max(float(np.abs(step).max()), 1e-300)) * sizes * step
        if np.array_equal(state, point.state):
            break
        point = RestingPoint(state, loop.slopes(state))
    return best


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The acceleration of its reference as the torque, for each plane its own."""
    return now.acceleration_ref


HOLD = Controller(name="hold", law=law, source="the plant alone", gains={}, presets={})


# Change of the plant's answer, as a share of it, that is none; the shortest integration step that is tried [s]; and at
# how many frequencies the plant is asked.
_EXACT, _SHORTEST, _FREQUENCIES = 1e-6, 2e-5, 24
# Outputs of a linear loop by the kinds of values that the kernel records.
_OUTPUTS = {"theta": "bend", "rate": "rate", "torque_wanted": "torque_wanted", "tension": "tension"}


@dataclass(frozen=True)
class LinearLoop:
    """A loop about where it rests: the closed one, which can be cut, and the plant alone from torque to bend.

    It is cut where a camera takes its frames, or, where sensors are ideal, where the law commands its torque: the same
    loop, through the wrist and its motors on one side and all that its controller is on the other. What is of each
    plane is a number in one plane, and (2,) in two; tensions are of one tendon of each place.
    """

    closed: SampledLoop
    plant: SampledLoop
    theta: Any
    """Bend at rest [rad]; `torque` [N m] and `tensions` [N] hold the wrist there."""
    torque: Any
    tensions: tuple[float, ...]
    names: Sequence[str]
    """Names of the closed loop's variables."""
    at_frames: bool
    """Whether it is cut where frames are taken."""
    bend: float
    """Relative difference of the law's slope between a small change and a hundred times it."""

    @property
    def planes(self) -> int:
        """Planes that it bends in."""
        return np.size(self.theta)


def linearise(
    law: Controller,
    gains: Sequence[float],
    loop: Loop,
    wrist: WristParameters,
    theta: ArrayLike,
    friction: FrictionReading,
) -> LinearLoop | None:
    """The loop about where it rests with its reference at theta [rad]; None where it rests nowhere near.

    It bends in as many planes as theta has entries, a number or (2,). Tendons with friction are taken as `slipping` or
    `stuck`; what is held between ticks is held exactly, however many integration steps the loop has. Raises UserError
    for frames that are too many control periods apart.
    """
    sliding, point = rest_of(law, gains, smooth(loop, "slipping"), wrist, theta)
    ticks = sliding
    if point is None:
        return None
    if friction == "stuck" and loop.actuator.winds:
        ticks = LoopTicks(law, gains, smooth(loop, "stuck"), wrist, theta)
        point = with_relaxed_bristles(ticks, sliding, point)
    memory = np.array(ticks.names) == "memory"
    controller_rows = np.isin(ticks.names, ("memory", "estimate", "estimate at the frame", "delivered", "frame"))
    columns = ticks.columns
    torque = point.recorded(columns["torque_wanted"])
    alone = smooth(loop.model_copy(update={"sensor": Sensor(), "coupling": "ignored"}), friction)
    held, steps = _held(torque, alone, wrist, theta, point.state[~controller_rows])
    camera = loop.sensor.level == "camera"
    exact = LoopTicks(law, gains, _stepped(smooth(loop, friction), steps), wrist, theta).slopes(point.state)
    closed = [_seen(tick, columns) if camera else _commanded(tick, columns, memory, held) for tick in exact]
    return LinearLoop(
        closed=SampledLoop(ticks.period, closed),
        plant=SampledLoop(ticks.period, [_alone(held, columns)]),
        theta=_of_planes(point.recorded(columns["bend"])),
        torque=_of_planes(torque),
        tensions=tuple(point.recorded(columns["tension"]).tolist()),
        names=ticks.names,
        at_frames=camera,
        bend=_bend(ticks, point),
    )


def _of_planes(values: Array) -> Any:
    return float(values[0]) if len(values) == 1 else values


def _held(torque: Array, alone: Loop, wrist: WristParameters, theta: ArrayLike, state: Array) -> tuple[TickSlopes, int]:
    """The plant's tick from a state with its torque held exactly, and how many integration steps a period has for that.

    Steps of third order, as the wrist's are, converge long before the shortest; of first order 1e-4 may be left.
    """
    steps, answer = alone.steps, None
    while True:
        plant = LoopTicks(HOLD, (), _stepped(alone, steps), wrist, theta, torque)
        (tick,) = plant.slopes(state)
        before, answer = answer, _answer(tick, plant.columns)
        converged = before is not None and (np.abs(answer - before) <= _EXACT * _sizes(before)).all()
        if converged or alone.control_period < 2 * steps * _SHORTEST:
            return tick, steps
        steps *= 2


def _answer(held: TickSlopes, columns: dict[str, slice]) -> Complex:
    """The plant's bends and rates per torque at frequencies up to half the sampling rate, (2, n, P, P).

    Far below it the answer is the static one, which no step changes, and difference quotients are less exact.
    """
    z, count = np.exp(1j * np.geomspace(0.03, math.pi, _FREQUENCIES)), len(held.after)
    state = np.linalg.solve(z[:, None, None] * np.eye(count) - held.transition, held.by_acceleration.reshape(count, -1))
    return np.array([held.outputs[columns[kind]] @ state for kind in ("bend", "rate")], complex)


def _sizes(answer: Complex) -> Array:
    """The largest of each kind at each frequency, over all planes."""
    sizes: Array = np.abs(answer).max(axis=(-2, -1), keepdims=True)
    return sizes


def _stepped(loop: Loop, steps: int) -> Loop:
    return loop.model_copy(update={"substeps": steps})


def _outputs(tick: TickSlopes, columns: dict[str, slice]) -> dict[str, Array]:
    return {name: _row(tick.outputs[columns[kind]]) for name, kind in _OUTPUTS.items()}


def _row(rows: Array) -> Array:
    """Rows of P planes, or of T places; the row of one plane alone."""
    return rows[0] if len(rows) == 1 else rows


def _seen(tick: TickSlopes, columns: dict[str, slice]) -> LinearTick:
    """A tick behind a camera, cut where its frame is taken."""
    outputs = _outputs(tick, columns)
    return LinearTick(tick.transition, tick.by_frame, outputs["theta"], tick.by_reference, tick.seen, outputs)


def _commanded(tick: TickSlopes, columns: dict[str, slice], memory: NDArray[np.bool_], held: TickSlopes) -> LinearTick:
    """A tick of an ideal sensor, cut at the law's torque, which its memory does not feel.

    What a large gain does is not to be told from the wrist's own motion in one difference: the wrist's part is that of
    the torque held, and what the law makes of it.
    """
    outputs, into, transition = _outputs(tick, columns), np.zeros_like(tick.by_reference), tick.transition.copy()
    into[~memory] = held.by_acceleration
    transition[~memory] = 0.0
    transition[np.ix_(~memory, ~memory)] = held.transition
    by_torque = held.by_acceleration.reshape(len(held.after), -1)
    transition[~memory] += by_torque @ tick.outputs[columns["torque_wanted"]]
    return LinearTick(transition, into, outputs["torque_wanted"], tick.by_reference, True, outputs)


def _alone(held: TickSlopes, columns: dict[str, slice]) -> LinearTick:
    """The plant: cut at its torque, of which -bend comes back, so that its response is the bend's."""
    bends = held.outputs[columns["bend"]]
    closed = held.transition - held.by_acceleration.reshape(len(held.after), -1) @ bends
    into, outputs = held.by_acceleration, {"theta": _row(bends)}
    return LinearTick(closed, into, -outputs["theta"], held.by_reference, True, outputs)


def _bend(ticks: LoopTicks, point: RestingPoint) -> float:
    """Relative difference of the torque's slope between a small change and a hundred times it."""
    columns, worst = ticks.columns["torque_wanted"], 0.0
    for near, far in zip(point.ticks, ticks.slopes(point.state, 100.0), strict=True):
        size = float(np.abs(near.outputs[columns] * ticks.sizes).max())
        if size > 0.0:
            worst = max(worst, float(np.abs((far.outputs[columns] - near.outputs[columns]) * ticks.sizes).max()) / size)
    return worst if math.isfinite(worst) else math.inf
