"""Which swings a linearisation says nothing about."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.stability.conftest import CAMERA, LAGGED, PID, TENDON, row
from wristctl.config.loop import Loop
from wristctl.config.plant import Disturbances, Plant, Push, Sensor, TrueActuator
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.stability.linear_range import LinearityLimit, Swing, linearity_limits
from wristctl.stability.linearise import LinearLoop
from wristctl.stability.loop_analysis import AnalysedRow
from wristctl.stability.sampled_loop import Complex, LinearTick, Mode, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading

WRIST = WristParameters()
BEHIND = Loop(control_period=5e-3, actuator=TENDON, sensor=CAMERA)


def _limits(own: AnalysedRow, degrees: float = 0.0) -> dict[str, LinearityLimit]:
    found = own.analysed(math.radians(degrees))
    assert found is not None
    return {each.what: each for each in found.limits}


def _with(loop: Loop, **plant: object) -> Loop:
    return loop.model_copy(update={"plant": Plant.model_validate(plant)})


def _swing(hertz: float, motors: float = 0.0, pulls: float = 0.0, factor: float = 1.0, frames: bool = True) -> Swing:
    """A swing of 1 rad at so many Hz, of a loop that is written out: its motors' counts and pulls (either side's)."""
    rate = 2.0j * math.pi * hertz
    nothing, tension = np.zeros(4), np.array([[pulls, 0.0, 0.0, 0.0], [-pulls, 0.0, 0.0, 0.0]])
    rows = {"theta": np.eye(4)[0], "rate": np.eye(4)[1], "tension": tension}
    loop = SampledLoop(5e-3, [LinearTick(np.eye(4), nothing, nothing, nothing, True, rows)])
    names = ("angle", "rate", "motor", "motor")
    linear = LinearLoop(loop, loop, math.radians(-25.0), 0.1, (9.0, 5.0), names, frames, 0.0)
    states: Complex = 3.0 * np.array([[1.0, rate, motors, -motors]], np.complex128)
    return Swing(linear, Mode(0.0, hertz, states) if hertz else None, factor)


def _told(swing: Swing, loop: Loop, friction: FrictionReading = "slipping") -> dict[str, LinearityLimit]:
    law = controller("smc-tracking")
    gains = {"lambda": 20.0, "kappa": 0.0, "k": 100.0, "phi": 3.0}
    return {each.what: each for each in linearity_limits(swing, loop, WRIST, friction, law.surface, gains)}


EVERYTHING = Loop(
    control_period=5e-3, actuator=TENDON, sensor=Sensor(level="camera"),
    plant=Plant(
        end_stop_deg=40.0, actuator=TrueActuator(backlash=1e-4, torque=0.4, broken_at=1.0, slips_at=2.0, slip=1e-3)
    ),
    disturbances=Disturbances(load=0.5, push=Push(force=-1.0)),
)  # fmt: skip


@pytest.mark.parametrize("reading", ["slipping", "stuck"])
def test_each_effect_is_felt_below_its_swing_or_above_it_and_those_above_come_last(reading: FrictionReading) -> None:
    found = _told(_swing(0.0), EVERYTHING, reading)
    below = {"the camera's noise", "a motor's microstep", "backlash"}
    above = {"a motor's speed", "the stepper's acceleration", "a slack tendon", "saturation", "the end stops"}
    above |= {"the boundary layer's end", "a person's push", "a tendon that breaks", "a spool that slips"}
    above |= {"a motor that stalls"}
    (above if reading == "stuck" else below).add(
        "friction that slips" if reading == "stuck" else "friction that sticks"
    )
    assert {name: each.above for name, each in found.items()} == dict.fromkeys(below, False) | dict.fromkeys(
        above, True
    )
    order = [(each.above, math.isnan(each.swing)) for each in found.values()]
    assert order == sorted(order), "and what has no swing after what has one"
    for either in (False, True):
        swings = [each.swing for each in found.values() if each.above is either and math.isfinite(each.swing)]
        assert swings == sorted(swings) and len(swings) >= 2
    assert found["the end stops"].swing == pytest.approx(math.radians(15.0))
    assert found["a slack tendon"].swing == pytest.approx(5.0 / (TENDON.tendon_stiffness * WRIST.tendon_offset))
    assert all(math.isnan(found[name].swing) for name in ("a motor's speed", "saturation", "the boundary layer's end"))


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_limits_of_motors_and_tensions_are_those_over_what_a_radian_makes_of_them(factor: float) -> None:
    """Motors that are told a factor less, since what stands behind them is a factor stronger."""
    hertz, length, per_radian = 3.0, TENDON.step_length, 2.0 * 1e-3
    omega = 2.0 * math.pi * hertz
    found = _told(_swing(hertz, 1e-3 * factor, 7.0 * factor, factor), EVERYTHING)
    assert found["a motor's microstep"].swing == pytest.approx(0.5 * length / per_radian)
    assert found["a motor's speed"].swing == pytest.approx(length * TENDON.step_rate / (omega * per_radian))
    fastest = length * TENDON.step_acceleration
    assert found["the stepper's acceleration"].swing == pytest.approx(0.3 * fastest / (omega**2 * per_radian))
    assert found["saturation"].swing == pytest.approx((WRIST.tension_limit - 9.0) / 14.0)
    assert found["the boundary layer's end"].swing == pytest.approx(3.0 / abs(20.0 + 1j * omega))
    at_once = _told(_swing(hertz, 1e-3, 7.0, factor, frames=False), EVERYTHING)
    assert at_once["saturation"].swing == pytest.approx((WRIST.tension_limit - 9.0) / 14.0)
    still = _told(_swing(hertz), EVERYTHING)
    assert math.isinf(still["a motor's speed"].swing) and math.isinf(still["saturation"].swing)
    pulls = 2.0 * LAGGED.tendon_stiffness * 1e-3  # motors that pull are counted by their pulls
    lagged = _told(_swing(hertz, pulls), EVERYTHING.model_copy(update={"actuator": LAGGED}))
    assert lagged["a motor's microstep"].swing == pytest.approx(0.5 * length / per_radian)
    assert lagged["a motor's speed"].swing == pytest.approx(length * LAGGED.step_rate / (omega * per_radian))
    assert "a slack tendon" not in lagged and "the stepper's acceleration" not in lagged


@pytest.mark.slow
def test_saturation_is_felt_where_a_swing_uses_up_the_tension_that_is_left() -> None:
    """At its margin, half the control rate, a PD loop's torque is its derivative's: Kd |rate|."""
    own = row("pid", PID, Loop())
    found, linear = _limits(own)["saturation"], own.linear(0.0)
    assert linear is not None
    (tick,) = linear.closed.ticks
    state = linear.closed.modes(own.analysed(0.0).margins.most.value)[0].states[0]  # type: ignore[union-attr]
    torque = abs((tick.outputs["torque_wanted"] @ state) / (tick.outputs["theta"] @ state))
    left = (own.wrist.tension_limit - own.wrist.pretension) * 2.0 * own.wrist.tendon_offset
    assert found.above and found.swing == pytest.approx(left / torque, rel=1e-5)
    assert "saturation" not in _limits(row("pid", PID, Loop(limits=False)))
    bent = own.linear(math.radians(30.0))
    assert bent is not None and bent.tensions[0] > bent.tensions[1]
    assert f"{own.wrist.tension_limit - bent.tensions[0]:.3g} N below" in _limits(own, 30.0)["saturation"].read_as


@pytest.mark.slow
def test_the_boundary_layer_ends_where_sigma_has_its_width() -> None:
    gains = {"lambda": 20.0, "kappa": 250.0, "k": 100.0, "phi": 10.0}
    narrow, wide = (_limits(row("smc-tracking", gains | {"phi": phi}, BEHIND)) for phi in (1.0, 10.0))
    name = "the boundary layer's end"
    assert wide[name].above and wide[name].swing == pytest.approx(10.0 * narrow[name].swing, rel=1e-4)
    finer = BEHIND.model_copy(update={"control_period": 2.5e-3})  # at 5 ms samples are too far apart for a derivative
    found = row("smc-tracking", gains, finer).analysed(0.0)
    assert found is not None
    omega = found.margins.most.omega
    swing = _limits(row("smc-tracking", gains, finer))[name].swing
    assert swing == pytest.approx(10.0 / abs(20.0 + 250.0 / (1j * omega) + 1j * omega), rel=0.02)
    assert name not in _limits(row("computed-torque", "default", BEHIND))


@pytest.mark.slow
def test_limits_of_motors_scale_with_what_the_motors_are() -> None:
    gains = "hardware"
    plain = _limits(row("smc-tracking", gains, BEHIND))
    fine = _limits(
        row("smc-tracking", gains, BEHIND.model_copy(update={"actuator": TENDON.model_copy(update={"microstep": 32})}))
    )
    assert fine["a motor's microstep"].swing == pytest.approx(0.5 * plain["a motor's microstep"].swing, rel=1e-6)
    assert fine["the stepper's acceleration"].swing == pytest.approx(0.5 * plain["the stepper's acceleration"].swing)
    slow = _limits(row("smc-tracking", gains, _with(BEHIND, actuator={"step_acceleration": "x0.25"})))
    assert slow["the stepper's acceleration"].swing == pytest.approx(0.25 * plain["the stepper's acceleration"].swing)
    assert slow["a motor's speed"].swing == pytest.approx(plain["a motor's speed"].swing)
    assert plain["a motor's microstep"].above is False and plain["the stepper's acceleration"].above


@pytest.mark.slow
def test_a_microstep_swallows_what_makes_a_motor_swing_by_half_of_it() -> None:
    """A lagged motor's pull is the torque over the arm, less by its lag."""
    own = row("pid", {"Kp": 0.05, "Ki": 1.0, "Kd": 1e-4}, Loop(plant_segments=1, actuator=LAGGED))
    found, linear = _limits(own)["a motor's microstep"], own.analysed(0.0)
    assert linear is not None
    (tick,) = linear.linear.closed.ticks
    mode = linear.linear.closed.modes(linear.margins.most.value)[0]
    torque = abs((tick.outputs["torque_wanted"] @ mode.states[0]) / (tick.outputs["theta"] @ mode.states[0]))
    pull = 2.0 * LAGGED.tendon_stiffness * LAGGED.step_length
    lag = math.hypot(1.0, 2.0 * math.pi * mode.frequency * LAGGED.lag)
    assert found.swing == pytest.approx(0.5 * pull * lag * own.wrist.tendon_offset / torque, rel=0.03)


