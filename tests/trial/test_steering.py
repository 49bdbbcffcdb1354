"""Observer and law of one plane, tick by tick: what is believed when, and what the tendons are told."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.trial.spools import Paths
from wristctl.trial.steering import REMEMBERED, Steering

WRIST, PERIOD = WristParameters(), 5e-3
LAW = controller("feedforward")


def steering(theta: float = 0.0) -> Steering:
    made = Steering(WRIST, Actuator(level="tendon"), Sensor(level="camera"), PERIOD, theta)
    made.use(LAW, ())
    return made


def reeled(tension: float, theta: float = 0.0) -> tuple[float, float]:
    """What the sides' spools hold where each tendon pulls like that on a wrist held at this angle."""
    paths = Paths(WRIST, "ulnar")
    plus, minus = paths.sides(paths.taut(theta)[0])
    return plus + tension / Actuator().tendon_stiffness, minus + tension / Actuator().tendon_stiffness


def go_on(steered: Steering, ticks: int) -> None:
    for _ in range(ticks):
        steered.predict(*reeled(10.0))


def test_it_begins_at_rest_at_the_angle_that_it_is_given() -> None:
    assert steering(0.2).estimate == (0.2, 0.0, 0.0) and steering().tick == 0


def test_held_alike_on_both_sides_it_stays_straight_and_counts_its_ticks() -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.tick == 40 and steered.estimate.theta == pytest.approx(0.0, abs=1e-9)


def test_it_bends_toward_the_side_that_is_reeled_in() -> None:
    for sign in (1.0, -1.0):
        steered = steering()
        for _ in range(100):
            plus, minus = reeled(10.0)
            steered.predict(plus + 5e-4 * sign, minus - 5e-4 * sign)
        assert sign * steered.estimate.theta > 0.02


def test_an_angle_seen_is_believed_and_one_from_the_past_moves_the_present() -> None:
    for captured in (0.1995, 0.15):
        steered = steering()
        go_on(steered, 40)
        assert steered.see(0.05, captured)
        assert 0.005 < steered.estimate.theta <= 0.06
    again = steering()
    go_on(again, 40)
    for _ in range(30):
        assert again.see(0.05, 0.2)
    assert again.estimate.theta == pytest.approx(0.05, abs=0.01), "seen often enough"


def test_an_angle_is_compared_with_what_was_believed_when_it_was_taken() -> None:
    """Seen late, the angle of that time changes nothing, and the present one, of a wrist that moved on, does."""
    changes = []
    for seen_at in (30, 60):
        steered, course = steering(), []
        for _ in range(60):
            course.append(steered.estimate.theta)
            plus, minus = reeled(10.0)
            steered.predict(plus + 5e-4, minus - 5e-4)
        before = steered.estimate.theta
        assert steered.see([*course, before][seen_at], 30 * PERIOD + 1e-9)
        changes.append(abs(steered.estimate.theta - before))
    assert changes[0] < 1e-6 < 1e-5 < changes[1]


@pytest.mark.parametrize(
    ("captured", "taken"),
    [(0.0, True), (-0.001, False), (39.0 * PERIOD, True), (40.999 * PERIOD, True), (41.001 * PERIOD, False)],
)
def test_angles_from_before_the_beginning_or_yet_to_come_are_refused(captured: float, taken: bool) -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.see(0.05, captured) == taken
    assert (steered.estimate.theta != pytest.approx(0.0, abs=1e-9)) == taken


@pytest.mark.parametrize(("late", "taken"), [(REMEMBERED - 1, True), (REMEMBERED, False)])
def test_a_frame_may_be_so_many_ticks_late_and_no_more(late: int, taken: bool) -> None:
    steered = steering()
    go_on(steered, 300)
    assert steered.see(0.05, (300 - late + 0.5) * PERIOD) == taken


def test_an_older_frame_than_the_last_one_used_is_refused() -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.see(0.01, 30.5 * PERIOD) and not steered.see(0.01, 29.5 * PERIOD)


def still(angle: float) -> np.ndarray:
    return np.array([[angle, 0.0, 0.0]])


def test_feedforward_asks_for_the_torque_that_holds_the_reference() -> None:
    answer = steering().respond(still(0.1))
    mirrored = steering().respond(still(-0.1))
    assert answer.torque_wanted == pytest.approx(-mirrored.torque_wanted) and answer.torque_wanted > 0.0
    assert (answer.plus, answer.minus) == pytest.approx((mirrored.minus, mirrored.plus))
    assert answer.torque == pytest.approx(answer.torque_wanted) and not answer.saturated
    assert answer.torque == pytest.approx(2.0 * WRIST.tendon_offset * (answer.plus - answer.minus), rel=1e-3)
    assert answer.minus >= WRIST.pretension - 1e-9


def test_at_rest_each_tendon_keeps_its_pretension() -> None:
    answer = steering().respond(still(0.0))
    assert (answer.torque_wanted, answer.torque) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert (answer.plus, answer.minus) == pytest.approx((WRIST.pretension, WRIST.pretension))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_out_of_reach_is_cut_at_the_limits_and_said(sign: float) -> None:
    answer = steering().respond(still(sign * 10.0))
    assert answer.saturated and abs(answer.torque) < abs(answer.torque_wanted)
    pulled, slack = (answer.plus, answer.minus) if sign > 0.0 else (answer.minus, answer.plus)
    assert pulled == pytest.approx(WRIST.tension_limit) and slack == pytest.approx(WRIST.pretension)


def test_a_law_taken_up_again_has_forgotten_what_it_did() -> None:
    law = controller("pid")
    gains = gains_of(law, "printed", None)
    steered = steering()
    steered.use(law, gains)
    first = steered.respond(still(1e-6))
    later = [steered.respond(still(1e-6)) for _ in range(20)][-1]
    steered.use(law, gains)
    assert later.torque_wanted != pytest.approx(first.torque_wanted, rel=1e-6)
    assert steered.respond(still(1e-6)) == first


def test_the_law_is_told_what_the_motors_withhold_until_it_is_taken_up_again() -> None:
    steered, toward = steering(), np.array([[0.1, 0.0, 0.0]])
    law = controller("pid")
    gains, wanted = law.values({"Kp": 1.0, "Ki": 10.0, "Kd": 0.1}), []
    for withheld in (0.0, 0.3, -0.3):
        steered.use(law, gains)
        steered.withheld = withheld
        wanted.append([steered.respond(toward).torque_wanted for _ in range(3)][-1])
    assert wanted[0] == wanted[2] > wanted[1], "an integral does not push on what is behind"
    steered.withheld = 0.3
    steered.use(law, gains)
    assert steered.withheld == 0.0
