"""When trials must stop: limits on what is measured, commanded and late."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.board_errors import SAFETY_STOP
from wristctl.board.messages import State
from wristctl.config.hw_run import Safety
from wristctl.control.response import Estimate
from wristctl.errors import Phrase, UserError
from wristctl.trial.spools import Spools
from wristctl.trial.steering import Answer


class SafetyStop(UserError):
    """The trial was stopped; motors are to be stopped too."""

    def __init__(self, what: str, where: str = "", fix: Phrase = "") -> None:
        super().__init__(f"stopped: {what}", where, fix, SAFETY_STOP)


class Seen(NamedTuple):
    """Values that the monitor judges at one tick; SI units."""

    estimate: Estimate
    age: float
    """Since the capture of the last usable marker angle."""
    verdict: str
    """Verdict of the newest frame, or why there was none."""
    position: Array
    """Spools, (4,) [steps]."""
    taut: Array
    """Taut lengths of the tendons at the estimated angle, (4,) [m]."""
    state: State
    late: float
    lapses: int
    """Step rates that have outlived their life, as the board counts."""
    time: float
    """On the clock [s]."""
    fix: str = ""
    """Advice about a camera that gives no usable angle."""


# So many rates that have outlived their life within so many seconds are too many.
_LAPSES, _WITHIN = 3, 1.0


class Monitor:
    """Raises SafetyStop at the first tick whose values are beyond the limits."""

    def __init__(self, limits: Safety, spools: Spools) -> None:
        self._limits, self._spools = limits, spools
        self._lapses: int | None = None
        self._lapsed: deque[float] = deque(maxlen=_LAPSES)

    def see(self, tick: Seen) -> None:
        """Judge what was measured. A late tick comes first: what it sees is late as well."""
        limits = self._limits
        if tick.late > limits.late:
            problem = f"a tick came {1e3 * tick.late:.0f} ms late"
            raise SafetyStop(problem, fix="close other programs, or a longer control_period")
        self._count_lapses(tick)
        if not all(map(math.isfinite, tick.estimate)):
            raise SafetyStop("the observer's estimate is not a number", fix="see the frames in data/frames.csv")
        self._angle(tick.estimate.theta)
        if abs(tick.estimate.rate) > limits.rate:
            fix = "gentler gains or reference, or widen safety.rate"
            raise SafetyStop(f"rate {tick.estimate.rate:.1f} rad/s beyond +-{limits.rate:g} rad/s", fix=fix)
        if tick.age > limits.stale:
            raise SafetyStop(f"no usable marker angle for {1e3 * tick.age:.0f} ms ({tick.verdict})", fix=tick.fix)
        self._pull(tick.position, tick.taut)
        reeled = float(np.abs(tick.position).max()) * self._spools.step
        if reeled > limits.travel:
            fix = "a smaller reference, or widen safety.travel"
            raise SafetyStop(f"a spool {1e3 * reeled:.1f} mm from zero, beyond {1e3 * limits.travel:g} mm", fix=fix)
        if tick.state != State.ENABLED:
            raise SafetyStop(f"the board is {tick.state.name}, not ENABLED", fix="home again")

    def standing(self, theta: float, position: Array, taut: Array) -> None:
        """Judge a wrist whose motors stand by one marker angle [rad]; position and taut as of `Seen`."""
        self._angle(theta)
        self._pull(position, taut)

    @property
    def stale(self) -> float:
        """Seconds for which the marker may be out of sight."""
        return self._limits.stale

    def _count_lapses(self, tick: Seen) -> None:
        before = tick.lapses if self._lapses is None else self._lapses
        self._lapses = tick.lapses
        self._lapsed.extend([tick.time] * ((tick.lapses - before) & 0xFF))
        if len(self._lapsed) == _LAPSES and tick.time - self._lapsed[0] < _WITHIN:
            problem = f"step rates came too late to the board {_LAPSES} times in {_WITHIN:g} s"
            raise SafetyStop(problem, fix="close other programs, or see that the cable and its plugs are sound")

    def _angle(self, theta: float) -> None:
        limit = self._limits.angle_deg
        if abs(theta) > math.radians(limit):
            fix = "gentler gains or reference, or widen safety.angle_deg"
            raise SafetyStop(f"angle {math.degrees(theta):.1f} deg beyond +-{limit:g} deg", fix=fix)

    def _pull(self, position: Array, taut: Array) -> None:
        pulling, limit = float(self._spools.tension(position, taut).max()), self._limits.tension
        if pulling > limit:
            fix = "something holds the wrist, or the zero positions are wrong: home again"
            raise SafetyStop(f"tension of about {pulling:.0f} N beyond {limit:g} N", fix=fix)

    def answer(self, answer: Answer) -> None:
        """Judge what the law wants."""
        if not all(map(math.isfinite, answer)):
            raise SafetyStop("the law's torque is not a number", fix="see its gains and model")
