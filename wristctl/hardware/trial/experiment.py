"""The experiment from the first command to the last: connect, home, trials, return, and the stop if it comes to that."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from wristctl.config.errors import UserError
from wristctl.config.hw_run import HwRunSettings, RigSettings
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.hardware.board import Board
from wristctl.hardware.errors import BoardError
from wristctl.hardware.messages import Configure, Limits, State
from wristctl.hardware.trial.eye import Eye
from wristctl.hardware.trial.faults import HostFaults
from wristctl.hardware.trial.halt import Halt, halt
from wristctl.hardware.trial.homing import Patience, Zero, find_zero
from wristctl.hardware.trial.log import TrialLog
from wristctl.hardware.trial.loop import ControlLoop, Timing
from wristctl.hardware.trial.safety import SafetyStop
from wristctl.hardware.trial.moves import at_rest, back, motion_of
from wristctl.hardware.trial.spools import spools_of
from wristctl.hardware.trial.trials import Trial
from wristctl.hardware.transport import Transport
from wristctl.runs.interrupt import undisturbed
from wristctl.wrist.directions import DIRECTIONS, in_plane

log = logging.getLogger(__name__)

Gains = Mapping[str, Mapping[str, float]]


class Rig(Protocol):
    """What an experiment stands on besides the board: the wrist in front of the camera."""

    emulated: bool
    transport: Transport

    def eye(self) -> Eye:
        """The camera with a fresh tracker."""

    def face(self, direction: str) -> None:
        """Turn the wrist so that this direction's plane is the one that bends and is seen. May ask the operator."""

    def begin(self, start: float, disturbances: Disturbances) -> None:
        """A trial's motion starts at `start` on the transport's clock."""

    def truth(self, since: float) -> list[list[float]]:
        """Rows (time since then, segment angles, their sum, pulls) of an emulated wrist; none of a real one."""

    def close(self) -> None:
        """Give everything back."""


def prepare(board: Board, settings: RigSettings) -> None:
    """Set ramps, watchdog and soft limits of a board, clear an old fault, and switch the drives on."""
    limits, spools = settings.safety, spools_of(settings.actuator)
    if board.read().state == State.FAULT:
        board.clear()
    board.configure(
        Configure(
            watchdog=limits.watchdog,
            hold_on_fault=int(limits.hold),
            acceleration=round(spools.acceleration),
        )
    )
    furthest = round(limits.travel / spools.step)
    board.send(Limits((-furthest,) * 4, (furthest,) * 4))
    board.enable()


def check_unmoved(board: Board, stored: Mapping[str, Any]) -> None:
    """Raises BoardError where the zero positions of a calibration no longer hold: the board has restarted or moved."""
    hello = board.hello or board.connect()
    position = list(board.read().position)
    if hello.boot_nonce != stored["boot_nonce"]:
        what = "the calibration's zero positions are lost: the board has restarted since"
    elif position != stored["position"]:
        what = f"the calibration left the motors at {stored['position']}, the board says {position}"
    else:
        return
    fix = "leave out positions: stored, and zero is found anew; senses of turning are kept"
    raise BoardError("host", what, board.transport.name, fix)


@dataclass(frozen=True)
class Stop:
    """Why and how an experiment was stopped before its end."""

    reason: str
    where: str
    trial: int
    """Being done at the time; -1: none."""
    halt: Halt

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        status = self.halt.status
        return {
            "reason": self.reason,
            "where": self.where,
            "trial": None if self.trial < 0 else self.trial,
            "motors_stand": self.halt.verified,
            "how": self.halt.how,
            "seconds": self.halt.seconds,
            "state": status.state.name if status else None,
            "faults": status.faults.name or "none" if status else None,
            "position": list(status.position) if status else None,
            "rate": list(status.rate) if status else None,
        }


