"""The linear loop is the simulated one to small signals, and its parts are what closed forms say."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.stability.conftest import CAMERA, LAGGED, PID, TENDON, linear, row
from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.plant import Disturbances, Plant, Push, TrueActuator, TrueSensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import CONTROLLERS
from wristctl.errors import UserError
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.stability.loop_ticks import looks_back
from wristctl.stability.sampled_loop import SampledLoop
from wristctl.stability.smooth_loop import cycle_of, smooth
from wristctl.wrist.statics import least_stiffness

pytestmark = pytest.mark.slow

WRIST = WristParameters()
FINE = Loop(plant_segments=1, control_period=1e-5)
BEHIND = Loop(control_period=5e-3, actuator=LAGGED, sensor=CAMERA)


def _swinging(loop: SampledLoop) -> complex:
    """The slowest pole with a frequency [1/s]."""
    mode = next(each for each in loop.modes() if each.frequency > 0.1)
    return complex(mode.growth, 2.0 * math.pi * mode.frequency)


def test_poles_of_computed_torque_are_those_that_its_gains_place() -> None:
    pole = _swinging(linear("computed-torque", {"w": 50.0, "zeta": 0.5}, FINE, 20.0).closed)
    assert pole == pytest.approx(50.0 * complex(-0.5, math.sqrt(0.75)), rel=2e-3)


def test_poles_of_pd_on_the_straight_wrist_are_those_of_a_spring_and_a_damper() -> None:
    gains = {"Kp": 5.0, "Kd": 0.02}
    pole = _swinging(linear("pid", {**gains, "Ki": 0.0}, FINE).closed)
    inertia = WRIST.mass * WRIST.length**2 / 16.0 + WRIST.hand_mass * (0.5 * WRIST.length + WRIST.hand_offset) ** 2
    stiffness = least_stiffness(WRIST, 1) + gains["Kp"]
    found = np.roots([inertia, WRIST.damping + gains["Kd"], stiffness])
    assert pole == pytest.approx(found[np.argmax(found.imag)], rel=2e-3)


def test_the_plant_alone_is_the_wrists_stiffness_at_rest() -> None:
    loop = linear("feedforward", "default", Loop(plant_segments=1))
    slack = WRIST.model_copy(update={"pretension": 0.0})  # the torque of which allocation makes up for
    assert abs(loop.plant.response(np.array([1e-4]))[0]) == pytest.approx(1.0 / least_stiffness(slack, 1), rel=1e-6)
    assert np.abs(loop.closed.response(np.array([1.0, 10.0]))).max() < 1e-9


def _course(law: str, gains: str | dict[str, float], loop: Loop, step: float, horizon: float) -> Array:
    """Angles of the nonlinear loop after a step from straight [rad]."""
    own = row(law, gains, loop)
    followed = motion(
        Reference(kind="step", angle_deg=math.degrees(step)), WRIST, horizon, sample_period(loop.control_period)
    )
    values = np.array([own.law.values(own.gains)])
    return rollout(own.law, values, [followed], np.zeros(1, np.int64), loop, WRIST, record=True).column("theta", 0)


def _linear_course(loop: SampledLoop, count: int) -> Array:
    """Its angles at the ticks after a step of 1."""
    state, found = np.zeros(len(loop.ticks[0].into)), []
    for k in range(count):
        tick = loop.ticks[k % len(loop.ticks)]
        found.append(tick.outputs["theta"] @ state)
        state = tick.transition @ state + tick.reference
    return np.array(found)


COURSES: dict[str, tuple[str, str | dict[str, float], Loop]] = {
    "ideal": ("pid", PID, Loop()),
    "lagged": ("smc-tracking", "default", Loop(actuator=LAGGED)),
    "camera": ("computed-torque", "default", BEHIND),
    "camera, frames that arrive at once": (
        "computed-torque", {"w": 20.0, "zeta": 1.0},
        BEHIND.model_copy(update={"sensor": CAMERA.model_copy(update={"delay_frames": 0.0, "frame_rate": 100.0})}),
    ),
    "tendon, camera": ("smc-tracking", "hardware", Loop(control_period=5e-3, actuator=TENDON, sensor=CAMERA)),
    "another world": (
        "smc-tracking", "hardware",
        Loop(
            control_period=5e-3, actuator=TENDON, sensor=CAMERA,
            plant=Plant(
                tendon_radius="x1.05", stiffness_scale=0.8,
                actuator=TrueActuator(pulley_radius="x1.1", tendon_stiffness=1.5e4),
                sensor=TrueSensor(delay_frames=2.5),
            ),
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", COURSES)
def test_a_small_step_of_the_simulated_loop_is_the_linear_one(name: str) -> None:
    """Of the loop without steps and limits, simulated finely; 100 ms and more, over many cycles of frames."""
    law, gains, loop = COURSES[name]
    step, count = 1e-5, 60 if loop.sensor.level == "camera" else 250
    fine = smooth(loop, "slipping").model_copy(update={"substeps": 40})
    angles = _course(law, gains, fine, step, count * loop.control_period) / step
    own = linear(law, gains, loop)
    found = _linear_course(own.closed, count)
    np.testing.assert_allclose(angles, found, atol=2e-3 * np.abs(found).max())
    assert np.abs(found).max() > 0.3
    assert own.at_frames == (loop.sensor.level == "camera")
    assert sum(tick.cut for tick in own.closed.ticks) == (cycle_of(loop)[1] or 1), (
        "where each frame is taken, or always"
    )


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "feedforward"])
def test_every_law_rests_and_its_open_loop_closes_again(name: str) -> None:
    ours: dict[str, Any] = {"smc": "hardware", "pid-angle": {"Kp": 0.5, "Ki": 2.0, "Kd": 0.01}}  # not at their limits
    preset = ours.get(name, next(iter(CONTROLLERS[name].presets)))
    for degrees in (0.0, 30.0):
        found = linear(name, preset, Loop(), degrees)
        assert found.theta == pytest.approx(math.radians(degrees), abs=math.radians(0.1)) and found.bend < 0.05
        z = np.exp(1j * np.array([0.05, 0.7]))
        for each, answer in zip(z, found.closed.returned(z)[:, 0, 0], strict=True):
            tick, own = found.closed.ticks[0], np.eye(len(found.names))
            opened = tick.transition - np.outer(tick.into, tick.back)
            assert answer == pytest.approx(tick.back @ np.linalg.solve(each * own - opened, tick.into), rel=1e-6)


def test_a_law_that_learns_over_repetitions_is_its_feedback_within_one() -> None:
    gains = dict(CONTROLLERS["ilc"].presets["default"])
    feedback = {name: gains[name] for name in CONTROLLERS["pid-ff"].gains}
    learning, alone = linear("ilc", gains, Loop(), 20.0), linear("pid-ff", feedback, Loop(), 20.0)
    assert learning.names == alone.names
    np.testing.assert_allclose(learning.closed.transitions()[0], alone.closed.transitions()[0], atol=1e-6)


def test_a_law_that_is_a_line_over_next_to_nothing_is_told_by_its_bend() -> None:
    assert linear("smc", "printed", Loop()).bend > 0.1 > 1e-3 > linear("pid", PID, Loop()).bend


def test_a_load_that_stays_is_held_and_a_push_that_passes_is_not_there() -> None:
    loop = Loop(disturbances=Disturbances(load=0.5, push=Push(force=5.0)))
    torque = [linear("pid", PID, each, 0.0).torque for each in (loop, Loop())]
    assert torque[0] == pytest.approx(-0.5 * 0.5 * WRIST.length, rel=0.05) and torque[1] == pytest.approx(
        0.0, abs=1e-12
    )


def test_an_unstable_loop_is_found_where_it_rests() -> None:
    found = linear("pid", "printed", Loop(), 30.0)
    assert found.theta == pytest.approx(math.radians(30.0), abs=1e-9) and found.closed.growth() > 1e3


def test_stuck_tendons_are_stiffer_by_their_bristles() -> None:
    """A side's pull P falls by P mu phi / s with its travel, which the angle makes by the tendons' arm."""
    loop, theta, stiffness, pulls = (
        Loop(control_period=5e-3, actuator=TENDON),
        math.radians(30.0),
        [],
        0.0,
    )
    for reading in ("slipping", "stuck"):
        found = row("feedforward", "default", loop, "stuck" if reading == "stuck" else "slipping").linear(theta)
        assert found is not None
        (tick,), pulls = found.plant.ticks, 2.0 * sum(found.tensions)
        held, state = found.plant.transitions(0.0)[0], np.zeros(len(tick.into))
        for _ in range(2000):
            state = held @ state + tick.into
        stiffness.append(1.0 / float(tick.outputs["theta"] @ state))
    more = pulls * TENDON.friction * theta / TENDON.presliding * WRIST.tendon_offset**2
    assert stiffness[1] - stiffness[0] == pytest.approx(more, rel=0.02) and more > 5.0


@pytest.mark.parametrize(
    ("rate", "period", "cycle"),
    [
        (60.0, 5e-3, (10, 3)), (50.0, 5e-3, (4, 1)), (60.0, 1e-3, (50, 3)), (40.0, 1e-2, (10, 4)), (60.0, 1e-2, (5, 3)),
        (100.0, 1e-2, (1, 1)),
    ],
)  # fmt: skip
def test_frames_fall_on_ticks_again_after_a_cycle(rate: float, period: float, cycle: tuple[int, int]) -> None:
    loop = Loop(control_period=period, sensor=CAMERA.model_copy(update={"frame_rate": rate}))
    assert cycle_of(loop) == cycle and smooth(loop, "slipping").sensor.frame_rate == rate
    assert cycle_of(Loop(control_period=period)) == (1, 0)


def test_a_frame_rate_that_never_repeats_becomes_the_nearest_that_does() -> None:
    loop = Loop(control_period=5e-3, sensor=CAMERA.model_copy(update={"frame_rate": 58.37}))
    assert smooth(loop, "slipping").sensor.frame_rate == pytest.approx(58.37, rel=2e-3)
    cycle, frames = cycle_of(loop)
    assert frames / (cycle * 5e-3) == pytest.approx(smooth(loop, "slipping").sensor.frame_rate)


def test_a_smooth_loop_keeps_what_is_linear_and_drops_what_is_not() -> None:
    world = Plant(
        stiffness_scale=0.8, payload=0.1, end_stop_deg=40.0, stiffness_spread=0.1,
        actuator=TrueActuator(creep=0.2, backlash=1e-4, torque=0.4, friction=0.3, pulley_radius="x1.1"),
    )  # fmt: skip
    loop = Loop(actuator=TENDON, plant=world)
    sliding, stuck = smooth(loop, "slipping").plant, smooth(loop, "stuck").plant
    for each in (sliding, stuck):
        assert (each.stiffness_scale, each.payload, each.actuator.creep) == (0.8, 0.1, 0.2)
        assert each.actuator.pulley_radius == "x1.1" and each.end_stop_deg is None
        assert each.actuator.backlash == 0.0 and each.actuator.torque is None and each.stiffness_spread == 0.0
    assert (sliding.actuator.friction, stuck.actuator.friction) == (None, 0.3)
    assert smooth(loop, "slipping").actuator.friction == 0.0 and not smooth(loop, "stuck").limits


def test_frames_that_are_too_many_ticks_apart_are_refused() -> None:
    loop = Loop(control_period=1e-4, sensor=CAMERA)
    with pytest.raises(UserError, match="looks back over 501 control periods") as caught:
        looks_back(loop)
    fixed = replace(row("smc-tracking", "camera", loop), loop=loop.model_copy(update={"control_period": 2.6e-4})).loop
    assert looks_back(fixed)[1].ticks <= 200 and "0.25 ms" in caught.value.fix
