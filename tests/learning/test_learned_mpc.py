"""Networks of a wrist's dynamics, and `learned-mpc` over them, beside the model that they learned."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.documented import script_of_docs
from wristctl.config.choices import CONTROLLERS
from wristctl.config.learning import DataSettings, NetworkSettings
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.control.vetting import call_law, vet
from wristctl.errors import UserError
from wristctl.learning.dataset import split_samples
from wristctl.learning.learned_dynamics import Dynamics, load_dynamics, predicted, save_dynamics
from wristctl.learning.learned_mpc import learned_mpc
from wristctl.learning.network import Network, Scaler
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Job
from wristctl.learning.transitions import Transitions, draw_transitions
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.oscillation import LIMIT_CYCLE
from wristctl.simulation.planes import motion_in
from wristctl.simulation.repetitions import Simulation
from wristctl.study_files.load import load_study

WRIST = WristParameters()
THREE = WristParameters(tendons="three", length=0.095, stiffness=1.1)
INERTIA, DAMPING, STIFFNESS = 0.004, 0.1, 0.6


def spring_damper(planes: int, coupling: float = 0.0) -> Transitions:
    """Motions of masses on springs and dampers under smooth torques, by small steps; `coupling` joins two planes."""
    rng, h, steps, ticks, count = np.random.default_rng(planes), 1e-3, 10, 600, 8
    stiffness = STIFFNESS * np.eye(planes) + coupling * (np.ones((planes, planes)) - np.eye(planes))
    bend, rate = np.zeros((count, planes)), np.zeros((count, planes))
    frequency, phase = rng.uniform(3.0, 40.0, (count, planes, 3)), rng.uniform(0.0, 6.3, (count, planes, 3))
    courses: list[list[np.ndarray]] = [[], [], []]
    for k in range(ticks):
        torque = 0.3 * np.sin(frequency * k * h + phase).sum(axis=2)
        for course, values in zip(courses, (bend, rate, torque), strict=True):
            course.append(values)
        for _ in range(steps):
            acceleration = (torque - bend @ stiffness - DAMPING * rate) / INERTIA
            rate = rate + h / steps * acceleration
            bend = bend + h / steps * rate
    moved = [np.stack(course, axis=1) for course in courses]
    recording, tick = np.divmod(rng.permutation(count * (ticks - 1))[:1500], ticks - 1)
    return Transitions(moved[0], moved[1], moved[2], h, recording, tick)


def learned(samples: Transitions, hidden: tuple[int, ...] = (8,), epochs: int = 40) -> Dynamics:
    """A small network of transitions."""
    split = split_samples(len(samples.tick), 0.75, np.random.default_rng(0), None, samples.recording)
    settings = NetworkSettings(preset="recommended", hidden=hidden, epochs=epochs)
    return Dynamics.of(train_one(samples, Job("network", settings, split, np.random.SeedSequence(1))).network, samples)


@cache
def law_of(*changes: str, wrist: WristParameters = WRIST) -> Controller:
    """`learned-mpc` over a network of the wrist as it is in a loop with these settings."""
    loop = load_study([], [f"simulate.loop.{change}" for change in changes]).simulate.loop
    samples = draw_transitions(DataSettings(source="transitions", loop=loop), wrist, np.random.default_rng(0))
    return learned_mpc(learned(samples, (16,), 30))


def linear(planes: int, damping: float = DAMPING) -> Dynamics:
    """A network without error of masses on springs and dampers: one layer of units that stay linear."""
    size, scale = 3 * planes, 1e-4
    inputs = np.eye(size) * scale
    outputs = np.hstack([np.eye(planes) * factor for factor in (-STIFFNESS, -damping, 1.0)]) / (INERTIA * scale)
    weights, biases = (inputs, outputs), (np.zeros(size), np.zeros(planes))
    scalers = Scaler.none(size), Scaler.none(planes)
    network = Network(weights, biases, "tanh", *scalers, Transitions.domain)
    ends = np.repeat([1.0, 20.0, 2.0], planes)
    return Dynamics(network, -ends, ends, 1e-3)


def torques(law: Controller, gains: tuple[float, ...], *states: dict[str, float], times: int = 1) -> np.ndarray:
    """Torques of a law in one plane at states that name some of what it sees, whose reference stands still."""
    from wristctl.control.law import NOW, signals_of

    rows = np.zeros((len(states), signals_of(law.preview)))
    for row, state in zip(rows, states, strict=True):
        row[NOW.index("torque_low")], row[NOW.index("torque_high")], row[NOW.index("period")] = -50.0, 50.0, 1e-5
        for name, value in state.items():
            row[NOW.index(name)] = value
        row[len(NOW) :] = np.tile([row[NOW.index("theta_ref")], 0.0, 0.0], law.preview)
    found: np.ndarray = call_law(law, rows, np.tile(gains, (len(states), 1)), times=times)
    return found


def followed(law: Controller, gains: Any, wrist: WristParameters, *changes: str, kind: str = "sine") -> Simulation:
    """A motion in a loop with these settings."""
    loop = load_study([], [f"simulate.loop.{change}" for change in changes]).simulate.loop
    planes = 2 if wrist.tendons == "three" else 1
    motion = motion_in(planes, Reference(kind=kind), None, wrist, 2.0, 1e-3)
    return follow(law, np.array(gains_of(law, gains)), motion, wrist, loop)


@pytest.mark.slow
@pytest.mark.parametrize("planes", [1, 2])
def test_a_network_of_a_spring_and_a_damper_has_their_stiffness_damping_and_inertia(planes: int) -> None:
    dynamics = learned(spring_damper(planes, 0.2 if planes == 2 else 0.0))
    rest, step = np.zeros((1, planes)), 1e-3
    slopes = []
    for which in range(3):
        moved = [rest + step * np.eye(planes)[:, None, :].sum(axis=1) if k == which else np.zeros((planes, planes))
                 for k in range(3)]  # fmt: skip
        back = [-values for values in moved]
        slopes.append((dynamics.acceleration(*moved) - dynamics.acceleration(*back)) / (2.0 * step) * INERTIA)
    coupled = 0.2 * (1.0 - np.eye(planes)) if planes == 2 else np.zeros((1, 1))
    # over a period of 1 ms the mean acceleration is by d h / (2 m) less than the one at its beginning
    within = 1.0 - 0.5 * DAMPING * 1e-3 / INERTIA
    np.testing.assert_allclose(slopes[0], -within * (STIFFNESS * np.eye(planes) + coupled), atol=0.03)
    np.testing.assert_allclose(slopes[1], -within * DAMPING * np.eye(planes), atol=0.003)
    np.testing.assert_allclose(slopes[2], within * np.eye(planes), atol=0.02)


@pytest.mark.slow
def test_predictions_of_a_motion_that_was_not_learned_are_near_it() -> None:
    samples = spring_damper(2, 0.2)
    some = replace(samples, bend=samples.bend[:-1], rate=samples.rate[:-1], torque=samples.torque[:-1],
                   recording=samples.recording % 7)  # fmt: skip
    found, true = predicted(learned(some).acceleration, samples, np.array([7]), 100)
    still = samples.bend[7][: len(samples.bend[7]) - 100 : 100]
    assert np.abs(found - true).max() < 0.02 * np.abs(true - still).max()


def test_transitions_and_networks_are_read_back_whole(tmp_path: Any) -> None:
    samples = spring_damper(2)
    again = Transitions.from_arrays(samples.arrays())
    np.testing.assert_array_equal(again.inputs, samples.inputs)
    np.testing.assert_array_equal(again.targets, samples.targets)
    dynamics, file = linear(2), tmp_path / "dynamics.safetensors"
    save_dynamics(dynamics, file, {"seed": 3})
    state = np.random.default_rng(0).normal(size=(3, 5, 2))
    np.testing.assert_array_equal(load_dynamics(file).acceleration(*state), dynamics.acceleration(*state))
    file.write_bytes(file.read_bytes()[:-8])
    with pytest.raises(UserError, match="not a readable safetensors file"):
        load_dynamics(file)


@pytest.mark.slow
def test_over_a_linear_wrist_it_is_the_linear_law_whatever_the_wrist_is_believed_to_be() -> None:
    law, (w, zeta) = learned_mpc(linear(1)), (30.0, 1.0)
    states = ({"theta": 0.2, "theta_ref": 0.1, "rate": 0.5}, {"theta": -0.3, "rate": -2.0})
    expected = [
        STIFFNESS * s["theta"] + DAMPING * s["rate"]
        + INERTIA * (-2.0 * zeta * w * s["rate"] - w * w * (s["theta"] - s.get("theta_ref", 0.0)))
        for s in states
    ]  # fmt: skip
    # a plan of a few turns is not there at the first tick
    np.testing.assert_allclose(torques(law, (w, zeta, 0.0), *states, times=60), expected, rtol=0.02)


@pytest.mark.slow
def test_a_wrist_that_stands_where_the_network_has_it_move_is_pushed_until_the_load_is_made_up_for() -> None:
    law = learned_mpc(linear(1))
    state = {"theta": 0.1, "theta_ref": 0.15, "period": 1e-3}
    first, last = (torques(law, (30.0, 1.0, 50.0), state, times=times)[0] for times in (20, 400))
    assert first > STIFFNESS * 0.1 and last > 3.0 * first


@pytest.mark.slow
def test_torques_that_tendons_do_not_reach_are_not_asked_for() -> None:
    law, ends = learned_mpc(linear(1)), {"torque_low": -0.2, "torque_high": 0.3, "period": 1e-3}
    found = torques(law, (100.0, 1.0, 50.0), {"theta": 0.6} | ends, {"theta": -0.6} | ends, times=50)
    np.testing.assert_allclose(found, [-0.2, 0.3], rtol=1e-6)


@pytest.mark.slow
def test_a_law_of_two_planes_allocates_nothing_and_is_that_of_one_where_the_other_rests() -> None:
    both, one = learned_mpc(linear(2)), learned_mpc(linear(1))
    vet(both, "two planes")
    states = ({"theta": 0.2, "theta_ref": 0.1, "rate": 0.5}, {"theta": -0.3, "rate": -2.0})
    gains = (30.0, 1.0, 50.0)
    np.testing.assert_allclose(torques(both, gains, *states), torques(one, gains, *states), rtol=1e-9)


@pytest.mark.slow
def test_networks_of_one_shape_do_not_share_compiled_code() -> None:
    state, gains = {"theta": 0.0, "rate": 1.0}, (30.0, 1.0, 50.0)
    found = [torques(learned_mpc(linear(1, damping)), gains, state)[0] for damping in (DAMPING, 2.0 * DAMPING)]
    assert found[1] - found[0] == pytest.approx(DAMPING, rel=1e-3)


def test_a_network_by_which_torques_push_the_wrong_way_is_refused() -> None:
    dynamics = linear(1)
    weights = (dynamics.network.weights[0], dynamics.network.weights[1] * [[1.0, 1.0, -1.0]])
    with pytest.raises(UserError, match="torques move the wrist the wrong way in 100 %"):
        learned_mpc(replace(dynamics, network=replace(dynamics.network, weights=weights)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["step", "minimum-jerk"])
def test_over_a_network_of_the_believed_wrist_it_does_what_mpc_does(kind: str) -> None:
    mpc = controller("mpc")
    known, found = (followed(law, "default", WRIST, kind=kind).trajectory for law in (mpc, law_of()))
    assert np.abs(np.degrees(found.theta - known.theta)).max() < (0.5 if kind == "step" else 0.01)


@pytest.mark.slow
def test_trained_on_the_true_wrist_it_errs_less_than_mpc_where_neither_observes_a_load() -> None:
    changes = ("plant.stiffness=x0.7", "plant.payload=0.1")
    blind = {"w": 50.0, "zeta": 1.0, "wo": 1e-1}
    known, found = (
        followed(law, blind, WRIST, *changes).metrics["rmse"] for law in (controller("mpc"), law_of(*changes))
    )
    assert found < 0.1 * known


@pytest.mark.slow
def test_with_three_tendons_in_two_planes_it_comes_near_mpc_and_needs_no_model() -> None:
    law = law_of(wrist=THREE)
    assert law.planes == 2
    for changes in ((), ("plant.stiffness=x0.7",)):
        found = followed(law, "default", THREE, *changes, kind="circle").metrics["rmse"]
        without = followed(controller("feedforward"), "default", THREE, *changes, kind="circle").metrics["rmse"]
        assert found < 0.01 * without


@pytest.mark.slow
@pytest.mark.parametrize(("period", "stiffness", "sheath"), [(5e-3, 8e3, 0.0), (1e-2, 8e3, 0.0), (5e-3, 4e4, 3.0)])
def test_behind_motors_and_a_camera_it_does_not_swing_at_the_ends_of_its_conditions(
    monkeypatch: pytest.MonkeyPatch, period: float, stiffness: float, sheath: float
) -> None:
    law, margins = law_of(), script_of_docs("margins")
    monkeypatch.setitem(CONTROLLERS, law.name, law)
    (fast, slow), (soft, _) = law.conditions["hardware"]
    assert fast <= period <= slow and soft <= stiffness
    assert margins.swing(law.name, "hardware", margins.loop_of(period, stiffness, sheath)) <= LIMIT_CYCLE


def test_transitions_below_a_millisecond_are_refused() -> None:
    settings = DataSettings(source="transitions", loop=Loop(control_period=5e-4))
    with pytest.raises(UserError, match="every millisecond"):
        draw_transitions(settings, WRIST, np.random.default_rng(0))
