"""Zero of a rig that takes targets: where each tendon is just taut on the straight wrist, by small guarded moves.

One tendon after the other is reeled in by small moves until the wrist bends, and let go again: whose target bends the
wrist where, is held against the rig's facts. Then all are slackened, so that none holds against another, and each in
turn is reeled in through its taut point. From there the bend grows linearly, so that a line through the bent readings
crosses the straight bend at the taut point; its slope says what a radian takes, and is held against the model.
"""

import logging
import math
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.rig import most, value
from wristctl.trial.expected_moves import LEAST, bends_alone
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.resting import judge_weight
from wristctl.trial.safety import SafetyStop
from wristctl.wrist.tendon_layout import TendonLayout

log = logging.getLogger(__name__)

# Tendon reeled in or let out while homing [m/s], and seconds between two targets.
_SLOWLY, _EVERY = 5e-3, 0.02
# Seconds within which a bend must be seen.
_READING = 2.0
# A bend at which homing stops.
_FURTHEST = math.radians(10.0)
# Share of `homing.bend_deg` by which a reading may err, and that a wrist at rest may move by between two readings.
_STEADY, _STILL = 0.4, 0.2
# Share of `homing.pull` by which a tendon is reeled in beyond its taut point to check it.
_CHECKED = 1.2
# Springs that are stiffer than believed and friction may ask for so many times the pull that the model says.
_HARDER = 1.5


