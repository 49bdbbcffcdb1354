"""A trained multilayer perceptron as plain arrays, with exact derivatives along a path."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from wristctl.arrays import Array
from wristctl.config.learning import Activation
from wristctl.learning.domain import Domain
from wristctl.wrist.kinematics import AnglePath, TipPath

# Tips propagated at once: few enough that the products of the paper's layers stay on one thread. On a busy machine the
# threads of a linear algebra library wait for each other, ten times longer than the product takes on one.
BLOCK = 12

# Slope of leaky ReLU below zero.
LEAK = 0.01


def _sigmoid(z: Array) -> tuple[Array, Array, Array]:
    s = 0.5 + 0.5 * np.tanh(0.5 * z)  # cannot overflow
    slope = s * (1.0 - s)
    return s, slope, slope * (1.0 - 2.0 * s)


def _tanh(z: Array) -> tuple[Array, Array, Array]:
    t = np.tanh(z)
    slope = 1.0 - t * t
    return t, slope, -2.0 * t * slope


def _silu(z: Array) -> tuple[Array, Array, Array]:
    s, slope, bend = _sigmoid(z)
    return z * s, s + z * slope, 2.0 * slope + z * bend


def _relu(z: Array) -> tuple[Array, Array, Array]:
    return np.maximum(z, 0.0), np.where(z > 0.0, 1.0, 0.0), np.zeros_like(z)


def _leaky_relu(z: Array) -> tuple[Array, Array, Array]:
    slope = np.where(z > 0.0, 1.0, LEAK)
    return z * slope, slope, np.zeros_like(z)


# Activations with their first and second derivatives. At its kink ReLU takes the slope from below.
ACTIVATIONS: dict[Activation, Callable[[Array], tuple[Array, Array, Array]]] = {
    "sigmoid": _sigmoid,
    "relu": _relu,
    "leaky-relu": _leaky_relu,
    "tanh": _tanh,
    "silu": _silu,
}


@dataclass(frozen=True)
class Scaler:
    """Maps values to (values - mean) / deviation, per column."""

    mean: Array
    """(D,)"""
    deviation: Array
    """(D,)"""

    @staticmethod
    def of(values: Array, alike: bool = False) -> Scaler:
        """Zero mean and unit deviation for the rows of `values` (N, D); a constant column is only shifted.

        With `alike` all columns have one deviation, the root of their mean square: vectors keep their directions.
        """
        deviation = values.std(axis=0)
        if alike:
            deviation = np.full(len(deviation), np.sqrt(np.mean(deviation**2)))
        return Scaler(values.mean(axis=0), np.where(deviation > 0.0, deviation, 1.0))

    @staticmethod
    def none(columns: int) -> Scaler:
        """Leaves values as they are."""
        return Scaler(np.zeros(columns), np.ones(columns))

    def scale(self, values: Array) -> Array:
        """Scaled values, (..., D)."""
        return (values - self.mean) / self.deviation

    def restore(self, scaled: Array) -> Array:
        """Values of scaled ones, (..., D)."""
        return scaled * self.deviation + self.mean


@dataclass(frozen=True)
class Network:
    """Inputs, of which the tip (P + 1) [m] is the first, to the bend in P planes [rad]; scaled, linear outputs."""

    weights: tuple[Array, ...]
    """per layer (neurons, inputs)"""
    biases: tuple[Array, ...]
    """per layer (neurons,)"""
    activation: Activation
    """applied after every layer but the last"""
    input_scaler: Scaler
    output_scaler: Scaler
    domain: Domain
    """the region of inputs it was trained on"""
    others: tuple[str, ...] = ()
    """inputs after the tip"""
    segments: int = 1
    """segments of the wrist that it learned; 1: any"""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in, one output each."""
        return len(self.biases[-1])

    @property
    def parameters(self) -> int:
        """Number of weights and biases."""
        return sum(weight.size + len(weight) for weight in self.weights)

    @property
    def multiply_adds(self) -> int:
        """Multiply-adds of one angle, activations not counted."""
        return sum(weight.size for weight in self.weights)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Inputs, neurons of each hidden layer, outputs."""
        return (self.weights[0].shape[1], *(len(bias) for bias in self.biases))

    def folded(self) -> list[tuple[Array, Array]]:
        """Weights and biases of each layer, with scaling folded into the first and the last."""
        weights, biases = [*self.weights], [*self.biases]
        weights[0] = weights[0] / self.input_scaler.deviation
        biases[0] = biases[0] - weights[0] @ self.input_scaler.mean
        weights[-1] = weights[-1] * self.output_scaler.deviation[:, None]
        biases[-1] = biases[-1] * self.output_scaler.deviation + self.output_scaler.mean
        return list(zip(weights, biases, strict=True))

    def at(self, others: Mapping[str, float]) -> Network:
        """The network of the tip alone that this one is where its other inputs stay at these values (SI units).

        A value outside the trained domain leaves no tip inside. Raises KeyError where a value is missing.
        """
        values = np.array([others[name] for name in self.others])
        scaler, weight, tip = self.input_scaler, self.weights[0], self.planes + 1
        shift = weight[:, tip:] @ ((values - scaler.mean[tip:]) / scaler.deviation[tip:])
        return replace(
            self,
            weights=(weight[:, :tip], *self.weights[1:]),
            biases=(self.biases[0] + shift, *self.biases[1:]),
            input_scaler=Scaler(scaler.mean[:tip], scaler.deviation[:tip]),
            domain=self.domain.at(values),
            others=(),
        )

    def angle(self, inputs: Array) -> Array:
        """Bends (...) [rad] of inputs (..., P + 1 + others); `domain.contains` says which can be trusted.

        In two planes they are of shape (..., 2).
        """
        rows = inputs.reshape(-1, self.sizes[0])
        blocks = [self._forward(rows[i : i + BLOCK]) for i in range(0, len(rows), BLOCK)]
        bends = np.concatenate(blocks or [np.empty((0, self.planes))])
        return self._of_planes(bends).reshape((*inputs.shape[:-1], *self._shape))

    @property
    def _shape(self) -> tuple[int, ...]:
        """Shape of one bend: a number in one plane."""
        return () if self.planes == 1 else (self.planes,)

    def _of_planes(self, bends: Array) -> Array:
        """Bends (N, P) as (N,) in one plane."""
        return bends[:, 0] if self.planes == 1 else bends

    def along(self, path: TipPath) -> AnglePath:
        """Angles along a path with their exact first and second time derivatives.

        Only for networks of the tip alone (`at`). Every layer passes on its value and both derivatives (a
        second-order Taylor expansion in time), so nothing is differenced. Tips outside the trained domain are
        flagged. A ReLU network's angle is piecewise linear in the tip: at its kinks the rate jumps, which the
        acceleration does not show.
        """
        count = len(path.position)
        columns = np.empty((3, count, *self._shape))
        for start in range(0, count, BLOCK):
            rows = slice(start, start + BLOCK)
            columns[:, rows] = self._expand(path.position[rows], path.velocity[rows], path.acceleration[rows])
        return AnglePath(columns[0], columns[1], columns[2], ~self.domain.contains(path.position))

    def _forward(self, inputs: Array) -> Array:
        activate = ACTIVATIONS[self.activation]
        value = self.input_scaler.scale(inputs)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            value = activate(value @ weight.T + bias)[0]
        return self.output_scaler.restore(value @ self.weights[-1].T + self.biases[-1])

    def _expand(self, tip: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        activate = ACTIVATIONS[self.activation]
        value = self.input_scaler.scale(tip)
        rate, bend = velocity / self.input_scaler.deviation, acceleration / self.input_scaler.deviation
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            rate, bend = rate @ weight.T, bend @ weight.T
            value, slope, curvature = activate(value @ weight.T + bias)
            rate, bend = slope * rate, curvature * rate * rate + slope * bend
        last = self.weights[-1].T
        deviation = self.output_scaler.deviation
        theta = self.output_scaler.restore(value @ last + self.biases[-1])
        rate, bend = rate @ last * deviation, bend @ last * deviation
        return self._of_planes(theta), self._of_planes(rate), self._of_planes(bend)
