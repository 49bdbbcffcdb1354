"""The emergency stop and alarm inputs, and what the board keeps of its starts and of what it was told."""

from __future__ import annotations

import numpy as np
import pytest

from tests.board.bench import MS, Bench
from tests.board.board_suite.test_safety import assert_latched, milliseconds_to_last_step, set_moving
from wristctl.board.messages import ESTOP_MS, Command, Configure, Fault, Flag, Limits, Reset, Result, State

ESTOP = ("G", 0)
ALARMS = [("L", axis) for axis in range(4)]


def test_an_emergency_stop_input_open_for_less_than_two_milliseconds_is_noise(bench: Bench) -> None:
    rng = np.random.default_rng(8)
    set_moving(bench)
    for _ in range(20):
        bench.run(int(rng.integers(0, MS)))
        bench.chip.drive(*ESTOP, True)
        bench.run_ms(rng.uniform(0.1, ESTOP_MS - 1.02))
        bench.chip.drive(*ESTOP, False)
        bench.do(Command.PING)
        bench.run_ms(5)
    assert bench.status().state is State.ENABLED


@pytest.mark.slow
def test_open_for_three_it_stops_within_3_1_milliseconds(bench: Bench) -> None:
    rng, found = np.random.default_rng(4), []
    for hold in (0, 1, 0, 0, 1):
        set_moving(bench, Configure(hold_on_fault=hold), int(rng.integers(0, MS)))
        opened = bench.chip.cycles
        bench.chip.drive(*ESTOP, True)
        found.append(milliseconds_to_last_step(bench, opened))
        assert bench.drives_energised() == [False] * 4
        assert bench.ask(Command.CLEAR)[0] is Result.ESTOP_OPEN
        bench.chip.drive(*ESTOP, False)
        assert_latched(bench, Fault.ESTOP_INPUT)
        bench.do(Command.DISABLE)
        bench.run_ms(60)
    print(f"emergency stop input: last step {max(found):.2f} ms after it has opened, at most")
    assert max(found) < ESTOP_MS + 0.1


@pytest.mark.parametrize(("period", "share"), [(2.0, 0.5), (2.5, 0.5), (3.0, 0.7), (7.3, 0.6), (1.7, 0.5)])
@pytest.mark.slow
def test_a_contact_that_chatters_stops(bench: Bench, period: float, share: float) -> None:
    """Open for half of the time, however quickly: each millisecond of it adds more than one closed takes away."""
    set_moving(bench)
    for _ in range(round(30.0 / period)):
        bench.chip.drive(*ESTOP, True)
        bench.run_ms(share * period)
        bench.chip.drive(*ESTOP, False)
        bench.run_ms((1.0 - share) * period)
    assert_latched(bench, Fault.ESTOP_INPUT)


@pytest.mark.slow
def test_an_input_that_is_open_for_a_fifth_of_the_time_is_noise(bench: Bench) -> None:
    set_moving(bench)
    for _ in range(40):
        bench.chip.drive(*ESTOP, True)
        bench.run_ms(1.0)
        bench.chip.drive(*ESTOP, False)
        bench.run_ms(2.0)
        bench.do(Command.PING)
        bench.run_ms(2.0)
    assert bench.status().state is State.ENABLED


@pytest.mark.parametrize("hold", [0, 1])
@pytest.mark.slow
def test_an_alarm_of_any_drive_stops_all_within_a_millisecond(bench: Bench, hold: int) -> None:
    rng, found = np.random.default_rng(5), []
    for alarm in ALARMS:
        set_moving(bench, Configure(hold_on_fault=hold), int(rng.integers(0, MS)))
        opened = bench.chip.cycles
        bench.chip.drive(*alarm, True)
        found.append(milliseconds_to_last_step(bench, opened))
        assert bench.drives_energised() == [bool(hold)] * 4
        assert Flag.ALARM in bench.status().flags
        bench.chip.drive(*alarm, False)
        assert_latched(bench, Fault.DRIVE)
        bench.do(Command.DISABLE)
        bench.run_ms(60)
    print(f"alarm input: last step {max(found):.2f} ms after it has opened, at most")
    assert max(found) < 1.05


def test_without_energised_drives_an_open_alarm_input_is_a_supply_that_is_off(bench: Bench) -> None:
    bench.chip.drive(*ALARMS[2], True)
    bench.run_ms(5)
    status = bench.status()
    assert status.state is State.DISABLED and status.faults is Fault(0) and Flag.ALARM in status.flags
    assert bench.ask(bench.enable)[0] is Result.ALARM
    assert bench.drives_energised() == [False] * 4
    bench.chip.drive(*ALARMS[2], False)
    bench.do(bench.enable)
    assert Flag.ALARM not in bench.status().flags


def test_every_start_has_a_number_of_its_own(bench: Bench) -> None:
    first = bench.do(Command.HELLO)
    assert first.reset_cause is Reset.POWER_ON
    for k in range(1, 4):
        bench.chip.reset()
        bench.run_ms(10)
        hello = bench.do(Command.HELLO)
        assert hello.boot_nonce == (first.boot_nonce + k) % 2**32
        assert Reset.WARM in hello.reset_cause and Reset.POWER_ON not in hello.reset_cause
        assert hello.connection == (hello.boot_nonce << 8) % 2**16


def test_drives_are_not_energised_under_settings_that_the_host_does_not_know_of(bench: Bench) -> None:
    ours = bench.enable
    for other in (Configure(acceleration=50_001), Limits((-5, -5, -5, -5), (5, 5, 5, 6))):
        bench.do(other)
        assert bench.ask(ours)[0] is Result.CONFIGURATION
        assert bench.drives_energised() == [False] * 4
        bench.do(Configure() if isinstance(other, Configure) else Limits())
    bench.do(ours)
