"""Network files: safetensors whose header says what the numbers mean and where they come from."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationError
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from wristctl.arrays import Array
from wristctl.config.learning import Activation
from wristctl.config.section import Section
from wristctl.errors import Call, UserError
from wristctl.learning.domain import OTHERS, Domain
from wristctl.learning.network import Network, Scaler
from wristctl.records.files import replacing

# Path of the network in a train run.
NETWORK = "models/network.safetensors"
# The one entry of the file's metadata: of several, safetensors writes the order at random.
ENTRY = "wristctl"

Positive = Annotated[float, Field(gt=0)]


class _Input(Section):
    names: tuple[Literal["x"], Literal["y"]] = ("x", "y")
    unit: Literal["m"] = "m"
    mean: tuple[float, float]
    deviation: tuple[Positive, Positive]


class _Other(Section):
    name: str
    unit: str
    mean: float
    deviation: Positive
    range: tuple[float, float]


class _Output(Section):
    names: tuple[Literal["theta"]] = ("theta",)
    unit: Literal["rad"] = "rad"
    mean: tuple[float]
    deviation: tuple[Positive]


class _Region(Section):
    theta: tuple[float, float]
    arc_length: tuple[float, float]


class _Header(Section):
    format: Literal["wristctl.network/1"] = "wristctl.network/1"
    hidden: tuple[int, ...]
    activation: Activation
    input: _Input
    others: tuple[_Other, ...] = ()
    segments: int = 1
    output: _Output
    domain: _Region
    training: dict[str, object]


def save_network(network: Network, path: Path, training: dict[str, object]) -> None:
    """Write a network and `training`, its record: settings, seed, the data's hash, whatever JSON can hold."""
    scaler = _columns(network.input_scaler)
    header = _Header(
        hidden=network.sizes[1:-1],
        activation=network.activation,
        input=_Input.model_validate({name: tuple(values[:2]) for name, values in scaler.items()}),
        others=tuple(
            _Other(name=name, unit=OTHERS[name], mean=mean, deviation=deviation, range=ends)
            for name, mean, deviation, ends in zip(
                network.others, scaler["mean"][2:], scaler["deviation"][2:], network.domain.others, strict=True
            )
        ),
        segments=network.segments,
        output=_Output.model_validate(_columns(network.output_scaler)),
        domain=_Region(theta=network.domain.theta, arc_length=network.domain.arc_length),
        training=training,
    )
    tensors = {}
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tensors[f"{layer}.weight"], tensors[f"{layer}.bias"] = np.ascontiguousarray(weight), bias
    with replacing(path) as temporary:
        temporary.write_bytes(save(tensors, {ENTRY: header.model_dump_json()}))


def load_network(path: Path) -> Network:
    """Read a network. Raises UserError for anything that `save_network` would not have written."""
    header, tensors = _read(path)
    weights, biases, entries = [], [], header.others
    for layer, (inputs, neurons) in enumerate(pairwise((2 + len(header.others), *header.hidden, 1))):
        weights.append(_tensor(path, tensors, f"{layer}.weight", (neurons, inputs)))
        biases.append(_tensor(path, tensors, f"{layer}.bias", (neurons,)))
    return Network(
        tuple(weights),
        tuple(biases),
        header.activation,
        Scaler(
            np.array([*header.input.mean, *(entry.mean for entry in entries)]),
            np.array([*header.input.deviation, *(entry.deviation for entry in entries)]),
        ),
        Scaler(np.array(header.output.mean), np.array(header.output.deviation)),
        Domain(header.domain.theta, header.domain.arc_length, tuple(entry.range for entry in entries)),
        tuple(entry.name for entry in entries),
        header.segments,
    )


def training_record(path: Path) -> dict[str, object]:
    """Record of the training that `save_network` wrote. Raises UserError like `load_network`."""
    return _read(path)[0].training


def _read(path: Path) -> tuple[_Header, dict[str, Array]]:
    if not path.is_file():
        raise UserError("there is no such network file", str(path), ("train one with `", Call("train"), "`"))
    try:
        with safe_open(path, "numpy") as file:
            text = (file.metadata() or {}).get(ENTRY)
            names = file.keys()
            tensors = {name: file.get_tensor(name) for name in names}
    except (SafetensorError, OSError, TypeError, AttributeError) as error:  # the last two of types that numpy has not
        raise _broken(path, f"not a readable safetensors file: {error}") from error
    if text is None:
        raise _broken(path, "a safetensors file, but not one of wristctl's networks")
    try:
        return _Header.model_validate_json(text), tensors
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise _broken(path, f"the header's {where or 'text'} is wrong: {first['msg']}") from error


def _tensor(path: Path, tensors: dict[str, Array], name: str, shape: tuple[int, ...]) -> Array:
    tensor = tensors.get(name)
    if tensor is None:
        raise _broken(path, f"the array {name} is missing")
    if tensor.shape != shape or tensor.dtype != np.float64:
        raise _broken(path, f"the array {name} is {tensor.shape} of {tensor.dtype}, the header says {shape} of float64")
    if not np.isfinite(tensor).all():
        raise _broken(path, f"the array {name} holds numbers that are not finite")
    return tensor


def _columns(scaler: Scaler) -> dict[str, tuple[float, ...]]:
    return {"mean": tuple(scaler.mean.tolist()), "deviation": tuple(scaler.deviation.tolist())}


def _broken(path: Path, problem: str) -> UserError:
    return UserError(problem, where=str(path), fix="use a file from models/ of a sealed train run, or train again")
