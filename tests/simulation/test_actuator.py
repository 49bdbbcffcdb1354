"""Actuators: lag, steps, limits of speed, elastic tendons that only pull, friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Sides, belief_in_lanes
from wristctl.control.table import controller
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import Aim, actuate, deliver
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.simulated_drives import (
    DRIVE,
    SIDES,
    Drive,
    LaggedDrive,
    Motor,
    SpoolDrive,
    at_rest,
    drive_in_lanes,
    drive_of,
)
from wristctl.wrist.pcc import PCC
from wristctl.wrist.segments import segments

WRIST = WristParameters()
PERIOD, MOVE = 1e-3, Reference()


@kernel
def _drive(drive: Any, state: Any, belief: Any, winding: Any, commands: Any, out: Any, h: float) -> None:
    known, motors, in_lanes = belief_in_lanes(belief), rows_of(state), drive_in_lanes(drive)
    for tick in range(commands.shape[0]):
        command, result = rows_of(commands[tick]), rows_of(out[tick])
        counts = part(result, 0, (0, 0))
        bend, told = part(command, 2, (0,)), lanes_like(counts)
        actuate(
            in_lanes,
            motors,
            known,
            Aim(bend, part(command, 3, (0,)), lanes_like(counts)),
            part(command, 0, (0, 0)),
            h,
            told,
        )
        middle = 0.5 * h + zero_like(motors[0])
        deliver(in_lanes, (motors, rows_of(winding), told, bend, h), middle, (counts, lanes_like(counts)))
        result[2] = motors[4]


def delivered(drive: Drive, commands: np.ndarray, period: float = PERIOD) -> np.ndarray:
    """What both sides deliver in the middle of ticks to commands (T, 3 or 4), and the withheld torque; (T, 3).

    Commands are pulls [N], a reference angle and its rate, else 0.
    """
    out, aimed = np.zeros((len(commands), 3)), np.zeros((len(commands), 4))
    aimed[:, : commands.shape[1]] = commands
    sides = np.array(SIDES)
    state = at_rest(drive, sides * WRIST.pretension, WRIST.length, PCC.taut(WRIST, np.zeros(1)))
    _drive(drive, state, Sides(segments(WRIST, 1)[None], sides), np.array([1.0, 0.0, 0.0]), aimed, out, period)
    return out


def motor_of_side(drive: LaggedDrive | SpoolDrive) -> Motor:
    """A side's motor: its stiffness is that of both its tendons."""
    return Motor(*drive.motor.tolist())._replace(stiffness=float(drive.stiffness[0]))


def driven(actuator: Actuator, period: float = PERIOD) -> LaggedDrive | SpoolDrive:
    drive = drive_of(actuator, SIDES, period)
    assert isinstance(drive, LaggedDrive | SpoolDrive)
    return drive


def run(
    name: str, actuator: Actuator, plant: Plant | None = None, gains: tuple[float, ...] = (),
    reference: Reference = MOVE,
) -> Outcome:  # fmt: skip
    course = motion(reference, WRIST, 4.0, PERIOD)
    loop, row = Loop(actuator=actuator, plant=plant or Plant()), np.array([gains]).reshape(1, -1)
    return rollout(controller(name), row, [course], np.zeros(1, np.int64), loop, WRIST, record=True, threads=1)


@pytest.mark.slow
def test_lagged_pull_approaches_a_step_with_its_time_constant_in_whole_steps() -> None:
    drive = driven(Actuator(level="lagged", lag=0.05))
    pull = delivered(drive, np.tile([44.0, 4.0, 0.0], (500, 1)))
    time = (np.arange(500) + 1) * PERIOD
    quantum = motor_of_side(drive).stiffness * motor_of_side(drive).step
    assert np.abs(pull[:, 0] - (44.0 - 40.0 * np.exp(-time / 0.05))).max() < 0.5 * quantum + 0.4
    np.testing.assert_allclose(pull[:, :2] / quantum, np.rint(pull[:, :2] / quantum), atol=1e-9)
    assert (pull[:, 2] == 0.0).all(), "a lag is no limit"
    assert np.abs(pull[:, 1] - 4.0).max() <= 0.5 * quantum + 1e-9


