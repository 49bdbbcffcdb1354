"""What the laws promise that an expert would set against ours, and the rungs of the ladder above feedforward."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are
from scipy.signal import lsim

from tests.control.test_laws import torque
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Plant, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.fopi import SECTIONS, fractional
from wristctl.control.law import Controller, ahead
from wristctl.control.lqi import spectral_factor
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.simulation.kernel import RECORDED
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

WRIST = WristParameters(gravity=(-8.0, 3.0))
MOVE = Reference(angle_deg=30.0, duration=0.5)
SOFTER = Loop(plant_segments=1, plant=Plant.model_validate({"stiffness": "x0.7", "payload": 0.05}))
LADDER = ("feedforward", "pd-ff", "pid-ff", "pid-dob", "smc-dob")


def followed(
    law: Controller, gains: dict[str, float] | str, loop: Loop, reference: Reference = MOVE, horizon: float = 2.0
) -> Outcome:
    course = motion(reference, WRIST, horizon, max(loop.control_period, 1e-3))
    given = np.array([gains_of(law, gains)])
    return rollout(law, given, [course], np.zeros(1, np.int64), loop, WRIST, record=True)


@pytest.mark.parametrize("name", ["ct-dob", "mpc", "adrc", "pid-ff", "pid-dob", "smc-dob", "lqi"])
def test_a_wrong_model_leaves_no_error_at_rest(name: str) -> None:
    law = controller(name)
    gains = {**law.presets["default"], **({"Ki": 20.0} if "Ki" in law.gains else {})}
    done = followed(law, gains, SOFTER, horizon=6.0)
    assert not done.failed[0] and done.metrics["steady_state"][0] < 1e-5


@pytest.mark.parametrize("name", ["computed-torque", "pd-ff"])
def test_without_integral_or_observer_it_leaves_one(name: str) -> None:
    assert followed(controller(name), "default", SOFTER, horizon=6.0).metrics["steady_state"][0] > 1e-3


@pytest.mark.parametrize("name", ["ct-dob", "pd-ff", "pid-ff", "pid-dob", "lqi", "mpc"])
def test_on_the_model_itself_the_reference_is_followed(name: str) -> None:
    done = followed(controller(name), "default", Loop(plant_segments=1, control_period=1e-4))
    assert done.metrics["rmse"][0] < 1e-4


def test_the_disturbance_observer_finds_the_load() -> None:
    """A force across the tip [N] at rest: its torque is what the reference's torque is short of."""
    law = controller("ct-dob")
    loop = Loop(plant_segments=1, plant=Plant.model_validate({"stiffness": "x0.8"}))
    for bandwidth in (20.0, 1e5):
        done = followed(law, {"w": 50.0, "zeta": 1.0, "wo": bandwidth}, loop)
        rest = done.column("theta", 0)[-1]
        missing = 0.2 * WRIST.stiffness * rest
        own = followed(law, {"w": 50.0, "zeta": 1.0, "wo": bandwidth}, Loop(plant_segments=1))
        assert own.column("torque", 0)[-1] - done.column("torque", 0)[-1] == pytest.approx(missing, rel=1e-3)


def test_saturation_is_no_load() -> None:
    """A step beyond what tendons reach: the observer does not take their limit for a load, and winds up none."""
    law, step = controller("ct-dob"), Reference(kind="step", angle_deg=45.0)
    weak = WristParameters(tension_limit=30.0)
    course = motion(step, weak, 2.0, 1e-3)
    loop = Loop(plant_segments=1)
    done = [
        rollout(each, np.array([gains_of(each, "default")]), [course], np.zeros(1, np.int64), loop, weak, record=True)
        for each in (law, controller("computed-torque"))
    ]
    assert done[0].metrics["saturation"][0] > 0.01
    assert np.ptp([each.metrics["overshoot"][0] for each in done]) < 0.5


