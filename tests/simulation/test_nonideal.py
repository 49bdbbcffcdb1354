"""What a real wrist has: backlash, creep, end stops and faults, against closed forms and the statics."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.spools import HOME, STIFF, WRIST, antagonists, minimum_jerk, spooled
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueActuator, TrueWrist
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.nonideal import is_ideal, nonideal_of, wears
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout


def test_a_tendon_that_is_held_relaxes_as_one_maxwell_branch_does() -> None:
    pull = spooled(np.full((3000, 2), HOME + 1e-4), STIFF, TrueActuator(creep=0.2, creep_time=0.7)).spool_plus
    time = 1e-3 * np.arange(3000)
    np.testing.assert_allclose(pull / pull[0], 1.0 - 0.2 * (1.0 - np.exp(-time / 0.7)), rtol=1e-12)


def test_a_loaded_spring_creeps_to_its_relaxed_stiffness() -> None:
    """Without tendons and gravity, under a small force: K before, (1 - f) K at last."""
    light = WRIST.model_copy(update={"gravity": (0.0, 0.0)})
    slack, force = np.full((20_000, 2), -0.05), 0.05
    at_once = spooled(slack, STIFF, plant=TrueWrist(), wrist=light, force=force).theta[-1]
    at_last = spooled(slack, STIFF, plant=TrueWrist(creep=0.25, creep_time=1.5), wrist=light, force=force).theta[-1]
    assert at_once == pytest.approx(force * WRIST.length / (2.0 * WRIST.stiffness), rel=0.2)
    assert at_last == pytest.approx(at_once / 0.75, rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("dissipation", [0.0, 3.0])
def test_end_stops_throw_back_no_faster_than_they_are_hit_and_hold(sign: float, dissipation: float) -> None:
    """A wrist thrown at its stop without springs' damping, tendons or gravity."""
    free = WRIST.model_copy(update={"gravity": (0.0, 0.0), "damping": 1e-9, "stiffness": 1e-9})
    stop = TrueWrist(end_stop_deg=30.0, end_stop_stiffness=50.0, end_stop_dissipation=dissipation)
    slack, rate = np.full((3000, 2), -0.05), np.array([6.0 * sign])
    done = spooled(slack, STIFF, plant=stop, wrist=free, h=1e-4, n=1, rate=rate)
    limit = np.radians(30.0)
    touching = np.flatnonzero(sign * done.theta > limit)
    first = touching[0]
    last = first + np.flatnonzero(sign * done.theta[first:] <= limit)[0] - 1
    rebound = abs(done.rate[last + 1]) / abs(done.rate[first])
    assert (sign * done.theta).max() < limit + np.radians(12.0)
    assert rebound == pytest.approx(1.0, abs=0.02) if dissipation == 0.0 else rebound < 0.6


def test_a_wrist_pressed_against_its_stop_bends_little_beyond_it() -> None:
    """By the torque that is left of the force over the stiffness of both; each of more segments stops at its share."""
    light = WRIST.model_copy(update={"gravity": (0.0, 0.0)})
    stop, limit = TrueWrist(end_stop_deg=20.0, end_stop_stiffness=50.0), np.radians(20.0)
    slack = np.full((3000, 2), -0.05)
    bend = spooled(slack, STIFF, plant=stop, wrist=light, force=20.0, n=1).theta[-1]
    arm = 0.5 * WRIST.length * np.sin(bend) / bend  # of a force at the tip of one arc, nearly
    expected = (20.0 * arm - WRIST.stiffness * limit) / (WRIST.stiffness + 50.0)
    assert bend - limit == pytest.approx(expected, rel=0.25)
    pulled, soft = slack + np.array([0.07, 0.0]), STIFF.model_copy(update={"tendon_stiffness": 2e3})
    one, four = (spooled(pulled, soft, plant=stop, wrist=light, n=n).theta[-1] - limit for n in (1, 4))
    assert one > 1e-3 and four == pytest.approx(one, rel=0.3)  # a tendon's moment is the same on each segment


