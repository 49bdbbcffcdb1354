"""The control loop at a fixed period: marker angle, observer, law, tensions, spool targets, step rates, board.

One tick is one exchange with the board: step rates out, status back. What the spools reeled in is the observer's
input, a frame is fused at its capture time. Everything runs on the transport's clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.hardware.board import Board
from wristctl.hardware.messages import Fault, Status
from wristctl.hardware.trial.eye import Eye
from wristctl.hardware.trial.log import TrialLog
from wristctl.hardware.trial.safety import Monitor, SafetyStop, Seen
from wristctl.hardware.trial.spools import TENDONS, Paths, spools_of
from wristctl.hardware.trial.steering import Answer, Steering
from wristctl.hardware.vision.marker import Sighting
from wristctl.simulation.reference import Motion

Array = NDArray[np.float64]

_UNDERWAY = 0.35
"""Share of a command's round trip until the board has read it, by the bytes of command and answer."""


class Disturber(Protocol):
    """Faults of the host itself, injected to see what they do."""

    def answer(self, answer: Answer, time: float) -> Answer:
        """The law's answer, or what a fault makes of it. Raises what a broken law would."""

    def disk(self, time: float) -> bool:
        """Whether the disk is to be full."""


@dataclass
class Timing:
    """When ticks began, against when they were due."""

    period: float
    late: list[float] = field(default_factory=list)
    """Of each tick [s]."""
    overruns: int = 0
    """Ticks that were skipped because one before took too long."""

    def jitter(self, share: float) -> float:
        """This quantile of lateness [s]."""
        return float(np.quantile(self.late, share)) if self.late else math.nan


