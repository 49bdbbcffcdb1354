"""A move's course between few answers of the board is that of the flashed firmware."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.board.driver import Board
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.messages import Configure, Flag, Limits, Target
from wristctl.trial.rig_strokes import RampedMove

ACCELERATION = 50_000.0


def answered(distance: int, rate: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and positions [steps] of a move of axis 1, asked of the flashed firmware as often as it can be."""
    with Board(VirtualTransport()) as board:
        board.set_up(Configure(0.5, 0, round(ACCELERATION)), Limits((-5000,) * 4, (5000,) * 4))
        board.enable()
        board.home()
        clock, told, moving = board.transport, list[tuple[float, float]](), True
        board.send(Target((0, distance, 0, 0), (rate,) * 4))
        while moving:
            begun = clock.now()
            status = board.read()
            moving = Flag.MOVING in status.flags
            told.append((0.5 * (begun + clock.now()), status.position[1]))
        told += [(told[-1][0] + k * 5e-3, status.position[1]) for k in range(1, 9)]
    time, position = np.array(told, float).T
    return time, position


@pytest.mark.parametrize(("distance", "rate"), [(136, 2037), (-136, 2037), (300, 1000), (-40, 4000)])
def test_the_flashed_firmware_moves_like_this_and_few_answers_tell_when_it_began(distance: int, rate: int) -> None:
    time, position = answered(distance, rate)
    assert len(time) > 20 and position[-1] == distance
    move = RampedMove(distance, rate, ACCELERATION)
    begun = move.began(time, position)
    assert np.abs(move.course(time - begun) - position).max() < 0.03 * abs(distance) + 2.0
    few = slice(None, None, max(1, round(0.016 / float(np.median(np.diff(time))))))
    assert move.began(time[few], position[few]) == pytest.approx(begun, abs=1e-3)
    late = time[few][1:], position[few][1:]  # the first answer came when it was well under way
    assert move.began(*late) == pytest.approx(begun, abs=1e-3)


@given(st.floats(5.0, 3000.0), st.floats(100.0, 20_000.0), st.floats(1000.0, 200_000.0), st.sampled_from([-1.0, 1.0]))
def test_it_ends_where_it_is_to_and_no_faster_than_it_may(
    distance: float, rate: float, acceleration: float, sign: float
) -> None:
    time = np.linspace(-0.01, 2.0 * distance / rate + 4.0 * np.sqrt(distance / acceleration), 4001)
    course = sign * RampedMove(sign * distance, rate, acceleration).course(time)
    speed = np.gradient(course, time)
    assert abs(course[0]) < 1e-9 * distance and course[-1] == pytest.approx(distance)
    assert speed.min() > -1e-6 * rate and speed.max() < rate * (1.0 + 1e-6)
    step = float(time[1] - time[0])
    assert np.abs(np.diff(speed)).max() <= acceleration * step * 1.01 + 1e-6 * rate