@pytest.mark.parametrize(("rung", "off"), [
    ("pd-ff", {"Kp": 0.0, "Kd": 0.0}), ("pid-ff", {"Ki": 0.0}), ("pid-dob", {"wo": 0.0}), ("smc-dob", {"Ks": 0.0}),
])  # fmt: skip
def test_a_rung_is_the_one_below_where_its_term_is_nothing(rung: str, off: dict[str, float]) -> None:
    """So that what a term buys is what the ladder shows."""
    below = controller(LADDER[LADDER.index(rung) - 1])
    shared = {"Kp": 3.0, "Ki": 2.0, "Kd": 0.2, "wo": 15.0, "Ks": 0.1, "phi": 0.5}
    upper, lower = (
        followed(each, {name: (shared | own)[name] for name in each.gains}, SOFTER)
        for each, own in ((controller(rung), off), (below, {}))
    )
    torques = [each.column("torque_wanted", 0) for each in (upper, lower)]
    moving = slice(-500, None) if rung == "pd-ff" else slice(None)  # feedforward alone knows no motion
    assert np.allclose(torques[0][moving], torques[1][moving], atol=1e-12) and np.ptp(torques[0]) > 0.1


@kernel
def _factor(values: Any, out: Any) -> None:
    given, found = rows_of(values), rows_of(out)
    found[0], found[1] = spectral_factor(given[0], given[1], given[2], given[3], given[4])


@pytest.mark.parametrize("weights", [(40.0, 40.0, 15.0), (0.1, 5.0, 30.0), (1.0, 300.0, 2.0), (500.0, 1.0, 1.0)])
def test_the_linear_quadratic_gains_are_those_of_the_riccati_equation(weights: tuple[float, float, float]) -> None:
    wd, wp, wi = weights
    damping, stiffness = 35.0, 205.0
    plant = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -stiffness, -damping]])
    push = np.array([[0.0], [0.0], [1.0]])
    gains = push.T @ solve_continuous_are(plant, push, np.diag([wi**6, wp**4, wd**2]), np.eye(1))
    found = np.zeros(2)
    _factor(np.array([damping, stiffness, wd, wp, wi]), found)
    assert np.array([wi**3, found[0] - stiffness, found[1] - damping]) == pytest.approx(gains.ravel(), rel=1e-6)


def test_the_extended_observer_has_its_poles_where_it_says() -> None:
    """The error of its angle after one period, of a wrist that it has placed wrongly, by powers of exp(-wo h)."""
    law, memory = controller("adrc"), np.array([1.0, 0.1, 0.0, 0.0])
    torque(law, (30.0, 200.0, 1.0), memory, theta=0.0, torque_low=0.0, torque_high=0.0)
    pole = np.exp(-0.2)
    assert memory[1] - 1e-3 * memory[2] + 0.5e-6 * memory[3] == pytest.approx(0.1 * pole**3, rel=1e-12)
    assert memory[3] == pytest.approx(-0.1 * (1.0 - pole) ** 3 / 1e-6, rel=1e-12)


def test_the_network_learns_to_follow_its_reference_model() -> None:
    law = controller("nn-mrac")
    sine = Reference(kind="sine", angle_deg=15.0, frequency=0.5)
    wanted, w = motion(sine, WRIST, 8.0, 1e-3), 50.0
    _, modelled, _ = lsim(([w * w], [1.0, 2.0 * w, w * w]), wanted.theta_ref, wanted.time)
    error = []
    for learning in (100.0, 1e-9):
        gains = dict(law.presets["default"]) | {"eta": learning}
        done = followed(law, gains, Loop(plant_segments=1), sine, horizon=8.0)
        error.append(np.abs(done.column("theta", 0) - modelled)[4000:].mean())
    assert error[0] < 0.02 * error[1]


