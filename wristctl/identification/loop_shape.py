"""Shape of a measured loop by itself, without a model: width, work of a cycle and slope."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.wrist.tendons import TENDONS_PER_SIDE


class LoopShape(NamedTuple):
    """What a measured loop shows; None where its columns do not tell."""

    width: float | None
    """Angle on the way back less that on the way out, in the middle of the drive's range, mean of the strokes [rad]."""
    work: float | None
    """Work of the pulls at the spools in a cycle, mean of the whole cycles [J]."""
    stiffness: float | None
    """Slope of the spools' torque over the angle [N m/rad]."""
    gain: float | None
    """Slope of the angle over what the + side reels in [rad/m]; None where spools were not measured."""
    cycles: int
    """Whole cycles."""


def loop_shape(loop: MeasuredLoop, wrist: WristParameters) -> LoopShape:
    """The shape of a loop from its first turn on; its tensions are taken at the spools, two tendons a side."""
    turns = loop.turns
    pulled = loop.drive[:, 0] - loop.drive[:, 1]
    cycles = list(zip(turns[:-2:2], turns[2::2], strict=False))
    tail = slice(turns[0], None)
    work = stiffness = gain = None
    if loop.tensions is not None:
        torque = TENDONS_PER_SIDE * wrist.tendon_offset * (loop.tensions[:, 0] - loop.tensions[:, 1])
        stiffness = _slope(loop.angle[tail], torque[tail])
        works = [_work(loop, torque, slice(begin, end + 1)) for begin, end in cycles]
        work = float(np.mean(works)) if works else None
    if loop.spools is not None:
        gain = _slope(loop.spools[tail, 0], loop.angle[tail])
    return LoopShape(_width(pulled, loop.angle, turns), work, stiffness, gain, len(cycles))


def _slope(x: Array, y: Array) -> float:
    return float(np.polyfit(x - x.mean(), y - y.mean(), 1)[0])


def _work(loop: MeasuredLoop, torque: Array, cycle: slice) -> float:
    """Along the spools' path; where only tensions are known, along the angle's."""
    if loop.spools is None or loop.tensions is None:
        return float(np.trapezoid(torque[cycle], loop.angle[cycle]))
    pulls = zip(loop.tensions.T, loop.spools.T, strict=True)
    return float(TENDONS_PER_SIDE * sum(np.trapezoid(pull[cycle], path[cycle]) for pull, path in pulls))


def _width(pulled: Array, angle: Array, turns: NDArray[np.int64]) -> float | None:
    """Mean angle of the strokes back less that of the strokes out, at the middle of the drive's range."""
    middle = 0.5 * float(pulled[turns[0] :].max() + pulled[turns[0] :].min())
    out, back = list[float](), list[float]()
    for begin, end in zip(turns, [*turns[1:], len(pulled) - 1], strict=True):
        stroke = slice(int(begin), int(end) + 1)
        x, rises = pulled[stroke], pulled[end] > pulled[begin]
        if min(x[0], x[-1]) < middle < max(x[0], x[-1]):
            order = np.argsort(x, kind="stable")
            (out if rises else back).append(float(np.interp(middle, x[order], angle[stroke][order])))
    return float(np.mean(back) - np.mean(out)) if out and back else None
