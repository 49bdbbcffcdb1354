"""Rotors with inertia on their magnetic springs, by the board's pins alone, against closed forms and solve_ivp."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from tests.bench.test_motors import MS, RADIUS, STEP, Pins
from wristctl.arrays import Array
from wristctl.bench.motors import stepper_of
from wristctl.config.bench import BenchSettings, Motors

ROTOR, SPOOL, DAMPING, HOLDING = 3e-5, 7e-7, 2e-3, 0.32
"""Defaults [kg m^2], [N m s/rad], [N m]."""
FREE = (0.5, 0.5, 0.5, 0.5)
"""Slack [m] that no test takes up."""
TURN = 64 * STEP
TEETH = 50
"""Electrical turns in one of the shaft."""


def pins(**motors: object) -> Pins:
    """A wrist whose rotors have the inertia of the defaults unless `motors` says otherwise."""
    given: dict[str, Any] = {"rotor_inertia": ROTOR, "spool_inertia": SPOOL, **motors}
    return Pins(**given)


def ramped(wrist: Pins, acceleration: float, seconds: float, axis: int = 0) -> None:
    """Step an axis so that its field is never more than half a step from a ramp from rest [steps/s^2]."""
    for k in range(math.floor(0.5 * acceleration * seconds**2 + 0.5)):
        wrist.step(round(16e6 * math.sqrt((2.0 * k + 1.0) / acceleration)), axis)


def turned(wrist: Pins, rate: float, begin: float, end: float, *axes: int) -> None:
    """Steps of these axes together at a constant rate [1/s] between two times [s]."""
    for k in range(round((end - begin) * rate)):
        wrist.step(round(16e6 * (begin + k / rate)), *axes)


def lag(wrist: Pins, milliseconds: int, axis: int = 0) -> float:
    """Length [m] by which a spool stands behind what its drive counts."""
    motors = wrist.settings.motors
    truth = wrist.after(milliseconds).truth()
    return float(STEP * wrist.wrist.motion.steps[axis] - motors.slack[axis] - truth.reeled[-1, axis])


@pytest.mark.parametrize(("inertia", "torque"), [(ROTOR, HOLDING), (1.2e-4, HOLDING), (ROTOR, 0.64)])
def test_a_rotor_rings_at_its_natural_frequency_and_dies_out_by_its_damping(inertia: float, torque: float) -> None:
    """After one microstep: sqrt(teeth x torque / inertia), and exp(-damping t / (2 inertia))."""
    ringing = pins(slack=FREE, rotor_inertia=inertia, holding_torque=torque)
    ringing.step(MS // 2, 0)
    swing = ringing.after(120).truth().reeled[:, 0] + FREE[0] - STEP
    whole = inertia + SPOOL
    natural, decay = math.sqrt(TEETH * torque / whole), DAMPING / (2.0 * whole)
    time, damped = 1e-3 * np.arange(len(swing)), math.sqrt(natural**2 - decay**2)
    exact = -STEP * np.exp(-decay * time) * (np.cos(damped * time) + decay / damped * np.sin(damped * time))
    assert natural / (2.0 * math.pi) == pytest.approx(
        {ROTOR: 114.0, 1.2e-4: 58.0}[inertia] * math.sqrt(torque / 0.32), rel=0.01
    )
    assert np.abs(swing - exact).max() < 0.05 * STEP


def test_a_rotor_lags_behind_its_field_by_the_angle_at_which_it_holds_its_tendon() -> None:
    """asin(pull/holding) of an electrical turn; all four alike, so that the wrist stays straight."""
    wrist = pins()
    turned(wrist, 500.0, 0.001, 0.241, 0, 1, 2, 3)
    behind = lag(wrist, 500)
    pull = wrist.wrist.truth().pull[-1]
    assert pull[0] > 0.7 * HOLDING / RADIUS and np.ptp(pull) < 1e-3
    assert behind == pytest.approx(TURN / (2.0 * math.pi) * math.asin(pull[0] * RADIUS / HOLDING), rel=1e-3)


def test_a_lightly_loaded_rotor_makes_its_tendon_softer_by_the_spring_of_its_field() -> None:
    wrist = pins()
    turned(wrist, 500.0, 0.001, 0.041, 0, 1, 2, 3)
    pull, steps = wrist.after(300).truth().pull[-1], wrist.wrist.motion.steps[0]
    assert pull == pytest.approx([wrist.settings.stiffness_with_field * steps * STEP] * 4, rel=1e-3)
    assert pull[0] < 0.94 * wrist.settings.actuator.tendon_stiffness * steps * STEP
    exact = BenchSettings(motors=Motors(rotor_inertia=0.0))
    assert exact.stiffness_with_field == exact.actuator.tendon_stiffness


def test_a_taut_tendon_is_a_spring_beside_the_field_that_neither_feeds_nor_damps_a_swing() -> None:
    """From 6 N at power-on; field and tendon together have the closed form's frequency and size of swing."""
    wrist = pins(slack=(-3e-4,) * 4, damping=0.0)
    swing = wrist.after(2002).truth().reeled[2:, 0]
    tendon = wrist.settings.actuator.tendon_stiffness
    stiffness = TEETH * HOLDING / RADIUS**2 + tendon
    for part in (swing[:500], swing[-500:]):
        assert np.ptp(part) == pytest.approx(2.0 * 3e-4 * tendon / stiffness, rel=0.03)
    spectrum = np.abs(np.fft.rfft(swing - swing.mean()))
    natural = math.sqrt(stiffness * RADIUS**2 / (ROTOR + SPOOL)) / (2.0 * math.pi)
    assert 0.5 * np.argmax(spectrum) == pytest.approx(natural, abs=1.0)


