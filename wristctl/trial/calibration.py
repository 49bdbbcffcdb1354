"""A rig's calibration as a run keeps it: what stays true of the rig, and where its motors stood."""

from dataclasses import dataclass
from typing import Any, Self

from wristctl.board.board_errors import BoardError
from wristctl.board.driver import Board
from wristctl.config.hw_run import CalibrateWristSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plain_files import read_json
from wristctl.records import Run
from wristctl.trial.homing import Zero, find_zero, slacken
from wristctl.trial.motors_ready import after_a_fault, in_sight, prepare
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.testbeds import Testbed

FILE, SCHEMA = "data/wrist.json", "wristctl.wrist/1"


@dataclass(frozen=True)
class WristCalibration:
    """`zero` is durable; `position` [steps] holds only as long as the board has neither restarted nor moved since."""

    zero: Zero
    plane: str
    boot_nonce: int
    position: tuple[int, ...]
    """Positions of the board's axes after the calibration, counted from zero."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        board = {"plane": self.plane, "boot_nonce": self.boot_nonce, "position": self.position}
        return {"schema": SCHEMA, **self.zero.plain(), **board}

    @classmethod
    def load(cls, run: Run) -> Self:
        """Read a calibrate-wrist run. Raises UserError."""
        file = run.file(FILE)
        try:
            table = read_json(file)
            if table["schema"] != SCHEMA:
                raise ValueError(table["schema"])
            return cls(Zero.of_plain(table), table["plane"], table["boot_nonce"], tuple(table["position"]))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise UserError("not a wrist calibration", str(file), "wristctl hw calibrate wrist") from error

    def restore(self, board: Board) -> None:
        """Take up its zero positions. Raises BoardError where they hold no longer."""
        hello = board.hello or board.connect()
        position = board.read().position
        if hello.boot_nonce != self.boot_nonce:
            problem = "the calibration's zero positions are lost: the board has restarted since"
        elif position != self.position:
            problem = f"the calibration left the motors at {self.position}, the board says {position}"
        else:
            board.home(position)
            return
        fix = "leave out positions: stored, and zero is found anew; senses of turning are kept"
        raise BoardError("host", problem, board.transport.name, fix)


def calibrated(testbed: Testbed, settings: CalibrateWristSettings, wrist: WristParameters) -> WristCalibration:
    """Home a rig, slacken its tendons again, and say what was found. Closes the stand.

    Raises SafetyStop, BoardError and CameraError; the motors are stopped before.
    """
    with in_sight(testbed, settings, wrist) as (board, hello, tracking):
        if settings.planes == 2:  # what one camera sees of a bend depends on the other
            tracking.zero = Patience(board).markers(tracking, 4 * settings.homing.frames)
        with after_a_fault(prepare(board, settings)):
            zero = find_zero(board, tracking, settings, wrist, settings.plane)
        position = slacken(board, spools_of(settings.actuator), settings.homing, zero.signs)
    return WristCalibration(zero, settings.plane, hello.boot_nonce, position)
