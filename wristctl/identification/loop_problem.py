"""A measured loop as a fit of friction sees it: which samples count, and what the model expects in them.

What a loop tells at once is the capstan's exponent at its mean bend, mu (bend + sheath), by its width, and presliding,
by how soon its corners turn. Only the exponent's change with the bend tells mu from the sheath. So a search goes by the
exponent and by the bend's share of it, bend/(bend + sheath), from 0 (an endless sheath of hardly any friction) to 1 (no
sheath): where the share may be 0, the sheath has no end.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.measured_loop import MeasuredLoop
from wristctl.identification.measured_trials import frame_noise
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.wrist.statics import FROM_ABOVE, FROM_BELOW
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Coordinates of a search: the exponent, the bend's share of it, logarithms over where it begins, zeros [rad, m];
# friction inside the wrist as the bend at which its torque balances the springs [rad]. The last three only where spools
# were measured.
(EXPONENT, SHARE, PRESLIDING, STIFFNESS, DAMPING, ANGLE_ZERO, INNER, INNER_PRESLIDING, RADIUS, TENDON, SPOOL_PLUS,
 SPOOL_MINUS) = range(12)  # fmt: skip
# Steps of finite differences.
NUDGES = (1e-4, 1e-4, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-3, 1e-4, 1e-3, 1e-6, 1e-6)
# Start of a search for presliding [m], and its width as a logarithm; that of inner friction [deg].
BEGIN_PRESLIDING, WIDEST = 2e-5, math.log(1e3)
BEGIN_INNER_PRESLIDING_DEG = 1.0
# Below it a share is none.
LEAST_SHARE = 1e-4
_BEGIN_FRICTION, _BEGIN_SHEATH, _BEGIN_INNER = 0.1, 1.0, 0.05
# Share of the samples that may pass before the first that counts.
_MOST_LOST = 0.7
# Integration steps of a loop: a slow one takes longer ones, up to the longest [s].
_STEPS, _LONGEST_STEP = 20_000, 0.02
# Least noise of an angle [rad] and of a tension [N].
_LEAST_NOISE = (math.radians(0.01), 0.01, 0.01)


class Supposition(NamedTuple):
    """What a fit of a loop takes for granted."""

    words: str
    freed: bool
    """Whether stiffness, radius, slack and the angle's zero are hardly known beforehand."""
    inner: bool
    """Whether there is friction inside the wrist."""
    tendons: bool = True
    """Whether tendons rub."""


AS_BELIEVED = Supposition("friction of the tendons", False, False)
SUPPOSITIONS = (
    AS_BELIEVED,
    Supposition("and stiffness, radius, slack free", True, False),
    Supposition("and friction inside the wrist", True, True),
)
"""In the order in which they are tried: each has what those before it have."""
# Standard deviations of what is freed: logarithms, then radians and metres.
# How well a bend in which inner friction turns round is known: a logarithm.
_INNER_PRESLIDING_ERROR = 1.5
_FREED = {STIFFNESS: 1.0, RADIUS: 0.5, ANGLE_ZERO: math.radians(10.0), SPOOL_PLUS: 3e-3, SPOOL_MINUS: 3e-3}


