"""Errors between host and board; each says whether host, cable or firmware is to blame."""

import errno

from wristctl.board.layout import FAULT_FIX, FAULT_MEANING, RESULT_FIX, RESULT_MEANING
from wristctl.board.messages import Command, Fault, Result
from wristctl.errors import UserError

# Exit codes.
HARDWARE, SAFETY_STOP = 4, 5

# Seconds of waiting for an answer beyond what was to be waited: the computer did not let the host run.
_OVERSLEPT = 0.02


class BoardError(UserError):
    """The board could not be made to do something; `origin` is host, cable or firmware."""

    def __init__(self, origin: str, what: str, where: str = "", fix: str = "", exit_code: int = HARDWARE) -> None:
        super().__init__(f"{origin}: {what}", where, fix, exit_code)
        self.origin = origin


class PortUnusable(BoardError):
    """The port cannot be opened."""

    def __init__(self, port: str, cause: Exception) -> None:
        number, text = getattr(cause, "errno", None), str(cause).lower()
        if number == errno.EACCES or "permission" in text or "access is denied" in text:
            problem, fix = "no permission to open the port", "sudo usermod -aG dialout $USER, then log in again"
        elif number in (errno.EBUSY, errno.EAGAIN) or "lock" in text or "busy" in text:
            problem, fix = "another program uses the port", "close it (wristctl, an Arduino serial monitor)"
        elif "://" in port:
            problem, fix = f"cannot connect ({cause})", "start the server first: wristctl hw emulate --tcp 5000"
        else:
            problem, fix = "there is no such port", "wristctl hw ports lists the ports of this computer"
        super().__init__("host", problem, port, fix)


class PortLost(BoardError):
    """The port went away while it was in use."""

    def __init__(self, port: str, cause: Exception) -> None:
        super().__init__("cable", f"the port is gone ({cause})", port, "plug the board in again and home it")


class NoAnswer(BoardError):
    """Nothing valid came back."""

    def __init__(self, port: str, command: Command, attempts: int, bytes_seen: int, overslept: float = 0.0) -> None:
        asked = f"to {command.name} after {attempts} attempts"
        if bytes_seen:
            problem = f"only garbled bytes ({bytes_seen}) in answer {asked}"
            fix = "check --baud; if another program runs on the board: wristctl hw flash"
            super().__init__("firmware", problem, port, fix)
        elif overslept > _OVERSLEPT:
            problem = f"no answer {asked}, of which this computer slept through {1e3 * overslept:.0f} ms"
            fix = "close other programs, or give the loop priority: hw-run --priority"
            super().__init__("host", problem, port, fix)
        else:
            fix = "check USB cable and power, and that this is the board's port: wristctl hw ports"
            super().__init__("cable", f"no answer {asked}", port, fix)


class WrongFirmware(BoardError):
    """The board speaks by another message table."""

    def __init__(self, port: str, theirs: int, version: tuple[int, ...], ours: int) -> None:
        problem = (
            f"the board's firmware {'.'.join(map(str, version))} has the message table {theirs:08x}, "
            f"this host {ours:08x}"
        )
        super().__init__("firmware", problem, port, f"wristctl hw flash --port {port}")


class Refused(BoardError):
    """The board understood, and did not do it."""

    def __init__(self, port: str, command: Command, result: Result) -> None:
        self.result = result
        super().__init__("host", f"{command.name} refused: {RESULT_MEANING[result]}", port, RESULT_FIX[result])


class Restarted(BoardError):
    """The board has started anew under a session."""

    def __init__(self, port: str) -> None:
        problem = "the board has restarted; its positions are lost, and its drives may hold for 2 s more"
        super().__init__(
            "cable",
            problem,
            port,
            "keep clear until they let go; check its supply and that nobody pressed reset; enable and home",
            SAFETY_STOP,
        )


class Faulted(BoardError):
    """The board has stopped and latched a fault."""

    def __init__(self, port: str, faults: Fault, silence: float, watchdog: float) -> None:
        self.faults = faults
        latched = [fault for fault in Fault if fault in faults]
        problem = "; ".join(FAULT_MEANING[fault] for fault in latched) or "a fault is latched"
        fix = "; ".join(dict.fromkeys(FAULT_FIX[fault] for fault in latched))
        firmware = Fault.HANG in faults or Fault.WATCHDOG in faults
        late = silence > watchdog
        if faults == Fault.LINK and late:
            problem += f" of {1e3 * watchdog:.0f} ms: this computer was silent for {1e3 * silence:.0f} ms"
        blamed = "firmware" if firmware else "cable" if faults == Fault.LINK and not late else "host"
        super().__init__(blamed, problem, port, fix, SAFETY_STOP)
