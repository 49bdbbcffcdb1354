"""What servos say of themselves, judged every tick: errors, heat, silence, a restart, positions that do not follow."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.rig import Fault, most
from wristctl.servos.servo_bus import Status
from wristctl.servos.servo_settings import ServoSettings
from wristctl.servos.x_series import TICKS, WATCHDOG_UNIT, named_errors

# Tendon [m] by which a servo may be off all its recent goals, and for how long [s].
_OFF, _FOR = 0.4e-3, 0.05
# Tendon [m] beyond what its largest speed explains from which a position has jumped.
_JUMP = 1e-3
# Degrees below a servo's limit at which it counts as hot.
_HOT = 5
# Age [s] from which an answer is old, and by how much the servos' clocks may err.
_OLD, _DRIFT = 0.025, 0.02
# Share of the largest tension from which a servo pulls as hard as it may.
_HARD = 0.9


class ServoWatch:
    """Judge of a rig's servos, which stood at these positions [counts] at `now` [s].

    `hottest` are their temperature limits [degrees Celsius].
    """

    def __init__(self, settings: ServoSettings, hottest: Sequence[int], stood: Sequence[int], now: float) -> None:
        self._settings, self._hottest = settings, hottest
        self._names = [f"servo {servo.id} (tendon {k})" for k, servo in enumerate(settings.servos, 1)]
        # Goals of longer ago are over: even slow servos have all but reached them.
        self._window = most(settings.drive_delay) + 3.0 * most(settings.drive_lag)
        self._goals: deque[tuple[float, Array]] = deque([(now, np.array(stood))])
        self._positions, self._at = np.array(stood), now
        self._least: Array | None = None
        self._told = now
        self._since = np.full(len(stood), np.inf)
        self.trusted = [True] * len(stood)
        """Whether each servo's position is where it is, and gets to where it is sent."""

    def is_new(self, status: Sequence[Status], now: float) -> bool:
        """Whether a status is of now, by the servos' own clocks: a late answer may be that to an earlier question."""
        behind = now - 1e-3 * np.array([one.tick for one in status])
        turn = 1e-3 * TICKS
        if self._least is None:
            self._least = behind
        late = (behind - self._least + 0.5 * turn) % turn - 0.5 * turn
        allowed = _DRIFT * (now - self._told)
        self._least, self._told = self._least + np.minimum(late, allowed), now
        return bool((late - allowed < _OLD).all())

    def judge(self, status: Sequence[Status]) -> None:
        """Raise Fault for what servos (T,) say of themselves."""
        for name, one, hottest in zip(self._names, status, self._hottest, strict=True):
            if one.error:
                errors = ", ".join(named_errors(one.error))
                raise Fault(f"{errors}: {name} has shut down. The next connection reboots it, and homing follows")
            if one.watchdog == -1:
                silence = self._settings.watchdog * WATCHDOG_UNIT
                raise Fault(f"silence: {name} heard nothing for {silence:g} s")
            if not one.torque:
                raise Fault(f"restart: {name} has let go: see its power and plugs, then home again")
            if one.temperature >= hottest - _HOT:
                raise Fault(f"heat: {name} is at {one.temperature} degrees, and shuts down at {hottest}: let it cool")

    def judge_positions(self, positions: Array, goals: Array, tension: Array, now: float) -> None:
        """Raise Fault where a position (T,) [counts] jumps, or is off all recent goals (T,); these are the newest.

        `tension` (T,) [N] is that of the servos' currents.
        """
        unit, rate = self._settings.metres_per_count, self._settings.rate
        jumps = np.abs(positions - self._positions) * unit - rate * (now - self._at)
        self._positions, self._at = positions, now
        if (jumps > _JUMP).any():
            worst = int(np.argmax(jumps))
            jump = f"{1e3 * jumps[worst]:.3g} mm of tendon"
            raise Fault(f"wrong zero: the position of {self._names[worst]} jumps by {jump}; home again")
        self._goals.append((now, goals))
        while len(self._goals) > 1 and self._goals[1][0] < now - self._window:
            self._goals.popleft()
        recent = np.array([goal for _, goal in self._goals])
        off = np.maximum(positions - recent.max(axis=0), recent.min(axis=0) - positions) * unit
        self._since = np.where(off > _OFF, np.minimum(self._since, now), np.inf)
        if (late := now - self._since >= _FOR).any():
            worst = int(np.argmax(np.where(late, off, 0.0)))
            self.trusted[worst] = False
            hard = tension[worst] > _HARD * self._settings.tension
            why = "it pulls as hard as it may: the wrist is held, or its gear is stuck" if hard else (
                "its gear, its horn or its position sensor is stuck"
            )  # fmt: skip
            raise Fault(f"stall: {self._names[worst]} stands {1e3 * off[worst]:.2g} mm off its goal; {why}")

    def stopped(self, status: Sequence[Status]) -> None:
        """The servos' goals are where they stand."""
        self._positions = np.array([one.position for one in status])
        self._goals = deque([(self._at, self._positions)])
        self._since[:] = np.inf
