"""What stops the board, how fast, and what it takes to move again."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from tests.board.bench import MS, Bench
from tests.board.conftest import IMAGE
from wristctl.board.layout import LAYOUTS
from wristctl.board.messages import (
    ENABLE_KEY,
    ESTOP_SEQ,
    HEARTBEAT_MS,
    Command,
    Configure,
    Fault,
    Flag,
    Home,
    Jog,
    Rate,
    Result,
    State,
    Status,
    Target,
)

FAST = Rate((10_000.0, -10_000.0, 5_000.0, 0.0), 0.2)
RAMP_MS = 10_000 / 400_000 * 1000  # from 10,000 steps/s with the default stop acceleration
TIMER0_MASK = 0x6E
ESTOP = ("G", 0)


def set_moving(bench: Bench, configuration: Configure | None = None, odd_cycles: int = 0) -> None:
    bench.do(configuration or Configure())
    bench.get_ready()
    for _ in range(60):
        bench.do(FAST)
        bench.run_ms(6)
    bench.run(odd_cycles)
    bench.do(FAST)
    bench.look()


def milliseconds_to_last_step(bench: Bench, since: int) -> float:
    bench.run_ms(400)
    bench.look()
    return (bench.last_step() - since) / MS


def assert_latched(bench: Bench, fault: Fault) -> None:
    """Nothing moves and positions are not trusted until the fault is cleared and the axes are homed."""
    status = bench.status()
    assert (status.state, status.faults) == (State.FAULT, fault)
    assert Flag.HOMED not in status.flags
    steps = sum(drive.steps for drive in bench.drives)
    target = Target((10, 10, 10, 10), (100, 100, 100, 100))
    for refused in (bench.enable, FAST, target, Jog((5, 5, 5, 5)), Home((0, 0, 0, 0)), Configure()):
        assert bench.ask(refused)[0] is Result.FAULTED
    assert bench.do(Command.CLEAR).state is State.DISABLED
    assert bench.ask(target)[0] is Result.STATE
    bench.do(Configure())
    bench.do(bench.enable)
    assert bench.ask(target)[0] is Result.UNHOMED
    assert bench.ask(FAST)[0] is Result.UNHOMED
    bench.run_ms(50)
    assert sum(drive.steps for drive in bench.drives) == steps
    bench.get_ready()
    bench.do(Target(tuple(drive.position + 3 for drive in bench.drives), (100,) * 4))  # type: ignore[arg-type]
    bench.wait_for_rest()
    assert sum(drive.steps for drive in bench.drives) == steps + 12


@pytest.mark.parametrize("watchdog", [0.020, 0.100, 0.150])
def test_cut_link_ramps_down_after_the_watchdog_time_and_releases(bench: Bench, watchdog: float) -> None:
    set_moving(bench, Configure(watchdog=watchdog))
    _, _, last_byte = bench.send(FAST)
    to_last_step = milliseconds_to_last_step(bench, last_byte)
    assert watchdog * 1000 - 1 < to_last_step < watchdog * 1000 + RAMP_MS + 3
    assert bench.drives_energised() == [False] * 4
    assert_latched(bench, Fault.LINK)


def test_asking_for_status_does_not_keep_the_motors_alive(bench: Bench) -> None:
    set_moving(bench)
    for _ in range(40):
        bench.ask(Command.STATUS)
        bench.ask(Command.COUNTERS)
        bench.run_ms(5)
    assert bench.status().faults is Fault.LINK


def test_hold_on_fault_keeps_the_drives_on_until_disabled(bench: Bench) -> None:
    set_moving(bench, Configure(hold_on_fault=1))
    bench.run_ms(200)
    assert bench.status().state is State.FAULT
    assert bench.drives_energised() == [True] * 4
    assert bench.do(Command.DISABLE).state is State.FAULT
    assert bench.drives_energised() == [False] * 4


@pytest.mark.parametrize("hold", [0, 1])
@pytest.mark.slow
def test_emergency_stop_command_ends_stepping_within_a_millisecond(bench: Bench, hold: int) -> None:
    rng = np.random.default_rng(3)
    for seq in (ESTOP_SEQ, 77, 1, ESTOP_SEQ, 255):
        set_moving(bench, Configure(hold_on_fault=hold), int(rng.integers(0, MS)))
        _, _, last_byte = bench.send(Command.ESTOP, seq)
        assert milliseconds_to_last_step(bench, last_byte) < 1.0
        assert bench.drives_energised() == [False] * 4
        assert_latched(bench, Fault.ESTOP_COMMAND)
        bench.do(Command.DISABLE)
        bench.run_ms(60)


def test_emergency_stop_overtakes_the_commands_that_wait_before_it(bench: Bench) -> None:
    set_moving(bench)
    for _ in range(6):
        bench.send(FAST)
    _, _, last_byte = bench.send(Command.ESTOP, ESTOP_SEQ)
    assert milliseconds_to_last_step(bench, last_byte) < 0.1
    assert_latched(bench, Fault.ESTOP_COMMAND)


@pytest.mark.slow
def test_a_status_is_of_one_instant_also_where_a_stop_falls_into_its_making(bench: Bench) -> None:
    """The millisecond that latches the button comes at every moment of the answer's making, every 16 cycles of it."""
    bench.run(-bench.chip.cycles % MS)
    states = []
    for offset in range(0, MS, 16):
        bench.do(bench.enable)
        bench.run(-bench.chip.cycles % MS + MS // 2)
        bench.chip.drive(*ESTOP, True)
        bench.run(3 * MS - 7 * 640 - offset)
        bench.send(Command.STATUS)
        bench.run(4 * MS)
        ((_, _, payload),) = bench.frames()
        status = LAYOUTS[Status].unpack(Status, payload[1:])
        states.append(status.state)
        is_on = status.state is State.ENABLED
        assert (Flag.DRIVES_ON in status.flags, status.faults == Fault(0)) == (is_on, is_on), offset
        bench.chip.drive(*ESTOP, False)
        bench.run_ms(5)
        bench.do(Command.CLEAR)
    assert {State.ENABLED, State.FAULT} == set(states), "both sides of it were met"


@pytest.mark.slow
def test_no_axis_starts_again_when_a_stop_falls_into_the_working_out_of_its_rate(bench: Bench, rounds: int) -> None:
    rng = np.random.default_rng(7)
    for _ in range(20 + 10 * rounds):
        bench.get_ready()
        for _ in range(rng.integers(10, 20)):  # always accelerating, the main loop never idle
            bench.send(Rate(tuple(rng.uniform(-10_000, 10_000, 4))))
            bench.run(int(rng.integers(10_000, 20_000)))
        opened = bench.chip.cycles
        bench.chip.drive(*ESTOP, True)
        assert milliseconds_to_last_step(bench, opened) < 4.0
        bench.chip.drive(*ESTOP, False)
        bench.frames()
        bench.do(Command.CLEAR)


def flash() -> bytes:
    """Return the image's bytes from address 0 (a hex image below 64 KiB)."""
    out = b""
    for line in IMAGE.read_text().splitlines():
        record = bytes.fromhex(line[1:])
        if record[3] == 0:
            assert int.from_bytes(record[1:3], "big") == len(out)
            out += record[4:-1]
    return out


ENDLESS = flash().index(b"\xf8\x94\xff\xcf")  # `cli` and `rjmp` to itself: where a C program ends


def test_hung_main_loop_stops_stepping_within_10_ms(bench: Bench) -> None:
    set_moving(bench)
    hung = bench.chip.cycles
    was_at = bench.chip.jump(ENDLESS + 2)
    assert milliseconds_to_last_step(bench, hung) < HEARTBEAT_MS + 2 <= 10
    assert bench.drives_energised() == [False] * 4
    bench.chip.jump(was_at)
    bench.run_ms(5)
    assert_latched(bench, Fault.HANG)


def test_hang_with_interrupts_off_stops_stepping_at_once(bench: Bench) -> None:
    set_moving(bench)
    hung = bench.chip.cycles
    bench.chip.jump(ENDLESS)
    assert milliseconds_to_last_step(bench, hung) < 1.0


def test_dead_millisecond_interrupt_is_caught_by_the_chips_watchdog(bench: Bench) -> None:
    set_moving(bench)
    died = bench.chip.cycles
    bench.chip.poke(TIMER0_MASK, 0)
    assert milliseconds_to_last_step(bench, died) < 45
    assert bench.drives_energised() == [False] * 4
    status = bench.status()
    assert (status.state, status.faults) == (State.FAULT, Fault.WATCHDOG)


def test_reset_leaves_drives_off_and_shows_as_another_boot(bench: Bench) -> None:
    before = bench.do(Command.HELLO)
    set_moving(bench)
    bench.chip.reset()
    bench.run_ms(5)
    assert bench.ask(bench.enable)[0] is Result.CONNECTION, "of a connection before"
    bench.connect()
    after = bench.do(Command.HELLO)
    assert after.boot_nonce != before.boot_nonce and after.reset_cause & 0x80
    status = bench.status()
    assert status.state is State.DISABLED and Flag.HOMED not in status.flags
    assert bench.drives_energised() == [False] * 4


def test_disable_ramps_down_before_it_releases(bench: Bench) -> None:
    set_moving(bench)
    bench.do(Command.DISABLE)
    assert bench.drives_energised() == [True] * 4
    bench.run_ms(60)
    assert bench.status().state is State.DISABLED
    assert bench.drives_energised() == [False] * 4
    rises = bench.look()[0]
    assert len(rises) > 50 and all(b >= a - MS // 50 for a, b in pairwise(np.diff(rises)[-20:]))  # ever slower


def test_enable_is_refused_with_the_wrong_key_and_with_the_button_pressed(bench: Bench) -> None:
    assert bench.ask(bench.enable._replace(key=ENABLE_KEY ^ 1))[0] is Result.KEY
    bench.chip.drive(*ESTOP, True)
    bench.run_ms(5)
    assert bench.ask(bench.enable)[0] is Result.FAULTED
    assert Flag.ESTOP_OPEN in bench.status().flags
    assert bench.drives_energised() == [False] * 4
