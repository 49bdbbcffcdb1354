"""Checks of a homed wrist: does each tendon do as it should, is each slack, do none pull against each other?"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.board.messages import JOG_RATE
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import LEAST, Bend, ExpectedMoves, middle
from wristctl.trial.homing import Zero, rest_of, slacken
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Motors, Patience, Reading
from wristctl.trial.tracking import Tracking
from wristctl.wrist.tendon_layout import TendonLayout

# Share of `homing.pull` by which a tendon is reeled in to check it, and times that by which it is then: what bends the
# wrist further by so little is still no other tendon's hold, since those are let out by `homing.pull` twice.
_CHECKED, _ON = 1.2, 1.5
# Seconds in which a wrist that has been let go comes to rest, but for creep.
_SETTLES = 0.5
# Shares of the bend at which tendons let out by `homing.pull` hold a wrist that sags: from which on they may, and by
# which it sags on where they are let out twice as far.
_HELD, _FURTHER = 0.6, 0.5
# Share of a bend that is left where tendons have brought a wrist back.
_BACK = 0.5
# Growth of a bend [rad] that counts as none.
_LEAST_GROWN = 1e-6


class HomedWrist:
    """A homed wrist at rest with slack tendons, as each check leaves it too. Raises SafetyStop.

    `layout` has the tendons that its motors wind; None: the board's four.
    """

    def __init__(
        self, board: Motors, tracking: Tracking, settings: HwRunSettings, wrist: WristParameters, plane: str,
        zero: Zero, layout: TendonLayout | None = None,
    ) -> None:  # fmt: skip
        self._board, self._tracking, self._settings, self._zero = board, tracking, settings, zero
        self._expected, self._spools = ExpectedMoves(settings, wrist, plane, layout), spools_of(settings.actuator)
        self._homing, self._slack = settings.homing, round(settings.homing.pull / self._spools.step)
        self._stiffness = self._expected.tendon_stiffness(zero.steps_per_radian)

    def slacken(self, times: float = 1.0) -> None:
        """Let its tendons out by so many times `homing.pull`."""
        slacken(self._board, self._spools, self._homing, self._zero.signs, times)

    def check_zero(self) -> tuple[float, ...]:
        """Let each tendon bend it a little; all must do as they should.

        Returns each camera's marker angle of the straight wrist [rad].

        Raises SafetyStop where a tendon is not slack, or a motor turns the wrong way or winds another tendon than its
        own.
        """
        held = self._reading()
        self.slacken(2.0)
        Patience(self._board).wait(0.5 * self._homing.let_go)
        rest = self._reading()
        self._expected.judge_slackened(self._expected.bend(held, rest))
        middles = self._all_tried(rest)
        return tuple(angle + bent for angle, bent in zip(self._tracking.zero, middle(middles), strict=False))

    def check_tendons(self) -> None:
        """Let each tendon of a wrist in two planes bend it a little, beside the one opposite.

        A law makes up for half a tendon by the others, and a motion may ask nothing of one: no residual shows that it
        is lost. In one plane it is shown by a bend across. Raises SafetyStop.
        """
        self.slacken(2.0)
        self._all_tried(self._rest())

    def check_straight(self, where: str) -> None:
        """See that it rests straight. Raises SafetyStop at this place."""
        self.slacken()
        rest, axes = self._rest(), range(len(self._expected.plus))
        rigid = min(self._expected.steps(math.inf, axis=axis) for axis in axes) * self._spools.step
        if (off := _sag(rest)) > self._homing.pull / rigid:
            problem = f"the slack wrist rests {math.degrees(off):.1f} deg off where it was straight"
            fix = "a tendon is shorter than it was, caught or slipped, or the bend's zero has moved: home again"
            raise SafetyStop(problem, where, fix)

    def check_cocontraction(self) -> bool:
        """See that no tendons of a wrist at rest at zero pull against each other.

        Pulls that balance bend nothing, so they show in no residual. All tendons are let out by `homing.pull`, then
        those of one side twice as far again: where the other side pulls, the wrist bends to it. In two planes one
        tendon of both opposite pairs is let out so. Returns False where nobody can tell, since the wrist sags under a
        declared payload. Raises SafetyStop.
        """
        self.slacken()
        self._rest()
        held = self._reading()
        patience = self._reeled(np.where(self._expected.plus, -3 * self._slack, -self._slack))
        patience.wait(_SETTLES)
        bend = self._expected.bend(held, patience.reading(self._tracking, 4 * self._homing.frames))
        self.slacken()
        if self._is_loaded(held):
            return False
        try:
            self._expected.judge_cocontraction(bend)
        except SafetyStop:
            rest = self._rest()
            if not _goes_on(bend, self._expected.bend(held, rest)):
                raise
            self._judge_load(_sag(rest))
            return False
        return True

    def _is_loaded(self, held: Reading) -> bool:
        """Whether a wrist that was `held` by tendons let out by `homing.pull` sags on when they are let out further.

        A payload does that; nobody can then tell whether tendons pull against each other. One that does, or friction
        inside that keeps a wrist bent, bends it no further. Raises SafetyStop where no payload was declared.
        """
        before, held_at = _sag(held), self._homing.pull / self._expected.lever
        if before < _HELD * held_at:
            return False
        self.slacken(2.0)
        sag = _sag(self._rest())
        self.slacken()
        if sag - before < _FURTHER * held_at:
            return False
        self._judge_load(sag)
        return True

    def _judge_load(self, sag: float) -> None:
        """Raises SafetyStop where no payload was declared of a wrist that sags by this bend [rad]."""
        if self._settings.payload > 0.0:
            return
        problem = f"the slack wrist sags by {math.degrees(sag):.1f} deg, as it did not when it was homed"
        likely = "more load than declared (hw-run.payload), or something that pushes at the hand"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", "lay the load down, or declare it")

    def _all_tried(self, rest: Reading) -> list[Bend]:
        """Where a wrist that is at rest so is straight, by the tendons of each pair; its tendons are let out twice."""
        middles = []
        for pair in self._expected.turns:
            straight, rest = self._tried(pair, rest)
            middles.append(straight)
        self.slacken()
        return middles

    def _tried(self, pair: Sequence[int], rest: Reading) -> tuple[Bend, Reading]:
        """Let two opposite tendons bend the wrist at rest; where it is straight, and where it rests then.

        Friction inside a wrist leaves it bent where it was let go, and turns a bend by another tendon aside. So
        opposite tendons bend it in turn, each from where the other has left it, and straight is the middle of where it
        rests. One bend tells no wrong steps from a wrong zero, which may cancel each other: what it grows by does.
        """
        expected, reeled = self._expected, round(_CHECKED * self._homing.pull / self._spools.step)
        against = pair[1] if len(pair) > 1 else expected.against(pair[0])
        (bend,), rest = self._bent(against, (2 * reeled,), rest)
        meant = reeled / expected.steps(self._stiffness, axis=against)
        if expected.size(bend) < LEAST * meant:
            raise expected.bends_too_little(against, bend, meant)
        rests, bends, further = [_bend_of(rest)], [], round(_ON * reeled)
        for axis in pair:
            both, rest = self._bent(axis, (reeled, further), rest)
            bends.append(both)
            rests.append(_bend_of(rest))
        straight = middle(rests[1:])
        for axis, before, (bend, on) in zip(pair, rests, bends, strict=False):
            away = expected.along(axis, straight.since(before)) * expected.steps(self._stiffness, axis=axis)
            expected.judge_small_move(axis, reeled + away, bend, self._stiffness)
            grown = max(_LEAST_GROWN, expected.along(axis, on.since(bend)))
            expected.judge_growth(axis, (further - reeled) / grown, self._stiffness)
        return straight, rest

    def _bent(self, axis: int, positions: Sequence[int], rest: Reading) -> tuple[list[Bend], Reading]:
        """The bends that an axis makes of the wrist at rest at these positions, and where that rests after them."""
        bends = []
        for reeled in positions:
            every = np.full(len(self._zero.signs), -2 * self._slack)
            every[axis] = reeled
            patience = self._reeled(every)
            patience.wait(2.0 * self._homing.rest)
            bends.append(self._expected.bend(rest, patience.reading(self._tracking, self._homing.frames)))
        self.slacken(2.0)
        return bends, self._rest()

    def _reeled(self, positions: NDArray[np.int64]) -> Patience:
        """Reel all tendons in by so many microsteps (T,); who waits while they stand."""
        self._board.go_to((np.array(self._zero.signs) * positions).tolist(), JOG_RATE)
        return Patience(self._board)

    def _rest(self) -> Reading:
        """Where it rests, once it moves no more."""
        return rest_of(self._board, self._tracking, self._expected, self._homing)

    def _reading(self) -> Reading:
        return Patience(self._board).reading(self._tracking, 4 * self._homing.frames)


def _sag(rest: Reading) -> float:
    """How far off straight a wrist rests [rad]."""
    return float(np.hypot.reduce(np.nan_to_num(_bend_of(rest))))


def _goes_on(bend: Bend, since: Bend) -> bool:
    """Whether a wrist that bent while tendons were let out on one side has not come back since they pull as before.

    Tendons that pull against each other bring it back; under a load that it hardly bears it goes on.
    """
    there, now = (np.nan_to_num(each) for each in (bend, since))
    return float(there @ now) > _BACK * float(there @ there)


def _bend_of(rest: Reading) -> Bend:
    """A reading in its plane, or in both: what one camera sees across is left out."""
    return Bend(rest.theta, rest.beside)