def followed(acceleration: float, seconds: float, motors: dict[str, Any]) -> bool:
    """Whether the bench's rotor follows a ramp from rest."""
    wrist = pins(slack=FREE, **motors)
    ramped(wrist, acceleration, seconds)
    return lag(wrist, math.floor(1e3 * seconds)) < 0.5 * TURN


def integrated(acceleration: float, seconds: float, motors: Motors) -> bool:
    """Whether a rotor does by solve_ivp, in angles of the shaft, whose field does not step."""
    inertia = motors.rotor_inertia + motors.spool_inertia
    to_shaft = 2.0 * math.pi / 3200.0

    def rates(time: float, state: Array) -> tuple[float, float]:
        angle, speed = state
        steps = acceleration * time
        share = 1.0
        if motors.top_speed is not None and steps > motors.corner_speed:
            share = max(0.0, (motors.top_speed - steps) / (motors.top_speed - motors.corner_speed))
        field = 0.5 * acceleration * to_shaft * time**2
        torque = motors.holding_torque * share * math.sin(TEETH * (field - angle)) - motors.damping * speed
        return speed, torque / inertia

    end = solve_ivp(rates, (0.0, seconds), (0.0, 0.0), rtol=1e-8, atol=1e-9).y[0, -1]
    return bool(0.5 * acceleration * to_shaft * seconds**2 - end < math.pi / TEETH)


def largest(follows: Any, low: float, high: float) -> float:
    """The largest ramp [steps/s^2] that is followed, within 0.2 %."""
    assert follows(low) and not follows(high)
    while high > 1.002 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if follows(middle) else (low, middle)
    return low


@pytest.mark.parametrize(
    "motors", [{}, {"damping": 0.0}, {"corner_speed": 8e3, "top_speed": 6e4}], ids=["default", "undamped", "falling"]
)
def test_the_largest_ramp_from_rest_is_that_of_an_independent_integration(motors: dict[str, float]) -> None:
    """Without damping and at full torque it is 0.725 of holding / inertia, by the work done up to the farthest lag."""
    given = {"spool_inertia": 2.7e-4, **motors}
    settings = Motors.model_validate({"rotor_inertia": ROTOR, **given})
    standing = HOLDING / 3e-4 * 3200.0 / (2.0 * math.pi)
    seconds = 0.06
    bench = largest(lambda ramp: followed(ramp, seconds, given), 0.3 * standing, 1.2 * standing)
    assert bench == pytest.approx(
        largest(lambda ramp: integrated(ramp, seconds, settings), 0.3 * standing, 1.2 * standing), rel=0.01
    )
    if motors == {"damping": 0.0}:
        assert bench == pytest.approx(0.7246 * standing, rel=0.01)


