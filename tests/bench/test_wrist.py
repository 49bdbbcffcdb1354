"""What the board's step pulses do to motors, tendons and the wrist."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.bench.conftest import EXACT, TAUT, Host, HostOn
from wristctl.bench.bench_wrist import Truth
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.bench import BenchSettings, InjectedFault, Motors, StepperActuator, WeakenedPlant
from wristctl.config.camera import Markers
from wristctl.config.plant import Disturbances, Push
from wristctl.config.wrist import WristParameters
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import equilibrium

SETTINGS, WRIST = BenchSettings(motors=TAUT), WristParameters()
ACTUATOR, PLANT, N = SETTINGS.actuator, plant_of(WRIST, SETTINGS.plant), SETTINGS.segments
FREE = BenchSettings(motors=TAUT, actuator=StepperActuator(friction=0.0))
"""Tendons that slide freely."""
PUSH = Push(force=2.0, start=0.1, duration=0.3)
BEND = (-110, -110, 130, 130)
"""Steps of the axes of tendons 1, 2, 4, 5: a bend of about 0.12 rad toward ulnar."""


def simulated(steps: Truth, start: float) -> np.ndarray:
    """Angles (T, n) from rest under these reeled lengths and PUSH, tendon by tendon, in explicit steps of 50 us."""
    theta, omega, z = np.zeros(N), np.zeros(N), np.zeros(4)
    force = PUSH.force * np.sin(np.pi * (steps.time - 1e-3 - start - PUSH.start) / PUSH.duration).clip(0.0)
    force[(steps.time - 1e-3 < start + PUSH.start) | (steps.time - 1e-3 > start + PUSH.start + PUSH.duration)] = 0.0
    angles, before = [], terms(segments(PLANT, N), theta, omega).tendon_lengths.sum(axis=0)
    across = np.concatenate([[0.0], steps.across[:-1]])
    taken = PLANT.tendon_offset * np.outer(across, (-1.0, 1.0, -1.0, 1.0))  # by the bend toward flexion, tendons 2, 5
    for reeled, tip_force in zip(steps.reeled - taken, force, strict=True):
        wrist = segments(PLANT, N, (0.0, tip_force))
        for _ in range(20):
            lengths = terms(wrist, theta, omega).tendon_lengths.sum(axis=0)
            pull = np.zeros(2)
            for axis, side in enumerate((1, 1, 0, 0)):
                slid = before[side] - lengths[side]
                z[axis] = np.sign(slid) + (z[axis] - np.sign(slid)) * np.exp(-abs(slid) / ACTUATOR.presliding)
                stretch = max(0.0, reeled[axis] - PLANT.length + lengths[side])
                left = np.exp(-ACTUATOR.friction * (ACTUATOR.sheath + np.abs(theta).sum()) * z[axis])
                pull[side] += ACTUATOR.tendon_stiffness * stretch * left
            before = lengths
            after = integrate(PCC, wrist, theta, omega, pull, [5e-5], 5e-5)
            theta, omega = after[0][0], after[1][0]
        angles.append(theta)
    return np.array(angles)


@pytest.mark.slow
def test_a_bench_moves_as_the_simulation_does_under_the_same_reeled_lengths_and_push(host_on: HostOn) -> None:
    host = host_on()
    host.bench.begin(host.start, Disturbances(push=PUSH))
    host.turn((-600.0, -600.0, 700.0, 700.0), 0.15)
    host.turn((100.0, 90.0, -150.0, -140.0), 0.3)
    truth = host.bench.truth()
    moved = truth.theta[truth.time > host.start].sum(axis=1)
    assert np.ptp(moved) > 0.05
    apart = truth.theta - simulated(truth, host.start)
    assert np.abs(apart).max() < 1e-4 and np.sqrt((apart**2).mean()) < 1e-5


def test_at_rest_the_wrist_stands_where_statics_put_it_under_the_same_pulls(host_on: HostOn) -> None:
    host = host_on()
    host.reel(BEND)
    host.rest(4.0)
    truth = host.bench.truth()
    minus, plus = truth.pull[-1].reshape(2, 2).mean(axis=1)
    assert plus > minus > 1.0
    bend = truth.theta[-1].sum()
    assert bend > 0.1
    most = np.exp(ACTUATOR.friction * bend)
    least, straightest = equilibrium(PLANT, N, (plus / most, minus * most)), equilibrium(PLANT, N, (plus, minus))
    assert least.sum() < bend < equilibrium(PLANT, N, (plus * most, minus / most)).sum(), "within the dead band"
    np.testing.assert_allclose(truth.theta[-1] / bend, straightest / straightest.sum(), atol=1e-3)


def test_a_pushed_wrist_on_held_spools_yields_and_comes_back_to_where_it_was(host_on: HostOn) -> None:
    host = host_on(FREE)
    host.reel(BEND)
    host.rest(4.0)
    start = host.bench.transport.now()
    before = host.bench.truth().theta[-1].sum()
    host.bench.begin(start, Disturbances(push=Push(force=5.0, start=0.1, duration=0.4)))
    host.rest(3.0)
    moved = host.bench.truth(start).theta.sum(axis=1) - before
    assert moved.max() > 1e-3 and moved.min() > -0.1 * moved.max()  # damped: hardly beyond where it came from
    assert moved[-1] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("planes", [1, 2])
def test_a_payload_bends_a_wrist_as_if_its_hand_weighed_so_much_more_and_no_longer_than_it_is_held(planes: int) -> None:
    """A bent upright wrist on held spools goes further; before it takes the payload and after it stands as without."""
    taken = InjectedFault(kind="payload-taken", size=0.2, at=1.5, since="power-on", duration=1.5)
    ends = []
    for plant, faults in ((WeakenedPlant(), (taken,)), (WeakenedPlant(payload=0.2), ()), (WeakenedPlant(), ())):
        second = None if planes == 1 else Markers(base=2, tip=3)
        motors = TAUT.model_copy(update={"rotor_inertia": 0.0})
        settings = FREE.model_copy(update={"plant": plant, "faults": faults, "motors": motors})
        host = Host(VirtualBench(settings, WristParameters(), 0, None, second))
        host.reel(BEND)
        host.rest(5.0)
        truth = host.bench.truth()
        angle = truth.angle.reshape(len(truth.time), -1)[:, 0]
        ends.append([float(np.interp(at, truth.time, angle)) for at in (1.4, 2.9, 4.9)])
    moved, heavy, light = ends
    assert heavy[1] > light[1] + 1e-3
    assert moved == pytest.approx([light[0], heavy[1], light[2]], abs=2e-5)


def test_the_other_side_and_the_other_plane_bend_alike(host_on: HostOn) -> None:
    courses = {}
    for direction, steps in {
        "ulnar": BEND,
        "radial": (130, 130, -110, -110),
        "flexion": (-110, 130, -110, 130),
        "extension": (130, -110, 130, -110),
    }.items():
        host = host_on(FREE)
        host.bench.face(direction)
        host.reel(steps)
        host.rest(0.5)
        courses[direction] = host.bench.truth().theta[-1].sum()
    assert courses["ulnar"] > 0.1
    for direction, sign in (("radial", -1), ("flexion", 1), ("extension", -1)):
        # the axes' interrupts do not fall together: their steps differ by microseconds, and so by whole periods
        assert courses[direction] == pytest.approx(sign * courses["ulnar"], abs=1e-6)


def test_a_tendon_breaks_in_a_trial_not_while_it_is_homed_and_stays_broken(host_on: HostOn) -> None:
    """The + side's first; the wrist then bends less, and turned to the other plane and back it is broken still."""
    broken = StepperActuator(broken_at=0.3)
    host = host_on(BenchSettings(motors=TAUT, actuator=broken))
    host.reel(BEND)
    host.rest(1.0)
    before = host.bench.truth()
    assert before.pull[-1].min() > 1.0, "it has been on for longer than 0.3 s"
    host.bench.begin(host.bench.transport.now(), Disturbances())
    host.rest(1.0)
    after = host.bench.truth()
    assert after.pull[-1, 2] == 0.0 and after.pull[-1, [0, 3]].min() > 0.0
    assert math.degrees(after.across[-1]) > 1.0, "the rest pull it away from the lost one"
    assert after.angle[-1] < before.angle[-1] - 1e-3
    host.bench.face("flexion")
    host.bench.face("ulnar")
    host.bench.begin(host.bench.transport.now(), Disturbances())
    host.rest(0.2)
    assert host.bench.truth().pull[-1, 2] == 0.0