def test_lagged_pull_grows_no_faster_than_the_motor_turns() -> None:
    drive = driven(Actuator(level="lagged", lag=1e-4, step_rate=500.0))
    pull = delivered(drive, np.tile([100.0, 4.0, 0.0], (100, 1)))[:, 0]
    slope = (pull[50] - pull[0]) / (50 * PERIOD)
    assert slope == pytest.approx(motor_of_side(drive).stiffness * motor_of_side(drive).speed, rel=0.05)


@pytest.mark.slow
def test_a_stepper_keeps_its_speed_and_acceleration_and_stops_within_a_step_of_its_target() -> None:
    drive = driven(Actuator(level="tendon"))
    length = delivered(drive, np.tile([4.0, 4.0, 0.8], (500, 1)))[:, 0]
    fine = length / motor_of_side(drive).step
    np.testing.assert_allclose(fine, np.rint(fine), atol=1e-6)
    speed = np.diff(length) / PERIOD
    assert speed.max() <= motor_of_side(drive).speed + motor_of_side(drive).step / PERIOD
    begun = 4  # ticks until the first rate has taken effect
    ramp = 2.0 * np.polyfit(PERIOD * np.arange(20), length[begun : begun + 20], 2)[0]
    assert ramp == pytest.approx(motor_of_side(drive).acceleration, rel=0.15)
    target = 4.0 / motor_of_side(drive).stiffness + WRIST.length - _plus_length(0.8)
    assert length[-1] == pytest.approx(target, abs=motor_of_side(drive).step)
    assert length.max() <= target + 2 * motor_of_side(drive).step


@pytest.mark.parametrize("side", [0, 1])
def test_a_stepper_withholds_the_torque_of_what_it_cannot_reel_in_before_it_stops(side: int) -> None:
    """After a period from rest it moves at a h and has come a h^2; to stop takes a h^2/2 more. The arm is c."""
    drive = driven(Actuator(level="tendon"))
    commands = np.tile([4.0, 4.0, 0.0], (1000, 1))
    commands[0:, side] = 44.0
    torque = delivered(drive, commands)[:, 2]
    motor, sign = motor_of_side(drive), 1.0 - 2.0 * side
    short = 40.0 / motor.stiffness - 1.5 * motor.acceleration * PERIOD**2
    arm = WRIST.tendon_offset
    assert torque[0] == pytest.approx(sign * arm * motor.stiffness * short, rel=1e-9)
    assert (np.diff(sign * torque) <= 0.0).all() and (torque[-500:] == 0.0).all(), "it catches up"


def test_a_stepper_that_keeps_up_withholds_nothing() -> None:
    """Speed and acceleration are within the motor's; the profile's own braking distance is no shortfall."""
    drive = driven(Actuator(level="tendon"))
    time = PERIOD * np.arange(2000)
    commands = np.stack([4.0 + 0.0 * time, 4.0 + 0.0 * time, 0.2 * (1.0 - np.cos(2.0 * time))], axis=1)
    length, _, torque = delivered(drive, commands).T
    assert np.ptp(length) > 50 * motor_of_side(drive).step and (torque == 0.0).all()


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_spools_told_a_rate_move_with_the_reference_and_else_lag_by_braking(
    way: float,
) -> None:
    drive = driven(Actuator(level="tendon"))
    rate, time = 0.8 * way, PERIOD * np.arange(500)
    still = np.full_like(time, 4.0)
    told = delivered(drive, np.stack([still, still, rate * time, np.full_like(time, rate)], axis=1))
    late = delivered(drive, np.stack([still, still, rate * time], axis=1))
    angle, motor = rate * time[400:], motor_of_side(drive)
    wanted = 4.0 / motor.stiffness + WRIST.length - np.array([_plus_length(theta) for theta in angle])
    speed = abs(np.diff(wanted) / PERIOD).max()
    lag = way * (wanted - late[400:, 0])
    late = speed * (motor.delay + 0.5 * PERIOD)
    assert lag == pytest.approx(speed**2 / (2.0 * motor.acceleration) + late, abs=2.0 * motor.step)
    assert told[400:, 0] == pytest.approx(wanted + 0.5 * way * speed * PERIOD, abs=1.1 * motor.step)


