"""Motors that follow targets: delay, lag, rate and resolution by their closed forms, alike in one plane and two."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueActuator
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Sides, belief_in_lanes
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import Aim, actuate, deliver
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Motion
from wristctl.simulation.reference import motion
from wristctl.simulation.simulated_drives import SIDES, at_rest, drive_in_lanes, drive_of, motor_of
from wristctl.trial.spools import Follower
from wristctl.wrist.pcc import PCC
from wristctl.wrist.segments import segments

WRIST, STEP = WristParameters(), Actuator().step_length
PERIOD = 10e-3
FINE = 20
"""Looks in a period."""


def servo(delay: float = 0.0, lag: float = 0.0, rate: float = 10.0, resolution: float = 0.0) -> Actuator:
    """Motors by delay and lag [s], rate [m/s] and resolution [m]."""
    return Actuator(level="servo", command_delay=delay, lag=lag, step_rate=rate / STEP, resolution=resolution)


@kernel
def _drive(
    drive: Any, state: Any, belief: Any, winding: Any, commands: Any, out: Any, h: float, looks: int
) -> None:  # fmt: skip
    known, motors, in_lanes = belief_in_lanes(belief), rows_of(state), drive_in_lanes(drive)
    for tick in range(commands.shape[0]):
        command, counted = rows_of(commands[tick]), rows_of(out[tick, looks])
        counts, bend = part(counted, 0, (0, 0)), part(command, 2, (0,))
        aim = Aim(bend, part(command, 3, (0,)), lanes_like(counts))
        actuate(in_lanes, motors, known, aim, part(command, 0, (0, 0)), h, counts)
        counted[2] = motors[4]
        for look in range(looks):
            row = rows_of(out[tick, look])
            at = h * (look + 1) / looks + zero_like(motors[0])
            told = motors, rows_of(winding), counts, bend, h
            deliver(in_lanes, told, at, (part(row, 0, (0, 0)), part(row, 2, (0, 0))))


class Driven:
    """Both sides' motors over ticks of commands (T, 4): pulls [N], a reference bend [rad] and its rate [rad/s]."""

    def __init__(self, actuator: Actuator, commands: np.ndarray, truth: Actuator | None = None) -> None:
        sides = np.array(SIDES)
        drive = drive_of(actuator, sides, PERIOD, motor_of(truth or actuator))
        state = at_rest(drive, sides * WRIST.pretension, WRIST.length, PCC.taut(WRIST, np.zeros(1)))
        out = np.zeros((len(commands), FINE + 1, 4))
        _drive(
            drive, state, Sides(segments(WRIST, 1)[None], sides), np.array([1.0, 0.0, 0.0]), commands, out, PERIOD, FINE
        )
        self.time = PERIOD * (1 + np.arange(len(commands) * FINE)) / FINE
        self.places, self.speeds = (out[:, :FINE, k : k + 2].reshape(-1, 2) for k in (0, 2))
        self.counted, self.withheld = out[:, FINE, :2], out[:, FINE, 2]
        self.begin = sides * WRIST.pretension / (sides * actuator.tendon_stiffness)


def stepped(actuator: Actuator, ticks: int = 30, pull: float = 40.0, truth: Actuator | None = None) -> Driven:
    """From rest the + side is to pull so much more [N], the - side stays."""
    rest = 2.0 * WRIST.pretension
    return Driven(actuator, np.tile([rest + pull, rest, 0.0, 0.0], (ticks, 1)), truth)


REACH = 40.0 / (2.0 * Actuator().tendon_stiffness)
"""What the two tendons of a side stretch by under such a pull [m]."""