class Experiment:
    """Trials on a bench; `outcomes` holds how each trial that began has ended."""

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, rig: Rig, trials: list[Trial], log_: TrialLog,
        tuned: Gains | None = None, known: Zero | None = None, stored: Mapping[str, Any] | None = None,
        shown: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:  # fmt: skip
        self._settings, self._wrist, self._rig, self._trials, self._log = settings, wrist, rig, trials, log_
        self._known, self._stored, self._shown = known, stored, shown
        rows = [(controller(row.controller), row.gains) for row in settings.rows]
        self._laws = [(law, gains_of(law, gains, tuned)) for law, gains in rows]
        self._back = controller("feedforward")
        self._motions = {name: motion_of(settings, wrist, name) for name in settings.directions}
        self.timing = Timing(settings.control_period)
        self.outcomes: dict[int, str] = {}
        self.starts: dict[int, float] = {}
        self.stop: Stop | None = None
        self.zero: Zero | None = None
        self._now = -1

    def run(self, board: Board) -> None:
        """Do all trials on a connected board. Whatever ends them early, the motors are stopped before it is raised."""
        try:
            if self._stored is not None:
                check_unmoved(board, self._stored)
            prepare(board, self._settings)
            self._all(board)
            with undisturbed():
                self._ended(board, None)
        except BaseException as error:
            with undisturbed():
                self._ended(board, error)
            if isinstance(error, OSError):
                raise SafetyStop(f"the log cannot be written: {error.strerror}", "data/log.csv", "free space") from error
            raise

    def _all(self, board: Board) -> None:
        plane = ""
        for trial in self._trials:
            if trial.plane != plane:
                first, plane = not plane, trial.plane
                self._rig.face(trial.direction)
                loop, eye = self._loop(board, trial.plane, first)
            self._one(loop, trial)

    def _loop(self, board: Board, plane: str, first: bool) -> tuple[ControlLoop, Eye]:
        """A loop at rest at zero in this plane."""
        settings, eye = self._settings, self._rig.eye()
        if first:
            self.zero = self._home(board, eye, plane)
            eye.zero = self.zero.marker
        else:
            eye.zero = Patience(board, eye).angle(4 * settings.homing.frames)
        assert self.zero is not None
        wrist = in_plane(self._wrist, "ulnar" if plane == "ulnar" else "flexion")
        loop = ControlLoop(
            board, eye, settings, wrist, plane, self.zero.signs, settings.control_period, self._log, self.timing,
            self._shown,
        )  # fmt: skip
        loop.follow(at_rest(settings.rest, settings.control_period), self._back, ())
        return loop, eye

    def _home(self, board: Board, eye: Eye, plane: str) -> Zero:
        settings = self._settings
        if settings.positions == "stored":
            assert self._known is not None and self._stored is not None
            board.home(self._stored["position"])
            return self._known
        signs = self._known.signs if self._known else None
        return find_zero(board, eye, spools_of(settings.actuator), settings.homing, plane, signs)

    def _one(self, loop: ControlLoop, trial: Trial) -> None:
        settings, followed = self._settings, self._motions[trial.direction]
        law, gains = self._laws[trial.row]
        against = -DIRECTIONS[trial.direction].sign * trial.push
        push = settings.push.model_copy(update={"force": against})
        self._now, start = trial.number, loop.next_tick
        self.starts[trial.number] = start
        self.outcomes[trial.number] = "begun"
        self._rig.begin(start, Disturbances(push=push))
        faults = HostFaults(settings.bench.faults) if self._rig.emulated else None
        loop.follow(followed, law, gains, trial.number, faults)
        self._keep_truth()
        self.outcomes[trial.number], self._now = "ok", -1
        self._log.flush()
        loop.follow(back(followed.final, settings.back, settings.rest, settings.control_period), self._back, ())

    def _keep_truth(self) -> None:
        if self._rig.emulated:
            number = self._now
            self._log.truth([number, *row] for row in self._rig.truth(self.starts[number]))

    def _ended(self, board: Board, error: BaseException | None) -> None:
        """Stop the motors, and note why where it was before the end."""
        stopped = halt(board, self._settings.safety.watchdog)
        if error is None:
            return
        reason = error.what if isinstance(error, UserError) else "interrupted" if isinstance(error, KeyboardInterrupt) else f"{type(error).__name__}: {error}"
        where = error.where if isinstance(error, UserError) else ""
        self.stop = Stop(reason, where, self._now, stopped)
        if self._now >= 0:
            self.outcomes[self._now] = reason
            self._keep_truth()