@pytest.mark.parametrize("order", [0.5, -0.3, 0.0, 0.9])
@pytest.mark.parametrize("frequency", [1.0, 10.0, 60.0])
@pytest.mark.slow
def test_the_fractional_derivative_has_the_gain_and_phase_of_its_order(order: float, frequency: float) -> None:
    """Of a sine within the band: |jw|^order, and order times a right angle ahead."""
    period = 1e-4
    time = period * np.arange(round(30.0 * 2.0 * np.pi / frequency / period))
    value, found = np.sin(frequency * time), np.zeros(len(time))
    _fractional(value, np.array([order, period]), np.zeros(SECTIONS), found)
    last = slice(len(time) // 2, None)
    phasor = 2.0 * np.mean(found[last] * np.exp(-1j * frequency * time[last]) * 1j)
    assert abs(phasor) == pytest.approx(frequency**order, rel=0.05)
    assert np.angle(phasor) == pytest.approx(0.5 * np.pi * order, abs=0.1)


@kernel
def _fractional(value: Any, settings: Any, memory: Any, out: Any) -> None:
    values, given, kept, found = rows_of(value), rows_of(settings), rows_of(memory), rows_of(out)
    for k in range(len(value)):
        found[k] = fractional(values[k], given[0], given[1], kept, 0)


def test_the_impedance_answers_an_error_as_spring_and_damper() -> None:
    """Torques that differ by K and D alone, the model cancelled."""
    gains, quick = (3.0, 0.2, 10.0, 1e3), {"theta": 0.1, "rate": 0.2}
    there = torque("impedance", gains, np.zeros(12), **quick, theta_ref=0.1, rate_ref=0.2)
    off = torque("impedance", gains, np.zeros(12), **quick, theta_ref=0.3, rate_ref=0.7)
    assert off - there == pytest.approx(3.0 * 0.2 + 0.2 * 0.5, rel=1e-12)


def test_the_impedances_network_learns_what_the_model_lacks() -> None:
    """A softer spring and a payload, again and again: with learning a small part of the error is left."""
    law, sine = controller("impedance"), Reference(kind="sine", angle_deg=15.0, frequency=0.5)
    error = []
    for learning in (50.0, 1e-9):
        gains = dict(law.presets["default"]) | {"eta": learning}
        done = followed(law, gains, SOFTER, sine, horizon=6.0)
        wanted = motion(sine, WRIST, 6.0, 1e-3).theta_ref
        error.append(np.abs(done.column("theta", 0) - wanted)[4000:].mean())
    assert error[0] < 0.1 * error[1]


@pytest.mark.parametrize("name", ["impedance", "fopi"])
def test_the_rivals_leave_no_error_at_rest(name: str) -> None:
    done = followed(controller(name), "default", SOFTER, horizon=8.0)
    assert abs(done.column("theta", 0)[-1] - np.deg2rad(30.0)) < 1e-4


@pytest.mark.parametrize("period", [1e-3, 5e-3, 2.5e-4])
def test_a_preview_is_the_reference_to_come(period: float) -> None:
    """Of each derivative, at samples and between them; beyond the end it stays."""
    for value, exact in ((0, "theta_ref"), (1, "rate_ref"), (2, "acceleration_ref")):
        looking = Controller("looking", _of(value), "test", {}, {"default": {}}, preview=8)
        loop = Loop(plant_segments=1, control_period=period)
        done = followed(looking, "default", loop, horizon=0.6)
        course = motion(MOVE, WRIST, 0.6, max(period, 1e-3))
        wanted, there = done.column("torque_wanted", 0), getattr(course, exact)
        shift = 8 * period / max(period, 1e-3)
        whole = int(shift)
        assert shift == whole
        assert np.array_equal(wanted[:-whole], there[whole:]) and (wanted[-whole:] == there[-1]).all()


def _of(value: int) -> Any:
    def angle(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        return ahead(now, 8)[0]

    def rate(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        return ahead(now, 8)[1]

    def acceleration(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        return ahead(now, 8)[2]

    return (angle, rate, acceleration)[value]


def _load(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    return now.load


@pytest.mark.parametrize("level", ["ideal", "camera"])
def test_a_law_sees_the_load_that_the_observer_makes_out(level: str) -> None:
    looking = Controller("loaded", _load, "test", {}, {"default": {}})
    loop = SOFTER.model_copy(update={"control_period": 5e-3, "sensor": Sensor(level=level)})  # type: ignore[arg-type]
    done = followed(looking, "default", loop)
    seen, kept = done.column("torque_wanted", 0), done.column("load", 0)
    assert "load" in RECORDED and np.array_equal(seen, kept) and (np.ptp(seen) > 0.0) == (level == "camera")


def by_each(name: str, gains: tuple[float, ...], memory: np.ndarray, count: int, **now: float) -> np.ndarray:
    """Derivative of a law's torque by each of the first numbers that it remembers, by central differences."""
    found = []
    for place in range(count):
        nudged = [
            torque(name, gains, memory + side * 1e-6 * (np.arange(len(memory)) == place), **now) for side in (1, -1)
        ]
        found.append((nudged[0] - nudged[1]) / 2e-6)
    return np.array(found)


@pytest.mark.parametrize("seed", range(3))
def test_every_weight_of_the_network_learns_down_its_own_gradient(seed: int) -> None:
    """By the MIT rule, at the rate eta: what the torque in reach changes by the weight, times e_m + de_m/dt / w."""
    law, rng = controller("nn-mrac"), np.random.default_rng(seed)
    weights = law.memory - 3
    memory = np.concatenate([rng.uniform(-0.4, 0.4, weights), [1.0, 0.1, 0.3]])
    gains = {"w": 20.0, "zeta": 0.7, "eta": 50.0, "Kd": 0.1}
    now = {"theta": 0.17, "rate": 0.5, "theta_ref": 0.2, "torque_low": -2.0, "torque_high": 3.0, "period": 1e-3}
    gradient = by_each("nn-mrac", law.values(gains), memory, weights, **now) / 2.5
    assert (gradient != 0.0).all()
    after = memory.copy()
    torque("nn-mrac", law.values(gains), after, **now)
    step = -1e-3 * 50.0 * (0.07 + 0.2 / 20.0)
    np.testing.assert_allclose(after[:weights] - memory[:weights], step * gradient, rtol=1e-5, atol=1e-10)
    assert after[weights] == 1.0
    model = (after[-2] - 0.1) / 1e-3, after[-1]
    assert model == pytest.approx((after[-1], 0.3 + 1e-3 * (400.0 * (0.2 - after[-2]) - 28.0 * after[-1])))


def test_the_weights_of_the_network_stay_within_ten_of_where_they_began() -> None:
    law = controller("nn-mrac")
    gains = law.values({"w": 20.0, "zeta": 0.7, "eta": 1e9, "Kd": 0.1})
    memory = np.concatenate([np.full(law.memory - 3, 0.3), [1.0, 0.5, 0.0]])
    torque("nn-mrac", gains, memory, theta=0.1, rate=-0.5, theta_ref=0.2)
    assert np.abs(memory[:-3]).max() == 10.0 and set(np.sign(memory[:-3])) == {-1.0, 1.0}


def test_the_impedances_network_moves_toward_the_load_that_the_momentum_shows() -> None:
    """Along its outputs, by h eta phi.phi/(1 + h eta phi.phi) of the way at the state where it stands."""
    law, rng = controller("impedance"), np.random.default_rng(0)
    begun = np.zeros(law.memory)
    at: dict[str, float] = {"theta": 0.2, "rate": 0.4, "theta_ref": 0.25, "rate_ref": 0.1}
    first = {"K": 3.0, "D": 0.2, "eta": 1e-9, "wo": 100.0}
    torque("impedance", law.values(first), begun, **at)
    weights = law.memory - 9
    begun[weights:] = rng.uniform(-0.3, 0.3, 9)
    later = at | {"rate": 0.5}
    shown = []
    for eta in (1e12, 10.0, 300.0):
        gains = law.values(first | {"eta": eta})
        outputs = -by_each("impedance", gains, begun, law.memory, **later)[weights:]
        size, after = float(outputs @ outputs), begun.copy()
        torque("impedance", gains, after, **later)
        moved = after[weights:] - begun[weights:]
        np.testing.assert_allclose(moved, moved[0] * outputs, rtol=1e-5, atol=1e-10)
        assert outputs[0] == pytest.approx(1.0) and moved[0] != 0.0
        share = 1e-3 * eta * size
        shown.append(float(moved @ outputs) * (1.0 + share) / share)
    assert shown == pytest.approx([shown[0]] * 3, rel=1e-4)