@pytest.mark.parametrize("delay", [0.0, 4e-3, 10e-3, 23e-3])
@pytest.mark.parametrize("lag", [0.0, 6e-3, 30e-3])
def test_a_step_is_the_exponential_of_the_lag_after_the_delay(delay: float, lag: float) -> None:
    driven = stepped(servo(delay, lag, rate=1e3))
    since = np.maximum(driven.time - delay, 0.0)
    left = np.exp(-since / lag) if lag else (since <= 1e-6).astype(float)
    expected = REACH * (1.0 - left)
    away = np.abs(driven.time - delay) > 1e-4  # a jump has no value at its very time
    assert np.abs(driven.places[:, 0] - driven.begin[0] - expected)[away].max() < 1e-6 * REACH
    assert np.abs(driven.places[:, 1] - driven.begin[1]).max() < 1e-12, "the other side was sent nothing new"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_step_beyond_the_rate_is_a_ramp_that_turns_into_the_exponential_of_the_lag(side: float) -> None:
    """The host asks for all of it at once where it believes faster motors: |x'| is at most the rate."""
    rate, lag, delay = 0.02, 10e-3, 4e-3
    truth = servo(delay, lag, rate)
    driven = stepped(servo(delay, lag, 10.0), pull=side * 40.0, truth=truth)
    reach, ramp = REACH, REACH / rate - lag
    assert ramp > 0.0
    since = np.maximum(driven.time - delay, 0.0)
    late = np.maximum(since - ramp, 0.0)
    expected = np.where(since < ramp, rate * since, reach - rate * lag * np.exp(-late / lag))
    assert np.abs(side * (driven.places[:, 0] - driven.begin[0]) - expected).max() < 1e-6 * REACH
    moving = np.where(since < ramp, rate, rate * np.exp(-late / lag)) * (driven.time > delay)
    assert np.abs(side * driven.speeds[:, 0] - moving)[np.abs(driven.time - delay) > 1e-4].max() < 1e-6 * rate


def test_a_host_that_knows_the_rate_sends_no_target_that_is_further_than_a_tick_and_withholds_the_rest() -> None:
    rate = 0.02
    driven = stepped(servo(rate=rate))
    assert np.allclose(np.diff(driven.places[:, 0])[: 4 * FINE], rate * PERIOD / FINE, rtol=1e-9)
    short = REACH - rate * PERIOD * np.arange(1, 31)
    torque = WRIST.tendon_offset * 2.0 * Actuator().tendon_stiffness * np.maximum(short, 0.0)
    assert driven.withheld == pytest.approx(torque, abs=1e-9)
    assert driven.withheld[0] > 0.0 and driven.withheld[-1] == 0.0