def test_what_acts_over_a_coarse_period_is_the_spool_in_its_middle() -> None:
    """It goes on within the period: it is not at the period's end from its beginning."""
    period = 0.01
    drive = driven(Actuator(level="tendon"), period)
    time, still = period * np.arange(60.0), np.full(60, 4.0)
    angle, rate = 0.2 * (1.0 - np.cos(3.0 * time)), 0.6 * np.sin(3.0 * time)
    length = delivered(drive, np.stack([still, still, angle, rate], axis=1), period)[:, 0]
    middle, end = (
        [_plus_length(0.2 * (1.0 - math.cos(3.0 * (begin + share * period)))) for begin in time] for share in (0.5, 1.0)
    )
    reeled = length - 4.0 / motor_of_side(drive).stiffness
    assert np.abs(reeled - (WRIST.length - np.array(middle)))[5:].max() < 2.0 * motor_of_side(drive).step
    assert np.abs(reeled - (WRIST.length - np.array(end)))[5:].max() > 3.0 * motor_of_side(drive).step


def test_a_lagged_motor_withholds_what_its_speed_does() -> None:
    drive = driven(Actuator(level="lagged", lag=1e-4, step_rate=500.0))
    torque = delivered(drive, np.tile([4.0, 100.0, 0.0], (100, 1)))[:, 2]
    motor = motor_of_side(drive)
    share = PERIOD / (motor.lag + PERIOD)
    most = motor.stiffness * motor.speed * PERIOD
    assert torque[0] == pytest.approx(-WRIST.tendon_offset * (96.0 * share - most), rel=1e-9)


def _plus_length(theta: float) -> float:
    """Four straight spans between five discs, each bending by theta/4, at the offset +c (E1 and geometry)."""
    span = theta / 4
    return 8 * (WRIST.length / theta - WRIST.tendon_offset) * np.sin(span / 2)


def test_elastic_tendons_only_pull_and_stiff_ones_hold_a_softer_wrist() -> None:
    soft = Plant(stiffness_scale=0.8)
    ideal = run("feedforward", Actuator(), soft)
    tendon = run("feedforward", Actuator(level="tendon"), soft)
    for side in ("plus", "minus"):
        assert tendon.column(f"acting_{side}", 0).min() >= 0.0
    assert tendon.metrics["steady_state"][0] < 0.05 * ideal.metrics["steady_state"][0]


def test_friction_takes_from_a_tendon_that_reels_in_and_adds_to_one_that_pays_out() -> None:
    """So the wrist lags on the way out and on the way back of a slow sine."""
    sine = Reference(kind="sine", frequency=0.5)
    free, rubbing = (
        run("feedforward", Actuator(level="tendon", friction=f), reference=sine).column("theta", 0) for f in (0.0, 0.3)
    )
    out, back = slice(300, 800), slice(1300, 1800)
    assert (rubbing - free)[out].max() < -1e-4 < 1e-4 < (rubbing - free)[back].min()


def test_ideal_actuators_and_sensors_act_and_see_what_is_commanded_and_there() -> None:
    outcome = run("computed-torque", Actuator(), gains=(50.0, 1.0))
    for side in ("plus", "minus"):
        assert (outcome.column(f"acting_{side}", 0) == outcome.column(f"tension_{side}", 0)).all()
    assert (outcome.column("seen", 0) == outcome.column("theta", 0)).all()


# Lengths on the + side's spool, over those at the start [um], in the middle of 12 ticks of 10 ms, by version.
MOVED = {2: (0.0, 0.0, 0.0, 14.7, 88.4, 235.6, 397.6, 618.5, 913.0, 1295.9, 1678.8, 2032.2)}


def test_the_drive_of_this_version_delivers_what_is_recorded_of_it() -> None:
    """Where motors deliver something else for the same settings, raise DRIVE and record it anew: what was tuned before
    is of another drive."""
    drive = drive_of(Actuator(level="tendon"), period=1e-2)
    commands = np.zeros((12, 4))
    commands[:, 0], commands[:, 1] = 2 * WRIST.pretension, 2 * WRIST.pretension
    commands[3:, 0] += 20.0
    commands[6:, 2:] = np.stack([0.02 * np.arange(6), np.full(6, 2.0)], axis=1)
    spools = delivered(drive, commands, 1e-2)[:, 0]
    assert 1e6 * (spools - spools[0]) == pytest.approx(MOVED[DRIVE], abs=0.1)
