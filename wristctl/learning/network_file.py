"""Network files: safetensors whose header says what the numbers mean and where they come from."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, ValidationError, model_validator
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from wristctl.arrays import Array
from wristctl.config.learning import Activation
from wristctl.config.section import Section
from wristctl.errors import Call, UserError
from wristctl.learning.domain import AROUND, OTHERS, Domain
from wristctl.learning.network import Network, Scaler
from wristctl.records.files import replacing

# Path of the network in a train run.
NETWORK = "models/network.safetensors"
# The one entry of the file's metadata: of several, safetensors writes the order at random.
ENTRY = "wristctl"

Positive = Annotated[float, Field(gt=0)]
H = TypeVar("H", bound=Section)


TIP = ("x", "y", "z")
BENDS = {1: ("theta",), 2: ("bend_ulnar", "bend_flexion")}
"""Names of the outputs, by the number of planes."""


class _Columns(Section):
    names: tuple[str, ...]
    unit: str
    mean: tuple[float, ...]
    deviation: tuple[Positive, ...]

    @model_validator(mode="after")
    def _a_value_each(self) -> Self:
        count = len(self.names)
        if len(self.mean) != count or len(self.deviation) != count:
            raise ValueError(f"mean and deviation need {count} values each")
        return self


class _Input(_Columns):
    names: tuple[Literal["x"], Literal["y"]] | tuple[Literal["x"], Literal["y"], Literal["z"]] = ("x", "y")
    unit: Literal["m"] = "m"


class _Output(_Columns):
    names: tuple[Literal["theta"]] | tuple[Literal["bend_ulnar"], Literal["bend_flexion"]] = ("theta",)
    unit: Literal["rad"] = "rad"


class _Other(Section):
    name: str
    unit: str
    mean: float
    deviation: Positive
    range: tuple[float, float]


class _Region(Section):
    theta: tuple[float, float]
    arc_length: tuple[float, float]
    reach: tuple[float, ...] = ()


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

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return len(self.output.names)

    @model_validator(mode="after")
    def _planes_agree(self) -> Self:
        if len(self.input.names) != self.planes + 1:
            raise ValueError(f"a tip of {len(self.input.names)} coordinates has no bend in {self.planes} planes")
        if len(self.domain.reach) != (AROUND if self.planes == 2 else 0):
            raise ValueError(f"domain.reach needs {AROUND} values in two planes, and none in one")
        return self


def save_network(network: Network, path: Path, training: dict[str, object]) -> None:
    """Write a network and `training`, its record: settings, seed, the data's hash, whatever JSON can hold."""
    scaler, planes = _columns(network.input_scaler), network.planes
    tip = {name: tuple(values[: planes + 1]) for name, values in scaler.items()}
    header = _Header(
        hidden=network.sizes[1:-1],
        activation=network.activation,
        input=_Input.model_validate(tip | {"names": TIP[: planes + 1]}),
        others=tuple(
            _Other(name=name, unit=OTHERS[name], mean=mean, deviation=deviation, range=ends)
            for name, mean, deviation, ends in zip(
                network.others,
                scaler["mean"][planes + 1 :],
                scaler["deviation"][planes + 1 :],
                network.domain.others,
                strict=True,
            )
        ),
        segments=network.segments,
        output=_Output.model_validate(_columns(network.output_scaler) | {"names": BENDS[planes]}),
        domain=_Region(theta=network.domain.theta, arc_length=network.domain.arc_length, reach=network.domain.reach),
        training=training,
    )
    write_layers(path, network, header.model_dump_json(exclude={"domain": {"reach"}} if planes == 1 else None))


def write_layers(path: Path, network: Network, header: str) -> None:
    """Write a network's weights and biases, layer by layer, under this header."""
    tensors = {}
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tensors[f"{layer}.weight"], tensors[f"{layer}.bias"] = np.ascontiguousarray(weight), bias
    with replacing(path) as temporary:
        temporary.write_bytes(save(tensors, {ENTRY: header}))


def load_network(path: Path) -> Network:
    """Read a network. Raises UserError for anything that `save_network` would not have written."""
    header, tensors = read_layers(path, _Header)
    entries = header.others
    return Network(
        *layers_of(path, tensors, (header.planes + 1 + len(entries), *header.hidden, header.planes)),
        header.activation,
        Scaler(
            np.array([*header.input.mean, *(entry.mean for entry in entries)]),
            np.array([*header.input.deviation, *(entry.deviation for entry in entries)]),
        ),
        Scaler(np.array(header.output.mean), np.array(header.output.deviation)),
        Domain(
            header.domain.theta, header.domain.arc_length, tuple(entry.range for entry in entries), header.domain.reach
        ),
        tuple(entry.name for entry in entries),
        header.segments,
    )


def training_record(path: Path) -> dict[str, object]:
    """Record of the training that `save_network` wrote. Raises UserError like `load_network`."""
    return read_layers(path, _Header)[0].training


def read_layers(path: Path, kind: type[H]) -> tuple[H, dict[str, Array]]:
    """A file's header, of this kind, and its arrays. Raises UserError for a file that has not both."""
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
        return kind.model_validate_json(text), tensors
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise _broken(path, f"the header's {where or 'text'} is wrong: {first['msg']}") from error


def layers_of(
    path: Path, tensors: dict[str, Array], sizes: tuple[int, ...]
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Weights and biases of a network with layers of these sizes. Raises UserError for arrays that are no such ones."""
    shapes = list(enumerate(pairwise(sizes)))
    weights = tuple(_tensor(path, tensors, f"{layer}.weight", (out, into)) for layer, (into, out) in shapes)
    return weights, tuple(_tensor(path, tensors, f"{layer}.bias", (out,)) for layer, (_, out) in shapes)


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
    return UserError(problem, where=str(path), fix="use that of a sealed train run, or train again")
