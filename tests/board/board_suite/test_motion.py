"""Positions, rates and ramps of four axes, counted on the board's pins."""

from __future__ import annotations

import numpy as np
import pytest

from tests.board.bench import MS, Bench
from tests.board.drive_watch import CLOCK
from wristctl.board.messages import (
    JOG_RATE,
    Command,
    Configure,
    Flag,
    Home,
    Jog,
    Limits,
    Rate,
    Result,
    State,
    Target,
)

ORIGIN = (0, 0, 0, 0)


def positions(bench: Bench) -> tuple[int, ...]:
    return tuple(drive.position for drive in bench.drives)


def random_target(rng: np.random.Generator) -> Target:
    goal = rng.integers(-300, 301, 4) * rng.choice([1, 1, 8], 4)
    rates = rng.choice([1_500, 4_000, 10_000], 4)
    return Target(tuple(map(int, goal)), tuple(map(int, rates)))  # type: ignore[arg-type]


def keep_rate(bench: Bench, rate: Rate, seconds: float) -> None:
    until = bench.chip.cycles + seconds * CLOCK
    while bench.chip.cycles < until:
        bench.do(rate)
        bench.run_ms(20)


@pytest.mark.parametrize("acceleration", [50_000, 200_000])
@pytest.mark.slow
def test_random_moves_end_exactly_on_their_targets(bench: Bench, rounds: int, acceleration: int) -> None:
    rng = np.random.default_rng(1)
    bench.do(Configure(acceleration=acceleration))
    bench.get_ready()
    for _ in range(15 * rounds):
        target = random_target(rng)
        bench.do(target)
        status = bench.wait_for_rest()
        assert status.position == target.position == positions(bench)


def test_moves_retargeted_on_the_fly_end_exactly_on_the_last_target(bench: Bench, rounds: int) -> None:
    rng = np.random.default_rng(2)
    bench.get_ready()
    for _ in range(2 * rounds):
        for _ in range(20):
            target = random_target(rng)
            bench.do(target)
            bench.run_ms(int(rng.integers(0, 60)))
        status = bench.wait_for_rest()
        assert status.position == target.position == positions(bench)


SWEEP = np.geomspace(10, 20_000, 24).reshape(4, 6).T * (1, -1, 1, -1)  # six sets of four rates
HEAVIEST = [(20_000.0, -20_000.0, 0.0, 0.0), (10_000.0, -10_000.0, 10_000.0, 10_000.0)]


@pytest.mark.parametrize("rates", [*map(tuple, SWEEP.tolist()), *HEAVIEST], ids=lambda r: f"to {r[3]:.0f}")
@pytest.mark.slow
def test_step_rates_are_within_100_ppm_and_no_step_is_late(bench: Bench, rates: tuple[float, ...]) -> None:
    bench.get_ready()
    rate = Rate(rates)  # type: ignore[arg-type]
    keep_rate(bench, rate, 0.6)
    bench.look()
    keep_rate(bench, rate, 1.0)
    for wanted, rises in zip(rates, bench.look(), strict=True):
        if wanted == 0:
            assert len(rises) == 0
        else:
            mean = (len(rises) - 1) * CLOCK / int(rises[-1] - rises[0])
            assert mean == pytest.approx(abs(wanted), rel=100e-6)
    assert bench.do(Command.COUNTERS).late_steps == 0


@pytest.mark.parametrize("rates", HEAVIEST)
def test_flooded_line_costs_answers_but_neither_steps_nor_the_link(bench: Bench, rates: tuple[float, ...]) -> None:
    bench.get_ready()
    rate = Rate(rates)  # type: ignore[arg-type]
    keep_rate(bench, rate, 0.5)
    bench.look()
    for _ in range(400):
        bench.send(rate)
        bench.run_ms(1.08)  # as long as the frame takes: the line is never silent
    for wanted, rises in zip(rates, bench.look(), strict=True):
        if wanted:
            intervals = np.diff(rises) * abs(wanted) / CLOCK
            assert intervals.mean() == pytest.approx(1, rel=100e-6)
            assert intervals.max() < 2
    bench.run_ms(30)
    bench.frames()
    assert bench.status().state is State.ENABLED
    assert bench.do(Command.COUNTERS).late_steps == 0


def test_host_that_does_not_wait_loses_answers_but_gets_none_broken(bench: Bench) -> None:
    bench.get_ready()
    for _ in range(100):
        bench.send(Rate((0.0, 0.0, 0.0, 0.0)))
    bench.run_ms(150)
    answers = bench.frames()  # each with a right CRC
    counters = bench.do(Command.COUNTERS)
    assert counters.dropped_answers > 0
    assert len(answers) + counters.dropped_answers == 100


@pytest.mark.slow
def test_rates_that_cross_over_at_more_than_the_allowed_total_delay_no_step(bench: Bench) -> None:
    bench.get_ready()
    one_fast, three_fast = (20_000.0, -6_600.0, 6_600.0, -6_600.0), (0.0, 13_300.0, -13_300.0, 13_300.0)
    for rates in (one_fast, three_fast, one_fast, three_fast):
        keep_rate(bench, Rate(rates), 0.6)
    assert bench.do(Command.COUNTERS).late_steps == 0
    bench.do(Command.STOP)
    assert bench.wait_for_rest().position == positions(bench)