@pytest.mark.slow
def test_a_controller_sees_as_much_of_a_swing_whatever_stands_behind_its_motors() -> None:
    """With pulleys of twice the size a loop begins to swing at half the gain, and its motors turn for it as before."""
    limits = []
    for pulley in ("x1", "x2"):
        found = _limits(row("smc-tracking", "hardware", _with(BEHIND, actuator={"pulley_radius": pulley})))
        limits.append(
            [found[each].swing for each in ("saturation", "the stepper's acceleration", "a motor's microstep")]
        )
    assert limits[1] == pytest.approx(limits[0], rel=0.02)


@pytest.mark.slow
def test_a_tendon_goes_slack_where_a_turn_takes_up_its_stretch() -> None:
    own = row("smc-tracking", "hardware", BEHIND)
    stretch = own.wrist.pretension / TENDON.tendon_stiffness
    assert _limits(own)["a slack tendon"].swing == pytest.approx(stretch / own.wrist.tendon_offset, rel=1e-6)


@pytest.mark.slow
def test_friction_is_read_one_way_and_felt_the_other() -> None:
    turned = TENDON.presliding / row("pid", PID, BEHIND).wrist.tendon_offset
    sliding, stuck = (_limits(row("smc-tracking", "hardware", BEHIND, each)) for each in ("slipping", "stuck"))
    assert (sliding["friction that sticks"].above, stuck["friction that slips"].above) == (False, True)
    assert sliding["friction that sticks"].swing == stuck["friction that slips"].swing == pytest.approx(turned)
    smooth = BEHIND.model_copy(update={"actuator": TENDON.model_copy(update={"friction": 0.0})})
    assert not any("friction" in each for each in _limits(row("smc-tracking", "hardware", smooth)))