def test_tendons_only_pull_and_a_slack_one_not_at_all(host_on: HostOn) -> None:
    host = host_on()
    host.reel((-400, -400, 100, 100))
    host.rest(0.5)
    pull = host.bench.truth().pull
    assert pull.min() >= 0.0
    assert (pull[-1, :2] == 0.0).all() and (pull[-1, 2:] > 0.5).all()


def test_a_motor_reels_by_its_steps_its_sense_and_from_its_slack(host_on: HostOn) -> None:
    motors = Motors(rotor_inertia=0.0, slack=(1e-4, 2e-4, 3e-4, 4e-4), reversed=(False, True, False, True))
    host = host_on(BenchSettings(motors=motors))
    host.reel((40, -50, -30, 20))
    host.rest(0.1)
    signed = np.array([40, 50, -30, -20])
    assert host.bench.motion().steps == tuple(signed)
    expected = signed * ACTUATOR.step_length - np.array(motors.slack)
    np.testing.assert_allclose(host.bench.truth().reeled[-1], expected, atol=1e-15)


def test_released_motors_let_go_down_to_their_detent_and_never_reel_in(host_on: HostOn) -> None:
    host = host_on()
    host.reel((0, 0, 200, 200))
    host.rest(1.0)
    held = host.bench.truth()
    host.board.emergency_stop()
    released = host.bench.transport.now()
    host.bench.transport.wait(1.0)
    after = host.bench.truth(released)
    detent = SETTINGS.motors.detent_torque / ACTUATOR.pulley_radius
    assert held.pull[-1].max() > 2 * detent
    assert after.pull[30:].max() < 1.2 * detent and after.pull[-1].max() == pytest.approx(detent, rel=0.02)
    assert (np.diff(after.reeled, axis=0) <= 0.0).all()
    assert np.abs(np.diff(after.theta.sum(axis=1))).max() < 0.02  # no whip: less than 20 rad/s
    assert not any(host.bench.motion().energised)


