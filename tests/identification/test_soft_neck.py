"""The elastic arc that three tendons bend."""

import math

import numpy as np
import pytest

from wristctl.identification.soft_neck import error_by_blocks, static_bend

DIRECTIONS = np.array([[math.cos(angle), math.sin(angle)] for angle in np.radians([0.0, 120.0, 240.0])])


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.4])
def test_taut_tendons_bend_a_neck_as_springs_in_parallel_do(angle: float) -> None:
    toward = np.array([math.cos(angle), math.sin(angle)])
    lift = (1.0 + 0.2 * DIRECTIONS @ toward)[None, :]
    bend = static_bend(lift, 1.0, 8.0, 0.4, 0.0)
    assert bend[0] == pytest.approx(0.2 * 1.5 * 8.0 / (0.6 + 1.5 * 8.0) * toward, rel=1e-3)


def test_a_tendon_that_is_slack_pulls_nowhere_and_the_neck_turns_with_its_tendons() -> None:
    one, two = static_bend(np.array([[0.3, -9.0, -9.0], [-9.0, 0.3, -9.0]]), 0.0, 4.0, 0.9, 0.0)
    assert one == pytest.approx([0.3 * 4.0 / 5.0, 0.0], abs=1e-4)
    assert two == pytest.approx(np.linalg.norm(one) * DIRECTIONS[1], abs=1e-4)


def test_a_neck_that_shortens_bends_less() -> None:
    lift = np.array([[0.5, 0.2, 0.2]])
    assert 0.0 < static_bend(lift, 0.0, 8.0, 0.9, 0.05)[0, 0] < static_bend(lift, 0.0, 8.0, 0.9, 0.0)[0, 0]


def test_an_interval_by_blocks_holds_its_error_and_is_wide_where_few_blocks_err() -> None:
    time = np.arange(0.0, 50.0, 0.1)
    even = np.full((len(time), 2), 1.0)
    assert error_by_blocks(even, time) == pytest.approx([math.sqrt(2.0)] * 3)
    error, low, high = error_by_blocks(np.where((time < 10.0)[:, None], 3.0, 0.1), time)
    assert low < 0.7 * error and high > 1.2 * error
