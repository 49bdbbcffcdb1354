"""A rig whose marker is in sight and whose person has agreed, before motors move for a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from wristctl.board.driver import Board
from wristctl.board.messages import Hello
from wristctl.config.hw_run import CalibrateWristSettings
from wristctl.interrupt import undisturbed
from wristctl.trial.halt import halt
from wristctl.trial.patience import Patience
from wristctl.trial.testbeds import Testbed
from wristctl.trial.tracking import Tracking


@contextmanager
def in_sight(testbed: Testbed, settings: CalibrateWristSettings) -> Iterator[tuple[Board, Hello, Tracking]]:
    """The connected board, how it greeted, and the camera; at the end the drives are released and the testbed closed.

    Where that comes by an error the motors are stopped before, and verified to stand. Raises SafetyStop, BoardError and
    CameraError.
    """
    board = Board(testbed.transport)
    try:
        hello = board.connect()
        try:
            patience = Patience(board)
            testbed.face(settings.plane, patience.pulse)
            tracking = testbed.tracking()
            patience.angle(tracking, settings.homing.frames)  # the marker is seen, and nothing moves yet
            testbed.confirm(patience.pulse)
            yield board, hello, tracking
        except BaseException:
            with undisturbed():
                board.close(emergency=not halt(board, settings.safety.watchdog).verified)
            raise
        board.close()
    finally:
        testbed.close()