@pytest.mark.parametrize("acceleration", [20_000, 200_000])
def test_ramps_keep_the_configured_acceleration(bench: Bench, acceleration: int) -> None:
    bench.do(Configure(acceleration=acceleration))
    bench.get_ready()
    bench.look()
    keep_rate(bench, Rate((8_000.0, 0.0, 0.0, 0.0)), 0.6)
    keep_rate(bench, Rate((-8_000.0, 0.0, 0.0, 0.0)), 1.0)
    rises = bench.look()[0]
    moving = rises[(rises - rises[0]) < 0.95 * 8_000 / acceleration * CLOCK]  # on the way up to 8,000 steps/s
    rate = CLOCK / np.diff(moving).astype(float)
    fitted = np.polyfit(moving[1:] / CLOCK, rate, 1)[0]
    assert fitted == pytest.approx(acceleration, rel=0.03)
    windows = np.histogram(rises, bins=np.arange(int(rises[0]), int(rises[-1]), 20 * MS))[0] / 0.020
    assert np.abs(np.diff(windows)).max() <= acceleration * 0.020 + 2 / 0.020  # one step more or less at each end


def test_a_move_brakes_along_its_ramp_instead_of_stopping_dead(bench: Bench) -> None:
    bench.get_ready()
    bench.look()
    bench.do(Target((4_000, 0, 0, 0), (10_000, 1, 1, 1)))
    bench.wait_for_rest()
    last_intervals = np.diff(bench.look()[0])[-5:]
    assert CLOCK / last_intervals.min() < 1_000  # steps/s: a 1/16-stepped motor stops from there in one step


def test_rate_motion_ends_exactly_at_the_soft_limit_and_says_so(bench: Bench) -> None:
    bench.do(Limits((-500, -20_000, -20_000, -20_000), (3_000, 20_000, 20_000, 20_000)))
    bench.get_ready()
    furthest = 0
    for direction, limit in ((1, 3_000), (-1, -500)):
        for _ in range(40):
            status = bench.do(Rate((direction * 15_000.0, 0.0, 0.0, 0.0)))
            bench.run_ms(20)
            furthest = max(furthest, status.position[0])
        status = bench.status()
        assert status.position[0] == limit == bench.drives[0].position
        assert Flag.AT_LIMIT in status.flags and Flag.MOVING not in status.flags
    assert furthest == 3_000
    assert bench.ask(Target((3_001, 0, 0, 0), (100, 100, 100, 100)))[0] is Result.RANGE
    assert Flag.AT_LIMIT not in bench.do(Rate((100.0, 0.0, 0.0, 0.0))).flags


def test_rates_that_together_ask_too_much_of_the_board_are_refused(bench: Bench) -> None:
    bench.get_ready()
    assert bench.ask(Rate((20_000.0, -20_000.0, 1.0, 0.0)))[0] is Result.RANGE
    assert bench.ask(Target(ORIGIN, (20_000, 20_000, 1, 1)))[0] is Result.RANGE
    bench.run_ms(50)
    assert sum(drive.steps for drive in bench.drives) == 0


def test_stop_ramps_down_and_stays_enabled_and_homed(bench: Bench) -> None:
    bench.get_ready()
    keep_rate(bench, Rate((10_000.0, -5_000.0, 0.0, 0.0)), 0.5)
    bench.do(Command.STOP)
    status = bench.wait_for_rest()
    assert Flag.HOMED in status.flags and Flag.DRIVES_ON in status.flags
    assert status.position == positions(bench)


def test_until_homed_only_slow_short_jogs_move(bench: Bench) -> None:
    bench.do(bench.enable)
    assert bench.ask(Rate((100.0, 0.0, 0.0, 0.0)))[0] is Result.UNHOMED
    assert bench.ask(Target((100, 0, 0, 0), (100, 1, 1, 1)))[0] is Result.UNHOMED
    assert bench.ask(Jog((Limits().jog + 1, 0, 0, 0)))[0] is Result.RANGE
    bench.look()
    bench.do(Jog((-120, 50, 0, 0)))
    assert bench.wait_for_rest().position == (-120, 50, 0, 0)
    up_to_speed = np.diff(bench.look()[0])[3:]
    assert CLOCK / up_to_speed.min() < 1.01 * JOG_RATE
    assert bench.do(Home((7, 8, 9, 10))).position == (7, 8, 9, 10)
    assert bench.ask(Jog(ORIGIN))[0] is Result.STATE


@pytest.mark.slow
def test_jogs_together_lead_no_further_than_their_limit_until_the_drives_have_let_go(bench: Bench) -> None:
    bench.do(Limits(jog=300))
    bench.do(bench.enable)
    for goal in ((300, -300, 0, 0), (0, 0, 0, 0), (-300, 300, 1, 0)):
        bench.do(Jog(goal))
        assert bench.wait_for_rest().position == goal == positions(bench)
    for goal in ((-301, 300, 1, 0), (-300, 301, 1, 0), (0, 0, 0, 301)):
        assert bench.ask(Jog(goal))[0] is Result.RANGE
    bench.do(bench.enable)  # said again, it changes nothing
    assert bench.ask(Jog((-301, 300, 1, 0)))[0] is Result.RANGE
    assert bench.status().position == (-300, 300, 1, 0)
    bench.do(Command.DISABLE)
    bench.run_ms(60)
    bench.do(bench.enable)
    bench.do(Jog((-600, 600, 301, 0)))
    assert bench.wait_for_rest().position == (-600, 600, 301, 0)
    assert bench.ask(Jog((-600, 600, 302, 0)))[0] is Result.RANGE


def test_no_step_comes_before_the_drives_have_settled(bench: Bench) -> None:
    status = bench.do(bench.enable)
    enabled = bench.chip.cycles
    assert Flag.SETTLING in status.flags
    bench.do(Jog((100, 0, 0, 0)))
    bench.look()
    bench.wait_for_rest()
    assert bench.look()[0][0] - enabled > 190 * MS
