"""Units whose worker dies are blamed alone, and the time of all is summed: with workers that die when they are told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.work.walks import walks
from wristctl.errors import UserError
from wristctl.work import worker
from wristctl.work.executors import Pool, Workers
from wristctl.work.fan_out import UnitsDone, perform_units
from wristctl.work.worker import Unit

PATIENCE = 12
"""Deaths after which the deadly unit does its work, so that a test ends."""


class Mortal(Executor):
    """Works when it is asked for a width of units, all at once; dies of each unit that `deaths` still counts."""

    def __init__(self, deaths: dict[int, int], tried: list[int]) -> None:
        self._deaths, self._tried, self._broken = deaths, tried, False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As a process pool: all futures of one that has died are broken."""
        future: Future[Any] = Future()
        seed = int(args[1]["seed"])
        self._tried.append(seed)
        if self._deaths.get(seed, 0) > 0:
            self._deaths[seed] -= 1
            self._broken = True
        if self._broken:
            future.set_exception(BrokenProcessPool("a process has ended"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def performed(deaths: dict[int, int], count: int = 5, width: int = 1) -> tuple[UnitsDone, list[int]]:
    """What became of walks whose workers die so many times, and which were tried, in order."""
    tried: list[int] = []

    @contextmanager
    def opened() -> Iterator[Pool]:
        yield Pool(Mortal(deaths, tried), lambda: width, apart=False)

    return perform_units(walks(count), Workers("mortal", width, opened)), tried


@pytest.mark.parametrize("width", [1, 3])
def test_a_unit_of_which_workers_die_is_given_up_after_three_tries_by_itself_and_the_others_are_done(
    width: int,
) -> None:
    done, tried = performed({1: PATIENCE}, width=width)
    assert [each.unit.name for each in done.poisoned] == ["walk 1"] and "died" in done.poisoned[0].why
    assert [k for k, arrays in enumerate(done.arrays) if arrays is None] == [1]
    assert tried.count(1) == 3 if width == 1 else tried.count(1) == 4, "a death beside others is nobody's fault"


@pytest.mark.parametrize("times", [1, 2])
def test_a_unit_whose_worker_dies_less_than_three_times_is_as_if_it_had_not(times: int) -> None:
    done, tried = performed({1: times})
    assert done.poisoned == [] and tried.count(1) == 1 + times
    walked = perform_units(walks(5), Workers.of("serial")).arrays
    for one, other in zip(done.arrays, walked, strict=True):
        assert one is not None and other is not None
        np.testing.assert_array_equal(one["walk"], other["walk"])


def test_units_given_up_are_named_in_the_order_of_the_study() -> None:
    done, _ = performed({3: PATIENCE, 0: PATIENCE, 2: PATIENCE}, width=2)
    assert [each.unit.name for each in done.poisoned] == ["walk 0", "walk 2", "walk 3"]


def test_workers_that_die_before_they_are_given_anything_are_not_tried_for_ever() -> None:
    opened = []

    class Dead(Executor):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            raise BrokenProcessPool("a process has ended")

    @contextmanager
    def open_dead() -> Iterator[Pool]:
        opened.append(1)
        yield Pool(Dead(), lambda: 1, apart=False)

    with pytest.raises(UserError, match="die as they begin"):
        perform_units(walks(2), Workers("dead", 1, open_dead))
    assert len(opened) == 3


def test_what_workers_spend_is_summed_by_the_wall_and_by_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    """A unit that takes 3 s, of which it computes for 1.5 s."""
    now = SimpleNamespace(wall=100.0, processor=40.0)

    def work(spec: dict[str, Any]) -> dict[str, np.ndarray]:
        now.wall, now.processor = now.wall + 3.0, now.processor + 1.5
        return {"at": np.array(spec["seed"])}

    clock = SimpleNamespace(perf_counter=lambda: now.wall, process_time=lambda: now.processor)
    monkeypatch.setattr(worker, "time", clock)
    monkeypatch.setattr(worker, "function_at", lambda place: work)
    one = worker.compute("any:thing", {"seed": 1}, None)
    assert (one.seconds, one.processor) == (3.0, 1.5)
    units = [Unit("any:thing", {"seed": k}, f"unit {k}") for k in range(4)]
    done = perform_units(units, Workers.of("serial"))
    assert (done.seconds, done.processor) == (12.0, 6.0)


@pytest.mark.parametrize("named", ["processes:1", "processes:1024"])
def test_from_one_to_1024_processes_are_taken(named: str) -> None:
    assert Workers.of(named).many == int(named.partition(":")[2])
    with pytest.raises(UserError, match="1025 processes"):
        Workers.of("processes:1025")