class ControlLoop:
    """Drives a homed, enabled board in one bending plane."""

    def __init__(
        self, board: Board, eye: Eye, rig: RigSettings, wrist: WristParameters, plane: str, signs: tuple[int, ...],
        period: float, log: TrialLog, timing: Timing, shown: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:  # fmt: skip
        self._board, self._eye, self._log, self._timing, self._shown = board, eye, log, timing, shown
        self._clock, self._period, self._signs = board.transport, period, np.array(signs)
        self._spools, self._paths = spools_of(rig.actuator), Paths(wrist, plane)
        self._monitor = Monitor(rig.safety, self._spools)
        self._status = board.read()
        self._sent = np.zeros(4)
        self._underway = 0.0
        self._epoch = self._last_usable = self._clock.now()
        self._verdict = "no frame"
        self._skipped = 0
        self._steering = Steering(wrist, rig.actuator, rig.sensor, period, 0.0)

    @property
    def next_tick(self) -> float:
        """When the next tick is due, on the clock [s]."""
        return self._epoch + self._steering.tick * self._period

    def follow(
        self, motion: Motion, controller: Controller, gains: tuple[float, ...], trial: int = -1,
        disturber: Disturber | None = None,
    ) -> None:  # fmt: skip
        """Follow a motion sampled at the period; its ticks are logged under the number of the trial.

        Raises SafetyStop, BoardError, CameraError, and OSError where the log cannot be written.
        """
        self._steering.use(controller, gains)
        begin, first = self.next_tick, self._steering.tick
        while (k := self._steering.tick - first) < len(motion.time):
            self._tick(motion, k, begin, trial, disturber)

    def _tick(self, motion: Motion, k: int, begin: float, trial: int, disturber: Disturber | None) -> None:
        due = self.next_tick
        if (ahead := due - self._clock.now()) > 0.0:
            self._clock.wait(ahead)
        clock = self._clock.now()
        time, late = clock - begin, clock - due
        self._timing.late.append(late)
        newest, used = self._look(trial, begin)
        steering, reference = self._steering, (motion.theta_ref[k], motion.rate_ref[k], motion.acceleration_ref[k])
        estimate = steering.estimate
        position = self._reeled(self._status)
        self._monitor.see(
            Seen(
                estimate=estimate,
                age=clock - self._last_usable,
                verdict=self._verdict,
                position=position,
                taut=self._paths.taut(estimate.theta)[0],
                state=self._status.state,
                late=late + self._skipped * self._period,
            )
        )
        answer = self._answer(reference, time, disturber)
        tension = self._paths.each(answer.plus, answer.minus)
        taut, arm = self._paths.taut(reference[0])
        target, moving = self._spools.target(tension, taut), arm * reference[1] / self._spools.step
        # The command acts once the board has read it; the last one has moved the spools by then for a whole period.
        gap = target + moving * self._underway - (position + self._sent * self._period)
        rates = self._spools.rate(gap, moving, self._sent, self._period)
        sent, self._status = self._board.turn((self._signs * rates).tolist())
        self._sent = self._signs * np.array(sent)
        self._underway = min(_UNDERWAY * self._board.round_trip, 0.5 * self._period)
        reeled = self._reeled(self._status)
        self._log_tick(
            trial, k, time, clock, estimate, used, newest, begin, motion, answer, tension, target, reeled, late, disturber
        )
        middle = self._spools.step * (reeled + self._sent * (0.5 * self._period - self._underway))
        plus, minus = self._paths.sides(middle)
        steering.expect(plus, minus)
        self._skipped = max(0, int((self._clock.now() - self.next_tick) / self._period))
        for _ in range(self._skipped):
            steering.expect(plus, minus)
        self._timing.overruns += self._skipped

    def _look(self, trial: int, begin: float) -> tuple[Sighting | None, Sighting | None]:
        """Fuse what was seen since the last tick; the newest sighting, and the newest one that was used."""
        newest = used = None
        for seen in self._eye.look():
            newest, self._verdict = seen, str(seen.verdict)
            if math.isfinite(seen.theta) and self._steering.see(seen.theta, seen.time - self._epoch):
                used, self._last_usable = seen, seen.time
            if trial >= 0:
                now = self._clock.now() - begin
                self._log.frame(trial, seen.number, seen.time - begin, now, seen.theta, seen.verdict)
        return newest, used

    def _answer(self, reference: tuple[float, float, float], time: float, disturber: Disturber | None) -> Answer:
        try:
            answer = self._steering.respond(*reference)
            if disturber is not None:
                answer = disturber.answer(answer, time)
        except Exception as error:
            what = f"the controller failed: {type(error).__name__}: {error}"
            raise SafetyStop(what, fix="run again with --debug for the traceback") from error
        self._monitor.answer(answer)
        return answer

    def _reeled(self, status: Status) -> Array:
        reeled: Array = self._signs * np.array(status.position, float)
        return reeled

    def _log_tick(
        self, trial: int, k: int, time: float, clock: float, estimate: Any, used: Sighting | None,
        newest: Sighting | None, begin: float, motion: Motion, answer: Answer, tension: Array, target: Array,
        reeled: Array, late: float, disturber: Disturber | None,
    ) -> None:  # fmt: skip
        row: dict[str, Any] = {
            "trial": trial,
            "time": time,
            "clock": clock,
            "theta": estimate.theta,
            "rate": estimate.rate,
            "load": estimate.load,
            "theta_measured": used.theta if used else math.nan,
            "captured": used.time - begin if used else math.nan,
            "verdict": newest.verdict if newest else "",
            "theta_ref": float(motion.theta_ref[k]),
            "rate_ref": float(motion.rate_ref[k]),
            "acceleration_ref": float(motion.acceleration_ref[k]),
            "theta_desired": float(motion.theta_desired[k]),
            "error": estimate.theta - float(motion.theta_ref[k]),
            "torque_wanted": answer.torque_wanted,
            "torque": answer.torque,
            "state": self._status.state.name,
            "faults": "+".join(fault.name or "" for fault in Fault if fault in self._status.faults),
            "late": late,
        }
        for name, values in (("tension", tension), ("target", target), ("position", reeled), ("sent", self._sent)):
            row |= {f"{name}_{tendon}": value for tendon, value in zip(TENDONS, values.tolist(), strict=True)}
        if disturber is not None:
            self._log.disk.pretend_full = disturber.disk(time)
        self._log.tick(row)
        if self._shown is not None:
            self._shown(row)
