"""A network of the wrist's dynamics: bend, rate and torque of P planes to the accelerations, with its file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from wristctl.arrays import Array
from wristctl.config.learning import Activation
from wristctl.config.section import Section
from wristctl.learning.network import Network, Scaler
from wristctl.learning.network_file import layers_of, read_layers, write_layers
from wristctl.learning.transitions import Rows, Transitions

# Largest network that a controller evaluates: three times a period and plane.
MOST_WEIGHTS = 4000

# Accelerations (B, P) [rad/s^2] of bends, rates and torques (B, P) each.
Model = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class Dynamics:
    """Accelerations of the wrist by its bend, rate and torque, which stand in this order, each in P planes.

    Angles and rates outside the region that it learned count as those at its edge; torques add by their slope there.
    """

    network: Network
    low: Array
    """(3 P,) least inputs that it learned"""
    high: Array
    """(3 P,) greatest"""
    period: float
    """Period over which accelerations are means [s]."""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return self.network.planes

    @staticmethod
    def of(network: Network, samples: Transitions) -> Dynamics:
        """A network with the region of what it was trained on."""
        inputs = samples.inputs
        return Dynamics(network, inputs.min(axis=0), inputs.max(axis=0), samples.period)

    def acceleration(self, bend: Array, rate: Array, torque: Array) -> Array:
        """Accelerations (B, P) [rad/s^2] of bends [rad], rates [rad/s] and torques [N m] (B, P), within the region."""
        inputs = np.clip(np.hstack([bend, rate, torque]), self.low, self.high)
        return self.network.angle(inputs).reshape(-1, self.planes)

    def gain(self, inputs: Array) -> Array:
        """Slope of the accelerations with the torques, (B, P, P) [1/(kg m2)], by differences about inputs (B, 3 P)."""
        step, first = 1e-4 * (self.high - self.low), 2 * self.planes
        columns = []
        for column in range(first, first + self.planes):
            shift = np.zeros(3 * self.planes)
            shift[column] = step[column]
            ends = [self.network.angle(inputs + way * shift).reshape(-1, self.planes) for way in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2.0 * step[column]))
        return np.stack(columns, axis=-1)


def predicted(model: Model, transitions: Transitions, recordings: Rows, periods: int) -> tuple[Array, Array]:
    """Bends (S, P) that a model predicts so many periods ahead under the recorded torques, and those recorded [rad].

    Each prediction starts from a recorded bend and rate, and the next where it ends.
    """
    h, ticks = transitions.period, transitions.bend.shape[1]
    starts = np.arange(0, ticks - periods, periods)
    bend, rate = (
        values[recordings][:, starts].reshape(-1, transitions.planes) for values in (transitions.bend, transitions.rate)
    )
    for k in range(periods):
        torque = transitions.torque[recordings][:, starts + k].reshape(-1, transitions.planes)
        acceleration = model(bend, rate, torque)
        bend, rate = bend + h * (rate + 0.5 * h * acceleration), rate + h * acceleration
    return bend, transitions.bend[recordings][:, starts + periods].reshape(-1, transitions.planes)


Positive = Annotated[float, Field(gt=0)]


class _Header(Section):
    format: Literal["wristctl.dynamics/1"] = "wristctl.dynamics/1"
    planes: Literal[1, 2]
    hidden: tuple[int, ...]
    activation: Activation
    period: Positive
    low: tuple[float, ...]
    high: tuple[float, ...]
    input_mean: tuple[float, ...]
    input_deviation: tuple[Positive, ...]
    output_mean: tuple[float, ...]
    output_deviation: tuple[Positive, ...]
    training: dict[str, object]

    @model_validator(mode="after")
    def _a_value_each(self) -> Self:
        inputs = (self.low, self.high, self.input_mean, self.input_deviation)
        if {len(values) for values in inputs} != {3 * self.planes}:
            raise ValueError(f"the inputs are {3 * self.planes}")
        if {len(self.output_mean), len(self.output_deviation)} != {self.planes}:
            raise ValueError(f"the outputs are {self.planes}")
        return self


def save_dynamics(dynamics: Dynamics, path: Path, training: dict[str, object]) -> None:
    """Write a network and `training`, its record: settings, seed, the data's hash, whatever JSON can hold."""
    network, arrays = dynamics.network, {"low": dynamics.low, "high": dynamics.high}
    for end, scaler in (("input", network.input_scaler), ("output", network.output_scaler)):
        arrays |= {f"{end}_mean": scaler.mean, f"{end}_deviation": scaler.deviation}
    header = _Header.model_validate(
        {name: tuple(values.tolist()) for name, values in arrays.items()}
        | {
            "planes": dynamics.planes, "hidden": network.sizes[1:-1], "activation": network.activation,
            "period": dynamics.period, "training": training,
        }
    )  # fmt: skip
    write_layers(path, network, header.model_dump_json())


def load_dynamics(path: Path) -> Dynamics:
    """Read a network. Raises UserError for anything that `save_dynamics` would not have written."""
    header, tensors = read_layers(path, _Header)
    weights, biases = layers_of(path, tensors, (3 * header.planes, *header.hidden, header.planes))
    scalers = (
        Scaler(np.array(header.input_mean), np.array(header.input_deviation)),
        Scaler(np.array(header.output_mean), np.array(header.output_deviation)),
    )
    network = Network(weights, biases, header.activation, *scalers, Transitions.domain)
    return Dynamics(network, np.array(header.low), np.array(header.high), header.period)
