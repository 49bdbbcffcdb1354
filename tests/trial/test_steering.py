"""Observer and law of one plane, tick by tick: what is believed when, and what the tendons are told."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.response import FULL
from wristctl.control.table import controller, gains_of
from wristctl.trial.rig_belief import RigBelief
from wristctl.trial.steering import REMEMBERED, Answer, Steering

WRIST, PERIOD = WristParameters(), 5e-3
LAW = controller("feedforward")
BELIEF = RigBelief(WRIST, Actuator(level="tendon"), ("ulnar",))


def steering() -> Steering:
    made = Steering(BELIEF, Sensor(level="camera"), PERIOD)
    made.use(LAW, ())
    return made


def reeled(tension: float, theta: float = 0.0) -> np.ndarray:
    """What the sides' spools hold where each tendon pulls like that on a wrist held at this angle."""
    return BELIEF.at_places(BELIEF.taut((theta,))[0]) + tension / Actuator().tendon_stiffness


def go_on(steered: Steering, ticks: int) -> None:
    for _ in range(ticks):
        steered.predict(reeled(10.0))


def test_it_begins_straight_and_at_rest() -> None:
    assert steering().estimate == (0.0, 0.0, 0.0) and steering().tick == 0


def test_held_alike_on_both_sides_it_stays_straight_and_counts_its_ticks() -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.tick == 40 and steered.estimate.theta == pytest.approx(0.0, abs=1e-9)


def test_it_bends_toward_the_side_that_is_reeled_in() -> None:
    for sign in (1.0, -1.0):
        steered = steering()
        for _ in range(100):
            steered.predict(reeled(10.0) + 5e-4 * sign * np.array([1.0, -1.0]))
        assert sign * steered.estimate.theta > 0.02


def test_an_angle_seen_is_believed_and_one_from_the_past_moves_the_present() -> None:
    for captured in (0.1995, 0.15):
        steered = steering()
        go_on(steered, 40)
        assert steered.see(0, 0.05, captured)
        assert 0.005 < steered.estimate.theta <= 0.06
    again = steering()
    go_on(again, 40)
    for _ in range(30):
        assert again.see(0, 0.05, 0.2)
    assert again.estimate.theta == pytest.approx(0.05, abs=0.01), "seen often enough"


def test_an_angle_is_compared_with_what_was_believed_when_it_was_taken() -> None:
    """Seen late, the angle of that time changes nothing, and the present one, of a wrist that moved on, does."""
    changes = []
    for seen_at in (30, 60):
        steered, course = steering(), []
        for _ in range(60):
            course.append(float(steered.estimate.theta[0]))
            steered.predict(reeled(10.0) + 5e-4 * np.array([1.0, -1.0]))
        before = float(steered.estimate.theta[0])
        assert steered.see(0, [*course, before][seen_at], 30 * PERIOD + 1e-9)
        changes.append(abs(float(steered.estimate.theta[0]) - before))
    assert changes[0] < 1e-6 < 1e-5 < changes[1]


@pytest.mark.parametrize(
    ("captured", "taken"),
    [(0.0, True), (-0.001, False), (39.0 * PERIOD, True), (40.999 * PERIOD, True), (41.001 * PERIOD, False)],
)
def test_angles_from_before_the_beginning_or_yet_to_come_are_refused(captured: float, taken: bool) -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.see(0, 0.05, captured) == taken
    assert (steered.estimate.theta[0] != pytest.approx(0.0, abs=1e-9)) == taken


@pytest.mark.parametrize(("late", "taken"), [(REMEMBERED - 1, True), (REMEMBERED, False)])
def test_a_frame_may_be_so_many_ticks_late_and_no_more(late: int, taken: bool) -> None:
    steered = steering()
    go_on(steered, 300)
    assert steered.see(0, 0.05, (300 - late + 0.5) * PERIOD) == taken


def test_an_older_frame_than_the_last_one_used_is_refused() -> None:
    steered = steering()
    go_on(steered, 40)
    assert steered.see(0, 0.01, 30.5 * PERIOD) and not steered.see(0, 0.01, 29.5 * PERIOD)


def sides(answer: Answer) -> np.ndarray:
    """Tension of one tendon of the + and of the - side (2,): of tendons 4 and 5, and of 1 and 2."""
    assert answer.tension[0] == answer.tension[1] and answer.tension[2] == answer.tension[3]
    return answer.tension[[2, 0]]


def still(angle: float) -> np.ndarray:
    return np.array([[[angle, 0.0, 0.0]]])


def test_feedforward_asks_for_the_torque_that_holds_the_reference() -> None:
    answer = steering().respond(still(0.1))
    mirrored = steering().respond(still(-0.1))
    assert answer.torque_wanted == pytest.approx(-mirrored.torque_wanted) and answer.torque_wanted > 0.0
    assert sides(answer) == pytest.approx(sides(mirrored)[::-1])
    assert answer.torque == pytest.approx(answer.torque_wanted) and answer.share >= FULL
    assert answer.torque == pytest.approx(2.0 * WRIST.tendon_offset * np.subtract(*sides(answer)), rel=1e-3)
    assert answer.tension.min() >= WRIST.pretension - 1e-9


def test_at_rest_each_tendon_keeps_its_pretension() -> None:
    answer = steering().respond(still(0.0))
    assert np.hstack([answer.torque_wanted, answer.torque]) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert answer.tension == pytest.approx([WRIST.pretension] * 4)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_out_of_reach_is_cut_at_the_limits_and_said(sign: float) -> None:
    answer = steering().respond(still(sign * 10.0))
    assert answer.share < FULL and abs(answer.torque) < abs(answer.torque_wanted)
    pulled, slack = sides(answer)[:: int(sign)]
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
    again = steered.respond(still(1e-6))
    assert np.array_equal(np.hstack(again), np.hstack(first))


def test_the_law_is_told_what_the_motors_withhold_until_it_is_taken_up_again() -> None:
    steered, toward = steering(), np.array([[[0.1, 0.0, 0.0]]])
    law = controller("pid")
    gains, wanted = law.values({"Kp": 1.0, "Ki": 10.0, "Kd": 0.1}), []
    for withheld in (0.0, 0.3, -0.3):
        steered.use(law, gains)
        steered.withheld = np.array([withheld])
        wanted.append([steered.respond(toward).torque_wanted for _ in range(3)][-1])
    assert wanted[0] == wanted[2] > wanted[1], "an integral does not push on what is behind"
    steered.withheld = np.array([0.3])
    steered.use(law, gains)
    assert steered.withheld == 0.0
