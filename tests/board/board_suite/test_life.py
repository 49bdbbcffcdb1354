"""A step rate lives for a stated time, and bytes of an earlier connection move nothing."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.board.bench import MS, Bench
from wristctl.board.layout import BOUND, COMMAND_OF, LAYOUTS
from wristctl.board.messages import (
    ENABLE_KEY,
    Command,
    Configure,
    Connect,
    Enable,
    Fault,
    Flag,
    Home,
    Jog,
    Limits,
    Rate,
    Result,
    State,
    Target,
    Turn,
)

RATE, ACCELERATION = 2_000.0, 50_000.0
POLL, UPDATE, WAITS = 1.2, 2.5, 0.02
"""Milliseconds within which a life's end is noticed, an axis gets its new rate, and earlier interrupts are through."""


def turning(bench: Bench, life: float) -> int:
    """Two axes at speed; the cycle at which the last of a rate that lives so long was in."""
    for _ in range(30):
        bench.do(Rate((RATE, -RATE, 0.0, 0.0), 0.2))
        bench.run_ms(5)
    bench.look()
    return bench.send(Rate((RATE, -RATE, 0.0, 0.0), life))[2]


def pinged(bench: Bench, seconds: float) -> None:
    """Time goes by; the link is kept alive by PING and STATUS alone."""
    for _ in range(round(seconds / 0.005)):
        bench.ask(Command.PING)
        bench.ask(Command.STATUS)
        bench.run_ms(1)


@pytest.mark.parametrize("life", [0.01, 0.05, 0.2])
def test_a_rate_without_another_ramps_to_rest_after_its_life_whatever_feeds_the_watchdog(
    bench: Bench, life: float
) -> None:
    bench.get_ready()
    heard = turning(bench, life)
    pinged(bench, life + 0.3)
    status, courses = bench.status(), bench.look()
    assert status.state is State.ENABLED and status.faults is Fault(0) and bench.drives_energised() == [True] * 4
    assert Flag.HOMED | Flag.LAPSED in status.flags and Flag.MOVING not in status.flags and status.lapses == 1
    assert status.position == tuple(drive.position for drive in bench.drives)
    for rises in courses[:2]:
        since = (rises.astype(np.int64) - heard) / MS
        gaps = np.diff(since)
        ramp = since[:-1][gaps > 1.02 * 1e3 / RATE]
        assert 1e3 * life < ramp[0] + 1.0 and ramp[0] < 1e3 * life + POLL + UPDATE
        down = 1e3 * RATE / ACCELERATION
        last = 1e3 * math.sqrt(2.0 / ACCELERATION)  # from the last step to rest, where no further one fits in
        assert 1e3 * life + down - last < since[-1] < 1e3 * life + POLL + UPDATE + down + 5.0
        late = gaps[since[:-1] > 1e3 * life + 4.0]
        assert all(after > 0.95 * before - WAITS for before, after in pairwise(late))
    bench.do(Rate((RATE, 0.0, 0.0, 0.0), life))
    assert Flag.LAPSED not in bench.status().flags and bench.status().lapses == 1


def test_a_rate_that_is_renewed_in_time_goes_on(bench: Bench) -> None:
    bench.get_ready()
    turning(bench, 0.02)
    for _ in range(40):
        bench.do(Rate((RATE, -RATE, 0.0, 0.0), 0.02))
        bench.run_ms(15)
    rises = bench.look()[0]
    assert np.diff(rises).max() < 1.03 * 16e6 / RATE and bench.status().lapses == 0


@pytest.mark.slow
def test_nothing_lapses_at_rest_or_on_the_way_to_a_target(bench: Bench) -> None:
    bench.get_ready()
    bench.do(Rate((0.0, 0.0, 0.9, 0.0), 0.01))
    pinged(bench, 0.1)
    assert bench.status().lapses == 0
    turning(bench, 0.01)
    bench.do(Target((900, 0, 0, -60), (1_000, 1_000, 1_000, 1_000)))
    assert bench.wait_for_rest().position == (900, 0, 0, -60)
    bench.do(Command.DISABLE)
    bench.run_ms(60)
    bench.do(bench.enable)
    bench.run_ms(90)
    bench.do(Jog((1_000, 0, 0, -160)))
    assert bench.wait_for_rest().position == (1_000, 0, 0, -160)
    assert bench.status().lapses == 0 and Flag.LAPSED not in bench.status().flags


def test_a_silent_host_is_found_out_by_the_watchdog_all_the_same(bench: Bench) -> None:
    bench.get_ready()
    heard = turning(bench, 0.03)
    bench.run_ms(300)
    status = bench.status()
    assert (status.state, status.faults) == (State.FAULT, Fault.LINK)
    bench.look()
    assert (bench.last_step() - heard) / MS < 30.0 + 1e3 * RATE / ACCELERATION + 10.0, "it stands before that"


COMMANDS: list[Any] = [
    *(
        Command.PING,
        Command.CLEAR,
        Enable(ENABLE_KEY, 0),
        Rate((RATE, 0.0, 0.0, 0.0)),
        Turn((RATE, 0.0, 0.0, 0.0)),
        Target((9, 9, 9, 9), (100,) * 4),
    ),
    *(Jog((9, 9, 9, 9)), Home((1, 2, 3, 4))),
    *(Configure(watchdog=2.0), Limits((-5,) * 4, (5,) * 4)),
]


def test_whatever_could_move_something_is_obeyed_of_the_present_connection_alone(bench: Bench) -> None:
    assert {each if isinstance(each, Command) else COMMAND_OF[type(each)] for each in COMMANDS} == BOUND
    bench.get_ready()
    ours = bench.connection
    for other in ((ours - 1) % 2**16, (ours + 1) % 2**16, ours ^ 0x100, 0):
        for each in COMMANDS:
            command = each if isinstance(each, Command) else COMMAND_OF[type(each)]
            fields = b"" if isinstance(each, Command) else LAYOUTS[type(each)].pack(each)
            bench.do(Command.STOP)
            before = bench.status()
            bench.chip.write(bench.frame(command, 1, fields, other))
            bench.run_ms(4)
            assert [(code, payload[0]) for code, _, payload in bench.frames()] == [(command | 0x80, Result.CONNECTION)]
            after = bench.status()
            assert after.position == before.position and after.flags == before.flags
            assert after.watchdog_left < before.watchdog_left, "nor does it keep anything alive"
    for drive in bench.drives:
        assert drive.steps == 0


def test_anyone_may_stop_it(bench: Bench) -> None:
    bench.get_ready()
    turning(bench, 0.2)
    bench.connection ^= 1
    bench.do(Command.STOP)
    bench.run_ms(60)
    assert Flag.MOVING not in bench.status().flags
    bench.do(Command.DISABLE)
    bench.run_ms(10)
    assert bench.drives_energised() == [False] * 4


def test_a_connection_is_followed_by_the_next_alone(bench: Bench) -> None:
    """So old bytes cannot bring an old connection back."""
    ours = bench.connection
    for refused in ((ours - 1) % 2**16, (ours + 2) % 2**16, 0):
        assert bench.ask(Connect(refused))[0] is Result.CONNECTION
    assert bench.do(Command.HELLO).connection == ours
    bench.do(Connect(ours))  # said again, as where the answer was lost
    bench.do(Connect((ours + 1) % 2**16))
    assert bench.ask(Command.PING)[0] is Result.CONNECTION
    bench.connect()
    assert bench.connection == (ours + 2) % 2**16
    bench.do(Command.PING)
