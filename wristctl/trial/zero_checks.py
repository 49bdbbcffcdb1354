"""Checks of a homed wrist: does each tendon do as it should, is each slack, do none pull against each other?"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.board.messages import JOG_RATE
from wristctl.config.hw_run import HwRunSettings, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import LEAST, Bend, ExpectedMoves, middle
from wristctl.trial.homing import Zero, rest_of, slacken
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Motors, Patience, Reading
from wristctl.trial.tracking import Tracking
from wristctl.wrist.tendon_layout import TendonLayout

# Share of `homing.pull` by which a tendon is reeled in to check it.
_CHECKED = 1.2
# Seconds in which a wrist that has been let go comes to rest, but for creep.
_SETTLES = 0.5
# Shares of the bend at which tendons let out by `homing.pull` hold a wrist that sags: from which on they may, and by
# which it sags on where they are let out twice as far.
_HELD, _FURTHER = 0.6, 0.5


def check_zero(
    board: Motors, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str, zero: Zero
) -> tuple[float, ...]:
    """Let each tendon of a homed, slack wrist bend it a little, and leave it slack again; all must do as they should.

    Returns each camera's marker angle of the straight wrist [rad].

    Raises SafetyStop where a tendon is not slack, or a motor turns the wrong way or winds another tendon than its own.
    """
    expected, spools, homing = ExpectedMoves(settings, wrist, plane), spools_of(settings.actuator), settings.homing
    held = Patience(board).reading(tracking, 4 * homing.frames)
    slacken(board, spools, homing, zero.signs, 2.0)
    Patience(board).wait(0.5 * homing.let_go)
    rest = Patience(board).reading(tracking, 4 * homing.frames)
    expected.judge_slackened(expected.bend(held, rest))
    middles = []
    for pair in expected.turns:
        straight, rest = _tried(board, tracking, settings, expected, zero, pair, rest)
        middles.append(straight)
    slacken(board, spools, homing, zero.signs)
    return tuple(angle + bent for angle, bent in zip(tracking.zero, middle(middles), strict=False))


def _tried(
    board: Motors, tracking: Tracking, settings: RigSettings, expected: ExpectedMoves, zero: Zero,
    pair: Sequence[int], rest: Reading,
) -> tuple[Bend, Reading]:  # fmt: skip
    """Let two opposite tendons bend a slack wrist that is at rest so; where it is straight, and where it rests then.

    Friction inside a wrist leaves it bent where it was let go, and turns a bend by another tendon aside. So opposite
    tendons bend it in turn, each from where the other has left it, and straight is the middle of where it rests.
    """
    spools, homing = spools_of(settings.actuator), settings.homing
    slack, reeled = -round(homing.pull / spools.step), round(_CHECKED * homing.pull / spools.step)

    def bent(axis: int, by: int) -> tuple[Bend, Reading]:
        """The bend that an axis makes of the wrist at rest, and where that rests after it."""
        positions = np.full(len(zero.signs), 2 * slack)
        positions[axis] = by
        patience = _reeled(board, zero, positions)
        patience.wait(2.0 * homing.rest)
        bend = expected.bend(rest, patience.reading(tracking, homing.frames))
        slacken(board, spools, homing, zero.signs, 2.0)
        return bend, rest_of(board, tracking, expected, homing)

    against = pair[1] if len(pair) > 1 else expected.against(pair[0])
    bend, rest = bent(against, 2 * reeled)
    meant = reeled / expected.steps(axis=against)
    if expected.size(bend) < LEAST * meant:
        raise expected.bends_too_little(against, bend, meant)
    rests, bends = [_bend_of(rest)], []
    for axis in pair:
        bend, rest = bent(axis, reeled)
        bends.append(bend)
        rests.append(_bend_of(rest))
    straight = middle(rests[1:])
    for axis, before, bend in zip(pair, rests, bends, strict=False):
        away = expected.along(axis, straight.since(before)) * expected.steps(axis=axis)
        expected.judge_small_move(axis, reeled + away, bend)
    return straight, rest


def check_tendons(
    board: Motors, tracking: Tracking, settings: RigSettings, wrist: WristParameters, zero: Zero,
    layout: TendonLayout | None = None,
) -> None:  # fmt: skip
    """Let each tendon of a wrist in two planes bend it a little, beside the one opposite; leaves it slack.

    A law makes up for half a tendon by the others, and a motion may ask nothing of one: no residual shows that it is
    lost. In one plane it is shown by a bend across. Raises SafetyStop.
    """
    expected, spools, homing = ExpectedMoves(settings, wrist, "", layout), spools_of(settings.actuator), settings.homing
    slacken(board, spools, homing, zero.signs, 2.0)
    rest = rest_of(board, tracking, expected, homing)
    for pair in expected.turns:
        _, rest = _tried(board, tracking, settings, expected, zero, pair, rest)
    slacken(board, spools, homing, zero.signs)


def check_cocontraction(
    board: Motors, tracking: Tracking, settings: HwRunSettings, wrist: WristParameters, plane: str, zero: Zero,
    layout: TendonLayout | None = None,
) -> bool:  # fmt: skip
    """See that no tendons of a wrist at rest at zero pull against each other; leaves it slack.

    Pulls that balance bend nothing, so they show in no residual. All tendons are let out by `homing.pull`, then those
    of one side twice as far again: where the other side pulls, the wrist bends to it. In two planes one tendon of both
    opposite pairs is let out so. Returns False where nobody can tell, since the wrist sags under a declared payload.
    Raises SafetyStop.
    """
    expected, spools, homing = (
        ExpectedMoves(settings, wrist, plane, layout),
        spools_of(settings.actuator),
        settings.homing,
    )
    slack = round(homing.pull / spools.step)
    slacken(board, spools, homing, zero.signs)
    rest_of(board, tracking, expected, homing)
    held = Patience(board).reading(tracking, 4 * homing.frames)
    patience = _reeled(board, zero, np.where(expected.plus, -3 * slack, -slack))
    patience.wait(_SETTLES)
    bend = expected.bend(held, patience.reading(tracking, 4 * homing.frames))
    slacken(board, spools, homing, zero.signs)
    loaded = _is_loaded(board, tracking, settings, expected, zero, held)
    if not loaded:
        expected.judge_cocontraction(bend)
    return not loaded


def _is_loaded(
    board: Motors, tracking: Tracking, settings: HwRunSettings, expected: ExpectedMoves, zero: Zero, held: Reading,
) -> bool:  # fmt: skip
    """Whether a wrist that was `held` by tendons let out by `homing.pull` sags on when they are let out further.

    A payload does that; nobody can then tell whether tendons pull against each other. One that does, or friction inside
    that keeps a wrist bent, bends it no further. Raises SafetyStop where no payload was declared.
    """
    spools, homing = spools_of(settings.actuator), settings.homing
    before, held_at = _sag(held), homing.pull / expected.lever
    if before < _HELD * held_at:
        return False
    slacken(board, spools, homing, zero.signs, 2.0)
    sag = _sag(rest_of(board, tracking, expected, homing))
    slacken(board, spools, homing, zero.signs)
    if sag - before < _FURTHER * held_at:
        return False
    if settings.payload > 0.0:
        return True
    problem = f"the slack wrist sags by {math.degrees(sag):.1f} deg, as it did not when it was homed"
    likely = "more load than declared (hw-run.payload), or something that pushes at the hand"
    raise SafetyStop(f"{problem}; likely {likely}", "homing", "lay the load down, or declare it")


def _sag(rest: Reading) -> float:
    """How far off straight a wrist rests [rad]."""
    return float(np.hypot.reduce(np.nan_to_num(_bend_of(rest))))


def _reeled(board: Motors, zero: Zero, positions: NDArray[np.int64]) -> Patience:
    """Reel all tendons in by so many microsteps (T,); who waits while they stand."""
    board.go_to((np.array(zero.signs) * positions).tolist(), JOG_RATE)
    return Patience(board)


def _bend_of(rest: Reading) -> Bend:
    """A reading in its plane, or in both: what one camera sees across is left out."""
    return Bend(rest.theta, rest.beside)
