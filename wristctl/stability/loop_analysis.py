"""All that the linearised loop tells about one resting point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.stability.linear_range import LinearityLimit, Swing, linearity_limits
from wristctl.stability.linearise import LinearLoop, linearise
from wristctl.stability.margins import Margins, frequencies, margins
from wristctl.stability.root_locus import RootLocus, root_locus
from wristctl.stability.sampled_loop import Complex, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading
from wristctl.stability.step_response import StepResponse, step_response


@dataclass(frozen=True)
class LoopAnalysis:
    """A loop about one resting angle; `response` is its transfer at frequencies `omega` [rad/s], `plant` the angle's
    per torque [rad/(N m)]."""

    linear: LinearLoop
    margins: Margins
    step: StepResponse
    limits: Sequence[LinearityLimit]
    omega: Array
    response: Complex
    plant: Complex

    @property
    def is_open(self) -> bool:
        """Whether nothing is fed back."""
        return bool(np.abs(self.response).max() < _NOTHING)


_NOTHING = 1e-9


@dataclass(frozen=True)
class AnalysedRow:
    """What is analysed: a law with its gains, by name, in a loop of a wrist, its tendons' friction taken so."""

    law: Controller
    gains: dict[str, float]
    loop: Loop
    wrist: WristParameters
    friction: FrictionReading

    def linear(self, theta: float, **gains: float) -> LinearLoop | None:
        """The loop about where it rests near theta [rad], some of its gains as given; None where it does not."""
        values = self.law.values(self.gains | gains)
        return linearise(self.law, values, self.loop, self.wrist, theta, self.friction)

    def analysed(self, theta: float) -> LoopAnalysis | None:
        """Margins, step response and limits about theta [rad]; None where it rests nowhere near."""
        with threadpool_limits(limits=1):
            linear = self.linear(theta)
            if linear is None:
                return None
            found, omega = margins(linear.closed), frequencies(linear.closed)
            factor = found.most.value if found.stable and np.isfinite(found.most.value) else 1.0
            swings = [each for each in linear.closed.modes(factor) if each.frequency > 0.0]
            swing = Swing(linear, swings[0] if swings else None, factor)
            limits = linearity_limits(swing, self.loop, self.wrist, self.friction, self.law.surface, self.gains)
            response, plant = linear.closed.response(omega), linear.plant.response(omega)
            return LoopAnalysis(linear, found, step_response(linear.closed), limits, omega, response, plant)

    def locus(self, theta: float, over: str, span: float) -> RootLocus:
        """The root locus about theta [rad] over a gain of the law, or, where that is `loop`, over the loop's own."""
        with threadpool_limits(limits=1):
            here = self.linear(theta)
            if over == "loop":
                return root_locus(over, lambda factor: None if here is None else _times(here.closed, factor), span)

            def at(factor: float) -> SampledLoop | None:
                linear = self.linear(theta, **{over: factor * self.gains[over]})
                return None if linear is None else linear.closed

            return root_locus(over, at, span)


def _times(loop: SampledLoop, factor: float) -> SampledLoop:
    """The loop with its gain times a factor."""
    ticks = zip(loop.ticks, loop.transitions(factor), strict=True)
    return SampledLoop(loop.period, [tick._replace(transition=transition) for tick, transition in ticks])
