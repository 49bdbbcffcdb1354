"""A rig of servos on the emulated bus: settings that hold, limits that are kept, and what it says of faults."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.servos.bus_of import other, passed, rehearsed
from wristctl.errors import UserError
from wristctl.rig import Fault, Lost, Refused, Rig
from wristctl.servos.emulated import Emulated
from wristctl.servos.emulated_servo import OVERHEATING, OVERLOAD, EmulatedServo
from wristctl.servos.servo_bench import SETTINGS, ServoBench
from wristctl.servos.servo_settings import Servo
from wristctl.servos.servo_wrist import FREE, PLACE
from wristctl.servos.x_series import (
    BUS_WATCHDOG,
    COUNTS,
    CURRENT_LIMIT,
    GOAL_CURRENT,
    GOAL_POSITION,
    HARDWARE_ERROR,
    MODEL_NUMBER,
    OPERATING_MODE,
    PROFILE_VELOCITY,
    REALTIME_TICK,
    RETURN_DELAY,
    Item,
)


def kept(servo: EmulatedServo, item: Item) -> int:
    return item.decoded(servo.read(item.address, item.size))


def test_servos_stand_where_they_stood_with_their_limits_set() -> None:
    rig, servos = rehearsed()
    before = [servo.place for servo in servos.servos]
    stood = rig.connect()
    assert isinstance(rig, Rig) and stood == pytest.approx(before, abs=0.51)
    for servo in servos.servos:
        current = kept(servo, GOAL_CURRENT)
        assert current == kept(servo, CURRENT_LIMIT) == math.floor(SETTINGS.current / 2.69e-3)
        assert current * 2.69e-3 * SETTINGS.torque_constant / SETTINGS.spool_radius <= SETTINGS.tension
        assert kept(servo, OPERATING_MODE) == 5 and kept(servo, RETURN_DELAY) == 0
        assert kept(servo, BUS_WATCHDOG) == 10 and servo.torque
        assert kept(servo, PROFILE_VELOCITY) * 0.229 * math.tau / 60.0 * SETTINGS.spool_radius <= SETTINGS.rate
    passed(rig, 0.3, stood)
    assert [servo.place for servo in servos.servos] == pytest.approx(before, abs=1.0)
    rig.close()
    assert not any(servo.torque for servo in servos.servos)


def test_a_larger_target_reels_in_whatever_the_sense_and_the_turns() -> None:
    senses = [Servo(one.id, one.tendon, sense) for one, sense in zip(SETTINGS.servos, (1, -1, 1), strict=True)]
    rig, servos = rehearsed(settings=other(servos=senses), turns=(5, -7, 250))
    stood = rig.connect()
    assert stood[0] > 4 * COUNTS and stood[1] > 5 * COUNTS and stood[2] > 249 * COUNTS
    for k in range(3):
        begin, targets = servos.wrist.values[:, PLACE].copy(), stood.copy()
        targets[k] += 100.4
        assert rig.send(targets)[k] == round(targets[k])
        passed(rig, 0.3, targets)
        reeled = servos.wrist.values[:, PLACE] - begin
        assert reeled[k] == pytest.approx(100 * SETTINGS.metres_per_count, rel=0.02)
        passed(rig, 0.3, stood)


@pytest.mark.parametrize(
    ("turns", "named"), [((0, 256), r"servo 2 stands 25[67]"), ((0, 0, -257), r"servo 3 .* -25[67]")]
)
def test_a_servo_that_stands_too_many_turns_away_is_named(turns: tuple[int, ...], named: str) -> None:
    rig, _ = rehearsed(turns=turns)
    with pytest.raises(Fault, match=f"{named} turns"):
        rig.connect()


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, -2000.0, 2000.0])
def test_targets_beyond_the_travel_are_refused_and_nothing_is_sent(wrong: float) -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    goals = [kept(servo, GOAL_POSITION) for servo in servos.servos]
    with pytest.raises(Refused):
        rig.send(np.array([stood[0], stood[1], stood[2] + wrong]))
    assert [kept(servo, GOAL_POSITION) for servo in servos.servos] == goals


def test_a_servo_pulls_no_more_than_its_limit_where_the_wrist_is_held() -> None:
    rig, servos = rehearsed(settings=other(tension=25.0))
    stood = rig.connect()
    with pytest.raises(Fault, match=r"stall: servo \d \(tendon \d\) stands .* pulls as hard as it may"):
        for counts in range(0, 1000, 2):  # slowly, all three against each other
            passed(rig, 0.01, stood + counts)
    assert 20.0 < servos.largest_pull < 1.1 * 25.0
    tension = rig.look().tension
    assert tension is not None and np.asarray(tension).max() <= 25.0


@pytest.mark.parametrize("pulled", [0, 1, 2])
@pytest.mark.parametrize(("senses", "model"), [((1, 1, 1), 1030), ((1, -1, -1), 1010)])
def test_tension_is_that_of_the_currents_within_the_gears_friction(
    senses: tuple[int, int, int], model: int, pulled: int
) -> None:
    """Whichever servo pulls, in either sense, and where the last servo is of a model with another unit of current."""
    winding = [Servo(one.id, one.tendon, sense) for one, sense in zip(SETTINGS.servos, senses, strict=True)]
    rig, servos = rehearsed(settings=other(servos=winding))
    servos.servos[2]._model = model
    servos.servos[2]._put(MODEL_NUMBER, model)
    stood = rig.connect()
    passed(rig, 1.0, stood + 180.0 * np.eye(3)[pulled])
    tension = rig.look().tension
    friction = 0.015 / SETTINGS.spool_radius
    assert servos.wrist.pull[pulled] > 5.0 and tension == pytest.approx(servos.wrist.pull, abs=friction + 0.7)


def test_a_setting_that_a_servo_does_not_take_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, servos = rehearsed()
    write = EmulatedServo.write

    def stubborn(servo: EmulatedServo, address: int, data: bytes) -> int:
        return 0 if (servo.number, address) == (3, GOAL_CURRENT.address) else write(servo, address, data)

    monkeypatch.setattr(EmulatedServo, "write", stubborn)
    with pytest.raises(Fault, match=r"servo 3 takes 1193 as Goal Current \(102\) where 91 is written"):
        rig.connect()
    assert not any(servo.torque for servo in servos.servos)


def test_a_model_that_limits_no_current_is_refused() -> None:
    rig, servos = rehearsed()
    servos.servos[1]._put(Item(0, 2), 1060)
    with pytest.raises(Fault, match="servo 2, model 1060, limits no current"):
        rig.connect()


@pytest.mark.parametrize(
    ("fault", "kind", "words"),
    [
        ("id-missing", Lost, "no servo answers as id 2 on the emulated bus; there are 1, 3, 57"),
        ("id-doubled", Lost, "answers of id 2 collide: two servos"),
    ],
)
def test_a_wrong_id_is_named_before_anything_holds(fault: str, kind: type[Exception], words: str) -> None:
    rig, servos = rehearsed(fault)
    with pytest.raises(kind, match=words):
        rig.connect()
    assert not any(servo.torque for servo in servos.servos)


def test_no_servo_at_all_is_a_matter_of_power() -> None:
    rig, servos = rehearsed()
    for servo in servos.servos:
        servo.power_off()
    with pytest.raises(Lost, match=r"no servo answers on the emulated bus at 1000000 baud"):
        rig.connect()


def test_a_slow_bus_is_refused_before_anything_holds() -> None:
    rig, servos = rehearsed(settings=other(baud=57600))
    with pytest.raises(Fault, match=r"slow bus: an exchange takes \d+ ms of a tick"):
        rig.connect()
    assert not any(servo.torque for servo in servos.servos)


def test_an_adapter_that_holds_answers_back_is_refused() -> None:
    rig, servos = rehearsed()
    servos._latency = 16e-3
    with pytest.raises(Fault, match=r"slow bus: an exchange takes 1\d ms"):
        rig.connect()


def test_old_firmware_that_knows_no_fast_read_is_read_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, servos = rehearsed()
    answers = servos._all_answer

    def old(instruction: int, *rest: Any) -> Any:
        return [] if instruction == 0x8A else answers(instruction, *rest)

    monkeypatch.setattr(servos, "_all_answer", old)
    stood = rig.connect()
    passed(rig, 0.5, stood + np.array([0.0, 50.0, 0.0]))
    assert servos.servos[1].place - stood[1] == pytest.approx(50.0, abs=1.0) and rig.missed == 0


@pytest.mark.parametrize(
    ("error", "name"), [(OVERLOAD, "overload"), (OVERHEATING, "overheating"), (1, "input voltage")]
)
def test_a_servo_that_shuts_down_is_named_at_the_next_tick_and_revived_by_the_next_connection(
    error: int, name: str
) -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    passed(rig, 0.1, stood)
    servos.servos[2].shut_down(error)
    with pytest.raises(Fault, match=rf"{name}: servo 3 \(tendon 3\) has shut down"):
        rig.send(stood)
    rig.stop()
    assert servos.servos[0].torque and not servos.servos[2].torque
    again = rig.connect()
    assert kept(servos.servos[2], HARDWARE_ERROR) == 0 and servos.servos[2].torque
    passed(rig, 0.1, again)


def test_an_error_that_a_reboot_does_not_clear_is_named() -> None:
    rig, servos = rehearsed()
    servos.servos[0].temperature = 90.0
    servos.clock.wait_until(0.1)
    with pytest.raises(Fault, match="overheating: servo 1 reports it after its reboot too"):
        rig.connect()


def test_a_stuck_servo_overloads_in_the_end_though_its_current_is_limited() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    servos.wrist.values[0, FREE] = 0.0
    bus = rig._bus
    assert bus is not None
    for _ in range(300):
        bus.follow([int(stood[0]) + 1000, int(stood[1]), int(stood[2])])
        rig.clock.wait_until(rig.clock.now() + 0.01)
    assert kept(servos.servos[0], HARDWARE_ERROR) == OVERLOAD and not servos.servos[0].torque


def test_a_servo_whose_power_was_away_is_named() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    servos.servos[1]._wake(rig.clock.now())
    with pytest.raises(Fault, match=r"restart: servo 2 \(tendon 2\)"):
        rig.send(stood)


def test_servos_stop_by_themselves_where_they_hear_nothing() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    rig.send(stood + np.array([1500.0, 0.0, 0.0]))
    rig.clock.wait_until(rig.clock.now() + 0.15)
    assert servos.wrist.values[0, 1] > 0.01  # on its way
    rig.clock.wait_until(rig.clock.now() + 0.4)
    assert abs(servos.wrist.values[0, 1]) < 1e-3 and kept(servos.servos[0], BUS_WATCHDOG) == -1
    place = servos.servos[0].place
    with pytest.raises(Fault, match="silence: servo 1"):
        rig.send(stood + np.array([1500.0, 0.0, 0.0]))
    rig.clock.wait_until(rig.clock.now() + 0.2)
    assert servos.servos[0].place == pytest.approx(place, abs=2.0)
    rig.connect()
    assert kept(servos.servos[0], BUS_WATCHDOG) == 10


def test_a_stop_holds_the_servos_where_they_are_and_they_can_go_on() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    rig.send(stood + np.array([1500.0, 0.0, 0.0]))
    rig.clock.wait_until(rig.clock.now() + 0.05)
    place = servos.servos[0].place
    rig.stop()
    rig.clock.wait_until(rig.clock.now() + 0.15)
    assert abs(servos.servos[0].place - place) < 0.1 * (stood[0] + 1500 - place)
    assert abs(servos.wrist.values[0, 1]) < 5e-3 and servos.servos[0].torque
    rig.stop()
    passed(rig, 0.6, stood)
    assert servos.servos[0].place == pytest.approx(stood[0], abs=2.0)


def test_a_stop_lets_go_of_a_servo_that_says_the_same_position_for_ever_and_never_sends_it_there() -> None:
    """Should the packet that lets go be lost too, the servo stays at its goal."""
    rig, servos = rehearsed("stale-position")
    stood = rig.connect()
    away = stood + np.array([300.0, 700.0, 0.0])
    with pytest.raises(Fault, match="stall: servo 2"):
        passed(rig, 2.0, away)
    rig.stop()
    rig.clock.wait_until(rig.clock.now() + 0.05)
    assert [servo.torque for servo in servos.servos] == [1, 0, 1]
    goals = [kept(servo, GOAL_POSITION) for servo in servos.servos]
    assert goals[1] == SETTINGS.servos[1].sense * away[1]
    assert goals[0] == pytest.approx(servos.servos[0].place, abs=10.0)


def test_a_lost_answer_now_and_then_is_counted_and_survived() -> None:
    rig, _ = rehearsed("packet-lost", seed=3)
    stood = rig.connect()
    passed(rig, 6.0, stood)
    assert 3 <= rig.missed <= 25


def test_an_answer_to_an_earlier_question_counts_as_lost() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    passed(rig, 0.5, stood)
    old = servos.servos[1].read(REALTIME_TICK.address, 2)
    read = servos.servos[1].read

    def replayed(address: int, size: int) -> bytes:
        data = bytearray(read(address, size))
        if size == 14:
            data[6:8] = old
        return bytes(data)

    servos.servos[1].read = replayed  # type: ignore[method-assign]
    with pytest.raises(Lost, match="answers on the emulated bus are old"):
        passed(rig, 1.0, stood)


@pytest.mark.slow
def test_clocks_of_servos_that_run_slowly_are_no_old_answers() -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    for servo in servos.servos:
        drive = servo.drive

        def slow(time: float, force: float, servo: EmulatedServo = servo, drive: Any = drive) -> None:
            drive(time, force)
            servo._put(REALTIME_TICK, round(990.0 * time) % 32768)

        servo.drive = slow  # type: ignore[method-assign]
    servos.clock.wait_until(servos.clock.now() + 0.002)
    rig._watch._least = None
    passed(rig, 35.0, stood, period=0.15)  # beyond a turn of their clocks
    assert rig.missed == 0


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.lists(st.integers(-300, 300), min_size=3, max_size=3))
def test_sent_targets_are_whole_counts_and_are_reached_by_slack_servos(offsets: list[int]) -> None:
    rig, servos = rehearsed()
    stood = rig.connect()
    slack = np.minimum(np.array(offsets), 25) + 0.3
    sent = rig.send(stood + slack)
    passed(rig, 0.5, stood + slack)
    assert (sent == np.rint(stood + slack)).all()
    assert [servo.place for servo in servos.servos[:3]] == pytest.approx(sent, abs=1.5)


def test_the_bench_and_its_class_have_the_facts_of_the_settings() -> None:
    assert ServoBench.facts == SETTINGS.facts == ServoBench().facts
    facts = SETTINGS.facts
    assert facts.metres_per_unit == pytest.approx(2.0 * math.pi * 8e-3 / 4096) and facts.silence == pytest.approx(0.2)


def test_a_fault_that_there_is_not_is_named() -> None:
    with pytest.raises(UserError, match=r"no fault 'stuck'"):
        Emulated("stuck")


def test_without_the_makers_library_it_is_said_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dynamixel_sdk", None)
    with pytest.raises(UserError, match="dynamixel-sdk is not installed") as error:
        rehearsed()[0].connect()
    assert "wristctl[servos]" in str(error.value.fix)
