"""What is said of a network: on which samples, beside what, and each measure by its own name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wristctl.config.learning import NetworkSettings
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, KEPT, Samples, Split
from wristctl.learning.domain import Domain
from wristctl.learning.evaluation import MEASURES, angle_errors, error_map, inverses, measures, places
from wristctl.learning.network import Network, Scaler
from wristctl.learning.training_result import Epoch, Job, TrainingResult
from wristctl.wrist.kinematics import arc_tip, exact_angle

COUNT = 40
TEST = np.arange(COUNT - 12, COUNT)
CUT = Split(np.arange(20), np.arange(20, 28), TEST)


def loaded(codes: list[int]) -> Samples:
    """Samples with pose and mass whose angle is not that of an arc, the test's rows held out for these reasons."""
    rng = np.random.default_rng(0)
    theta = rng.uniform(-0.8, 0.8, COUNT)
    others = rng.uniform((0.0, 0.3), (3.0, 0.5), (COUNT, 2))
    held = np.full(COUNT, KEPT)
    held[TEST] = codes
    tip = arc_tip(theta, rng.uniform(0.07, 0.09, COUNT))
    domain = Domain((-0.8, 0.8), (0.07, 0.09), ((0.0, 3.0), (0.3, 0.5)))
    return Samples(tip, 0.9 * theta, np.full(COUNT, 0.08), domain, others, ("pose", "hand_mass"), held, 4)


def network(inputs: int, bias: float = 0.0) -> Network:
    """Linear in the inputs: 3 x + 2 y + pose/10 + mass/5 + bias."""
    factors = np.array([[3.0, 2.0, 0.1, 0.2][:inputs]])
    domain = Domain((-0.8, 0.8), (0.07, 0.09))
    weights = (np.vstack([factors, np.zeros((2, inputs))]), np.array([[1.0, 1.0, 1.0]]))
    biases = (np.full(3, 100.0), np.array([bias - 300.0]))
    return Network(weights, biases, "relu", Scaler.none(inputs), Scaler.none(1), domain)


def trial(own: Network) -> TrainingResult:
    epochs = (Epoch(0, 1, 9.0, 8.0), Epoch(0, 2, 7.0, 6.0), Epoch(0, 3, 5.0, 4.0))
    job = Job("one", NetworkSettings(), CUT, np.random.SeedSequence(0))
    return TrainingResult(job, own, epochs, 0.25, 0.125, False)


def test_samples_are_judged_by_why_they_were_held_out() -> None:
    codes = [HELD_PAYLOAD] * 5 + [HELD_POSE] * 7
    samples = loaded(codes)
    found = {place.name: place for place in places(samples, CUT)}
    assert list(found) == ["test samples", "held-out payloads", "held-out poses"]
    for name, rows in (("test samples", TEST), ("held-out payloads", TEST[:5]), ("held-out poses", TEST[5:])):
        np.testing.assert_array_equal(found[name].inputs, samples.inputs[rows])
        np.testing.assert_array_equal(found[name].theta, samples.theta[rows])
    assert [place.name for place in places(loaded([HELD_POSE] * 12), CUT)] == ["test samples"], "the same twice"
    assert [place.name for place in places(loaded([KEPT] * 11 + [HELD_POSE]), CUT)] == [
        "test samples",
        "held-out poses",
    ]


def test_where_curvature_is_constant_the_whole_domain_is_judged(samples: Samples, split: Split) -> None:
    test, whole = places(samples, split)
    assert (test.name, whole.name) == ("test samples", "whole workspace")
    np.testing.assert_allclose(exact_angle(whole.inputs), whole.theta, atol=1e-12)
    assert (whole.theta.min(), whole.theta.max()) == samples.domain.theta
    assert whole.theta.shape == error_map(exact_angle, samples.domain).theta.shape


@pytest.mark.parametrize("inputs", [2, 4])
def test_every_measure_stands_under_its_own_name(inputs: int) -> None:
    samples = loaded([HELD_PAYLOAD] * 5 + [HELD_POSE] * 7)
    own = network(inputs, bias=-0.2)
    found = measures(trial(own), places(samples, CUT))
    assert set(found) == set(MEASURES) - {"rmse_ulnar_deg", "rmse_flexion_deg"}, "in one plane"
    assert [MEASURES[name][0] for name in ("r2", "rmse_deg", "close_share", "train_loss")] == ["", "deg", "1", "rad^2"]
    for name, rows in (("", TEST), ("held_out_payloads_", TEST[:5]), ("held_out_poses_", TEST[5:])):
        wanted = angle_errors(samples.inputs[rows, :inputs] @ [3.0, 2.0, 0.1, 0.2][:inputs] - 0.2, samples.theta[rows])
        assert found[f"{name}rmse_deg"] == pytest.approx(wanted.rmse_deg, rel=1e-9)
        if not name:
            assert found["r2"] == pytest.approx(wanted.r2) and found["max_error_deg"] == pytest.approx(
                wanted.max_error_deg
            )
    assert np.isnan([found["workspace_rmse_deg"], found["workspace_max_error_deg"]]).all()
    assert (found["train_loss"], found["validation_loss"], found["gradient_norm"], found["epochs"]) == (
        5.0,
        0.25,
        0.125,
        3.0,
    )


def test_the_workspace_has_measures_of_its_own_where_it_is_known(samples: Samples, split: Split) -> None:
    own = network(2)
    found = measures(trial(own), places(samples, split))
    grid = error_map(own.angle, samples.domain)
    assert found["workspace_rmse_deg"] == pytest.approx(np.degrees(np.sqrt(np.mean(grid.error**2))))
    assert found["workspace_max_error_deg"] == pytest.approx(np.degrees(np.abs(grid.error).max()))
    assert np.isnan([found["held_out_payloads_rmse_deg"], found["held_out_poses_rmse_deg"]]).all()


def test_a_network_stands_beside_a_polynomial_of_all_inputs_and_the_exact_inverse() -> None:
    samples = loaded([KEPT] * 12)
    tip, others = (np.tile(each, (10, 1)) for each in (samples.tip, samples.others))
    many = replace(samples, tip=tip, others=others, theta=np.tile(samples.theta, 10))
    found = inverses(trial(network(2)), many, Split(np.arange(400), TEST, TEST))
    assert list(found) == ["network", "polynomial", "exact inverse"]
    inputs = samples.inputs
    angle, parameters, multiply_adds = found["network"]
    np.testing.assert_allclose(angle(inputs), inputs[:, :2] @ [3.0, 2.0], atol=1e-9)
    assert (parameters, multiply_adds) == (2 * 3 + 3 + 3 + 1, 2 * 3 + 3)
    angle, parameters, multiply_adds = found["polynomial"]
    assert (parameters, multiply_adds) == (126, 126 * 4 + 126), "degree 5 in four inputs"
    np.testing.assert_allclose(angle(inputs), samples.theta, atol=1e-6)
    angle, parameters, multiply_adds = found["exact inverse"]
    np.testing.assert_allclose(angle(inputs), exact_angle(samples.tip), atol=1e-15)
    assert (parameters, multiply_adds) == (0, 0)
