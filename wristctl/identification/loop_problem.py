"""A measured loop as a fit of friction sees it: which samples count, and what the model expects in them.

What a loop tells at once is the capstan's exponent at its mean bend, mu (bend + sheath), by its width, and presliding,
by how soon its corners turn. Only the exponent's change with the bend tells mu from the sheath. So a search goes by the
exponent and by the bend's share of it, bend/(bend + sheath), from 0 (an endless sheath of hardly any friction) to 1 (no
sheath): where the share may be 0, the sheath has no end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from wristctl.arrays import Array
from wristctl.config.errors import UserError
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.simulation.spooled import SpooledWrist, spooled
from wristctl.wrist.dead_band import FROM_ABOVE, FROM_BELOW
from wristctl.wrist.tendons import TENDONS_PER_SIDE

EXPONENT, SHARE, PRESLIDING, STIFFNESS, DAMPING, ANGLE_ZERO, TENDON, SPOOL_PLUS, SPOOL_MINUS = range(9)
"""Coordinates of a search: the exponent, the bend's share of it, logarithms over where it begins, zeros [rad, m]; the
last three only where spools were measured."""
NUDGES = (1e-4, 1e-4, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-6, 1e-6)
"""Steps of finite differences."""
BEGIN_PRESLIDING, WIDEST = 2e-5, math.log(1e3)
"""Where a search for presliding begins [m], and how far it goes from there, as a logarithm."""
LEAST_SHARE = 1e-4
"""Below it a share is none."""
_BEGIN_FRICTION, _BEGIN_SHEATH = 0.1, 1.0
_MOST_LOST = 0.7
"""Share of the samples that may pass before the first that counts."""


@dataclass(frozen=True)
class LoopProblem:
    """A measured loop, the wrist as it is believed to be, and what is known beforehand."""

    loop: MeasuredLoop
    wrist: WristParameters
    settings: HysteresisSettings

    @cached_property
    def first(self) -> int:
        """The sample from which on it is used: that of the first turn after a stroke beyond the run-up.

        How the bristles were bent when the recording began is not known; at the end of a stroke they are bent fully.
        """
        strokes = np.abs(np.diff(self.loop.angle[[0, *self.loop.turns]])) * self.wrist.tendon_offset
        long = np.flatnonzero(strokes > self.settings.known.run_up)
        at = self.loop.turns[long[0]] if len(long) else len(self.loop.time)
        if at > _MOST_LOST * len(self.loop.time):
            told = f"{1e3 * self.settings.known.run_up:g} mm of its tendons' path"
            raise UserError(
                f"too little comes after the first turn that follows a stroke of {told}", self.loop.name,
                "record two cycles or more; for small ones lower hysteresis.known.run_up to some times the presliding",
            )  # fmt: skip
        return int(at)

    @cached_property
    def bend(self) -> float:
        """Mean bend [rad], at which the exponent is meant."""
        return float(np.abs(self.loop.angle[self.first :]).mean())

    @property
    def measured(self) -> list[Array]:
        """What is used of it: angle [rad] and, where spools are what moved, both tensions [N]."""
        more = () if self.loop.winch or self.loop.tensions is None else self.loop.tensions.T
        return [each[self.first :] for each in (self.loop.angle, *more)]

    @cached_property
    def prior(self) -> Array:
        """One over the standard deviation with which each coordinate is known beforehand; 0 where nothing is."""
        known = self.settings.known
        errors = known.stiffness_error, known.damping_error, math.radians(known.zero_error_deg)
        spools = known.tendon_stiffness_error, known.spool_error, known.spool_error
        return np.array([0.0, 0.0, 0.0, *(1.0 / each for each in (*errors, *(() if self.loop.winch else spools)))])

    def begin(self) -> Array:
        """The coordinates at the start."""
        x = np.zeros(len(self.prior))
        x[EXPONENT] = _BEGIN_FRICTION * (_BEGIN_SHEATH + self.bend)
        x[SHARE] = self.bend / (_BEGIN_SHEATH + self.bend)
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates."""
        low, high = np.full(len(self.prior), -np.inf), np.full(len(self.prior), np.inf)
        low[:3], high[:3] = (0.0, LEAST_SHARE, -WIDEST), (5.0, 1.0, WIDEST)
        return low, high

    def tendons(self, x: Array) -> Actuator:
        """The tendons at coordinates x."""
        return Actuator(level="tendon").model_copy(
            update={
                "friction": x[SHARE] * x[EXPONENT] / self.bend,
                "sheath": self.bend * (1.0 / x[SHARE] - 1.0),
                "presliding": BEGIN_PRESLIDING * math.exp(x[PRESLIDING]),
                "tendon_stiffness": self.settings.tendon_stiffness * math.exp(x[TENDON] if len(x) > TENDON else 0.0),
            }
        )

    def expected(self, candidates: Sequence[Array]) -> list[list[Array]]:
        """What would have been measured at coordinates, as `measured` has it; they run side by side."""
        loop, sides = self.loop, float(TENDONS_PER_SIDE)
        zeros = np.array([(0.0, 0.0) if loop.winch else x[[SPOOL_PLUS, SPOOL_MINUS]] for x in candidates])
        drive = PchipInterpolator(loop.time - loop.time[0], (sides if loop.winch else 1.0) * loop.drive)
        begin = np.full(self.settings.segments, loop.angle[0] / self.settings.segments)
        z = FROM_BELOW if loop.rises else FROM_ABOVE
        lanes = [SpooledWrist(self._wrist(x), self.tendons(x), begin, loop.winch, z) for x in candidates]
        h, lasts = self.settings.step, float(loop.time[-1] - loop.time[0])
        every = max(1, int(0.5 * float(np.median(np.diff(loop.time))) / h))

        def told(time: Array, which: NDArray[np.int64]) -> Array:
            course: Array = drive(time.clip(0.0, lasts))[:, :, None] + zeros[which].T
            return course

        done = spooled(lanes, told, every * (math.ceil(lasts / (h * every)) + 1) + 1, h, every)
        grid, at = h * every * np.arange(done.theta.shape[1]), (loop.time - loop.time[0])[self.first :]
        found = []
        for lane, x in enumerate(candidates):
            pulls = () if len(self.measured) == 1 else (done.spool_plus[lane] / sides, done.spool_minus[lane] / sides)
            found.append([np.interp(at, grid, each) for each in (done.theta[lane] + x[ANGLE_ZERO], *pulls)])
        return found

    def _wrist(self, x: Array) -> WristParameters:
        own = self.wrist.stiffness * math.exp(x[STIFFNESS]), self.wrist.damping * math.exp(x[DAMPING])
        return self.wrist.model_copy(update=dict(zip(("stiffness", "damping"), own, strict=True)))
