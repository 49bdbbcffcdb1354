"""The control loop at a fixed period: measured bend, observer, law, tensions, spool targets, drive.

A tick sends what leads the spools to their targets; the answer is read while the next tick is waited for, so that a
slow link makes no tick late. What the spools reeled in is the observer's input, a frame is fused at its capture time.
Everything runs on the clock of the drive: the board with its cameras, the emulated bench or any other rig.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.response import Estimate
from wristctl.errors import UserError
from wristctl.simulation.motion import DERIVATIVES, Motion
from wristctl.trial.drives import BoardDrive
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog, column_of, of_planes, of_tendons
from wristctl.trial.rig_belief import RigBelief, names_of_planes, numbers_of
from wristctl.trial.rig_drive import RigDrive
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import Answer, HostFaults, Steering
from wristctl.trial.supervised_wait import InSight, Motors, Patience
from wristctl.trial.tendon_pulls import TendonPulls
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.tracking import Tracking, bend_of
from wristctl.trial.watch import Tick, Watch
from wristctl.wrist.tendon_layout import TendonLayout

# Takes each tick's row of the log, to show it.
Shown = Callable[[dict[str, Any]], None]

# Seconds within which motors at any speed have ramped down.
_COMING_TO_REST = 0.5


class Task(NamedTuple):
    """Motion that the loop follows, with its trial."""

    motion: Motion
    """Sampled at the loop's period."""
    course: Array
    """Bend, rate and acceleration of each plane, at each sample (T, P, 3)."""
    trial: int
    """Number of the trial; -1 between trials."""
    begin: float
    """When it begins, on the clock."""
    faults: HostFaults
    live: LiveReference | None = None
    """Reference that fills the course while it comes."""


def course_of(motion: Motion) -> Array:
    """A motion as laws follow it: bend, rate and acceleration of each plane at each sample (T, P, 3)."""
    return np.ascontiguousarray(motion.angles.rows.reshape(motion.planes, DERIVATIVES, -1).transpose(2, 0, 1))


class AtZero(NamedTuple):
    """A homed, slack wrist, as a loop takes it up."""

    drive: BoardDrive | RigDrive
    tracking: Tracking
    plane: str
    """In which it bends; empty for both."""
    oblique: float = 0.0
    """How far off square an uncalibrated camera looks at the plane [rad]."""
    pulls: TendonPulls | None = None
    """By load cells."""
    stiffness: float | None = None
    """Of the tendons [N/m] where homing has measured less than is believed."""
    wound_by: float | None = None
    """Stiffness of the tendons by which spools wind [N/m], where that is what homing has measured."""


