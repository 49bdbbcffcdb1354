"""A configured loop as a linear one, about a resting angle: its own compiled ticks, differentiated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.simulation.kernel import RECORDED
from wristctl.stability.hold import HOLD
from wristctl.stability.loop_ticks import LoopTicks, TickSlopes
from wristctl.stability.resting_point import RestingPoint, resting_point, with_relaxed_bristles
from wristctl.stability.sampled_loop import LinearTick, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading, smooth

_OUTPUTS = {name: RECORDED.index(name) for name in ("theta", "rate", "torque_wanted", "tension_plus", "tension_minus")}


@dataclass(frozen=True)
class LinearLoop:
    """A loop about where it rests: the closed one, which can be cut, and the plant alone from torque to angle.

    It is cut where a camera takes its frames, or, where sensors are ideal, where the law commands its torque: the same
    loop, through the wrist and its motors on one side and all that its controller is on the other.
    """

    closed: SampledLoop
    plant: SampledLoop
    theta: float
    """Where it rests [rad], and the torque [N m] and tensions [N] that hold it there."""
    torque: float
    tensions: tuple[float, float]
    names: Sequence[str]
    """What each of the closed loop's variables is."""
    at_frames: bool
    """Whether it is cut where frames are taken."""
    bend: float
    """By how much of its size the law's slope differs over a hundred times the small change."""


def linearise(
    law: Controller, gains: Sequence[float], loop: Loop, wrist: WristParameters, theta: float, friction: FrictionReading
) -> LinearLoop | None:
    """The loop about where it rests with its reference at theta [rad]; None where it rests nowhere near.

    Tendons with friction are taken as `slipping` or `stuck`. Raises UserError for frames that are too many control
    periods apart.
    """
    sliding = LoopTicks(law, gains, smooth(loop, "slipping"), wrist, theta)
    ticks, point = sliding, resting_point(sliding)
    if point is None:
        return None
    if friction == "stuck" and loop.actuator.level == "tendon":
        ticks = LoopTicks(law, gains, smooth(loop, "stuck"), wrist, theta)
        point = with_relaxed_bristles(ticks, sliding, point)
    memory = np.array(ticks.names) == "memory"
    own = np.isin(ticks.names, ("memory", "estimate", "estimate at the frame", "delivered", "frame"))
    torque = point.recorded("torque_wanted")
    alone = smooth(loop.model_copy(update={"sensor": Sensor()}), friction)
    held = LoopTicks(HOLD, (torque,), alone, wrist, theta).slopes(point.state[~own])[0]
    camera = loop.sensor.level == "camera"
    closed = [_seen(each) if camera else _commanded(each, memory, held) for each in point.ticks]
    return LinearLoop(
        closed=SampledLoop(ticks.period, closed),
        plant=SampledLoop(ticks.period, [_alone(held)]),
        theta=point.recorded("theta"),
        torque=torque,
        tensions=(point.recorded("tension_plus"), point.recorded("tension_minus")),
        names=ticks.names,
        at_frames=camera,
        bend=_bend(ticks, point),
    )


def _outputs(tick: TickSlopes) -> dict[str, Array]:
    return {name: tick.outputs[at] for name, at in _OUTPUTS.items()}


def _seen(tick: TickSlopes) -> LinearTick:
    """A tick behind a camera, cut where its frame is taken."""
    outputs = _outputs(tick)
    return LinearTick(tick.transition, tick.by_frame, outputs["theta"], tick.by_reference, tick.seen, outputs)


def _commanded(tick: TickSlopes, memory: NDArray[np.bool_], held: TickSlopes) -> LinearTick:
    """A tick of an ideal sensor, cut at the law's torque, which its memory does not feel.

    What a large gain does is not to be told from the wrist's own motion in one difference: the wrist's part is that of
    the torque held, and what the law makes of it.
    """
    outputs, into, transition = _outputs(tick), np.zeros(len(memory)), tick.transition.copy()
    into[~memory] = held.by_gain
    transition[~memory] = 0.0
    transition[np.ix_(~memory, ~memory)] = held.transition
    transition[~memory] += np.outer(held.by_gain, outputs["torque_wanted"])
    return LinearTick(transition, into, outputs["torque_wanted"], tick.by_reference, True, outputs)


def _alone(held: TickSlopes) -> LinearTick:
    """The plant: cut at its torque, of which -angle comes back, so that its response is the angle's."""
    angle = held.outputs[_OUTPUTS["theta"]]
    closed = held.transition - np.outer(held.by_gain, angle)
    return LinearTick(closed, held.by_gain, -angle, held.by_reference, True, {"theta": angle})


def _bend(ticks: LoopTicks, point: RestingPoint) -> float:
    """By how much of its size the torque's slope changes over a hundred times the small change."""
    at, worst = _OUTPUTS["torque_wanted"], 0.0
    for near, far in zip(point.ticks, ticks.slopes(point.state, 100.0), strict=True):
        size = float(np.abs(near.outputs[at] * ticks.sizes).max())
        if size > 0.0:
            worst = max(worst, float(np.abs((far.outputs[at] - near.outputs[at]) * ticks.sizes).max()) / size)
    return worst if math.isfinite(worst) else math.inf
