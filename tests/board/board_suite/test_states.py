"""The board's states under any order of commands, against a model of what may follow what."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from hypothesis.strategies import integers, sampled_from

from tests.board.bench import Bench
from tests.board.conftest import new_chip
from wristctl.board.messages import (
    ENABLE_KEY,
    Command,
    Configure,
    Fault,
    Flag,
    Home,
    Jog,
    Limits,
    Rate,
    Result,
    State,
    Status,
    Target,
)

FAR = (10**6,) * 4


class BoardStates(RuleBasedStateMachine):
    """Drives a board with random commands, button presses and silences. The model holds state, faults and homed."""

    emulator = "simavr"

    @initialize()
    def power_on(self) -> None:
        self.bench = Bench(new_chip(self.emulator))
        self.state, self.faults, self.homed, self.open = State.DISABLED, Fault(0), False, False
        self.origins = [0, 0, 0, 0]

    def teardown(self) -> None:
        self.bench.assert_drives_content()
        self.bench.chip.close()

    def ask(self, message: Command | tuple[Any, ...]) -> tuple[Result, Status]:
        """Ask with the link just fed, so that only silence() lets it run dry."""
        self.bench.do(Command.PING)
        return self.bench.ask(message)

    def expected_refusal(self, *, enabled: bool, homed: bool | None = None) -> Result | None:
        if self.state is State.FAULT:
            return Result.FAULTED
        if (self.state is State.ENABLED) is not enabled:
            return Result.STATE
        if homed is not None and homed is not self.homed:
            return Result.UNHOMED if homed else Result.STATE
        return None

    def ask_or_be_refused(self, message: tuple[Any, ...], refusal: Result | None) -> Result:
        result, _ = self.ask(message)
        if refusal is not None:
            assert result is refusal
        return result

    def latch(self, fault: Fault) -> None:
        self.state, self.faults, self.homed = State.FAULT, self.faults | fault, False

    @rule()
    def enable(self) -> None:
        result, _ = self.ask(self.bench.enable)
        assert result is (Result.FAULTED if self.state is State.FAULT else Result.OK)
        if result is Result.OK:
            self.state = State.ENABLED

    @rule(key=integers(0, 2**32 - 1).filter(lambda key: key != ENABLE_KEY))
    def enable_with_a_wrong_key(self, key: int) -> None:
        result, _ = self.ask(self.bench.enable._replace(key=key))
        assert result is (Result.FAULTED if self.state is State.FAULT else Result.KEY)

    @rule()
    def disable(self) -> None:
        assert self.ask(Command.DISABLE)[0] is Result.OK
        self.bench.run_ms(60)
        self.homed = False
        if self.state is State.ENABLED:
            self.state = State.DISABLED

    @rule()
    def emergency_stop(self) -> None:
        assert self.ask(Command.ESTOP)[0] is Result.OK
        self.latch(Fault.ESTOP_COMMAND)

    @rule()
    def press_the_button(self) -> None:
        self.bench.chip.drive("G", 0, True)
        self.bench.run_ms(4)
        self.open = True
        self.latch(Fault.ESTOP_INPUT)

    @rule()
    def release_the_button(self) -> None:
        self.bench.chip.drive("G", 0, False)
        self.bench.run_ms(2)
        self.open = False

    @rule()
    def clear(self) -> None:
        result, _ = self.ask(Command.CLEAR)
        if self.state is State.ENABLED:
            assert result is Result.STATE
        elif self.open:
            assert result is Result.ESTOP_OPEN
        else:
            assert result is Result.OK
            self.state, self.faults = State.DISABLED, Fault(0)

    @rule(rate=sampled_from([0.0, 50.0, -3_000.0, 10_000.0]))
    def turn(self, rate: float) -> None:
        refusal = self.expected_refusal(enabled=True, homed=True)
        assert self.ask_or_be_refused(Rate((rate, -rate, 0.0, rate / 2)), refusal) in (refusal, Result.OK)

    @rule(position=integers(-3_000, 3_000))
    def go_to(self, position: int) -> None:
        refusal = self.expected_refusal(enabled=True, homed=True)
        self.ask_or_be_refused(Target((position, 0, -position, 7), (9_000, 1, 9_000, 200)), refusal)

    @rule(position=integers(-3_000, 3_000))
    def jog(self, position: int) -> None:
        self.ask_or_be_refused(Jog((position,) * 4), self.expected_refusal(enabled=True, homed=False))

    @rule()
    def stop_and_wait(self) -> None:
        result, _ = self.ask(Command.STOP)
        assert result is (self.expected_refusal(enabled=True) or Result.OK)
        if self.state is State.ENABLED:
            status = self.bench.wait_for_rest()
            at = zip(self.bench.drives, self.origins, strict=True)
            assert status.position == tuple(drive.position + origin for drive, origin in at)

    @rule(position=integers(-100, 100))
    def home(self, position: int) -> None:
        refusal = self.expected_refusal(enabled=True)
        moving = Flag.MOVING in self.bench.status().flags
        result = self.ask_or_be_refused(Home((position,) * 4), refusal)
        if refusal is None and not moving:
            assert result is Result.OK
        if result is Result.OK:
            self.homed = True
            self.origins = [position - drive.position for drive in self.bench.drives]

    @rule(watchdog=sampled_from([0.05, 0.1, 0.2]), hold=integers(0, 1))
    def configure(self, watchdog: float, hold: int) -> None:
        refusal = self.expected_refusal(enabled=False)
        message = Configure(watchdog, hold)
        assert self.ask(message)[0] is (refusal or Result.OK)
        if refusal is None:
            self.bench.heed(message)

    @rule()
    def limit(self) -> None:
        refusal = self.expected_refusal(enabled=False)
        message = Limits(tuple(-n for n in FAR), FAR)  # type: ignore[arg-type]
        assert self.ask(message)[0] is (refusal or Result.OK)
        if refusal is None:
            self.bench.heed(message)

    @rule(seed=integers(0, 2**32 - 1))
    def noise(self, seed: int) -> None:
        self.bench.chip.write(random.Random(seed).randbytes(30) + b"\0")

    @precondition(lambda self: self.state is State.ENABLED)
    @rule()
    def silence(self) -> None:
        self.bench.run_ms(300)
        self.latch(Fault.LINK)

    @invariant()
    def the_board_is_as_the_model_says(self) -> None:
        self.bench.do(Command.PING)
        status = self.bench.status()
        assert (status.state, status.faults) == (self.state, self.faults)
        assert (Flag.HOMED in status.flags) is self.homed
        assert (Flag.ESTOP_OPEN in status.flags) is self.open
        assert self.state is not State.DISABLED or self.bench.drives_energised() == [False] * 4
        if self.state is State.ENABLED:
            assert self.bench.drives_energised() == [True] * 4


@pytest.mark.slow
def test_no_order_of_commands_leads_to_an_illegal_transition(emulator: str, rounds: int) -> None:
    machine = type("Machine", (BoardStates,), {"emulator": emulator})
    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=20 * rounds,
            stateful_step_count=25,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