@pytest.mark.parametrize(("stiffness", "sheath"), [(2e3, 0.0), (20e3, 1.0), (100e3, 3.0)])
def test_a_step_of_a_millisecond_is_as_good_as_twenty(stiffness: float, sheath: float) -> None:
    """Elastic tendons and friction are in the step's Jacobian: without, stiff tendons would ring or lag."""
    actuator = STIFF.model_copy(update={"tendon_stiffness": stiffness, "sheath": sheath})
    path = np.concatenate([minimum_jerk(0.0, 8e-3, 0.4), np.full(200, 8e-3), minimum_jerk(8e-3, 0.0, 0.4)])
    both = antagonists(path) + (WRIST.pretension / stiffness - HOME)
    coarse = spooled(both, actuator).theta
    fine = spooled(np.repeat(both, 20, axis=0), actuator, h=5e-5).theta[::20]
    assert np.degrees(np.abs(coarse - fine).max()) < 0.01


@pytest.mark.parametrize("sensor", ["ideal", "camera"])
def test_a_loop_of_ten_milliseconds_needs_nobody_to_choose_its_substeps(sensor: str) -> None:
    """Stiff tendons, much friction: RMSE within 1 % or 0.001 deg of twenty times the substeps (docs/accuracy.md)."""
    loop = Loop.model_validate(
        {
            "control_period": 1e-2,
            "actuator": {"level": "tendon", "tendon_stiffness": 1e5, "sheath": 3.0},
            "sensor": {"level": sensor},
        }
    )
    assert loop.steps == 20 and loop.model_copy(update={"actuator": Actuator(level="tendon")}).steps == 10
    own, fine = (loops([each]).metrics["rmse"][0] for each in (loop, loop.model_copy(update={"substeps": 400})))
    assert abs(own - fine) <= max(0.01 * fine, np.radians(0.001))


def test_a_spool_lags_in_its_backlash_and_no_further() -> None:
    path = np.concatenate([np.linspace(0.0, 1e-3, 200), np.linspace(1e-3, 0.0, 200), np.linspace(0.0, 1e-3, 200)])
    done = spooled(antagonists(path), STIFF, TrueActuator(backlash=2e-4))
    told = HOME + path
    np.testing.assert_allclose(done.given_plus[:200], told[:200], atol=1e-15)
    np.testing.assert_allclose(done.given_plus[200:400], np.minimum(told[199], told[200:400] + 2e-4), atol=1e-15)
    np.testing.assert_allclose(done.given_plus[400:], np.maximum(told[399] + 2e-4, told[400:]), atol=1e-15)


def test_one_of_two_tendons_that_breaks_leaves_half_the_pull() -> None:
    done = spooled(np.full((1000, 2), HOME), STIFF, TrueActuator(broken_at=0.5))
    assert done.spool_plus[499] == pytest.approx(2.0 * WRIST.pretension)
    assert done.spool_plus[500] == pytest.approx(WRIST.pretension) and done.spool_minus[500] > 1.9 * WRIST.pretension
    assert done.theta[-1] < -1e-3 and done.theta[499] == 0.0


def test_tendons_that_slip_stay_slipped() -> None:
    done = spooled(np.full((1000, 2), HOME + 1e-3), STIFF, TrueActuator(slips_at=0.5, slip=3e-4))
    np.testing.assert_allclose(done.given_plus[:500], HOME + 1e-3)
    np.testing.assert_allclose(done.given_plus[500:], HOME + 7e-4)


def test_a_motor_falls_back_by_electrical_turns_where_it_is_pulled_harder_than_it_holds() -> None:
    """Standing: by its torque. Turning at half of the speed at which it has none left: by half of that.

    Where its torque begins to fall at a quarter of that speed: by two thirds.
    """
    turn = 4 * STIFF.microstep * STIFF.step_length
    hardest = 2.0 * 0.3 / STIFF.pulley_radius
    ramp = minimum_jerk(0.0, 4e-3, 1.0)
    both = HOME + np.stack([ramp, ramp], axis=1)  # co-contracted: it stays straight
    top = 2.0 * np.diff(ramp).max() / 1e-3 / STIFF.step_length
    for corner_speed, top_speed, share in ((0.0, None, 1.0), (0.0, top, 0.5), (0.25 * top, top, 2.0 / 3.0)):
        motor = TrueActuator(torque=0.3, corner_speed=corner_speed, top_speed=top_speed)
        done = spooled(both, STIFF, motor)
        lost = (HOME + ramp) - done.given_plus
        assert lost[-1] > turn / 2
        np.testing.assert_allclose(lost / turn, np.rint(lost / turn), atol=1e-9)
        first = np.flatnonzero(lost > 0.0)[0]
        assert done.spool_plus[first - 1] > share * hardest * 0.99
        assert done.spool_plus[: first - 1].max() <= hardest * 1.001
        speed = np.diff(ramp).max() / 1e-3 if top_speed else 0.0
        assert top_speed is None or done.spool_plus[first - 1] < hardest, speed