class ControlLoop:
    """Drives a homed wrist. `layout` has the tendons that the motors wind; None: the board's four."""

    def __init__(
        self, ready: AtZero, settings: HwRunSettings, wrist: WristParameters, timing: TickTiming, log: TrialLog,
        shown: Shown | None = None, layout: TendonLayout | None = None,
    ) -> None:  # fmt: skip
        drive, self._tracking, plane, oblique, pulls, stiffness, wound_by = ready
        actuator = settings.actuator
        if wound_by is not None:
            actuator = actuator.model_copy(update={"tendon_stiffness": wound_by})
        self._drive, self._log, self._timing, self._shown = drive, log, timing, shown
        self._period, self._stale, self._tendons = timing.period, settings.safety.stale, numbers_of(layout)
        self._spools = spools_of(actuator)
        self._belief = RigBelief(wrist, actuator, names_of_planes(settings.planes, plane), layout)
        self._steering = Steering(self._belief, settings.sensor, timing.period)
        self._pulls = pulls
        self.watch = Watch(settings, wrist, plane, timing, oblique, pulls, stiffness, layout)
        timing.camera.expect(settings.planes)
        drive.begin()
        self._epoch = drive.now()
        self._last_usable = [self._epoch] * settings.planes
        self._skipped = 0

    @property
    def next_tick(self) -> float:
        """When the next tick is due, on the clock [s]."""
        return self._epoch + self._steering.tick * self._period

    def follow(
        self, motion: Motion, controller: Controller, gains: Sequence[float], trial: int = -1,
        faults: HostFaults | None = None, pushed: bool = False, live: LiveReference | None = None,
    ) -> None:  # fmt: skip
        """Follow a motion sampled at the period; its ticks are logged under the number of the trial.

        `pushed` says that a person pushes in it; a `live` reference takes the place of the motion's bends.
        At its end the motors stand, and the board has said so: that takes some ticks more, which belong to no trial.
        Raises SafetyStop, BoardError, CameraError, and OSError where the log cannot be written.
        """
        self._steering.use(controller, gains)
        self.watch.begin(pushed)
        task = Task(motion, course_of(motion), trial, self.next_tick, faults or HostFaults(()), live)
        first = self._steering.tick
        while (k := self._steering.tick - first) < len(motion.time):
            self._tick(task, k)
        if live is not None:  # samples that a late loop has missed
            live.fill(task.course, len(task.course) - 1)
        self._come_to_rest(task._replace(trial=-1))

    def patience(self, board: Motors, signs: Sequence[int]) -> Patience:
        """For waiting beside the board between two motions, the wrist in sight."""
        sight = InSight(self._tracking, self.watch, self._stale, self._belief, self._drive.now, np.array(signs))
        return Patience(board, sight)

    def _come_to_rest(self, task: Task) -> None:
        deadline = self._drive.now() + _COMING_TO_REST
        while self._drive.moving:
            if self._drive.now() > deadline:
                raise SafetyStop(f"the motors do not stand {_COMING_TO_REST:g} s after a motion", fix="home again")
            self._tick(task, None)
        self._drive.listen(self.next_tick)

    def _tick(self, task: Task, k: int | None) -> None:
        """One tick at the motion's sample `k`; None: behind its last, where no law is asked."""
        drive = self._drive
        asleep = drive.now() < self.next_tick
        drive.listen(self.next_tick)
        drive.wait_until(self.next_tick)
        if task.live is not None and k is not None:
            task.live.fill(task.course, k)
        woken = drive.now() - self.next_tick if asleep else 0.0
        clock, due = drive.now(), self.next_tick
        marker = self._look(task)
        estimate, position = self._steering.estimate, drive.reeled()
        self._judge(task.trial, estimate, position, clock, clock - due)
        answer: Answer | None = None
        tension, target = np.full(len(position), math.nan), position
        if k is None:
            drive.stand()
        else:
            answer = self._answer(task, k, clock - task.begin)
            tension = answer.tension
            target = self._turn(tension, task.course[k])
        heard = drive.heard
        values = {
            "trial": task.trial,
            "time": clock - task.begin,
            "clock": clock,
            **marker,
            **self._followed(task, k, estimate, answer),
            "state": heard.state.name,
            "faults": heard.faults,
            "counted": heard.counted - task.begin,
            "board": heard.time,
            "late": clock - due,
            "woken": woken,
            "round_trip": heard.round_trip,
        }
        self._log.disk.pretend_full = task.faults.disk(clock - task.begin)
        row = values | of_tendons(
            self._tendons, tension=tension, target=target, position=drive.reeled(), sent=drive.sent
        )  # fmt: skip
        if (pull := drive.tension if self._pulls is None else self._pulls.pull) is not None:
            row |= of_tendons(self._tendons, pull=pull)
        self._log.tick(row)
        if self._shown is not None:
            self._shown(row)
        took = drive.now() - clock
        self._go_on()
        culprit = self._timing.tick(clock - due, woken, took, self._skipped)
        self.watch.ticked(clock, heard.round_trip, self._skipped, culprit)

    def _look(self, task: Task) -> dict[str, Any]:
        """Fuse what was seen since the last tick; for the log the newest verdict and the newest angle used."""
        planes = self._belief.planes
        unseen = (math.nan,) * len(planes)
        marker = of_planes(planes, bend_measured=unseen, captured=unseen, verdict=("",) * len(planes))
        for sighting in self._tracking.look():
            captured = sighting.time - self._epoch
            now, frame = self._drive.now(), None
            self.watch.sighted(sighting, now)
            self._timing.camera.add(sighting)
            if math.isfinite(sighting.theta):
                bend = bend_of(self._tracking, sighting, self._steering.bend_at(captured))
                sighting = sighting._replace(theta=bend)
            if math.isfinite(sighting.theta) and self._steering.see(sighting.plane, sighting.theta, captured):
                self._last_usable[sighting.plane] = sighting.time
                frame = self.watch.saw(sighting, captured, now)
            shown: dict[str, Any] = {"verdict": str(sighting.verdict)}
            if frame is not None:
                shown |= {"bend_measured": sighting.theta, "captured": sighting.time - task.begin}
            plane = planes[sighting.plane]
            marker |= {column_of(name, plane, len(planes)): value for name, value in shown.items()}
            if task.trial >= 0:
                self._log.frame(task.trial, now - task.begin, task.begin, sighting, frame)
        return marker

    def _followed(self, task: Task, k: int | None, estimate: Estimate, answer: Answer | None) -> dict[str, Any]:
        """Columns of estimate, reference at the sample `k` (None: behind the last) and answer (None: none)."""
        last = -1 if k is None else k
        reference = task.course[last].T
        if k is None:
            reference = np.stack([reference[0], np.zeros(len(reference[0])), np.zeros(len(reference[0]))])
        unknown = np.full(len(reference[0]), math.nan)
        values = {
            "bend": estimate.theta,
            "rate": estimate.rate,
            "load": estimate.load,
            "bend_ref": reference[0],
            "rate_ref": reference[1],
            "acceleration_ref": reference[2],
            "bend_desired": task.motion.bend_desired[last] if task.live is None else reference[0],
            "error": estimate.theta - reference[0],
            "torque_wanted": unknown if answer is None else answer.torque_wanted,
            "torque": unknown if answer is None else answer.torque,
        }
        columns = of_planes(self._belief.planes, **{name: every.tolist() for name, every in values.items()})
        return columns | {"share": math.nan if answer is None else answer.share}

    def _judge(self, trial: int, estimate: Estimate, position: Array, clock: float, late: float) -> None:
        """Raises SafetyStop where a residual is beyond its limit; all are logged before."""
        taut, _ = self._belief.taut(estimate.theta)
        delay, heard = late + self._skipped * self._period, self._drive.heard
        told = heard.state, heard.lapses, heard.resent, clock - heard.counted, self._drive.tension, heard.slow
        tick = Tick(clock, delay, estimate, position, taut, *told)
        self._log.residuals(trial, clock, self.watch.see(tick, min(self._last_usable)))
        self.watch.judge(tick)

    def _answer(self, task: Task, k: int, time: float) -> Answer:
        try:
            answer: Answer = task.faults.answer(self._steering.respond(task.course, k), time)
        except UserError as error:
            raise SafetyStop(f"the controller failed: {error.what}", error.where, error.fix) from error
        except Exception as error:
            problem = f"the controller failed: {type(error).__name__}: {error}"
            raise SafetyStop(problem, fix="run again with --debug for the traceback") from error
        if not np.isfinite(np.hstack(answer)).all():
            raise SafetyStop("the law's torque is not a number", fix="see its gains and model")
        return answer

    def _turn(self, tension: Array, sample: Array) -> Array:
        """Send what leads to these tensions at a sample of the course; the targets [steps]."""
        taut, arms = self._belief.taut(sample[:, 0])
        target, moving = self._spools.target(tension, taut), arms @ sample[:, 1] / self._spools.step
        behind = self._drive.lead(target, moving)
        self._steering.withheld = self._spools.tension(behind, np.zeros(len(behind))) @ arms
        return target

    def _go_on(self) -> None:
        """To the next tick that is not over yet, with what the spools hold in the middle of this one."""
        self._skipped = max(0, int((self._drive.now() - self.next_tick - self._period) / self._period))
        for middle in self._drive.go_on(1 + self._skipped):
            reeled = self._belief.at_places(self._spools.step * middle)
            self._steering.predict(reeled)
            self.watch.predict(reeled)
