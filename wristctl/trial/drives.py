"""Between the control loop and what turns the spools: targets in, and where the spools are believed to be.

`BoardDrive` leads the motor board's axes by step rates, `wristctl.trial.rig_drive.RigDrive` a rig by targets.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, Fault, Flag, State
from wristctl.config.hw_run import HwRunSettings
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.trial.spools import spools_of

# By how much longer it takes the board to read a RATE for each step/s of all axes together, whose interrupts come
# first: by the firmware's cycles [s].
_BUSY = 6.6e-9


class Heard(NamedTuple):
    """What motors have said of themselves last."""

    counted: float
    """When the spools were where they are said to be, on the clock [s]."""
    time: float
    """The motors' own clock then [s]."""
    round_trip: float
    """Seconds that the last command took."""
    state: State = State.ENABLED
    """ENABLED where the motors follow."""
    faults: str = ""
    """Names of faults, for the log; empty without."""
    lapses: int = 0
    """Commands that came too late to be followed, modulo 256."""
    resent: int = 0
    """Commands that were sent again."""
    slow: str = ""
    """The call of a rig of one's own that takes long, with its time; empty where none does."""


class BoardDrive:
    """The board's axes. A tick posts step rates, whose answer, the status, is read in the next one.

    `signs` (T,) say which way each motor's positive steps turn; axes beyond these wind nothing, and stand. Values (T,)
    are of tendons, in microsteps of `actuator.step_length` reeled in.
    """

    tension = None
    """Its load cells are read by themselves."""

    def __init__(self, board: Board, settings: HwRunSettings, signs: Sequence[int]) -> None:
        self._board, self._signs, self._period = board, np.array(signs), settings.control_period
        self._clock, self._life, self._spools = board.transport, settings.rate_life, spools_of(settings.actuator)
        self.sent: Array = np.zeros(len(signs))
        """Step rates (T,) [1/s] that were really sent last, positive reeling in."""
        self._posted, self._counted = 0.0, 0.0
        self._idle = [0.0] * (AXES - len(signs))
        self._underway = settings.actuator.command_delay
        delay = self._spools.timing.delay
        remembered = remembered_commands(delay, self._period)
        self._late, self._rates = int(delay // self._period), np.zeros((len(signs), remembered))
        self._since_read = delay - self._late * self._period - self._underway

    def begin(self) -> None:
        """Take in where the motors stand; ticks follow."""
        self._status, self._counted = self._board.read(), self._clock.now()
        self._place, self._reckoned = self.reeled(), deque[tuple[float, Array]]()

    @property
    def heard(self) -> Heard:
        """By the board's last answer."""
        status, board = self._status, self._board
        faults = "+".join(fault.name or "" for fault in Fault if fault in status.faults)
        told = status.state, faults, status.lapses, board.traffic.resent
        return Heard(self._counted, status.time, board.round_trip, *told)

    @property
    def moving(self) -> bool:
        """Whether a rate was sent, or the board says that it moves."""
        return bool(self.sent.any()) or Flag.MOVING in self._status.flags

    def now(self) -> float:
        """Seconds on the transport's clock."""
        return self._clock.now()

    def wait_until(self, moment: float) -> None:
        """Let time pass until then."""
        if (ahead := moment - self._clock.now()) > 0.0:
            self._clock.wait(ahead)

    def reeled(self) -> Array:
        """Steps reeled in (T,) by the last status."""
        reeled: Array = self._signs * np.array(self._status.position[: len(self._signs)], float)
        return reeled

    def lead(self, target: Array, moving: Array) -> Array:
        """Send what leads to targets (T,) [steps] that move at this rate (T,) [1/s].

        A rate acts once an axis takes it up; by then the ones before have moved the spools. Returns by how much the
        motors will stay behind (T,) [steps], where that is more than one.
        """
        foreseen = self._spools.foreseen(self._place, self._rates, self._period)
        gap = target + moving * self._spools.timing.delay - foreseen
        before = self.sent
        self._send(self._signs * self._spools.rate(gap, moving, before, self._period))
        return self._spools.behind(gap, moving, self.sent, self._period)

    def stand(self) -> None:
        """Step rates of 0."""
        self._send(np.zeros(len(self._signs)))

    def _send(self, rates: Array) -> None:
        sent, self._posted = self._board.post_turn([*rates.tolist(), *self._idle], self._life)
        self.sent = self._signs * np.array(sent[: len(rates)])

    def listen(self, until: float) -> None:
        """Take in the board's answers to what was sent, those that come by `until` [s]."""
        while (answered := self._board.answered(until)) is not None:
            began, self._status = answered
            busy = _BUSY * float(np.abs(self._rates[:, 1]).sum())
            self._counted = began + self._underway + busy
            while self._reckoned[0][0] < began:  # lost on the way
                self._reckoned.popleft()
            self._place = self._place + (self.reeled() - self._reckoned.popleft()[1])

    def go_on(self, ticks: int) -> list[Array]:
        """Go over so many ticks, the first with what was sent last; where spools are in the middle of each (T,).

        It goes by the rates that were sent and the board's answers to those before.
        """
        middles = []
        for tick in range(ticks):
            ahead = self._spools.foreseen(self._place, self._rates, self._period)
            self._rates = np.column_stack([self.sent, self._rates[:, :-1]])
            middles.append(self._spools.reckoned(self._place, self._rates, 0.5 * self._period, self._period))
            self._place = ahead
            if tick == 0:
                in_force = self._rates[:, self._late + 1]
                self._reckoned.append((self._posted, ahead - in_force * self._since_read))
        return middles
