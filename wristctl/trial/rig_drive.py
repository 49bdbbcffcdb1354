"""A rig as the control loop drives and sees it: targets in the rig's own unit out, looks in."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.rig import value
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.trial.camera_pace import CameraPaces
from wristctl.trial.drives import Heard
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.rig_words import AGAINST
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import Follower
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.marker import Sighting, SightingVerdict

# Ticks for which reckoned places are remembered: motors that were measured before are believed to follow.
_REMEMBERED = 50
# Seconds by which a look may be ahead of the clock: both are rounded.
_CLOCKS = 1e-3
_UNSEEN = np.full((2, 4, 2), np.nan)


class RigDrive(RigMotors):
    """Motors that follow targets after a delay, with a lag: microsteps of `actuator.step_length`, positive reeling in.

    Its home is where every tendon of the straight wrist is just taut. What is believed of the spools is what was sent,
    after the delay and the lag of the rig's facts and at no more than its rate; where looks say where the motors are,
    they are as far from there as when they were looked at.
    """

    def __init__(self, rig: GuardedRig, settings: HwRunSettings, stood: Array) -> None:
        super().__init__(rig, settings, stood)
        drive, self._period = rig.facts.drive, settings.control_period
        delay, lag = value(drive.delay), value(drive.lag)
        self._motor = Follower(delay, lag, rig.facts.limits.rate / self._step)
        self._ahead, self._fastest = delay + lag + 0.5 * self._period, self._motor.speed * self._period
        self._remembered: deque[Array] = deque(maxlen=remembered_commands(delay, self._period))
        self._reckoned_at = deque[tuple[float, Array]](maxlen=_REMEMBERED)

    @property
    def _target(self) -> Array:
        return self._at / self._step

    def begin(self) -> None:
        """The motors stand where they were sent last."""
        self._place, self._off = self._target, np.zeros(len(self._at))
        self._remembered.extend([self._target] * (self._remembered.maxlen or 0))
        self.sent, self._counted = np.zeros(len(self._at)), self._rig.now()
        """Rates that the last targets ask for (T,) [1/s], and when the places were reckoned [s]."""
        self._reckoned_at.clear()
        self._reckoned_at.append((self._counted, self._place))

    @property
    def heard(self) -> Heard:
        """As reckoned; a rig that does not follow raises."""
        took, slow = self._rig.took["send()"], self._rig.slow(0.5 * self._period)
        return Heard(self._counted, self._counted, took, slow=slow)

    @property
    def tension(self) -> Array:
        """Of the rig's last look."""
        none = np.full(len(self._at), math.nan)
        return none if self._rig.tension is None else self._rig.tension

    @property
    def moving(self) -> bool:
        """Whether a motor is believed to be more than a step from its target."""
        return bool((np.abs(self._place - self._target) > 1.0).any())

    def wait_until(self, moment: float) -> None:
        """On the rig's clock."""
        self._rig.wait_until(moment)

    def reeled(self) -> Array:
        """As reckoned, and as far off that as the last look said."""
        if self._rig.reeled is not None:
            targets, time = self._rig.reeled
            times, places = zip(*self._reckoned_at, strict=True)
            if time >= times[0]:
                reckoned = [np.interp(time, times, each) for each in np.transpose(places)]
                self._off = (targets - self._zero) * (self._unit / self._step) - reckoned
        return self._place + self._off

    def lead(self, target: Array, moving: Array) -> Array:
        """As `BoardDrive.lead`: ahead of a moving target by the delay, the lag and half a period."""
        wanted = target + moving * self._ahead
        self._send(self._target + np.clip(wanted - self._target, -self._fastest, self._fastest))
        behind = wanted - self._target
        return np.where(np.abs(behind) > 1.0, behind, 0.0)

    def stand(self) -> None:
        """The last targets once more: a rig may stop by itself where it hears nothing."""
        self._send(self._target)

    def _send(self, steps: Array) -> None:
        before = self._target
        self.left_at(self._rig.send(self.targets_at(steps * self._step)))
        self.sent = (self._target - before) / self._period

    def listen(self, until: float) -> None:
        """A rig answers when it is asked."""

    def go_on(self, ticks: int) -> list[Array]:
        """As `BoardDrive.go_on`, by what was sent: of places that step within a tick their means over it."""
        means = []
        for _ in range(ticks):
            self._remembered.appendleft(self._target)
            self._place, mean = self._motor.over(self._place, np.array(self._remembered).T, self._period)
            means.append(mean + self._off)
            self._reckoned_at.append((self._reckoned_at[-1][0] + self._period, self._place))
        self._counted = self._rig.now()
        return means


