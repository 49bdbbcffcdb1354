"""Levenberg and Marquardt's steps: closed forms where the model is linear, and what they buy on the wrist."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import torch

from wristctl.config.learning import DataSettings, NetworkSettings, TrainSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning import levenberg_marquardt
from wristctl.learning.dataset import draw_samples, split_samples
from wristctl.learning.evaluation import error_map
from wristctl.learning.levenberg_marquardt import LevenbergMarquardt
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Job


def linear(seed: int) -> tuple[torch.nn.Linear, torch.Tensor, torch.Tensor]:
    """A linear model with samples (30, 3) and noisy values (30, 1)."""
    torch.manual_seed(seed)
    return torch.nn.Linear(3, 1).double(), torch.randn(30, 3).double(), torch.randn(30, 1).double()


@pytest.mark.parametrize("decay", [0.0, 0.3])
def test_undamped_a_linear_model_is_solved_in_one_step(decay: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(levenberg_marquardt, "BLOCK", 7)
    model, x, y = linear(1)
    optimiser = LevenbergMarquardt(model, decay)
    optimiser.damping = 1e-15
    before = float(((model(x) - y) ** 2).mean().detach())
    assert optimiser.step(x, y) == pytest.approx(before, rel=1e-12)
    design = np.hstack([x.numpy(), np.ones((30, 1))])
    ridge = np.linalg.solve(design.T @ design + 15.0 * decay * np.eye(4), design.T @ y.numpy()[:, 0])
    found = np.append(model.weight.detach().numpy(), model.bias.detach().numpy())
    np.testing.assert_allclose(found, ridge, rtol=1e-9)


def test_strongly_damped_a_step_follows_the_gradient() -> None:
    model, x, y = linear(2)
    before = torch.nn.utils.parameters_to_vector(model.parameters()).detach().clone()
    (gradient,) = torch.autograd.grad(((model(x) - y) ** 2).mean(), [model.weight], retain_graph=True)
    optimiser = LevenbergMarquardt(model)
    optimiser.damping = 1e6
    optimiser.step(x, y)
    moved = (torch.nn.utils.parameters_to_vector(model.parameters()).detach() - before)[:3]
    torch.testing.assert_close(moved, -gradient[0] / 1e6, rtol=1e-4, atol=0.0)


def test_the_loss_never_rises_and_at_the_minimum_nothing_moves() -> None:
    torch.manual_seed(3)
    model = torch.nn.Sequential(torch.nn.Linear(1, 5), torch.nn.Tanh(), torch.nn.Linear(5, 1)).double()
    x = torch.linspace(-2.0, 2.0, 40, dtype=torch.float64)[:, None]
    optimiser, y = LevenbergMarquardt(model), torch.sin(2.0 * x)
    losses = [optimiser.step(x, y) for _ in range(60)]
    assert all(after <= before for before, after in pairwise(losses))
    assert losses[-1] < 1e-4 * losses[0]
    straight, a, b = linear(4)
    solved = LevenbergMarquardt(straight)
    solved.damping = 1e-15
    solved.step(a, b)
    weights = straight.weight.detach().clone()
    solved.step(a, b)
    torch.testing.assert_close(straight.weight.detach(), weights, rtol=1e-12, atol=1e-14)


@pytest.mark.slow
def test_recommended_is_within_a_twentieth_of_a_degree_over_the_whole_domain() -> None:
    samples = draw_samples(DataSettings(), WristParameters(), np.random.default_rng(0))
    split = split_samples(1000, 0.75, np.random.default_rng(0))
    settings = NetworkSettings.model_validate({"preset": "recommended", "epochs": 40})
    network = train_one(samples, Job("one", settings, split, np.random.SeedSequence(7))).network
    errors = np.degrees(np.abs(error_map(network.angle, samples.domain).error))
    assert errors.max() < 0.05 and np.sqrt(np.mean(errors**2)) < 0.01


@pytest.mark.parametrize("more", [{"hidden": (200, 100, 100)}, {"search": True}])
def test_a_network_too_large_for_second_order_is_refused(more: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"all weights at once, at most 4000: 200.* choose fewer neurons, or adamw"):
        TrainSettings.model_validate({"preset": "recommended", **more})


def test_damping_falls_to_a_third_after_a_good_step() -> None:
    model, x, y = linear(5)
    optimiser = LevenbergMarquardt(model)
    optimiser.step(x, y)
    assert optimiser.damping == pytest.approx(1e-2 / 3.0)
    solved = LevenbergMarquardt(model)
    solved.damping = 1e-15
    solved.step(x, y)
    assert solved.damping == pytest.approx(1e-15 / 3.0)


def test_the_least_damping_is_never_undercut_and_state_carries_it() -> None:
    model, x, y = linear(6)
    optimiser = LevenbergMarquardt(model)
    optimiser.damping = 1.5e-16
    optimiser.step(x, y)
    assert optimiser.damping == 1e-16
    other = LevenbergMarquardt(model)
    assert other.damping == 1e-2
    other.load_state_dict(optimiser.state_dict())
    assert other.damping == 1e-16


def test_twenty_rejected_steps_leave_the_weights_as_they_are() -> None:
    """At an exact minimum no step lowers the objective: the damping has grown by 4 for each try."""
    torch.manual_seed(7)
    model = torch.nn.Linear(2, 1).double()
    x = torch.randn(20, 2, dtype=torch.float64)
    y = model(x).detach()
    before = [each.detach().clone() for each in model.parameters()]
    optimiser = LevenbergMarquardt(model)
    assert optimiser.step(x, y) == 0.0
    assert optimiser.damping == pytest.approx(1e-2 * 4.0**20)
    for now, was in zip(model.parameters(), before, strict=True):
        assert torch.equal(now.detach(), was)
