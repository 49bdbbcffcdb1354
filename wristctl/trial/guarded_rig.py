"""A rig of the user's own behind one guard: what its code does is an answer that can be used, or the user's error."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.board_errors import HARDWARE
from wristctl.errors import UserError
from wristctl.interrupt import from_outside
from wristctl.plugins.places import raised_at
from wristctl.rig import Facts, Fault, Lost, Reeled, Refused, Rig, RigError

# What each error of a rig says, and what to do about it.
_SAYS = {
    Lost: ("the rig does not answer", "see its cable, power and program, then run again"),
    Refused: ("the rig refuses what it was told", "a smaller motion, or facts.limits that are the robot's own"),
    Fault: ("the rig has stopped by itself", "see what it names, clear it at the robot, then run again"),
}


class RigStop(UserError):
    """A rig that cannot go on, or whose code has failed."""

    def __init__(self, what: str, where: str, fix: str) -> None:
        super().__init__(what, where, fix, HARDWARE)


class Seen(NamedTuple):
    """A look at the wrist, checked."""

    bend: Array
    """(P,) [rad]; nan where it is not seen."""
    time: float
    """On the rig's clock [s]."""
    tension: Array | None
    """(T,) [N]; None where it is not measured."""
    tip: Array | None = None
    """(P + 1,) [m]; None where it is not measured."""


class GuardedRig:
    """A rig whose answers have their shapes, and whose errors are RigStop with the line that raised them.

    Ctrl-C passes. `where` is the rig's file.py:NAME.
    """

    def __init__(self, rig: Rig, where: str) -> None:
        self.rig, self.where = rig, where
        self.facts: Facts = rig.facts
        self._count, self._clock = len(self.facts.tendons), -np.inf
        self.took = {"send()": 0.0, "look()": 0.0}
        """Seconds on the rig's clock that the last call of each took."""
        self.tension: Array | None = None
        """Tension (T,) [N] by the last look; None where it gave none."""
        self.reeled: tuple[Array, float] | None = None
        """Targets (T,) [facts.unit] that the motors had reached by the last look, and when [s]; None: it gave none."""

    @property
    def virtual(self) -> bool:
        """Whether the rig's time passes only while it is waited for."""
        return bool(getattr(self.rig.clock, "virtual", False))

    def connect(self) -> Array:
        """Targets (T,) at which the motors stand."""
        return self._values("connect", self._call("connect", self.rig.connect), self._count)

    def now(self) -> float:
        """Seconds on the rig's clock. Raises RigStop for a clock that goes back."""
        now = float(self._call("clock.now", self.rig.clock.now))
        if not now >= self._clock:
            raise RigStop(f"the rig's clock goes back, from {self._clock:g} to {now:g} s", self.where, "mend its clock")
        self._clock = now
        return now

    def wait_until(self, moment: float) -> None:
        """Let time pass until then."""
        self._call("clock.wait_until", lambda: self.rig.clock.wait_until(moment))

    def send(self, targets: Array) -> Array:
        """Send targets (T,) [facts.unit]; what was really sent (T,)."""
        before = self.now()
        sent = self._values("send", self._call("send", lambda: self.rig.send(targets.copy())), self._count)
        self.took["send()"] = self.now() - before
        return sent

    def look(self) -> Seen:
        """The newest bend. A bend that is infinite counts as not seen."""
        before = self.now()
        look = self._call("look", self.rig.look)
        self.took["look()"] = self.now() - before
        try:
            bend, time, *measured = look
            tension, reeled, tip = (*measured, None, None, None)[: max(3, len(measured))]
            moment, reeled = float(time), None if reeled is None else Reeled(*reeled)
        except (TypeError, ValueError) as error:
            fix = "return Look(bend, time, tension or None, Reeled(targets, time) or None, tip or None)"
            raise RigStop(f"look() returns {look!r}", self.where, fix) from error
        bends = self._values("look", bend, self.facts.planes, finite=False)
        if not np.isfinite(moment):
            raise RigStop("look() does not say when its bend was true", self.where, "Look.time on the rig's own clock")
        self.tension = None if tension is None else self._values("look", tension, self._count, finite=False)
        self.reeled = None if reeled is None else self._reeled(reeled)
        place = None if tip is None else self._values("look", tip, self.facts.planes + 1, finite=False)
        return Seen(np.where(np.isfinite(bends), bends, np.nan), moment, self.tension, place)

    def _reeled(self, reeled: Reeled) -> tuple[Array, float]:
        places, (moment,) = (self._values("look", values, count) for values, count in
                             ((reeled.targets, self._count), ([reeled.time], 1)))  # fmt: skip
        return places, float(moment)

    def slow(self, most: float) -> str:
        """The slower of send() and look() with its time, in words, where its last call took longer than `most` [s]."""
        call, seconds = max(self.took.items(), key=lambda timed: timed[1])
        return f"{call} takes {1e3 * seconds:.0f} ms" if seconds > most else ""

    def stop(self) -> str:
        """Stop the motors; what went wrong with that, in words, empty where nothing did."""
        return self._trouble_of("stop", self.rig.stop)

    def close(self) -> str:
        """Give the rig back; what went wrong with that, in words."""
        return self._trouble_of("close", self.rig.close)

    def _trouble_of(self, name: str, function: Callable[[], Any]) -> str:
        try:
            self._call(name, function)
        except UserError as error:
            return str(error.what)
        return ""

    def _call(self, name: str, function: Callable[[], Any]) -> Any:
        try:
            return function()
        except RigError as error:
            says, fix = next(said for kind, said in _SAYS.items() if isinstance(error, kind) or kind is Fault)
            raise RigStop(f"{says}: {error}".rstrip(": "), self.where, fix) from error
        except BaseException as error:
            if isinstance(error, UserError) or from_outside(error):
                raise
            what = f"{name}() of the rig failed: {type(error).__name__}: {error}".rstrip(": ")
            raise RigStop(what, raised_at(error) or self.where, "mend it there; --debug shows the traceback") from error

    def _values(self, name: str, values: Any, count: int, finite: bool = True) -> Array:
        try:
            numbers = np.array(values, float)
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (count,) or (finite and not np.isfinite(numbers).all()):
            what = f"{name}() of the rig returns {values!r}, not {count} numbers"
            raise RigStop(what, self.where, f"an array of {count}")
        return numbers
