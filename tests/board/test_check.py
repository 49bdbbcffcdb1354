"""What `check` measures, and how it moves an axis."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.board.check import WIRING_STEPS, move_a_little, round_trips
from wristctl.board.messages import Command, Configure


class Told:
    """A board whose round trips are given, and that keeps what it is told."""

    def __init__(self, trips: list[float]) -> None:
        self.trips, self.told = iter(trips), list[Any]()
        self.round_trip = 0.0

    def ping(self) -> None:
        self.told.append("ping")
        self.round_trip = next(self.trips)

    def read(self) -> None:
        self.told.append("read")
        self.round_trip = next(self.trips)

    def set_up(self, settings: Any) -> None:
        self.told.append(settings)

    def enable(self) -> Any:
        self.told.append("enable")
        return SimpleNamespace(position=(10, 20, 30, 40))

    def jog(self, positions: list[int]) -> None:
        self.told.append(list(positions))

    def disable(self) -> str:
        self.told.append("disable")
        return "off"


@pytest.mark.parametrize(("count", "p99"), [(200, 198), (100, 99), (1, 0), (5, 4)])
def test_median_99th_percentile_and_worst_are_of_the_sorted_round_trips(count: int, p99: int) -> None:
    board: Any = Told([float(k) for k in reversed(range(count))])
    found = round_trips(board, Command.PING, count)
    assert found == ("PING", count, float(count // 2), float(p99), float(count - 1))
    assert board.told == ["ping"] * count


def test_the_status_is_asked_for_where_it_is_to_be_measured() -> None:
    board: Any = Told([1.0, 2.0])
    assert round_trips(board, Command.STATUS, 2).command == "STATUS" and board.told == ["read", "read"]


def test_one_axis_creeps_a_twentieth_of_a_turn_forward_and_back() -> None:
    board: Any = Told([])
    last: Any = move_a_little(board, 2)
    assert last == "off"
    assert board.told == [Configure(watchdog=0.5), "enable", [10, 20, 30 + 160, 40], [10, 20, 30, 40], "disable"]
    assert WIRING_STEPS == 200 * 16 // 20