@dataclass(frozen=True)
class LoopProblem:
    """A measured loop, the wrist as it is believed to be, and what is known beforehand."""

    loop: MeasuredLoop
    wrist: WristParameters
    settings: IdentifySettings
    supposed: Supposition = AS_BELIEVED
    finer: int = 1
    """Integration steps in place of each usual one."""

    @cached_property
    def first(self) -> int:
        """The sample from which on it is used: that of the first turn after a stroke beyond the run-up.

        How the bristles were bent when the recording began is not known; at the end of a stroke they are bent fully.
        """
        strokes = np.abs(np.diff(self.loop.angle[[0, *self.loop.turns]])) * self.wrist.tendon_offset
        long = np.flatnonzero(strokes > self.settings.known.run_up)
        turn = self.loop.turns[long[0]] if len(long) else len(self.loop.time)
        if turn > _MOST_LOST * len(self.loop.time):
            run_up = f"{1e3 * self.settings.known.run_up:g} mm of its tendons' path"
            raise UserError(
                f"too little comes after the first turn that follows a stroke of {run_up}", self.loop.name,
                "record two cycles or more; for small ones lower identify.known.run_up to some times the presliding",
            )  # fmt: skip
        return int(turn)

    @cached_property
    def bend(self) -> float:
        """Mean bend [rad], at which the exponent is meant."""
        return float(np.abs(self.loop.angle[self.first :]).mean())

    @property
    def measured(self) -> list[Array]:
        """Signals for the fit: angle [rad] and, where spools are what moved, both tensions [N]."""
        more = () if self.loop.winch or self.loop.tensions is None else self.loop.tensions.T
        return [signal[self.first :] for signal in (self.loop.angle, *more)]

    @property
    def noise(self) -> Array:
        """Noise of each signal's single samples, whatever it does from sample to sample."""
        least = _LEAST_NOISE[: len(self.measured)]
        return np.array([max(frame_noise([s]), floor) for s, floor in zip(self.measured, least, strict=True)])

    @cached_property
    def step(self) -> float:
        """Integration step [s]."""
        lasts = float(self.loop.time[-1] - self.loop.time[0])
        return max(self.settings.step, min(_LONGEST_STEP, lasts / _STEPS)) / self.finer

    @cached_property
    def count(self) -> int:
        """Number of coordinates."""
        return TENDON if self.loop.winch else SPOOL_MINUS + 1

    @cached_property
    def fixed(self) -> dict[int, float]:
        """Coordinates that are held, with their values."""
        fix, held = self.settings.fix, dict[int, float]()
        if fix.stiffness is not None:
            held[STIFFNESS] = math.log(fix.stiffness / self.wrist.stiffness)
        if fix.tendon_radius is not None:
            held[RADIUS] = math.log(fix.tendon_radius / self.wrist.tendon_radius)
        elif self.loop.winch or not self.supposed.freed:
            held[RADIUS] = 0.0
        if fix.presliding is not None:
            held[PRESLIDING] = math.log(fix.presliding / BEGIN_PRESLIDING)
        if fix.inner_friction is not None:
            held[INNER] = fix.inner_friction / self.wrist.stiffness
        elif not self.supposed.inner:
            held[INNER] = 0.0
        if fix.inner_presliding_deg is not None:
            held[INNER_PRESLIDING] = math.log(fix.inner_presliding_deg / BEGIN_INNER_PRESLIDING_DEG)
        elif held.get(INNER) == 0.0:
            held[INNER_PRESLIDING] = 0.0
        if not self.supposed.tendons:
            held |= {EXPONENT: 0.0, SHARE: 0.5, PRESLIDING: 0.0}
        return held

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """Indices of the coordinates that a search moves."""
        return np.array([index for index in range(self.count) if index not in self.fixed], np.int64)

    @cached_property
    def prior(self) -> Array:
        """One over the standard deviation with which each coordinate is known beforehand; 0 where nothing is."""
        settings, known = self.settings, self.settings.known
        errors = {
            STIFFNESS: known.stiffness_error,
            DAMPING: known.damping_error,
            ANGLE_ZERO: math.radians(settings.zero_error_deg),
            INNER_PRESLIDING: _INNER_PRESLIDING_ERROR,
            RADIUS: settings.radius_error,
            TENDON: known.tendon_stiffness_error,
            SPOOL_PLUS: settings.spool_error,
            SPOOL_MINUS: settings.spool_error,
        }
        if self.supposed.freed:
            errors |= {index: max(error, errors[index]) for index, error in _FREED.items()}
        return np.array([1.0 / errors[index] if index in errors else 0.0 for index in range(self.count)])

    def begin(self) -> Array:
        """The coordinates at the start."""
        x = np.zeros(self.count)
        x[EXPONENT] = _BEGIN_FRICTION * (_BEGIN_SHEATH + self.bend)
        x[SHARE] = self.bend / (_BEGIN_SHEATH + self.bend)
        x[INNER] = _BEGIN_INNER
        for index, value in self.fixed.items():
            x[index] = value
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates."""
        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        low[:3], high[:3] = (0.0, LEAST_SHARE, -WIDEST), (5.0, 1.0, WIDEST)
        low[INNER], high[INNER], low[INNER_PRESLIDING], high[INNER_PRESLIDING] = 0.0, 2.0, -4.0, 4.0
        return low, high

    def tendons(self, x: Array) -> Actuator:
        """The tendons at coordinates x."""
        stiffer = math.exp(x[TENDON]) if len(x) > TENDON else 1.0
        return Actuator(level="tendon").model_copy(
            update={
                "friction": x[SHARE] * x[EXPONENT] / self.bend,
                "sheath": self.bend * (1.0 / x[SHARE] - 1.0),
                "presliding": BEGIN_PRESLIDING * math.exp(x[PRESLIDING]),
                "tendon_stiffness": self.settings.known.tendon_stiffness * stiffer,
            }
        )

    def plant(self, x: Array) -> TrueWrist:
        """Friction inside the wrist at coordinates x."""
        torque = float(x[INNER]) * self.supposed_wrist(x).stiffness
        if self.settings.fix.inner_friction is not None:
            torque = self.settings.fix.inner_friction
        turns = BEGIN_INNER_PRESLIDING_DEG * math.exp(x[INNER_PRESLIDING])
        return TrueWrist().model_copy(update={"inner_friction": torque, "inner_presliding_deg": turns})

    def supposed_wrist(self, x: Array) -> WristParameters:
        """The wrist at coordinates x."""
        scales = {"stiffness": x[STIFFNESS], "damping": x[DAMPING], "tendon_radius": x[RADIUS]}
        return self.wrist.model_copy(
            update={name: getattr(self.wrist, name) * math.exp(scale) for name, scale in scales.items()}
        )

    def expected(self, candidates: Sequence[Array]) -> list[list[Array]]:
        """Expected measurements at coordinates, as `measured` has it; they run side by side."""
        loop, sides = self.loop, float(TENDONS_PER_SIDE)
        zeros = np.array([(0.0, 0.0) if loop.winch else x[[SPOOL_PLUS, SPOOL_MINUS]] for x in candidates])
        drive = PchipInterpolator(loop.time - loop.time[0], (sides if loop.winch else 1.0) * loop.drive)
        begin = np.full(self.settings.segments, loop.angle[0] / self.settings.segments)
        z, inner_z = (FROM_BELOW, 1.0) if loop.rises else (FROM_ABOVE, -1.0)
        lanes = [
            SpooledWrist(self.supposed_wrist(x), self.tendons(x), begin, loop.winch, z, self.plant(x), inner_z)
            for x in candidates
        ]
        h, lasts = self.step, float(loop.time[-1] - loop.time[0])
        every = max(1, int(0.5 * float(np.median(np.diff(loop.time))) / h))

        def told(time: Array, which: NDArray[np.int64]) -> Array:
            course: Array = drive(time.clip(0.0, lasts))[:, :, None] + zeros[which].T
            return course

        courses = spooled(lanes, told, every * (math.ceil(lasts / (h * every)) + 1) + 1, h, every)
        grid, instants = h * every * np.arange(courses.theta.shape[1]), (loop.time - loop.time[0])[self.first :]
        signals = []
        for lane, x in enumerate(candidates):
            pulls = (
                ()
                if len(self.measured) == 1
                else (courses.spool[..., 0][lane] / sides, courses.spool[..., 1][lane] / sides)
            )
            signals.append(
                [np.interp(instants, grid, signal) for signal in (courses.theta[lane] + x[ANGLE_ZERO], *pulls)]
            )
        return signals
