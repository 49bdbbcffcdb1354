"""The network, the polynomial and the exact inverse as compiled code: one bend at a time, as a control loop asks.

Weights lie input by input, so that a layer is a sum of columns: many neurons at once and in a fixed order.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel
from wristctl.learning.network import LEAK, Network, Scaler

# Degree of the polynomial's terms: 21 terms in x and y, 126 with pose and mass.
DEGREE = 5


@dataclass(frozen=True)
class Polynomial:
    """Sum of factors times powers of the scaled inputs."""

    scaler: Scaler
    powers: NDArray[np.int64]
    """(terms, inputs)"""
    factors: Array
    """(terms,), in two planes (terms, 2) [rad]"""
    degree: int

    @property
    def multiply_adds(self) -> int:
        """Multiply-adds of one bend."""
        return int(self.powers.size + self.factors.size)

    def angle(self, inputs: Array) -> Array:
        """Bends (...), in two planes (..., 2) [rad], of inputs (..., D)."""
        return self._terms(inputs) @ self.factors

    def _terms(self, inputs: Array) -> Array:
        scaled = self.scaler.scale(inputs)
        return np.stack([np.prod(scaled**power, axis=-1) for power in self.powers], axis=-1)

    @staticmethod
    def fit(inputs: Array, theta: Array, degree: int = DEGREE) -> Polynomial:
        """The polynomial nearest to the bends (N,) or (N, 2) [rad] of inputs (N, D)."""
        everything = product(range(degree + 1), repeat=inputs.shape[1])
        powers = np.array([power for power in everything if sum(power) <= degree])
        empty = Polynomial(Scaler.of(inputs), powers, np.zeros(len(powers)), degree)
        factors: Array = np.linalg.lstsq(empty._terms(inputs), theta, rcond=None)[0].astype(np.float64)
        return Polynomial(empty.scaler, powers, factors, degree)


_ACTIVATIONS = ("sigmoid", "tanh", "silu", "relu", "leaky-relu")

# Inputs timed at once: enough to hide the call, few enough to be done within one slice of a busy machine's time.
CHUNK = 50

# From inputs (N, D) to bends (N,), in two planes (N, 2) [rad].
Timed = Callable[[Array], Array]


@compiled
def _activate(kind: int, value: Any) -> None:
    if kind == 0:
        for i in range(len(value)):
            value[i] = 1.0 / (1.0 + math.exp(-value[i]))
    elif kind == 1:
        for i in range(len(value)):
            value[i] = 1.0 - 2.0 / (1.0 + math.exp(2.0 * value[i]))
    elif kind == 2:
        for i in range(len(value)):
            value[i] = value[i] / (1.0 + math.exp(-value[i]))
    elif kind == 3:
        for i in range(len(value)):
            value[i] = max(value[i], 0.0)
    else:
        for i in range(len(value)):
            value[i] = max(value[i], LEAK * value[i])


@compiled
def _add_column(total: Any, factor: float, column: Any) -> None:
    for i in range(len(total)):
        total[i] += factor * column[i]


@compiled
def _add_columns(total: Any, factors: Any, columns: Any) -> None:
    """Four columns at once: the sums are read and written a quarter as often."""
    n = len(total)
    a, b, c, d = columns[:n], columns[n : 2 * n], columns[2 * n : 3 * n], columns[3 * n : 4 * n]
    p, q, r, s = factors[0], factors[1], factors[2], factors[3]
    for i in range(n):
        total[i] += (p * a[i] + q * b[i]) + (r * c[i] + s * d[i])


@kernel
def _angles(sizes: Any, kind: int, packed: Any, inputs: Any, value: Any, result: Any, out: Any) -> None:
    for sample in range(len(out)):
        value[: sizes[0]] = inputs[sample]
        position = 0
        for layer in range(1, len(sizes)):
            before, width = sizes[layer - 1], sizes[layer]
            total = result[:width]
            total[:] = packed[position : position + width]
            position += width
            fours = before // 4 * 4
            for j in range(0, fours, 4):
                _add_columns(total, value[j : j + 4], packed[position : position + 4 * width])
                position += 4 * width
            for j in range(fours, before):
                _add_column(total, value[j], packed[position : position + width])
                position += width
            if layer < len(sizes) - 1:
                _activate(kind, total)
            value[:width] = total
        for plane in range(out.shape[1]):
            out[sample, plane] = value[plane]


@kernel
def _polynomials(powers: Any, factors: Any, inputs: Any, table: Any, out: Any) -> None:
    for sample in range(len(out)):
        for j in range(inputs.shape[1]):
            table[j, 0] = 1.0
            for k in range(1, table.shape[1]):
                table[j, k] = table[j, k - 1] * inputs[sample, j]
        for plane in range(out.shape[1]):
            out[sample, plane] = 0.0
        for term in range(len(factors)):
            product = 1.0
            for j in range(inputs.shape[1]):
                product *= table[j, powers[term, j]]
            for plane in range(out.shape[1]):
                out[sample, plane] += factors[term, plane] * product


@kernel
def _arcs(inputs: Any, out: Any) -> None:
    for sample in range(len(out)):
        out[sample] = 2.0 * math.atan2(inputs[sample, 1], inputs[sample, 0])


@kernel
def _arcs_in_space(inputs: Any, out: Any) -> None:
    for sample in range(len(out)):
        y, z = inputs[sample, 1], inputs[sample, 2]
        across = math.sqrt(y * y + z * z)
        scale = 2.0 * math.atan2(across, inputs[sample, 0]) / max(across, 1e-300)
        out[sample, 0] = scale * y
        out[sample, 1] = scale * z


def compiled_network(network: Network) -> Timed:
    """The network's bends, one sample after another; scaling is folded into the first and the last layer."""
    packed = np.concatenate([np.concatenate([bias, weight.T.ravel()]) for weight, bias in network.folded()])
    sizes, kind = np.array(network.sizes), _ACTIVATIONS.index(network.activation)
    value, result = np.empty(sizes.max()), np.empty(sizes.max())

    def angles(inputs: Array) -> Array:
        out = np.empty((len(inputs), network.planes))
        _angles(sizes, kind, packed, np.ascontiguousarray(inputs), value, result, out)
        return out[:, 0] if network.planes == 1 else out

    return angles


def compiled_polynomial(polynomial: Polynomial) -> Timed:
    """The polynomial's bends, one sample after another."""
    factors = polynomial.factors.reshape(len(polynomial.factors), -1)
    table = np.empty((polynomial.powers.shape[1], polynomial.degree + 1))

    def angles(inputs: Array) -> Array:
        out = np.empty((len(inputs), factors.shape[1]))
        scaled = polynomial.scaler.scale(inputs)
        _polynomials(polynomial.powers, factors, scaled, table, out)
        return out.reshape(len(inputs), *polynomial.factors.shape[1:])

    return angles


def compiled_exact(tip: Array) -> Array:
    """Bend of the arc to each tip (N, P + 1) [m], one sample after another."""
    planes = tip.shape[1] - 1
    out = np.empty(len(tip) if planes == 1 else (len(tip), planes))
    (_arcs if planes == 1 else _arcs_in_space)(np.ascontiguousarray(tip), out)
    return out


def microseconds(angles: Timed, inputs: Array, repeats: int = 301) -> float:
    """Median time for one input [us]; each repeat is a run through up to CHUNK of them in compiled code."""
    few = inputs[:CHUNK]
    angles(few)
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        angles(few)
        times.append(time.perf_counter() - began)
    return 1e6 * statistics.median(times) / len(few)
