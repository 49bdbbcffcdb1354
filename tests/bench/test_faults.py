"""Faults of board and cable, one by one and together: the board stops by itself."""

from __future__ import annotations

from typing import get_args

import pytest

from tests.bench.conftest import TAUT, HostOn
from wristctl.board.board_errors import BoardError, Faulted, NoAnswer, PortLost, Restarted
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import Fault as Latched
from wristctl.config.bench import FAULTS, BenchSettings, FaultKind, InjectedFault

RATES = (0.0, 0.0, 500.0, 500.0)
WATCHDOG, RAMP = 0.1, 0.03


def settings(*faults: InjectedFault) -> BenchSettings:
    return BenchSettings(motors=TAUT, faults=faults)


def fail(host_on: HostOn, *faults: InjectedFault) -> tuple[BoardError, float, float]:
    """Turn until something goes wrong: the error, the time since the trial's start, and that of the last step."""
    host = host_on(settings(*faults))
    host.bench.begin(host.start)
    with pytest.raises(BoardError) as error:
        host.turn(RATES, 1.0)
    failed = host.bench.transport.now() - host.start
    host.bench.transport.wait(0.5)
    last = max(time for time in host.bench.motion().last_step if time is not None)
    assert not any(host.bench.motion().energised)
    return error.value, failed, last - host.start


def test_a_pulled_cable_is_noticed_at_once_and_the_boards_watchdog_stops_the_motors(host_on: HostOn) -> None:
    error, failed, last = fail(host_on, InjectedFault(kind="port-lost", at=0.3))
    assert isinstance(error, PortLost) and error.exit_code == 4
    assert 0.3 <= failed <= 0.31
    assert 0.3 < last < 0.3 + WATCHDOG + RAMP


def test_a_board_that_restarts_stops_at_once_and_is_found_out(host_on: HostOn) -> None:
    error, _, last = fail(host_on, InjectedFault(kind="board-reset", at=0.3))
    assert isinstance(error, Restarted | NoAnswer)
    assert 0.29 < last < 0.3001


def test_a_host_that_nobody_hears_is_stopped_by_the_watchdog(host_on: HostOn) -> None:
    error, _, last = fail(host_on, InjectedFault(kind="host-silent", at=0.3))
    assert isinstance(error, NoAnswer)
    assert 0.3 < last < 0.3 + WATCHDOG + RAMP


def test_a_host_heard_again_after_too_long_a_silence_finds_the_link_fault(host_on: HostOn) -> None:
    host = host_on(settings(InjectedFault(kind="host-silent", at=0.1, duration=0.2)))
    host.bench.begin(host.start)
    host.turn(RATES, 0.09)
    host.bench.transport.wait(0.3)
    with pytest.raises(Faulted) as error:
        host.turn(RATES, 0.01)
    assert error.value.faults == Latched.LINK


@pytest.mark.parametrize("other", ["board-reset", "host-silent"])
def test_of_two_faults_both_happen(host_on: HostOn, other: FaultKind) -> None:
    error, _, last = fail(host_on, InjectedFault(kind="port-lost", at=0.32), InjectedFault(kind=other, at=0.3))
    assert isinstance(error, PortLost | Restarted)
    assert last < (0.3001 if other == "board-reset" else 0.3 + WATCHDOG + RAMP)


def test_faults_count_from_the_start_of_the_trial(host_on: HostOn) -> None:
    host = host_on(settings(InjectedFault(kind="port-lost", at=0.0)))
    host.turn(RATES, 0.05)
    host.bench.begin(host.bench.transport.now() + 0.1)
    host.turn(RATES, 0.05)
    with pytest.raises(PortLost):
        host.turn(RATES, 0.1)


def test_every_kind_of_fault_is_explained_in_the_schema() -> None:
    said = InjectedFault.model_fields["kind"].description
    assert said is not None
    assert set(get_args(FaultKind)) == set(FAULTS)
    for kind in get_args(FaultKind):
        assert f"{kind}: {FAULTS[kind]}" in said
        assert InjectedFault(kind=kind).kind == kind


def test_a_reset_that_falls_due_between_two_cycles_of_the_clock_happens(host_on: HostOn) -> None:
    """The nearest cycle may lie before the moment that was asked for."""
    host = host_on(settings(InjectedFault(kind="board-reset", at=0.2)))
    starts = (host.start + k * 1e-3 for k in range(100))
    host.bench.begin(next(each for each in starts if round((each + 0.2) * FREQUENCY) < (each + 0.2) * FREQUENCY))
    with pytest.raises((Restarted, NoAnswer)):
        host.turn(RATES, 0.5)