@pytest.mark.parametrize(
    ("facts", "worn"),
    [
        ({}, False), ({"creep": 0.2}, False), ({"slip": 1e-3}, False), ({"top_speed": 9.0}, False),
        ({"backlash": 1e-4}, True), ({"broken_at": 0.5}, True), ({"slips_at": 0.5}, True), ({"torque": 0.3}, True),
    ],
    ids=str,
)  # fmt: skip
def test_one_fault_alone_is_enough_for_tendons_to_have_reeled_in_something_else_than_their_spools(
    facts: dict[str, float], worn: bool
) -> None:
    frictionless = STIFF.model_copy(update={"friction": 0.0})
    values = nonideal_of(TrueWrist(), frictionless, TrueActuator.model_validate(facts), 1e-3)
    assert wears(values) == worn and is_ideal(values) == (not worn and "creep" not in facts)
    assert not is_ideal(nonideal_of(TrueWrist(), STIFF, TrueActuator(), 1e-3)), "friction"
    for plant in (TrueWrist(creep=0.1), TrueWrist(end_stop_deg=30.0)):
        changed = nonideal_of(plant, frictionless, TrueActuator(), 1e-3)
        assert not is_ideal(changed) and not wears(changed)


def test_motors_that_are_no_steppers_and_stiff_tendons_have_none_of_it() -> None:
    facts = TrueActuator(backlash=1e-4, slips_at=0.5, slip=1e-3, creep=0.2)
    values = nonideal_of(TrueWrist(), Actuator(level="lagged", friction=0.2), facts, 1e-3)
    assert is_ideal(values) and not wears(values)


LEVELS = {
    "ideal": Loop(),
    "lagged": Loop(actuator=Actuator(level="lagged")),
    "tendon": Loop(
        control_period=5e-3,
        actuator=Actuator(level="tendon", friction=0.0),
        sensor=Sensor(level="camera"),
    ),
}


def loops(all_loops: list[Loop]) -> Outcome:
    law, count = controller("smc-tracking"), len(all_loops)
    followed = motion(Reference(duration=0.5), WRIST, 1.0, all_loops[0].control_period)
    gains = np.repeat([gains_of(law, "camera")], count, axis=0)
    streams = [(3, 1)] * count
    return rollout(
        law, gains, [followed], np.zeros(count, np.int64), all_loops, WRIST, streams=streams, record=True, threads=1
    )


@pytest.mark.parametrize("level", LEVELS)
def test_a_feature_at_nothing_gives_the_bits_of_the_feature_absent(level: str) -> None:
    """Beside a loop that has them all a loop without any is compiled with them."""
    ideal = LEVELS[level]
    facts = TrueActuator(friction=0.2, sheath=1.0, backlash=1e-4, creep=0.1)
    other = ideal.model_copy(update={"plant": Plant(creep=0.1, end_stop_deg=32.0, actuator=facts)})
    alone, beside = loops([ideal, ideal]), loops([ideal, other])
    assert alone.samples is not None and beside.samples is not None
    assert alone.samples[0].tobytes() == beside.samples[0].tobytes()
    assert alone.samples[0].tobytes() != beside.samples[1].tobytes()


def test_an_end_stop_inside_the_references_range_is_refused() -> None:
    short = LEVELS["ideal"].model_copy(update={"plant": Plant(end_stop_deg=29.0)})
    with pytest.raises(UserError, match="inside the reference's range, 30 deg"):
        loops([short])
