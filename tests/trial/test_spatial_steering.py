"""Laws, allocation and observers of a rig in two planes: those of simulation, asked tick by tick."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.response import FULL
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Motion
from wristctl.simulation.spatial_references import bend_path
from wristctl.trial.blind_model import BlindModel
from wristctl.trial.control_loop import course_of
from wristctl.trial.rig_belief import PLANES, RigBelief
from wristctl.trial.steering import REMEMBERED, Steering
from wristctl.wrist.tendon_layout import TendonLayout

pytestmark = pytest.mark.slow

WRIST, PERIOD = WristParameters(stiffness_axis_deg=30.0, flexion_ratio=1.4), 1e-2
ACTUATOR, SENSOR = Actuator(level="tendon"), Sensor(level="camera")
BELIEF = RigBelief(WRIST, ACTUATOR, PLANES)


def steering(law: str = "feedforward", gains: str = "") -> Steering:
    made, chosen = Steering(BELIEF, SENSOR, PERIOD), controller(law)
    made.use(chosen, gains_of(chosen, gains, None) if gains else ())
    return made


def reeled(tension: float, bend: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Length on the spools of tendons that all pull like that on a wrist held at this bend."""
    lengths: np.ndarray = BELIEF.taut(bend)[0] + tension / ACTUATOR.tendon_stiffness
    return lengths


@pytest.mark.parametrize("limit", [60.0, 12.0])
@pytest.mark.parametrize("law", ["ct-dob", "pid-dob"])
def test_torques_and_pulls_are_those_of_the_simulated_loop_at_every_tick(law: str, limit: float) -> None:
    """Given what the simulated laws saw, oblique springs and all: the same law with its memory, and one allocation;
    where tendons reach the torque and where they do not."""
    chosen, wrist = controller(law), WRIST.model_copy(update={"tension_limit": limit})
    gains = gains_of(chosen, "hardware")
    path = bend_path("figure-of-8", 20.0, 1.5, 1.2, 25.0)[:, :, ::10].copy()
    loop = Loop(control_period=PERIOD, plant_segments=1)
    motion = Motion.of_bends(path, PERIOD, wrist.length)
    course = follow(chosen, np.array(gains), motion, wrist.model_copy(update={"tendons": "four"}), loop).trajectory
    share = np.asarray(course.share)
    assert (share < 1.0).any() == (limit < 60.0)
    steered = Steering(RigBelief(wrist, ACTUATOR, PLANES), SENSOR, PERIOD)
    steered.use(chosen, gains)
    references = course_of(motion)
    for tick, (bend, rate) in enumerate(zip(course.bend, course.rate, strict=True)):
        steered._observer.now[:] = [bend[0], rate[0], 0.0, bend[1], rate[1], 0.0]
        answer = steered.respond(references, tick)
        assert answer.tension == pytest.approx(course.tension[tick], rel=1e-12, abs=1e-12)
        assert answer.torque_wanted == pytest.approx(course.torque_wanted[tick], rel=1e-12, abs=1e-12)
        assert answer.torque == pytest.approx(course.torque[tick], rel=1e-12, abs=1e-12)
        assert answer.share == share[tick]


def test_paths_are_those_of_the_exact_arc() -> None:
    bend, h = np.array([0.3, -0.2]), 1e-6
    taut, arms = BELIEF.taut(bend)
    layout = TendonLayout.four(WRIST.tendon_radius)
    assert arms == pytest.approx(layout.moment_arms(bend, WRIST.length, WRIST.discs), rel=1e-12)
    for plane in range(2):
        step = h * np.eye(2)[plane]
        slope = (BELIEF.taut(bend + step)[0] - BELIEF.taut(bend - step)[0]) / (2.0 * h)
        assert slope == pytest.approx(arms[:, plane], abs=1e-9)
    assert BELIEF.taut((0.0, 0.0))[0] == pytest.approx(np.zeros(4), abs=1e-15) and taut[0] < 0.0


def test_it_bends_toward_the_tendon_that_is_reeled_in() -> None:
    for axis, (ulnar, flexion) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1))):
        steered = steering()
        more = 5e-4 * np.eye(4)[axis]
        for _ in range(100):
            steered.predict(reeled(10.0) + more)
        bend = steered.estimate.theta
        assert ulnar * bend[0] > 0.005 and flexion * bend[1] > 0.005