@pytest.mark.slow
def test_what_happens_at_times_is_listed_as_left_out() -> None:
    loop = _with(BEHIND, end_stop_deg=40.0, actuator={"backlash": 1e-4, "torque": 0.4, "broken_at": 1.0})
    loop = loop.model_copy(
        update={"disturbances": Disturbances(push=Push(force=1.0)), "sensor": Sensor(level="camera")}
    )
    found = _limits(row("smc-tracking", "hardware", loop), 10.0)
    assert found["the end stops"].swing == pytest.approx(math.radians(30.0))
    assert found["backlash"].swing == pytest.approx(1e-4 / row("pid", PID, loop).wrist.tendon_offset)
    assert math.degrees(found["the camera's noise"].swing) == pytest.approx(0.1)
    for name in ("a person's push", "a tendon that breaks", "a motor that stalls"):
        assert found[name].read_as == "left out" and math.isnan(found[name].swing)
    assert "a spool that slips" not in found
    assert not TrueActuator().backlash and "backlash" not in _limits(row("smc-tracking", "hardware", BEHIND))


@pytest.mark.parametrize("bend", [(-25.0, 0.0), (0.0, 25.0), (15.0, -20.0)])
def test_the_end_stops_are_as_far_as_the_bend_of_both_planes_leaves_room(bend: tuple[float, float]) -> None:
    swing = _swing(0.0)
    linear = replace(swing.linear, theta=np.radians(bend), tensions=(5.0, 6.0, 7.0, 8.0))
    assert linear.planes == 2
    found = _told(replace(swing, linear=linear), EVERYTHING)
    assert found["the end stops"].swing == pytest.approx(math.radians(15.0))
    assert found["saturation"].read_as == f"none: tensions rest {WRIST.tension_limit - 8.0:.3g} N below their limit"