class LookPaces(CameraPaces):
    """The pace of a rig's looks, in its own words."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self._where, self._last = where, (-math.inf, "")

    def add(self, sighting: Sighting) -> None:
        """The next look, of one plane."""
        super().add(sighting)
        self._last = sighting.came, sighting.verdict

    def summary(self) -> str:
        """In words."""
        pace = self.by_camera[0]
        return f"look() brings {pace.rate:.3g} new bends/s, {1e3 * pace.latency:.0f} ms old when they come."

    def missing(self, now: float, stale: float) -> tuple[str, str]:
        """Why there has been no bend, and what to do about it."""
        came, verdict = self._last
        why = "look() brings nothing new"
        if now - came <= stale and verdict == SightingVerdict.STAMP:
            why = "look() dates its bends ahead of the clock"
        elif now - came <= stale and verdict != SightingVerdict.OK:
            why = "look() gives no number"
        return f"{why}", f"see its sensor, and what look() returns: wristctl check-rig {self._where}"


class RigTracking:
    """Looks of a rig as the loop has those of cameras: one sighting a plane, and none of a look that is no news."""

    def __init__(self, rig: GuardedRig) -> None:
        self._rig, self._time, self._number = rig, -math.inf, 0
        self.pace: CameraPaces | None = LookPaces(rig.where)
        self.apart = 1.0 / value(rig.facts.sensor.rate)
        self.zero: tuple[float, ...] = (0.0,) * rig.facts.planes

    def look(self) -> list[Sighting]:
        """The newest look, where it is news. Raises SafetyStop where a measured tension is beyond the rig's limit."""
        seen, now = self._rig.look(), self._rig.now()
        most = self._rig.facts.limits.tension
        if seen.tension is not None and (seen.tension > most).any():
            worst = int(np.nanargmax(seen.tension))
            problem = f"tendon {worst + 1} pulls {seen.tension[worst]:.3g} N, beyond {most:g} N"
            raise SafetyStop(problem, self._rig.where, f"something holds the wrist, or {AGAINST}")
        if seen.time <= self._time:
            return []
        self._number += 1
        ahead, self._time = seen.time > now + _CLOCKS, seen.time
        along, *across = [math.nan] * (len(self.zero) + 1) if seen.tip is None else seen.tip.tolist()
        return [
            Sighting(
                seen.time, self._number, bend - zero if math.isfinite(bend) and not ahead else math.nan,
                self._verdict(bend, ahead), _UNSEEN, tip_x=along, tip_y=aside, came=now, plane=plane,
            )
            for plane, (bend, zero, aside) in enumerate(zip(seen.bend.tolist(), self.zero, across, strict=True))
        ]  # fmt: skip

    @staticmethod
    def _verdict(bend: float, ahead: bool) -> SightingVerdict:
        if ahead:
            return SightingVerdict.STAMP
        return SightingVerdict.OK if math.isfinite(bend) else SightingVerdict.NO_TIP

    def bend(self, sighting: Sighting, other: float) -> float:
        """The bend as it was looked at."""
        return sighting.theta

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """No camera has to."""
        return None

    def close(self) -> None:
        """The rig stays open."""