def test_a_heavier_spool_loses_steps_on_a_ramp_that_a_lighter_one_follows_and_never_finds_them_again() -> None:
    heavy = {"spool_inertia": 5.7e-4}
    assert followed(3e5, 0.06, {"spool_inertia": 2.7e-4}) and not followed(3e5, 0.06, heavy)
    lost = pins(slack=FREE, **heavy)
    ramped(lost, 3e5, 0.06)
    turns = lag(lost, 5000) / TURN
    assert turns > 0.5 and turns == pytest.approx(round(turns), abs=1e-3)


def test_a_field_that_jumps_by_less_than_half_a_turn_takes_its_rotor_along_and_by_more_the_other_way() -> None:
    for steps, lost in ((31, 0), (33, 1)):
        jumped = pins(slack=FREE)
        for _ in range(steps):
            jumped.step(MS, 0)
        assert lag(jumped, 500) == pytest.approx(lost * TURN, abs=1e-3 * STEP)


@pytest.mark.parametrize(
    ("motors", "share"),
    [({}, 1.0), ({"top_speed": 800.0}, 0.5), ({"corner_speed": 200.0, "top_speed": 800.0}, 2.0 / 3.0),
     ({"corner_speed": 500.0, "top_speed": 800.0}, 1.0)],
)  # fmt: skip
def test_the_pull_at_which_a_turning_motor_loses_its_field_falls_with_speed(
    motors: dict[str, float], share: float
) -> None:
    """At 400 steps/s, where it lags by a quarter of a turn: the share of its torque that it has at that speed."""
    rate, slack, begin = 400.0, 1e-3, 1e-3
    wrist = pins(slack=(slack,) * 4, **motors)
    turned(wrist, rate, begin, 0.8, 0, 1, 2, 3)
    truth = wrist.after(800).truth()
    behind = STEP * (rate * (truth.time - 0.5e-3 - begin) + 0.5) - slack - truth.reeled[:, 0]
    first = np.flatnonzero(behind > 0.25 * TURN)[0]
    assert truth.pull[first, 0] == pytest.approx(share * HOLDING / RADIUS, rel=0.03)


def test_a_rotor_that_turns_freely_lags_by_what_its_damping_takes() -> None:
    wrist = pins(slack=FREE, damping=0.02)
    turned(wrist, 4000.0, 0.001, 0.3005, 0)
    taken = 0.02 * 4000.0 * 2.0 * math.pi / 3200.0
    behind = STEP * (4000.0 * (0.2995 - 0.001) + 0.5) - FREE[0] - wrist.after(300).truth().reeled[-1, 0]
    assert behind == pytest.approx(TURN / (2.0 * math.pi) * math.asin(taken / HOLDING), rel=0.02)


def test_substeps_keep_a_rotor_that_swings_fast_on_its_spring() -> None:
    """A small rotor in a strong field, 600 Hz: without damping its swing neither grows nor dies out."""
    small = {"rotor_inertia": 4e-6, "spool_inertia": 0.0, "holding_torque": 1.26, "damping": 0.0}
    assert stepper_of(BenchSettings(motors=Motors.model_validate(small))).substeps > 30
    wrist = pins(slack=FREE, **small)
    wrist.step(MS // 2, 0)
    swing = wrist.after(2000).truth().reeled[:, 0] + FREE[0] - STEP
    for part in (swing[:500], swing[-500:]):
        assert np.abs(part).max() == pytest.approx(STEP, rel=0.01)


def test_a_released_rotor_stands_and_switched_on_swings_into_the_nearest_place_that_fits() -> None:
    wrist = pins(slack=FREE)
    wrist.after(2)
    wrist.edge(2 * MS + 1, "C", 0xF)
    wrist.steps(94, 0, begin=2 * MS + 10)
    assert lag(wrist, 50) == pytest.approx(94 * STEP)
    wrist.edge(50 * MS + 1, "C", 0x0)
    assert lag(wrist, 600) == pytest.approx(TURN, abs=1e-3 * STEP)


def test_a_torque_that_falls_to_none_before_its_corner_is_refused() -> None:
    with pytest.raises(ValidationError, match="corner_speed"):
        Motors(corner_speed=5000.0, top_speed=4000.0)
