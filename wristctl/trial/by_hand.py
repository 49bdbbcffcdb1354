"""Motors moved by a person's word: before anything is known of the wrist, or after something went wrong."""

import math
from collections.abc import Callable, Sequence

from wristctl.board.board_errors import BoardError, Refused
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE, Result, Target
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.motors_ready import prepare
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.tracking import Tracking

# Tendon [m] that one word may move.
MOST = 5e-3


class ByHand:
    """The drives of a board, energised for as long as a person works with them; lengths of tendon [m], + reeled in.

    `signs` say which way each motor's positive steps turn. An old fault is cleared.
    """

    def __init__(self, board: Board, settings: RigSettings, signs: Sequence[int] = (1,) * AXES) -> None:
        self._board, self._signs, self._step = board, signs, spools_of(settings.actuator).step
        self._furthest = round(settings.safety.travel / self._step)
        self._stiffness, self._tension = settings.actuator.tendon_stiffness, settings.safety.tension
        prepare(board, settings, self.reach)
        self._origin = board.read().position

    @property
    def reach(self) -> float:
        """Tendon [m] that may be reeled in before homing: one that was taut then pulls `safety.tension`."""
        return self._tension / self._stiffness

    def jog(self, lengths: Sequence[float]) -> tuple[int, ...]:
        """Creep on by `lengths`; the steps made, once the axes stand. No more than `reach` in all.

        Raises UserError where that would be more.
        """
        steps = [sign * round(length / self._step) for sign, length in zip(self._signs, lengths, strict=True)]
        goal = [position + way for position, way in zip(self._board.read().position, steps, strict=True)]
        for axis, (position, origin) in enumerate(zip(goal, self._origin, strict=True)):
            if (way := abs(position - origin)) > round(self.reach / self._step):
                length = way * self._step
                problem = (
                    f"axis {axis} would be {1e3 * length:.1f} mm from where the drives were switched on: a tendon that "
                    f"was taut there would pull {length * self._stiffness:.0f} N, beyond {self._tension:g} N"
                )
                raise UserError(problem, fix="release the drives, so that a taut tendon lets go, and jog again")
        self._board.jog(goal)
        return tuple(steps)

    def patience(self) -> Patience:
        """For waiting while the drives hold."""
        return Patience(self._board)

    def home(self) -> None:
        """Make the axes' present positions zero, until the drives are released."""
        self._board.home()

    def go(self, axis: int, length: float) -> tuple[int, ...]:
        """Creep with one axis to a length from zero, within the soft limits; the positions [steps] then."""
        goal = list(self._board.read().position)
        goal[axis] = self._signs[axis] * round(length / self._step)
        return self._board.go_to(goal, JOG_RATE).position

    def limits_hold(self) -> int:
        """See that the board refuses to go a step beyond each soft limit, and moves nothing; the limit [steps].

        Raises BoardError where it does not refuse.
        """
        for axis in range(AXES):
            for beyond in (-self._furthest - 1, self._furthest + 1):
                goal = [beyond * (k == axis) for k in range(AXES)]
                self._board.ping()  # what the board refuses does not feed its watchdog
                try:
                    self._board.send(Target((goal[0], goal[1], goal[2], goal[3]), (1, 1, 1, 1)))
                except Refused as error:
                    if error.result is Result.RANGE:
                        continue
                    raise
                self._board.stop()
                raise BoardError("firmware", f"axis {axis} has no soft limit", fix="wristctl hw flash")
        return self._furthest


def take_up(
    board: Board, settings: RigSettings, signs: Sequence[int], axis: int, move: float, taut: Callable[[float], bool]
) -> float:
    """Reel a tendon in by one move [m] after the other until it is taut, then let it go by `homing.pull`.

    The drives are released before it is let go: a stalled motor's tendon then keeps no more than the motor's detent
    holds. They are released afterwards too.

    Parameters
    ----------
    board, settings, signs
        as for `ByHand`, with the drives released
    axis
        0 to 3
    move
        tendon reeled in before `taut` is asked [m]
    taut
        says of the length that is reeled in so far [m] whether the tendon is taut

    Returns
    -------
    float
        length reeled in [m]: the slack that it had, and what a taut tendon has let go where the drives were released on
        the way, since they lead no further than `ByHand.reach`

    Raises
    ------
    UserError
        where it is not taut within `safety.travel`
    """
    reeled, most = 0.0, settings.safety.travel
    while reeled + move <= most:
        hand, begun = ByHand(board, settings, signs), reeled
        while reeled + move <= min(begun + hand.reach, most):
            hand.jog([move * (k == axis) for k in range(AXES)])
            reeled += move
            if taut(reeled):
                board.disable()
                ByHand(board, settings, signs).jog([-settings.homing.pull * (k == axis) for k in range(AXES)])
                board.disable()
                return reeled
        board.disable()
    problem = f"axis {axis} has reeled in {1e3 * reeled:.1f} mm, and its tendon is not taut"
    raise UserError(problem, fix=f"see tendon, pulley and motor: wristctl hw check --wiring {axis}", exit_code=4)


def bent_by_tendon(
    board: Board, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str
) -> Callable[[float], bool]:
    """For `take_up`: says whether the wrist has bent by `homing.bend_deg` since it was read here at rest."""
    homing, expected = settings.homing, ExpectedMoves(settings, wrist, plane)
    straight = Patience(board).reading(tracking, 4 * homing.frames)

    def taut(reeled: float) -> bool:
        patience = Patience(board)
        patience.wait(homing.rest)
        bend = expected.bend(straight, patience.reading(tracking, homing.frames))
        return bend.askew > math.radians(homing.bend_deg)

    return taut
