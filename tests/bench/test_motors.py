"""Motors without inertia and tendons by the board's pins alone: edges in, reeled lengths and pulls out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.motors import spool_state_of, stepper_of
from wristctl.board.emulator.atmega2560 import EDGE
from wristctl.config.bench import BenchSettings, Motors, StepperActuator, WeakenedPlant
from wristctl.config.plant import Disturbances, Push
from wristctl.config.wrist import WristParameters
from wristctl.wrist.out_of_plane import across_of

WRIST = WristParameters()
MS = 16_000
"""Cycles of a millisecond."""
TAUT = (0.0, 0.0, 0.0, 0.0)
STEP = BenchSettings().actuator.step_length
STIFFNESS = BenchSettings().actuator.tendon_stiffness
RADIUS = BenchSettings().actuator.pulley_radius


class Pins:
    """A wrist whose board is a test: drives switched on at once, steps wherever they are wanted.

    Its rotors have no inertia unless `motors` says so.
    """

    def __init__(self, on: int = 0b1111, plant: WeakenedPlant | None = None, **motors: object) -> None:
        turned = Motors.model_validate({"slack": TAUT, "rotor_inertia": 0.0, **motors})
        self.settings = BenchSettings(motors=turned, plant=plant or WeakenedPlant())
        self.wrist = BenchWrist(self.settings, WRIST)
        self.edge(0, "C", ~on & 0xF)

    def edge(self, cycle: int, port: str, value: int) -> None:
        self.wrist.hear(np.array([(cycle, ord(port), value)], EDGE))

    def step(self, cycle: int, *axes: int, back: bool = False) -> None:
        """One step of these axes together."""
        direction = 0b1010_1010 if back else 0
        self.edge(cycle, "A", direction)
        self.edge(cycle, "A", direction | sum(1 << 2 * axis for axis in axes))
        self.edge(cycle, "A", direction)

    def steps(self, count: int, *axes: int, begin: int = 100, back: bool = False) -> None:
        for k in range(count):
            self.step(begin + 100 * k, *axes, back=back)

    def after(self, milliseconds: int) -> BenchWrist:
        self.wrist.follow(milliseconds * MS)
        return self.wrist


def test_each_axis_counts_its_own_steps_in_their_direction() -> None:
    pins = Pins()
    for axis, count in enumerate((3, 1, 4, 2)):
        pins.steps(count, axis, begin=100 + 1000 * axis)
    pins.steps(5, 1, begin=5000, back=True)
    motion = pins.after(1).motion
    assert motion.steps == (3, 1 - 5, 4, 2)
    assert motion.last_step == pytest.approx((300 / 16e6, 5400 / 16e6, 2400 / 16e6, 3200 / 16e6))
    assert motion.energised == (True,) * 4


def test_an_axis_that_never_stepped_has_no_last_step_and_one_off_is_not_energised() -> None:
    pins = Pins(on=0b0101)
    motion = pins.after(2).motion
    assert motion.energised == (True, False, True, False)
    assert motion.last_step == (None,) * 4 and motion.steps == (0, 0, 0, 0)
    pins.edge(2 * MS + 5, "C", 0b0101)
    assert pins.after(3).motion.energised == (False, True, False, True)


def test_a_held_step_line_and_the_other_ports_make_no_steps() -> None:
    pins = Pins()
    pins.edge(10, "A", 0b01)
    pins.edge(20, "A", 0b11)  # the direction changes, the step line stays up
    pins.edge(30, "A", 0b01)
    pins.edge(40, "B", 0b00)
    pins.edge(50, "B", 0b01)
    assert pins.after(1).motion.steps == (1, 0, 0, 0)


def test_a_reversed_motor_pays_out() -> None:
    pins = Pins(reversed=(False, True, False, False))
    pins.steps(3, 0, 1)
    assert pins.after(1).motion.steps == (3, -3, 0, 0)


def test_what_came_in_the_first_half_of_a_millisecond_is_reeled_in_it_and_the_rest_in_the_next() -> None:
    pins = Pins()
    pins.step(MS + MS // 2 - 1, 0)
    pins.step(MS + MS // 2, 2)
    reeled = pins.after(3).truth().reeled
    assert reeled[:, 0] == pytest.approx([0.0, STEP, STEP]) and reeled[:, 2] == pytest.approx([0.0, 0.0, STEP])


def test_tendons_begin_with_their_slack_and_pull_by_what_is_reeled_in_beyond_it() -> None:
    """All four alike, so that the wrist stays straight."""
    slack = 4.5 * STEP
    pins = Pins(slack=(slack,) * 4)
    pins.steps(20, 0, 1, 2, 3, begin=MS)
    truth = pins.after(4).truth()
    assert truth.reeled[0] == pytest.approx([-slack] * 4) and (truth.pull[0] == 0.0).all()
    assert truth.reeled[-1] == pytest.approx([15.5 * STEP] * 4)
    assert truth.pull[-1] == pytest.approx([15.5 * STEP * STIFFNESS] * 4, rel=1e-3)
    assert np.abs(truth.theta).max() < 1e-6 and np.abs(truth.angle).max() < 1e-6


def test_released_tendons_lose_their_surplus_with_the_release_time() -> None:
    pins = Pins(detent_torque=0.02, release_time=9e-3)
    pins.steps(40, 0, 1, 2, 3)
    pins.edge(5 * MS, "C", 0xF)
    truth = pins.after(60).truth()
    detent = 0.02 / RADIUS
    surplus = truth.pull[:, 0] - detent
    ratios = surplus[7:15] / surplus[6:14]
    assert ratios == pytest.approx(1.0 - 1.0 / 10.0, rel=1e-2), "1 ms of 9 ms and itself"
    assert truth.pull[-1] == pytest.approx([detent] * 4, rel=0.02)


def test_a_slack_tendon_of_a_released_motor_stays_where_it_is() -> None:
    pins = Pins(on=0, slack=(1e-4,) * 4)
    assert pins.after(50).truth().reeled == pytest.approx(np.full((50, 4), -1e-4))


def test_a_motor_that_is_pulled_too_hard_falls_back_by_four_full_steps() -> None:
    holding = 100 * STEP * STIFFNESS
    pins = Pins(holding_torque=holding * RADIUS)
    pins.steps(99, 0, 1, 2, 3)
    kept = pins.after(10).truth().reeled[-1]
    assert kept == pytest.approx([99 * STEP] * 4), "just under its limit it holds"
    pins.steps(4, 0, 1, 2, 3, begin=10 * MS + 100)
    assert pins.after(20).truth().reeled[-1] == pytest.approx([(103 - 64) * STEP] * 4)
    assert pins.wrist.motion.steps == (103,) * 4, "the board does not know"


@pytest.mark.parametrize(("away", "turns"), [(30, 0), (34, 1), (94, 1), (98, 2)])
def test_a_motor_switched_on_takes_the_nearest_place_that_fits_its_count(away: int, turns: int) -> None:
    """Every 64 microsteps; here all four were counted on while they were off."""
    pins = Pins()
    pins.after(2)
    pins.edge(2 * MS + 1, "C", 0xF)
    pins.steps(away, 0, 1, 2, 3, begin=2 * MS + 10)
    pins.edge(4 * MS + 1, "C", 0x0)
    assert pins.after(6).truth().reeled[-1] == pytest.approx([(away - 64 * turns) * STEP] * 4)


def test_what_the_motors_have_in_common_is_the_settings() -> None:
    settings = BenchSettings(
        motors=Motors(step_scale=(1.0, 2.0, 1.0, 1.0), holding_torque=1.5, detent_torque=0.06, release_time=4e-3),
        actuator=StepperActuator(microstep=8, motor_steps=400, pulley_radius=0.01),
    )
    motor = stepper_of(settings)
    assert spool_state_of(settings).step == pytest.approx([2.0 * math.pi * 0.01 / 3200 * k for k in (1, 2, 1, 1)])
    assert motor.turn == pytest.approx(2.0 * math.pi * 0.01 / 100), "four full steps of 400"
    assert (motor.holding, motor.detent, motor.release) == pytest.approx((150.0, 6.0, 0.2))


# --- what it has done -------------------------------------------------------------------------------------------------


def bent(pins: Pins, *axes: int, count: int = 100) -> BenchWrist:
    """Two tendons of a side reeled in by 1.5 mm."""
    pins.steps(count, *axes)
    return pins.after(400)


def test_tendons_4_and_5_bend_toward_ulnar_and_1_and_2_the_other_way() -> None:
    assert bent(Pins(), 2, 3).truth().angle[-1] > 0.03 and bent(Pins(), 0, 1).truth().angle[-1] < -0.03


def test_turned_to_the_other_plane_it_stays_bent_as_it_was_and_its_tendons_pull_as_they_did() -> None:
    pins = Pins()
    pins.steps(60, 2)
    before = bent(pins, 2, 3).truth()
    pins.wrist.face("flexion")
    turned = pins.after(401).truth()
    np.testing.assert_allclose(turned.pull[-1], before.pull[-1], atol=0.3)
    assert abs(turned.across[-1]) == pytest.approx(before.angle[-1], rel=0.02)
    assert abs(turned.angle[-1]) == pytest.approx(abs(before.across[-1]), rel=0.02)
    pins.wrist.face("extension")
    assert pins.after(402).truth().angle[-1] == pytest.approx(turned.angle[-1], rel=0.02), "the same plane"
    pins.wrist.face("radial")
    back = pins.after(403).truth()
    assert back.angle[-1] == pytest.approx(before.angle[-1], rel=0.04)
    assert back.across[-1] == pytest.approx(before.across[-1], rel=0.04)


def test_what_friction_inside_holds_bent_it_holds_when_turned_to_the_other_plane() -> None:
    pins = Pins(plant=WeakenedPlant(inner_friction=0.05), slack=(2e-3, 2e-3, 0.0, 2e-3))
    pins.steps(200, 2)
    pins.after(500)
    pins.steps(200, 2, begin=500 * MS, back=True)
    before = pins.after(1500).truth()
    assert before.pull[-1].max() == 0.0 and np.degrees(np.abs(before.across[-1])) > 1.0
    pins.wrist.face("flexion")
    turned = pins.after(2500).truth()
    for now, then in ((turned.across, before.angle), (turned.angle, before.across)):
        assert abs(now[-1]) == pytest.approx(abs(then[-1]), rel=5e-3)  # without its bristles it gives way by 4 %


def test_turned_to_the_other_plane_other_tendons_bend_it() -> None:
    pins = Pins()
    pins.wrist.face("flexion")
    assert bent(pins, 1, 3).truth().angle[-1] > 0.03


def test_a_tendon_alone_swings_the_wrist_as_much_across_the_plane_as_in_it_at_every_moment() -> None:
    """Springs, masses and damping are the same both ways; four segments are a little otherwise than one."""
    pins = Pins()
    pins.steps(100, 2)
    course = pins.after(600).truth()
    assert np.ptp(course.angle[60:150]) > 0.1 * course.angle[-1], "it swings"
    assert np.abs(course.angle + course.across).max() < 0.03 * np.abs(course.angle).max()


def test_friction_inside_the_wrist_holds_it_across_the_plane_as_in_it() -> None:
    """Let go, it stays bent toward the tendon that has pulled, by its torque over the stiffness less gravity's."""
    pins = Pins(plant=WeakenedPlant(inner_friction=5e-3), slack=(1e-3, 1e-3, 0.0, 1e-3))
    pins.steps(100, 2)
    pulled = pins.after(600).truth()
    assert np.abs(pulled.angle + pulled.across).max() < 0.03 * np.abs(pulled.angle).max()
    pins.steps(140, 2, begin=600 * MS, back=True)
    slack = pins.after(2000).truth()
    assert slack.pull[-1].max() == 0.0
    softer = WRIST.model_copy(update={"stiffness": pins.settings.plant.stiffness_scale * WRIST.stiffness})
    stays = 5e-3 / across_of(softer, (1, 1, 1, 1)).stiffness
    assert slack.angle[-1] == pytest.approx(-slack.across[-1], rel=0.1) and slack.angle[-1] == pytest.approx(
        stays, rel=0.15
    )


