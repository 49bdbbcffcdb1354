"""The control loop at a fixed period: marker angle, observer, law, tensions, spool targets, step rates, board.

A tick sends step rates; the board's answer, its status, is read while the next tick is waited for, so that a slow link
makes no tick late. What the spools reeled in is the observer's input, a frame is fused at its capture time. Everything
runs on the transport's clock.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, Fault, Flag
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.response import Estimate
from wristctl.errors import UserError
from wristctl.simulation.motion import DERIVATIVES, Motion
from wristctl.simulation.spool_timing import remembered_rates
from wristctl.trial.log import TrialLog, column_of, of_axes, of_planes
from wristctl.trial.rig_belief import RigBelief, names_of_planes
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import Answer, HostFaults, Steering
from wristctl.trial.supervised_wait import InSight, Patience
from wristctl.trial.tendon_pulls import TendonPulls
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.tracking import Tracking, bend_of
from wristctl.trial.watch import Tick, Watch

# Takes each tick's row of the log, to show it.
Shown = Callable[[dict[str, Any]], None]

# By how much longer it takes the board to read a RATE for each step/s of all axes together, whose interrupts come
# first: by the firmware's cycles [s].
_BUSY = 6.6e-9

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


def course_of(motion: Motion) -> Array:
    """A motion as laws follow it: bend, rate and acceleration of each plane at each sample (T, P, 3)."""
    return np.ascontiguousarray(motion.angles.rows.reshape(motion.planes, DERIVATIVES, -1).transpose(2, 0, 1))


class ControlLoop:
    """Drives a homed, enabled board in a bending plane, or in both; `signs` say which way each motor's positive steps
    turn, `stiffness` is that of the tendons [N/m] where homing has measured less than is believed.
    """

    def __init__(
        self, board: Board, tracking: Tracking, settings: HwRunSettings, wrist: WristParameters, plane: str,
        signs: Sequence[int], timing: TickTiming, log: TrialLog, shown: Shown | None = None, oblique: float = 0.0,
        pulls: TendonPulls | None = None, stiffness: float | None = None,
    ) -> None:  # fmt: skip
        self._board, self._tracking, self._log, self._timing, self._shown = board, tracking, log, timing, shown
        self._clock, self._period, self._signs = board.transport, timing.period, np.array(signs)
        self._life, self._stale = settings.rate_life, settings.safety.stale
        self._spools = spools_of(settings.actuator)
        self._belief = RigBelief(wrist, settings.actuator, names_of_planes(settings.planes, plane))
        self._steering = Steering(self._belief, settings.sensor, timing.period)
        self._pulls = pulls
        self.watch = Watch(settings, wrist, plane, timing, oblique, pulls, stiffness)
        self._status, self._sent = board.read(), np.zeros(AXES)
        timing.camera.expect(settings.planes)
        self._epoch = self._clock.now()
        self._last_usable = [self._epoch] * settings.planes
        self._underway = settings.actuator.command_delay
        delay = self._spools.timing.delay
        self._late, self._rates = int(delay // self._period), np.zeros((AXES, remembered_rates(delay, self._period)))
        self._since_read = delay - self._late * self._period - self._underway
        self._place, self._reckoned = self._reeled(), deque[tuple[float, Array]]()
        self._skipped = 0
        self._counted = self._epoch

    @property
    def next_tick(self) -> float:
        """When the next tick is due, on the clock [s]."""
        return self._epoch + self._steering.tick * self._period

    def follow(
        self, motion: Motion, controller: Controller, gains: Sequence[float], trial: int = -1,
        faults: HostFaults | None = None, pushed: bool = False,
    ) -> None:  # fmt: skip
        """Follow a motion sampled at the period; its ticks are logged under the number of the trial.

        `pushed` says that a person pushes in it.
        At its end the motors stand, and the board has said so: that takes some ticks more, which belong to no trial.
        Raises SafetyStop, BoardError, CameraError, and OSError where the log cannot be written.
        """
        self._steering.use(controller, gains)
        self.watch.begin(pushed)
        task = Task(motion, course_of(motion), trial, self.next_tick, faults or HostFaults(()))
        first = self._steering.tick
        while (k := self._steering.tick - first) < len(motion.time):
            self._tick(task, k)
        self._come_to_rest(task._replace(trial=-1))

    def patience(self) -> Patience:
        """For waiting between two motions, the wrist in sight."""
        sight = InSight(self._tracking, self.watch, self._stale, self._belief, self._clock.now, self._signs)
        return Patience(self._board, sight)

    def _come_to_rest(self, task: Task) -> None:
        deadline = self._clock.now() + _COMING_TO_REST
        while self._sent.any() or Flag.MOVING in self._status.flags:
            if self._clock.now() > deadline:
                raise SafetyStop(f"the motors do not stand {_COMING_TO_REST:g} s after a motion", fix="home again")
            self._tick(task, None)
        self._listen(self.next_tick)

    def _tick(self, task: Task, k: int | None) -> None:
        """One tick at the motion's sample `k`; None: behind its last, where no law is asked."""
        asleep = self._clock.now() < self.next_tick
        self._listen(self.next_tick)
        if (ahead := self.next_tick - self._clock.now()) > 0.0:
            self._clock.wait(ahead)
        woken = self._clock.now() - self.next_tick if asleep else 0.0
        clock, due = self._clock.now(), self.next_tick
        marker = self._look(task)
        estimate, position = self._steering.estimate, self._reeled()
        self._judge(task.trial, estimate, position, clock, clock - due)
        answer: Answer | None = None
        tension, target = np.full(AXES, math.nan), position
        if k is None:
            self._send(np.zeros(AXES))
        else:
            answer = self._answer(task, k, clock - task.begin)
            tension = answer.tension
            target = self._turn(tension, position, task.course[k])
        values = {
            "trial": task.trial,
            "time": clock - task.begin,
            "clock": clock,
            **marker,
            **self._followed(task, k, estimate, answer),
            "state": self._status.state.name,
            "faults": "+".join(fault.name or "" for fault in Fault if fault in self._status.faults),
            "counted": self._counted - task.begin,
            "board": self._status.time,
            "late": clock - due,
            "woken": woken,
            "round_trip": self._board.round_trip,
        }
        self._log.disk.pretend_full = task.faults.disk(clock - task.begin)
        row = values | of_axes(tension=tension, target=target, position=self._reeled(), sent=self._sent)
        if self._pulls is not None:
            row |= of_axes(pull=self._pulls.pull)
        self._log.tick(row)
        if self._shown is not None:
            self._shown(row)
        took = self._clock.now() - clock
        self._go_on()
        culprit = self._timing.tick(clock - due, woken, took, self._skipped)
        self.watch.ticked(clock, self._board.round_trip, self._skipped, culprit)

    def _look(self, task: Task) -> dict[str, Any]:
        """Fuse what was seen since the last tick; for the log the newest verdict and the newest angle used."""
        planes = self._belief.planes
        unseen = (math.nan,) * len(planes)
        marker = of_planes(planes, bend_measured=unseen, captured=unseen, verdict=("",) * len(planes))
        for sighting in self._tracking.look():
            captured = sighting.time - self._epoch
            now, frame = self._clock.now(), None
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
            "bend_desired": task.motion.bend_desired[last],
            "error": estimate.theta - reference[0],
            "torque_wanted": unknown if answer is None else answer.torque_wanted,
            "torque": unknown if answer is None else answer.torque,
        }
        columns = of_planes(self._belief.planes, **{name: every.tolist() for name, every in values.items()})
        return columns | {"share": math.nan if answer is None else answer.share}

    def _judge(self, trial: int, estimate: Estimate, position: Array, clock: float, late: float) -> None:
        """Raises SafetyStop where a residual is beyond its limit; all are logged before."""
        taut, _ = self._belief.taut(estimate.theta)
        delay, resent = late + self._skipped * self._period, self._board.traffic.resent
        state, lapses = self._status.state, self._status.lapses
        tick = Tick(clock, delay, estimate, position, taut, state, lapses, resent, clock - self._counted)
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

    def _turn(self, tension: Array, position: Array, sample: Array) -> Array:
        """Send the step rates that lead to these tensions at a sample of the course; the targets [steps]."""
        taut, arms = self._belief.taut(sample[:, 0])
        target, moving = self._spools.target(tension, taut), arms @ sample[:, 1] / self._spools.step
        # the command acts once an axis takes it up; by then the ones before have moved the spools
        foreseen = self._spools.foreseen(self._place, self._rates, self._period)
        gap = target + moving * self._spools.timing.delay - foreseen
        self._send(self._signs * self._spools.rate(gap, moving, self._sent, self._period))
        behind = self._spools.behind(gap, moving, self._sent, self._period)
        self._steering.withheld = self._spools.tension(behind, np.zeros(AXES)) @ arms
        return target

    def _send(self, rates: Array) -> None:
        """Step rates of the axes, one of which is 0 for none."""
        sent, self._posted = self._board.post_turn(rates.tolist(), self._life)
        self._sent = self._signs * np.array(sent)

    def _listen(self, until: float) -> None:
        """Take in the board's answers to what was sent, those that come by `until` [s]."""
        while (answered := self._board.answered(until)) is not None:
            began, self._status = answered
            busy = _BUSY * float(np.abs(self._rates[:, 1]).sum())
            self._counted = began + self._underway + busy
            while self._reckoned[0][0] < began:  # lost on the way
                self._reckoned.popleft()
            self._place = self._place + (self._reeled() - self._reckoned.popleft()[1])

    def _go_on(self) -> None:
        """To the next tick that is not over yet, with what the spools hold in the middle of this one."""
        self._skipped = max(0, int((self._clock.now() - self.next_tick - self._period) / self._period))
        for skipped in range(1 + self._skipped):
            ahead = self._spools.foreseen(self._place, self._rates, self._period)
            self._rates = np.column_stack([self._sent, self._rates[:, :-1]])
            middle = self._spools.reckoned(self._place, self._rates, 0.5 * self._period, self._period)
            reeled = self._belief.at_places(self._spools.step * middle)
            self._steering.predict(reeled)
            self.watch.predict(reeled)
            self._place = ahead
            if skipped == 0:
                in_force = self._rates[:, self._late + 1]
                self._reckoned.append((self._posted, ahead - in_force * self._since_read))

    def _reeled(self) -> Array:
        """Steps that the spools have reeled in, by the last status."""
        reeled: Array = self._signs * np.array(self._status.position, float)
        return reeled
