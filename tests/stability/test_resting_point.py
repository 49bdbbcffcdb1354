"""Where a loop rests is found from far away too, on maps whose resting points are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.stability.linearise import RestingPoint, change_in, resting_point
from wristctl.stability.loop_ticks import TickSlopes

SIZE = 4.0
"""Typical size of the only variable."""


class Mapped:
    """Stands in for a loop's ticks: one variable, from which each of them takes a function."""

    def __init__(self, begin: float, *taken: tuple[Callable[[float], float], Callable[[float], float]]) -> None:
        self.sizes, self._begin, self._taken = np.array([SIZE]), begin, taken
        self.names = ["angle"]

    def guesses(self) -> list[Array]:
        return [np.array([SIZE * self._begin])]

    def slopes(self, state: Array) -> list[TickSlopes]:
        x, nothing = float(state[0]) / SIZE, np.zeros(1)
        recorded = np.full(20, x)
        return [
            TickSlopes(
                SIZE * np.array([x - value(x)]), recorded, np.array([[1.0 - slope(x)]]), np.zeros((20, 1)), False,
                nothing, nothing, nothing,
            )
            for value, slope in self._taken
        ]  # fmt: skip


def _atan(at: float) -> tuple[Callable[[float], float], Callable[[float], float]]:
    return lambda x: math.atan(x - at), lambda x: 1.0 / (1.0 + (x - at) ** 2)


def _found(loop: Any) -> float | None:
    point = resting_point(loop)
    return None if point is None else float(point.state[0]) / SIZE


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("away", [0.0, 0.5, 2.0, 6.0])
def test_steps_of_newtons_method_are_short_enough_not_to_run_away(side: float, away: float) -> None:
    """Whole ones from more than 1.39 off the zero of an arc tangent go ever further."""
    assert _found(Mapped(1.0 + side * away, _atan(1.0))) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("changes", [(0.0, -3.0), (3.0, 0.5), (0.0, 0.0), (0.0, math.inf), (math.nan, 1.0)])
def test_what_changes_most_in_any_tick_counts(changes: tuple[float, float]) -> None:
    loop: Any = Mapped(1.0, *((lambda x, by=by: by, lambda x: 0.0) for by in changes))
    state = loop.guesses()[0]
    most = max(map(abs, changes)) if all(map(math.isfinite, changes)) else math.inf
    assert change_in(loop, RestingPoint(state, loop.slopes(state))) == most


def test_a_controllers_memory_that_drifts_and_acts_on_nothing_changes_nothing() -> None:
    """As the integral of an error whose gain is 0; any other variable that drifts does not rest."""
    loop: Any = Mapped(1.0, (lambda x: 2.0, lambda x: 0.0))
    state = loop.guesses()[0]
    assert change_in(loop, RestingPoint(state, loop.slopes(state))) == 2.0
    loop.names = ["memory"]
    assert resting_point(loop) is not None


def test_all_ticks_of_a_cycle_leave_the_same_state() -> None:
    twice: Callable[[float], float] = lambda x: 2.0 * (x - 1.0)  # noqa: E731
    assert _found(Mapped(0.0, _atan(1.0), (twice, lambda x: 2.0))) == pytest.approx(1.0, abs=1e-9)
    assert _found(Mapped(0.0, _atan(1.0), _atan(2.0))) is None, "no one state does for both"


def test_where_nothing_rests_there_is_no_point() -> None:
    assert _found(Mapped(0.0, (lambda x: 1.0 + x * x, lambda x: 2.0 * x))) is None
    assert _found(Mapped(0.0, (lambda x: math.nan, lambda x: math.nan))) is None


def test_a_loop_that_grows_fast_is_found_where_it_rests() -> None:
    assert _found(Mapped(0.2, (lambda x: -500.0 * (x - 0.25), lambda x: -500.0))) == pytest.approx(0.25, abs=1e-9)
