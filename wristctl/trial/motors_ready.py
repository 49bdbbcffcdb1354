"""Preparation of motors before they move, and their stop."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from wristctl.board.board_errors import BoardError
from wristctl.board.driver import Board
from wristctl.board.messages import Command, Configure, Fault, Flag, Hello, Limits, State, Status
from wristctl.config.hw_run import CalibrateWristSettings, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.interrupt import undisturbed
from wristctl.trial.resting import judge_rest
from wristctl.trial.rig_belief import PLANES
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.tendon_pulls import tendon_pulls_of
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tracking import Tracking

# Seconds within which motors at any speed have ramped down.
_PATIENCE = 0.5


class Halt(NamedTuple):
    """Outcome of stopping the motors."""

    verified: bool
    """Whether the board's own status says that nothing moves."""
    how: str
    status: Status | None
    seconds: float
    """From the decision to stop until they stood."""


def halt(board: Board, watchdog: float) -> Halt:
    """Stop the motors, first by a ramp, else by an emergency stop; never raises for a board that does not answer."""
    began = board.transport.now()
    answers = []
    for command in (Command.STOP, Command.ESTOP):
        try:
            try:
                board.send(command)
            except BoardError as error:  # in a fault it has stopped already: its status is what counts
                answers.append(str(error.what))
            status = _standing(board, began + _PATIENCE)
        except BoardError as error:
            answers.append(str(error.what))
            continue
        if status is not None:
            command_name = f"{command.name}, board {status.state.name}"
            return Halt(True, command_name, status, board.transport.now() - began)
    why = answers[-1] if answers else "still moving"
    fallback = f"{why}; the board stops by itself {1e3 * watchdog:.0f} ms after the last command, else cut motor power"
    return Halt(False, fallback, None, board.transport.now() - began)


def _standing(board: Board, deadline: float) -> Status | None:
    """The status once nothing moves, None if it still does at the deadline."""
    while True:
        status = board.read()
        if Flag.MOVING not in status.flags:
            return status
        if board.transport.now() > deadline:
            return None
        board.transport.wait(0.005)


@contextmanager
def in_sight(
    testbed: Testbed, settings: CalibrateWristSettings, wrist: WristParameters
) -> Iterator[tuple[Board, Hello, Tracking]]:
    """The connected board, how it greeted, and the camera; at the end the drives are released and the testbed closed.

    Where that comes by an error the motors are stopped before, and verified to stand. Raises SafetyStop, BoardError and
    CameraError.
    """
    board = Board(testbed.transport)
    board.cells = tendon_pulls_of(settings)
    try:
        hello = board.connect()
        try:
            patience = Patience(board)
            testbed.face(settings.plane, patience.pulse)
            tracking = testbed.tracking()
            patience.stand_square(tracking, settings.homing)  # the markers are seen, and nothing moves yet
            planes = (settings.plane,) if settings.planes == 1 else PLANES
            judge_rest(patience.sightings(tracking, 4 * settings.homing.frames), settings, wrist, planes)
            testbed.confirm(patience.pulse)
            yield board, hello, tracking
        except BaseException:
            with undisturbed():
                board.close(emergency=not halt(board, settings.safety.watchdog).verified)
            raise
        board.close()
    finally:
        testbed.close()


def prepare(board: Board, settings: RigSettings, reach: float | None = None) -> str:
    """Set ramps, watchdog and soft limits of a board, clear an old fault, and switch the drives on.

    Until the axes are homed none may creep further than `reach` [m] of tendon from where they are switched on; None:
    as far as homing goes. Returns the names of the faults that it has cleared, in which the drives have let go.
    """
    limits, spools = settings.safety, spools_of(settings.actuator)
    cleared, status = "", board.read()
    if status.state == State.FAULT:
        cleared = " and ".join(fault.name or "" for fault in Fault if fault in status.faults)
        board.clear()
    furthest = round(limits.travel / spools.step)
    ramps = Configure(limits.watchdog, int(limits.hold), round(settings.actuator.ramp))
    homing = settings.homing
    creeps = max(homing.slack + homing.pull, 2.0 * homing.pull) + 3.0 * homing.move  # in, and let out
    jog = round((creeps if reach is None else reach) / spools.step)
    board.set_up(ramps, Limits((-furthest,) * 4, (furthest,) * 4, jog))
    board.enable()
    return cleared


@contextmanager
def after_a_fault(cleared: str) -> Iterator[None]:
    """Within the block, a homing that stops says that its tendons hang slack where `prepare` has `cleared` a fault."""
    try:
        yield
    except SafetyStop as stop:
        if not cleared:
            raise
        problem = str(stop.what).removeprefix("stopped: ")
        problem += f"; the drives have let go in a fault before ({cleared}), which leaves tendons slack or crossed"
        fix = "see that each tendon lies on its pulley, take its slack up (wristctl hw tension), then home again"
        raise SafetyStop(problem, str(stop.where), fix) from stop
