"""The error of a trial that must stop."""

from wristctl.board.board_errors import SAFETY_STOP
from wristctl.errors import Phrase, UserError


class SafetyStop(UserError):
    """The trial was stopped; motors are to be stopped too."""

    def __init__(self, what: str, where: str = "", fix: Phrase = "") -> None:
        super().__init__(f"stopped: {what}", where, fix, SAFETY_STOP)