def test_each_camera_tells_of_its_plane_when_its_picture_was_taken() -> None:
    steered = steering()
    for _ in range(40):
        steered.predict(reeled(10.0))
    assert steered.see(0, 0.05, 0.35)
    first = steered.estimate.theta.copy()
    assert first[0] > 0.005 and abs(first[1]) < 1e-3
    assert steered.see(1, -0.05, 0.345), "a little older than the other camera's"
    second = steered.estimate.theta
    assert second[1] < -0.005 and second[0] == pytest.approx(first[0], abs=2e-3)


@pytest.mark.parametrize(
    ("captured", "taken"), [(-0.001, False), (0.4, True), (0.409, True), (0.411, False), (0.29, False), (0.32, True)]
)
def test_pictures_that_are_too_old_or_yet_to_come_are_refused(captured: float, taken: bool) -> None:
    steered = steering()
    for _ in range(40):
        steered.predict(reeled(10.0))
    assert steered.see(1, 0.0, 0.35)
    before = steered.estimate.theta.copy()
    assert steered.see(0, 0.05, captured) == taken
    assert (steered.estimate.theta[0] != pytest.approx(before[0], abs=1e-9)) == taken


def test_the_bend_is_remembered_as_it_was_believed() -> None:
    steered, past = steering(), []
    for tick in range(REMEMBERED + 20):
        past.append(steered.estimate.theta.copy())
        steered.predict(reeled(10.0) + 1e-6 * tick * np.array([0, 0, 1, 0]))
    at = (REMEMBERED + 5.25) * PERIOD
    between = past[REMEMBERED + 5] + 0.25 * (past[REMEMBERED + 6] - past[REMEMBERED + 5])
    assert steered.bend_at(at) == pytest.approx(between, abs=1e-12)
    assert steered.bend_at(99.0) == pytest.approx(steered.estimate.theta)
    assert steered.bend_at(0.0) == pytest.approx(past[21], abs=1e-12), "the oldest that is remembered"


def test_before_the_first_tick_the_bend_was_as_it_is_first_believed() -> None:
    steered = steering()
    assert steered.see(0, 0.05, 0.0)
    first = steered.estimate.theta.copy()
    assert first[0] > 0.001
    for _ in range(3):
        assert steered.bend_at(-0.4 * PERIOD) == pytest.approx(first, abs=1e-15)
        assert steered.bend_at(-9.0) == pytest.approx(first, abs=1e-15)
        steered.predict(reeled(10.0))


def test_what_motors_withhold_is_no_error_to_the_laws() -> None:
    """An integral that knows of withheld torque grows by less."""
    wanted = []
    for withheld in (0.0, 0.3):
        steered = steering("pid-dob", "hardware")
        for _ in range(5):
            steered.withheld = np.array([withheld, 0.0])
            answer = steered.respond(np.array([[[0.03, 0.0, 0.0], [0.03, 0.0, 0.0]]]))
        wanted.append(answer.torque_wanted)
    assert wanted[0][0] != pytest.approx(wanted[1][0], rel=1e-3) and wanted[0][1] == pytest.approx(wanted[1][1])


def test_a_torque_out_of_reach_keeps_its_direction_and_is_said() -> None:
    answer = steering().respond(np.array([[[8.0, 0.0, 0.0], [8.0, 0.0, 0.0]]]))
    assert answer.share < FULL
    turned = [math.atan2(torque[1], torque[0]) for torque in (answer.torque, answer.torque_wanted)]
    assert turned[0] == pytest.approx(turned[1], abs=1e-6)
    assert answer.tension.max() <= WRIST.tension_limit + 1e-9 and answer.tension.min() >= WRIST.pretension - 1e-9


def test_tendons_at_other_places_are_refused() -> None:
    with pytest.raises(UserError, match="winds the four tendons 1, 2, 4 and 5"):
        RigBelief(WristParameters(tendons="three"), ACTUATOR, PLANES)


def test_soft_tendons_bend_the_blind_wrist_less_in_both_planes() -> None:
    model = BlindModel(WRIST, ACTUATOR, 5e3, PERIOD, PLANES)
    for _ in range(150):
        model.predict(reeled(10.0) + 5e-4 * np.array([0, 0, 0, 1]))
    believed, soft = model.angles(150 * PERIOD)
    assert (soft > 0.005).all() and (believed > 1.03 * soft).all()