@dataclass(frozen=True)
class RigZero:
    """Result of homing; values (T,) in the order of the rig's targets."""

    targets: tuple[float, ...]
    """At which each tendon of the straight wrist is just taut [facts.unit]."""
    straight: tuple[float, ...]
    """Bend that the straight wrist shows (P,) [rad]."""
    metres_per_radian: tuple[float, ...]
    """Reeled in for one radian of measured bend, near the straight wrist."""
    slack: tuple[float, ...]
    """Reeled in from where the rig was connected until the tendon was taut [m]."""
    directions: tuple[float, ...]
    """Direction in which each tendon bends the wrist, from ulnar toward flexion [rad]; in one plane 0 or pi."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


class Lone(NamedTuple):
    """A bend by one tendon alone, as the model has it, of each tendon."""

    toward: Array
    """Direction of the measured bend (T, P): unit vectors."""
    metres: Array
    """Reeled in for a radian of it (T,), by tendons of no give."""
    stretch: Array
    """Tension for a radian of it (T,) [N/rad]."""

    @classmethod
    def of(cls, wrist: WristParameters, layout: TendonLayout, planes: int) -> "Lone":
        """By the believed wrist and the places of its tendons."""
        toward, path, sizes = bends_alone(wrist, layout.cross_section)
        seen = np.hypot.reduce(toward[:, :planes], axis=1)
        return cls(toward[:, :planes] / seen[:, None], path / seen, 1.0 / (sizes * seen))

    def per_radian(self, stiffness: float, harder: float = 1.0) -> Array:
        """Reeled in for a radian (T,) [m/rad], by tendons of this stiffness [N/m]."""
        return self.metres + harder * self.stretch / stiffness


class RigHoming:
    """Moves the tendons of a rig that was connected at the targets `stood` (T,) [facts.unit], one at a time.

    Positions are metres reeled in from there.
    """

    def __init__(
        self, rig: GuardedRig, settings: HwRunSettings, wrist: WristParameters, layout: TendonLayout, stood: Array
    ) -> None:
        self._rig, self._facts, self._settings, self._homing = rig, rig.facts, settings, settings.homing
        self._stood, self._at = stood, np.zeros(len(stood))
        self._lone, self._count = Lone.of(wrist, layout, rig.facts.planes), len(stood)
        self._bend = math.radians(self._homing.bend_deg)
        drive = rig.facts.drive
        self._settles = most(drive.delay) + 5.0 * most(drive.lag)
        self._looked = -math.inf
        judge_weight(settings, wrist, ("ulnar", "flexion")[: rig.facts.planes])

    @property
    def targets(self) -> Array:
        """Targets (T,) that were sent last [facts.unit]."""
        return self.targets_at(self._at)

    def targets_at(self, position: Array) -> Array:
        """Targets (T,) [facts.unit] of a position (T,) [m]."""
        targets: Array = self._stood + position / self._facts.metres_per_unit
        return targets

    @property
    def per_radian(self) -> Array:
        """Reeled in for a radian of measured bend by the model (T,) [m/rad]."""
        return self._lone.per_radian(self._settings.actuator.tendon_stiffness)

    def toward(self, tendon: int) -> Array:
        """Direction in which a tendon bends the wrist by the model (P,), a unit vector."""
        toward: Array = self._lone.toward[tendon]
        return toward

    def left_at(self, targets: Array) -> None:
        """Say that others have sent the rig to these targets (T,) [facts.unit]."""
        self._at = (targets - self._stood) * self._facts.metres_per_unit

    def reel(self, position: Array) -> None:
        """Go slowly to a position (T,) [m]."""
        pace = min(_SLOWLY, 0.5 * self._facts.limits.rate) * _EVERY
        while (left := position - self._at).any():
            self._at = self._at + np.clip(left, -pace, pace)
            self._rig.send(self.targets)
            self._rig.wait_until(self._rig.now() + _EVERY)

    def wait(self, seconds: float) -> None:
        """Let time pass; the rig hears its targets again and again."""
        every = min(_EVERY, (self._facts.silence or math.inf) / 4.0)
        end = self._rig.now() + seconds
        while (now := self._rig.now()) < end:
            self._rig.send(self.targets)
            self._rig.wait_until(min(end, now + every))

    def reading(self, frames: int) -> Array:
        """Median of the next so many looks that are news (P,) [rad]. Raises SafetyStop where none come."""
        return np.median(self.looks(frames), axis=0)

    def looks(self, frames: int) -> Array:
        """The next so many looks that are news (n, P) [rad]."""
        bends = list[Array]()
        began, unseen, came = self._rig.now(), 0, 0
        every = min(0.5 / value(self._facts.sensor.rate), (self._facts.silence or math.inf) / 4.0)
        while len(bends) < frames:
            self.wait(every)
            seen = self._rig.look()
            if began < seen.time <= self._rig.now() and seen.time > self._looked:
                self._looked = seen.time
                came += 1
                unseen += not np.isfinite(seen.bend).all()
                if np.isfinite(seen.bend).all():
                    bends.append(seen.bend)
            if self._rig.now() - began > _READING + frames / value(self._facts.sensor.rate):
                why = "it is not a number" if unseen else f"{came} looks are news" if came else "its time stands still"
                problem = f"the bend could not be read: in {_READING:g} s {why}"
                raise SafetyStop(problem, self._rig.where, "see what look() returns: wristctl check-rig")
        return np.array(bends)

    def rest(self) -> Array:
        """Bend (P,) [rad] of a wrist that was let go, once it moves no more, or after `homing.let_go`."""
        deadline, before = self._rig.now() + self._homing.let_go, None
        while True:
            self.wait(self._homing.rest + self._settles)
            reading = self.reading(self._homing.frames)
            still = before is not None and math.dist(reading, before) < _STILL * self._bend
            if still or self._rig.now() >= deadline:
                return reading
            before = reading

    def bent(self, tendon: int, rested: Array) -> Array:
        """Bend (P,) since the wrist `rested` so [rad]. Raises SafetyStop where it is too far."""
        self.wait(self._homing.rest + self._settles)
        bend = self.reading(self._homing.frames) - rested
        if math.hypot(*bend) > _FURTHEST:
            self.let_go()
            problem = f"target {tendon + 1} bent the wrist by {math.degrees(math.hypot(*bend)):.1f} deg while homing"
            raise SafetyStop(problem, self._rig.where, "slacken all tendons before the rig is connected")
        return bend

    def let_go(self, zero: Array | float = 0.0, times: float = 1.0) -> None:
        """Let all tendons out by so many times `homing.pull` from a position (T,) [m]."""
        self.reel(np.broadcast_to(zero - times * self._homing.pull, self._count))

    def sense(self, tendon: int, rested: Array) -> float:
        """About where a tendon bends the wrist [m]. Raises SafetyStop where it bends it elsewhere, or not at all."""
        move, slack = 2.0 * self._homing.move, self._homing.slack
        for sense in (1.0, -1.0):
            for reeled in np.arange(1, math.ceil(slack / move) + 2) * move:
                self.reel(sense * reeled * np.eye(self._count)[tendon])
                bend = self.bent(tendon, rested)
                if math.hypot(*bend) > self._bend:
                    self.reel(np.zeros(self._count))
                    if sense < 0.0 or float(self._lone.toward[tendon] @ bend) < 0.0:
                        self._judge_sense(tendon, bend, sense)
                    self.judge_place(tendon, bend)
                    return float(reeled)
            self.reel(np.zeros(self._count))
        problem = f"target {tendon + 1} does not bend the wrist within {1e3 * slack:g} mm of tendon, reeled in or out"
        fix = "see that its motor has power and its tendon is on; facts.metres_per_unit; or raise homing.slack"
        raise SafetyStop(problem, self._rig.where, fix)

    def _judge_sense(self, tendon: int, bend: Array, sense: float) -> None:
        if float(self._lone.toward[tendon] @ bend) < 0.0 and sense > 0.0 and self._is_like(tendon, bend):
            return  # another tendon's bend: `judge_place` names it
        how = (
            "a smaller target reels it in" if sense < 0.0 else "a larger target lets it out, or its tendon is opposite"
        )
        problem = f"target {tendon + 1} has the wrong sense: {how}"
        raise SafetyStop(problem, self._rig.where, f"turn the sign of target {tendon + 1} in send() and connect()")

    def _is_like(self, tendon: int, bend: Array) -> bool:
        nearest = int(np.argmax(self._lone.toward @ bend))
        return nearest != tendon and self._off(nearest, bend) <= math.radians(self._homing.direction_deg)

    def _off(self, tendon: int, bend: Array) -> float:
        """Angle between a bend and where a tendon should bend the wrist [rad]."""
        return math.acos(float(np.clip(self._lone.toward[tendon] @ bend / math.hypot(*bend), -1.0, 1.0)))

    def judge_place(self, tendon: int, bend: Array) -> None:
        """Raises SafetyStop where a bend (P,) by a tendon is not toward its place."""
        if self._off(tendon, bend) <= math.radians(self._homing.direction_deg):
            return
        place = self._facts.tendons[tendon].angle_deg
        toward = math.degrees(_direction(bend)) % 360.0
        problem = f"target {tendon + 1} bends the wrist toward {toward:.0f} deg, and its tendon is at {place:g} deg"
        if self._is_like(tendon, bend):
            like = int(np.argmax(self._lone.toward @ bend))
            problem += f": as tendon {like + 1} would"
        fix = "see the order of facts.tendons and of the targets, and the axes of look()"
        raise SafetyStop(problem, self._rig.where, fix)

    def line(self, tendon: int, about: float, straight: Array) -> tuple[float, float, float, Array]:
        """Taut point [m], metres per radian and direction [rad] of a tendon, and where the wrist rests after it."""
        move, pull, toward = self._homing.move, self._homing.pull, self._lone.toward[tendon]
        slack, rested = np.full(self._count, -2.0 * pull), self.rest()
        reeled, along, bends = list[float](), list[float](), list[Array]()
        for position in np.arange(min(0.0, about - 3.0 * move), about + 2.0 * pull, move):
            slack[tendon] = position
            self.reel(slack.copy())
            bend = self.bent(tendon, rested)
            if float(toward @ bend) > self._bend:
                reeled.append(float(position))
                along.append(float(toward @ (bend + rested - straight)))
                bends.append(bend)
            if reeled and position - reeled[0] >= 0.7 * pull:
                break
        self.let_go(times=2.0)
        rests = self.rest()
        if len(reeled) < 3:
            problem = f"the tendon of target {tendon + 1} pulls differently each time"
            raise SafetyStop(problem, self._rig.where, "see whether it slips, and how noisy look() is")
        self.judge_place(tendon, bends[-1])
        slope, offset = np.polyfit(reeled, along, 1)
        taut = -offset / slope
        self._judge_scale(tendon, 1.0 / slope)
        if taut < -self._homing.taut - float(self._lone.stretch[tendon]) * self._bend / self._settings.safety.softest:
            problem = f"the tendon of target {tendon + 1} was taut by {-1e3 * taut:.2f} mm when homing began"
            raise SafetyStop(problem, self._rig.where, "slacken all tendons before the rig is connected")
        return float(taut), float(1.0 / slope), _direction(bends[-1]), rests

    def _judge_scale(self, tendon: int, metres: float) -> None:
        """Raises SafetyStop where a radian takes another length of tendon than by the model."""
        share, believed = self._homing.steps_tolerance, self._settings.actuator.tendon_stiffness
        softest = min(self._settings.safety.softest, believed)
        meant = float(self._lone.per_radian(believed)[tendon])
        furthest = float(self._lone.per_radian(softest, _HARDER)[tendon])
        if (1.0 - share) * meant <= metres <= (1.0 + share) * furthest:
            return
        problem = (
            f"target {tendon + 1} takes {1e3 * metres:.3g} mm of tendon for one radian, {metres / meant:.2f} times "
            f"what the model says ({1e3 * meant:.3g} mm)"
        )
        fix = "see facts.metres_per_unit, the tendon's radius, wrist.stiffness and facts.drive.stiffness"
        raise SafetyStop(problem, self._rig.where, fix)

    def check(self, zero: RigZero) -> None:
        """See that a homed wrist that is let go rests straight, and let each tendon bend it a little; leaves it slack.

        Raises SafetyStop where a tendon was lost, slipped or pulls against another.
        """
        taut, pull = np.array(zero.slack), self._homing.pull
        self.let_go(taut)
        held = self.rest()
        off = held - np.array(zero.straight)
        self.let_go(taut, 2.0)
        moved = self.rest() - held
        if math.hypot(*moved) > self._bend or math.hypot(*off) > pull / float(self._lone.metres.min()):
            problem = f"the slack wrist rests {math.degrees(math.hypot(*off)):.1f} deg off where it was straight"
            fix = "a tendon is shorter than it was, caught or slipped, or the bend's zero has moved: home again"
            raise SafetyStop(problem, self._rig.where, fix)
        for tendon in range(self._count):
            rested, position = self.rest(), taut - 2.0 * pull
            position[tendon] = taut[tendon] + _CHECKED * pull
            self.reel(position)
            bend = self.bent(tendon, rested)
            self.let_go(taut, 2.0)
            meant = _CHECKED * pull / zero.metres_per_radian[tendon]
            if float(self._lone.toward[tendon] @ bend) < LEAST * meant:
                found = math.degrees(float(self._lone.toward[tendon] @ bend))
                problem = f"target {tendon + 1} bends the wrist by {found:.1f} of {math.degrees(meant):.1f} deg"
                fix = "its tendon is off, cut or slipped, or its motor has stalled: see it, then home again"
                raise SafetyStop(problem, self._rig.where, fix)
        self.let_go(taut)


def _direction(bend: Array) -> float:
    """Direction of a bend (P,) from ulnar toward flexion [rad]."""
    return math.atan2(float(bend[1]) if len(bend) > 1 else 0.0, float(bend[0]))


def find_rig_zero(homing: RigHoming, settings: HwRunSettings, where: str) -> RigZero:
    """Zero of a connected rig with slack tendons; leaves them slack.

    Raises SafetyStop where a target bends the wrist otherwise than by the rig's facts and the model, and RigStop.
    """
    looks = homing.looks(4 * settings.homing.frames)
    errs = math.degrees(float(looks.std(axis=0).max())) / math.sqrt(settings.homing.frames)
    if errs > _STEADY * settings.homing.bend_deg:
        problem = f"the bend is seen unsteadily: a reading errs by {errs:.2f} deg"
        raise SafetyStop(problem, where, "a steadier sensor, more homing.frames, or a larger homing.bend_deg")
    straight = np.median(looks, axis=0)
    about = [homing.sense(tendon, straight) for tendon in range(len(homing.targets))]
    homing.let_go(times=2.0)
    straight = homing.rest()
    lines = [homing.line(tendon, reach, straight) for tendon, reach in enumerate(about)]
    slack, per_radian, directions, rests = zip(*lines, strict=True)
    homing.let_go(np.array(slack))
    zero = homing.targets_at(np.array(slack))
    for tendon, (length, metres) in enumerate(zip(slack, per_radian, strict=True), 1):
        log.info("target %d: slack %.2f mm, %.2f mm per rad", tendon, 1e3 * length, 1e3 * metres)
    middle = np.mean(rests, axis=0)
    return RigZero(tuple(zero.tolist()), tuple(middle.tolist()), per_radian, slack, directions)