@pytest.mark.parametrize("resolution", [1e-4, 3e-4])
def test_targets_are_multiples_of_the_resolution_and_places_are_not(resolution: float) -> None:
    driven = stepped(servo(lag=20e-3, resolution=resolution), ticks=60)
    nearest = np.rint((driven.begin[0] + REACH) / resolution)
    assert driven.places[-1, 0] / resolution == pytest.approx(nearest, abs=1e-6)
    between = driven.places[: 2 * FINE, 0] / resolution
    assert (np.abs(between - np.rint(between)) > 0.01).any()
    assert abs(driven.places[-1, 0] - driven.begin[0] - REACH) <= 0.5 * resolution
    assert (driven.withheld == 0.0).all(), "less than the resolution is nothing that motors withhold"


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 0.0), (15e-3, 0.0), (7e-3, 12e-3)])
def test_a_target_that_moves_evenly_is_met_in_the_middle_of_ticks(delay: float, lag: float) -> None:
    """Targets are held over a tick; with half of one ahead, and by the delay and the lag, they are right on average."""
    speed = 0.2
    bend = speed * PERIOD * np.arange(100)
    commands = np.column_stack([np.full((100, 2), 2.0 * WRIST.pretension), bend, np.full(100, speed)])
    driven = Driven(servo(delay, lag), commands)
    mean = driven.places[60 * FINE :, 0].reshape(-1, FINE).mean(axis=1)
    middles = speed * PERIOD * (np.arange(60, 100) + 0.5)
    shorter = [WRIST.length - PCC.taut(WRIST, np.array([middle]))[0] for middle in middles]
    reeled = WRIST.tendon_offset * speed * PERIOD
    assert mean - driven.begin[0] == pytest.approx(np.array(shorter), abs=reeled / FINE)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.0, 0.04), st.one_of(st.just(0.0), st.floats(1e-3, 0.05)), st.floats(0.01, 1.0),
    st.lists(st.floats(-5e-3, 5e-3), min_size=3, max_size=12),
)  # fmt: skip
def test_the_host_of_a_trial_reckons_as_the_motors_move(
    delay: float, lag: float, rate: float, targets: list[float]
) -> None:
    """The compiled law against x' = clip((target - x)/lag, -rate, rate) in small steps of time."""
    motor, remembered = Follower(delay, lag, rate), int(delay // PERIOD) + 3
    place, sent, fine = np.zeros(1), np.zeros((1, remembered)), 400
    integrated, change = 0.0, PERIOD / fine
    history = [(-1.0, 0.0)]
    tolerance = 3.0 * rate * change + 1e-5
    for tick, target in enumerate(targets):
        sent = np.column_stack([[target], sent[:, :-1]])
        history.append((tick * PERIOD + delay, target))
        summed = 0.0
        for step in range(fine):
            now = tick * PERIOD + (step + 0.5) * change
            held = [one for when, one in history if when <= now][-1]
            follows = (held - integrated) * (-math.expm1(-change / lag) if lag else 1.0)
            integrated += float(np.clip(follows, -rate * change, rate * change))
            summed += integrated / fine
        place, mean = motor.over(place, sent, PERIOD)
        assert place[0] == pytest.approx(integrated, abs=tolerance)
        assert mean[0] == pytest.approx(summed, abs=tolerance)


def loop_of(actuator: Actuator, planes: Literal[1, 2] | None = None, **plant: Any) -> Loop:
    """A loop behind a camera."""
    return Loop(
        actuator=actuator, sensor=Sensor(level="camera", dropped=0.0), control_period=PERIOD,
        planes=planes, plant=Plant(actuator=TrueActuator(**plant)),
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_one_plane_and_two_move_alike(side: float) -> None:
    law, wrist = controller("pid-ff"), WristParameters(gravity=(0.0, 0.0), tendons="four")
    gains, actuator = np.array(gains_of(law, "hardware")), servo(8e-3, 10e-3, 0.1)
    planar = motion(Reference(angle_deg=25.0 * side), wrist, 1.5, PERIOD)
    moves = np.stack([planar.theta_ref, planar.rate_ref, planar.acceleration_ref])
    spatial = Motion.of_bends(np.stack([moves, 0.0 * moves]), PERIOD, wrist.length)
    exact = {"sensor": Sensor()}
    one = follow(law, gains, planar, wrist, loop_of(actuator).model_copy(update=exact)).trajectory
    two = follow(law, gains, spatial, wrist, loop_of(actuator, 2).model_copy(update=exact)).trajectory
    assert np.abs(one.theta).max() > 0.3
    assert np.abs(np.asarray(two.theta)[:, 1]).max() < 1e-9
    assert np.degrees(np.abs(one.theta - np.asarray(two.theta)[:, 0]).max()) < 0.05


@pytest.mark.slow
def test_a_light_wrist_swings_with_delayed_motors_and_not_with_those_that_are_at_once() -> None:
    """The drive decides: what held with motors at once loses its phase with 25 ms of delay."""
    law = controller("pid-ff")
    gains = 3.0 * np.array(gains_of(law, "hardware"))
    wrist = WristParameters()
    followed = motion(Reference(), wrist, 3.0, PERIOD)
    swing = [
        follow(law, gains, followed, wrist, loop_of(servo(delay, 0.0, 0.3))).metrics["oscillation"]
        for delay in (0.0, 25e-3)
    ]
    assert np.degrees(swing[0]) < 0.1 and not np.degrees(swing[1]) < 3.0 * np.degrees(swing[0])


@pytest.mark.slow
def test_what_motors_truly_are_is_not_what_their_host_believes() -> None:
    law, wrist = controller("pid-ff"), WristParameters()
    gains, followed = np.array(gains_of(law, "hardware")), motion(Reference(), wrist, 2.0, PERIOD)
    actuator = servo(5e-3, 0.0, 0.3)
    believed = follow(law, gains, followed, wrist, loop_of(actuator)).metrics["rmse"]
    slower = follow(law, gains, followed, wrist, loop_of(actuator, lag=0.05, command_delay=0.03)).metrics["rmse"]
    same = follow(law, gains, followed, wrist, loop_of(actuator, lag=0.0, command_delay=5e-3)).metrics["rmse"]
    assert same == believed and slower > 1.5 * believed