def test_its_course_is_told_since_a_time_at_the_ends_of_milliseconds() -> None:
    wrist = bent(Pins(), 2, 3)
    assert wrist.time == pytest.approx(0.4)
    whole, last = wrist.truth(), wrist.truth(0.395)
    assert whole.time == pytest.approx(1e-3 * np.arange(1, 401)) and last.time == pytest.approx(
        [0.396, 0.397, 0.398, 0.399, 0.4]
    )
    assert np.array_equal(last.theta, whole.theta[-5:]) and np.array_equal(last.pull, whole.pull[-5:])
    assert len(wrist.truth(0.4).time) == 0 and len(wrist.truth(5.0).time) == 0
    assert whole.angle == pytest.approx(whole.theta.sum(axis=1))
    assert np.gradient(whole.theta[:, 0], whole.time)[50:-1] == pytest.approx(whole.rate[50:-1, 0], abs=0.05)


def test_between_milliseconds_its_angles_lie_on_straight_lines() -> None:
    wrist = bent(Pins(), 2, 3)
    truth = wrist.truth()
    between = wrist.angles(np.array([0.1, 0.1004, 0.101]))
    at = int(np.argmin(np.abs(truth.time - 0.1)))
    assert between[0] == pytest.approx(truth.theta[at]) and between[2] == pytest.approx(truth.theta[at + 1])
    assert between[1] == pytest.approx(0.6 * truth.theta[at] + 0.4 * truth.theta[at + 1])


def test_a_push_counts_from_where_it_is_said_to_begin() -> None:
    pins = Pins()
    pins.wrist.disturb(Disturbances(push=Push(force=1.0, start=0.02, duration=0.05)), 0.1)
    moved = np.abs(pins.after(300).truth().angle)
    assert moved[:119].max() < 1e-9 and moved[125:170].max() > 1e-3
    pins.wrist.disturb(Disturbances(), 0.3)
    assert np.abs(pins.after(1500).truth().angle[-1]) < 1e-3


def test_edges_wait_until_their_time_has_come() -> None:
    pins = Pins()
    pins.step(5 * MS, 0)
    assert pins.after(3).motion.steps[0] == 0 and pins.after(6).motion.steps[0] == 1
    assert pins.wrist.time == pytest.approx(6e-3)
    pins.wrist.follow(6 * MS + MS - 1)
    assert pins.wrist.time == pytest.approx(6e-3), "whole milliseconds alone"