def test_a_motor_switched_on_again_falls_into_a_place_that_fits_its_count(host_on: HostOn) -> None:
    host = host_on(BenchSettings(motors=EXACT))
    host.reel((0, 0, 200, 200))
    host.board.emergency_stop()
    host.bench.transport.wait(0.5)
    before = host.bench.truth().reeled[-1]
    host.board.clear()
    host.board.enable()
    reeled, counted = host.bench.truth().reeled[-1], np.array(host.bench.motion().steps)
    full_step = ACTUATOR.microstep * ACTUATOR.step_length
    turns = (reeled - counted * ACTUATOR.step_length) / (4 * full_step)
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-9)
    assert turns.min() <= -1.0 + 1e-9
    assert np.abs(reeled - before).max() <= 2 * full_step + 1e-12


def test_an_overloaded_motor_slips_by_whole_turns_of_its_field(host_on: HostOn) -> None:
    host = host_on(BenchSettings(motors=Motors(slack=TAUT.slack, holding_torque=0.15)))
    host.reel((120, 120, 120, 120))
    host.rest(0.5)
    truth = host.bench.truth()
    holding = 0.15 / ACTUATOR.pulley_radius
    assert 0.5 * holding < truth.pull.max() < holding + 2.0
    assert truth.pull[-1].max() <= holding
    slip = (np.array(host.bench.motion().steps) * ACTUATOR.step_length - truth.reeled[-1]) / ACTUATOR.step_length
    np.testing.assert_allclose(slip, np.repeat(64 * np.rint(slip[0] / 64), 4), atol=1e-6)
    assert slip[0] >= 64


@pytest.mark.parametrize("axes", [(0, 3), (1, 2), (0, 1, 2, 3)])
def test_steps_that_nobody_counts_pull_opposite_tendons_up_to_what_the_motors_hold(
    host_on: HostOn, axes: tuple[int, ...]
) -> None:
    """Pulls that balance bend nothing: 100 uncounted steps/s, first along the tendons' stiffness, then slipping."""
    rate = 100 * ACTUATOR.step_length
    faults = tuple(
        InjectedFault(kind="tendon-creeps", at=0.5, axis=axis, size=-1e3 * rate, since="power-on") for axis in axes
    )
    host = host_on(BenchSettings(motors=TAUT, faults=faults))
    host.rest(3.0)
    truth = host.bench.truth()
    holding = SETTINGS.motors.holding_torque / ACTUATOR.pulley_radius
    early = truth.pull[np.searchsorted(truth.time, 1.0)]
    assert early[list(axes)] == pytest.approx(ACTUATOR.tendon_stiffness * rate * 0.5, rel=0.15)
    assert holding - 20.0 < truth.pull.max() <= holding + ACTUATOR.tendon_stiffness * rate * 5e-3 + 0.1
    assert np.abs(truth.angle).max() < np.deg2rad(1.0) and host.bench.motion().steps == (0, 0, 0, 0)


def test_the_same_seed_gives_the_same_bytes_however_often_one_looks() -> None:
    courses = []
    for looks in (1, 7):
        bench = VirtualBench(BenchSettings(), WRIST, seed=3)
        for _ in range(looks):
            bench.transport.wait(0.35 / looks)
            bench.truth()
        bench.transport.wait(0.5 - bench.transport.now())
        courses.append(b"".join(column.tobytes() for column in bench.truth()))
    assert courses[0] == courses[1]


def test_a_softer_plant_bends_further(host_on: HostOn) -> None:
    angles = []
    for scale in (0.7, 1.0):
        host = host_on(BenchSettings(motors=TAUT, plant=WeakenedPlant(stiffness_scale=scale)))
        host.reel((-300, -300, 60, 60))
        host.rest(2.0)
        angles.append(host.bench.truth().theta[-1].sum())
    assert angles[0] > angles[1] > 0.02


@pytest.mark.slow
def test_the_last_minute_is_remembered_with_its_times() -> None:
    bench = VirtualBench(BenchSettings(), WRIST, 0)
    bench.transport.wait(130.0)
    truth = bench.truth()
    assert 60.0 <= len(truth.time) * 1e-3 <= 120.0
    assert truth.time[-1] == pytest.approx(130.0, abs=1.1e-3)
    np.testing.assert_allclose(np.diff(truth.time), 1e-3, atol=1e-9)
    assert len(bench.truth(129.0).time) == pytest.approx(1000, abs=1)


def test_a_bench_stays_weak_and_elastic_where_other_leaves_are_set() -> None:
    some = BenchSettings.model_validate({"plant": {"payload": 0.1}, "actuator": {"friction": 0.2}})
    assert some.plant.stiffness_scale == 0.7 and some.actuator.level == "tendon"
    with pytest.raises(ValueError, match="tendon"):
        BenchSettings.model_validate({"actuator": {"level": "ideal"}})
