"""What is kept of a stop: why, when, and how the motors were left."""

from __future__ import annotations

from wristctl.board.messages import Fault, Flag, State, Status
from wristctl.trial.motors_ready import Halt
from wristctl.trial.safety import SafetyStop
from wristctl.trial.trial_series import Stop

STATUS = Status(1.0, State.FAULT, Fault.LINK, Flag(0), 0.0, (1, 2, 3, 4), (5, 6, 7, 8), 0)


def test_a_stop_tells_what_the_board_last_said() -> None:
    plain = Stop(SafetyStop("too far"), 3, 1.25, Halt(True, "STOP, board FAULT", STATUS, 0.02)).plain()
    assert plain == {
        "reason": "stopped: too far", "trial": 3, "time": 1.25, "motors_stand": True, "how": "STOP, board FAULT",
        "seconds": 0.02, "state": "FAULT", "faults": "LINK", "position": (1, 2, 3, 4), "rate": (5, 6, 7, 8),
    }  # fmt: skip
    calm = Halt(True, "STOP", STATUS._replace(faults=Fault(0), state=State.ENABLED), 0.02)
    assert Stop(SafetyStop("x"), None, None, calm).plain() | {"faults": "none", "state": "ENABLED", "trial": None} == (
        Stop(SafetyStop("x"), None, None, calm).plain()
    )


def test_of_a_board_that_does_not_answer_nothing_is_known() -> None:
    plain = Stop(SafetyStop("lost"), 0, 0.5, Halt(False, "no answer", None, 0.3)).plain()
    assert not plain["motors_stand"]
    assert [plain[name] for name in ("state", "faults", "position", "rate")] == [None] * 4


def test_the_reason_is_the_users_error_the_operator_or_the_bug_by_its_kind() -> None:
    halted = Halt(True, "STOP", STATUS, 0.0)
    assert Stop(KeyboardInterrupt(), None, None, halted).reason == "interrupted by the operator"
    assert Stop(ZeroDivisionError("by zero"), None, None, halted).reason == "ZeroDivisionError: by zero"
