from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
import torch
from torch import nn

from wristctl.config.learning import Activation
from wristctl.learning.domain import Domain
from wristctl.learning.inference import compiled_network
from wristctl.learning.network import BLOCK, Network, Scaler
from wristctl.learning.training import LAYERS
from wristctl.wrist.kinematics import TipPath, arc_tip

DOMAIN = Domain((-0.9, 0.9), (0.07, 0.09))
SIZES = (2, 30, 20, 10, 1)
ALL = get_args(Activation)


def pair(activation: Activation) -> tuple[Network, nn.Sequential]:
    """The same random network twice: ours and torch's (on scaled inputs)."""
    rng = np.random.default_rng(11)
    weights = tuple(rng.normal(0, 1.5 / np.sqrt(i), (o, i)) for i, o in pairwise(SIZES))
    biases = tuple(rng.normal(0, 0.3, o) for o in SIZES[1:])
    layers: list[nn.Module] = []
    for weight, bias in zip(weights, biases, strict=True):
        linear = nn.Linear(weight.shape[1], weight.shape[0], dtype=torch.float64)
        linear.weight.data, linear.bias.data = torch.tensor(weight), torch.tensor(bias)
        layers += [linear, LAYERS[activation]()]
    scaler = Scaler(np.array([0.07, 0.001]), np.array([0.005, 0.02]))
    ours = Network(weights, biases, activation, scaler, Scaler(np.array([0.02]), np.array([0.5])), DOMAIN)
    return ours, nn.Sequential(*layers[:-1])


def swing(time: np.ndarray) -> TipPath:
    """A smooth path through the domain and its exact derivatives."""
    w, zero = 3.0, np.zeros_like(time)
    return TipPath(
        np.stack([0.074 + 0.004 * np.cos(w * time), 0.03 * np.sin(w * time)], axis=-1) + zero[..., None],
        w * np.stack([-0.004 * np.sin(w * time), 0.03 * np.cos(w * time)], axis=-1),
        -w * w * np.stack([0.004 * np.cos(w * time), 0.03 * np.sin(w * time)], axis=-1),
    )


@pytest.mark.parametrize("activation", ALL)
def test_angle_plain_and_compiled_equals_torch(activation: Activation) -> None:
    ours, theirs = pair(activation)
    tip = np.random.default_rng(2).uniform((0.05, -0.05), (0.09, 0.05), (500, 2))
    with torch.no_grad():
        wanted = theirs(torch.tensor(ours.input_scaler.scale(tip))).numpy()[:, 0] * 0.5 + 0.02
    np.testing.assert_allclose(ours.angle(tip), wanted, rtol=0, atol=1e-12)
    np.testing.assert_allclose(compiled_network(ours)(tip), wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("activation", ALL)
def test_derivatives_along_a_path_match_finite_differences(activation: Activation) -> None:
    network, _ = pair(activation)
    time, step = np.linspace(0.05, 2.0, 40), 2e-5
    path = network.along(swing(time))
    before, here, after = (network.angle(swing(time + k * step).position) for k in (-1, 0, 1))
    np.testing.assert_allclose(path.theta, here, rtol=0, atol=1e-14)
    np.testing.assert_allclose(path.rate, (after - before) / (2 * step), rtol=0, atol=1e-6)
    np.testing.assert_allclose(path.acceleration, (after - 2 * here + before) / step**2, rtol=0, atol=1e-4)


def test_a_path_longer_than_a_block_equals_its_parts() -> None:
    network, _ = pair("tanh")
    time = np.linspace(0.0, 2.0, 2 * BLOCK + 7)
    whole = network.along(swing(time))
    for part in np.array_split(np.arange(len(time)), 5):
        piece = network.along(swing(time[part]))
        np.testing.assert_allclose(whole.theta[part], piece.theta, rtol=0, atol=1e-14)
        np.testing.assert_allclose(whole.acceleration[part], piece.acceleration, rtol=0, atol=1e-11)


def test_angle_keeps_the_shape_of_its_grid() -> None:
    network, _ = pair("relu")
    tip = np.random.default_rng(0).uniform(0.05, 0.09, (3, 4, 2))
    assert network.angle(tip).shape == (3, 4)
    assert network.angle(tip)[2, 1] == pytest.approx(network.angle(tip[2, 1]), abs=1e-14)
    assert network.angle(np.empty((0, 2))).shape == (0,)


def test_tips_outside_the_trained_domain_are_flagged() -> None:
    network, _ = pair("sigmoid")
    theta, length = (
        np.array([0.0, 0.89, 0.91, -0.91, 0.3, 0.3]),
        np.array([0.08, 0.08, 0.08, 0.08, 0.091, 0.069]),
    )
    still = np.zeros((6, 2))
    path = network.along(TipPath(arc_tip(theta, length), still, still))
    assert path.outside.tolist() == [False, False, True, True, True, True]


@pytest.mark.slow
def test_a_network_needs_no_torch() -> None:
    code = "import sys, wristctl.learning.network_file; print({'torch', 'scipy', 'pandas'} & set(sys.modules))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "set()"


def test_a_network_at_a_pose_and_mass_is_the_network_with_those_inputs() -> None:
    two, _ = pair("silu")
    rng = np.random.default_rng(1)
    four = replace(
        two,
        weights=(np.hstack([two.weights[0], rng.normal(size=(30, 2))]), *two.weights[1:]),
        input_scaler=Scaler(np.array([0.07, 0.001, 1.0, 0.3]), np.array([0.005, 0.02, 0.5, 0.1])),
        domain=Domain(DOMAIN.theta, DOMAIN.arc_length, ((0.0, 3.0), (0.3, 0.45))),
        others=("pose", "hand_mass"),
    )
    tip = arc_tip(np.linspace(-0.8, 0.8, 20), 0.08)
    at = four.at({"pose": 1.2, "hand_mass": 0.4})
    inputs = np.hstack([tip, np.tile([1.2, 0.4], (20, 1))])
    np.testing.assert_allclose(at.angle(tip), four.angle(inputs), rtol=0, atol=1e-14)
    assert at.domain.contains(tip).all() and four.domain.contains(inputs).all()
    assert not four.at({"pose": 1.2, "hand_mass": 0.6}).domain.contains(tip).any(), "too heavy: every tip is flagged"


def test_an_input_that_is_not_finite_lies_outside() -> None:
    assert not DOMAIN.contains(np.array([[np.nan, 0.0], [np.inf, 0.0]])).any()
