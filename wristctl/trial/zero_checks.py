"""Checks of a homed wrist: does each tendon do as it should, is each slack, do none pull against each other?"""

import math

import numpy as np
from numpy.typing import NDArray

from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE
from wristctl.config.hw_run import Homing, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.homing import Zero, moves_of, slacken
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.supervised_wait import Patience, Reading
from wristctl.trial.tracking import Tracking

# Share of `homing.pull` by which a tendon is reeled in to check it.
_CHECKED = 1.2
# Seconds in which a wrist that has been let go comes to rest, but for creep.
_SETTLES = 0.5


def check_zero(
    board: Board, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str, zero: Zero
) -> None:
    """Let each tendon of a homed, slack wrist bend it a little, and leave it slack again; all must do as they should.

    Raises SafetyStop where a tendon is not slack, or a motor turns the wrong way or winds another tendon than its own.
    """
    expected, spools, homing = moves_of(settings, wrist, plane), spools_of(settings.actuator), settings.homing
    slack, reeled = -round(homing.pull / spools.step), round(_CHECKED * homing.pull / spools.step)
    patience = Patience(board)
    held = patience.reading(tracking, 4 * homing.frames)
    slacken(board, spools, homing, zero.signs, 2.0)
    patience = Patience(board)
    patience.wait(0.5 * homing.let_go)
    straight = patience.reading(tracking, 4 * homing.frames)
    expected.judge_slackened(expected.bend(held, straight))
    for axis in range(AXES):
        positions = np.full(AXES, slack)
        positions[axis] = reeled
        patience = _reeled(board, zero, positions)
        patience.wait(2.0 * homing.rest)
        bend = expected.bend(straight, patience.reading(tracking, homing.frames))
        slacken(board, spools, homing, zero.signs)
        expected.judge_small_move(axis, reeled, bend)
        _straighten(board, tracking, homing, expected, straight)


def check_cocontraction(
    board: Board, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str, zero: Zero
) -> None:
    """See that no tendons of a wrist at rest at zero pull against each other; leaves it slack.

    Pulls that balance bend nothing, so they show in no residual. All tendons are let out by `homing.pull`, then those
    of one side twice as far again: where the other side pulls, the wrist bends to it. In two planes one tendon of both
    opposite pairs is let out so. Raises SafetyStop.
    """
    expected, spools, homing = moves_of(settings, wrist, plane), spools_of(settings.actuator), settings.homing
    slack = round(homing.pull / spools.step)
    slacken(board, spools, homing, zero.signs)
    patience = Patience(board)
    patience.wait(_SETTLES)
    held = patience.reading(tracking, 4 * homing.frames)
    patience = _reeled(board, zero, np.where(on_plus_side(plane or "ulnar"), -3 * slack, -slack))
    patience.wait(_SETTLES)
    bend = expected.bend(held, patience.reading(tracking, 4 * homing.frames))
    slacken(board, spools, homing, zero.signs)
    expected.judge_cocontraction(bend)


def _reeled(board: Board, zero: Zero, positions: NDArray[np.int64]) -> Patience:
    """Reel all tendons in by so many microsteps (4,); who waits while they stand."""
    one, two, four, five = map(int, np.array(zero.signs) * positions)
    board.go_to((one, two, four, five), JOG_RATE)
    return Patience(board)


def _straighten(
    board: Board, tracking: Tracking, homing: Homing, expected: ExpectedMoves, straight: Reading
) -> None:  # fmt: skip
    patience, clock = Patience(board), board.transport
    deadline, least = clock.now() + homing.let_go, 0.5 * math.radians(homing.bend_deg)
    while expected.size(expected.bend(straight, patience.reading(tracking, 1))) > least and clock.now() < deadline:
        pass