@pytest.mark.parametrize("reading", ["slipping", "stuck"])
def test_of_tendons_at_several_radii_the_outer_ones_friction_turns_and_the_inner_ones_play_is_felt_longest(
    reading: FrictionReading,
) -> None:
    radii = (0.012, 0.02, 0.016)
    places = tuple({"angle_deg": 120.0 * k, "radius": radius} for k, radius in enumerate(radii))
    wrist = WristParameters.model_validate({"tendons": places})
    swing = _swing(0.0)
    linear = replace(swing.linear, theta=np.zeros(2), tensions=(6.0, 5.0, 7.0))
    limits = linearity_limits(replace(swing, linear=linear), EVERYTHING, wrist, reading, None, {})
    found = {each.what: each.swing for each in limits}
    friction = "friction that sticks" if reading == "slipping" else "friction that slips"
    assert found[friction] == pytest.approx(TENDON.presliding / 0.02)
    assert found["backlash"] == pytest.approx(1e-4 / 0.012)
    assert found["a slack tendon"] == pytest.approx(5.0 / (TENDON.tendon_stiffness * 0.02))


def test_lagged_motors_have_steps_and_a_speed() -> None:
    found = _limits(row("computed-torque", "default", Loop(actuator=LAGGED)))
    assert {"a motor's microstep", "a motor's speed", "saturation"} == set(found)
    assert np.isfinite([each.swing for each in found.values()]).all()
