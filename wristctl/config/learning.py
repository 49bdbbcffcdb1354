"""Data sets and networks."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from wristctl.config.given_files import columns_of_file, given_file
from wristctl.config.loop import Loop
from wristctl.config.section import Section, choice, quantity

Activation = Literal["sigmoid", "relu", "leaky-relu", "tanh", "silu"]


# Samples that are drawn where no number is given: the paper's.
_DRAWN = 1000
_OF_TRANSITIONS = 4000


class DataSettings(Section):
    """Samples of tip positions and bending angles."""

    source: Literal["pcc", "plant", "run", "csv", "transitions"] = choice(
        "pcc",
        "constant curvature (E1), static equilibria of the loaded wrist, or measured: in an earlier run, in CSV files; "
        "or transitions of the wrist in motion, for a network of its dynamics",
        "paper",
    )
    samples: int | None = choice(
        None,
        "number of samples; null: 1000 that are drawn, 4000 of transitions, or all that were measured",
        "paper",
        ge=10,
        le=10_000_000,
    )
    sampling: Literal["uniform", "latin-hypercube", "sobol"] = choice(
        "sobol", "how angle, stretch and payload are drawn"
    )
    stretch: tuple[float, float] = quantity(
        (0.9, 1.1), "", "pcc: range of arc length over the wrist's length", "assumed"
    )
    planes: Literal[1, 2] | None = choice(
        None, "planes that samples which are drawn bend in; null: two where the wrist leaves its plane, else one"
    )
    segments: int = choice(1, "segments: each with an angle of its own (pcc), in equilibrium (plant)", ge=1, le=8)
    poses: tuple[float, ...] = quantity(
        (0.0, 90.0, 180.0), "deg", "plant: tilts of the base from upright, drawn in turn", "assumed", min_length=1
    )
    rolls: tuple[Annotated[float, Field(gt=-90, le=90)], ...] = quantity(
        (),
        "deg",
        "plant, in two planes: directions of the tilts, from ulnar toward flexion, drawn in turn; empty: the "
        "wrist's own",
    )
    held_out_poses: tuple[float, ...] = quantity((), "deg", "plant: tilts kept from training, to test by")
    payload: tuple[float, float] = quantity(
        (0.0, 0.5), "", "plant: range of the payload over the hand's mass", "assumed"
    )
    held_out_payload: tuple[float, float] = quantity(
        (0.2, 0.3), "", "plant: part of that range kept from training, to test by"
    )
    run: str | None = choice(
        None, "run: one with tips and angles (hw-run, track, simulate, compare): path, id or latest:hw-run"
    )
    files: tuple[str, ...] = given_file("csv: open logs with tips and angles (documentation: The open log)", ())
    columns: str | None = columns_of_file()
    loop: Loop = Field(Loop(), description="transitions: plant, motors and period", json_schema_extra={"unsaid": True})

    @property
    def measured(self) -> bool:
        """Whether the samples are of recordings."""
        return self.source in ("run", "csv")

    @property
    def drawn_samples(self) -> int:
        """Number of samples to draw."""
        number = _OF_TRANSITIONS if self.source == "transitions" else _DRAWN
        return number if self.samples is None else self.samples

    @model_validator(mode="after")
    def _loop_is_of_transitions(self) -> Self:
        if self.source != "transitions" and self.loop != Loop():
            raise ValueError("a loop is for source: transitions")
        return self

    @model_validator(mode="after")
    def _ranges_in_order(self) -> Self:
        low, high = self.stretch
        if not 0 < low <= high:
            raise ValueError(f"stretch must be 0 < low <= high, not ({low}, {high})")
        for name, (least, most) in (("payload", self.payload), ("held_out_payload", self.held_out_payload)):
            if not 0 <= least <= most:
                raise ValueError(f"{name} must be 0 <= low <= high, not ({least}, {most})")
        return self


_PRINTED = {"optimiser": "adam", "standardise": False, "weight_decay": 0.01}

# T1's columns (momentum read as beta1; coupled decay and raw inputs, of which T1 says nothing, C11), and a network
# that is accurate: small, smooth, scaled, trained by second order; experiments/accurate_network_selection.yaml chose
# its layers.
PRESETS: dict[str, dict[str, Any]] = {
    "t1-sigmoid": {"activation": "sigmoid", "beta1": 0.90, "learning_rate": 0.003, **_PRINTED},
    "t1-relu": {"activation": "relu", "beta1": 0.95, "learning_rate": 0.001, **_PRINTED},
    "t1-leaky-relu": {"activation": "leaky-relu", "beta1": 0.92, "learning_rate": 0.001, **_PRINTED},
    "t1-tanh": {"activation": "tanh", "beta1": 0.97, "learning_rate": 0.002, **_PRINTED},
    "recommended": {
        "activation": "tanh",
        "hidden": (24, 12),
        "optimiser": "levenberg-marquardt",
        "weight_decay": 0.0,
        "epochs": 200,
        "patience": 30,
    },
}

# Most weights of a network trained by second order, which solves for all weights at once (2 inputs counted).
MOST_WEIGHTS = 4000


class NetworkSettings(Section):
    """A multilayer perceptron and its training; defaults are the paper's network."""

    preset: Literal["t1-sigmoid", "t1-relu", "t1-leaky-relu", "t1-tanh", "recommended"] | None = choice(
        None, "values for the settings below that are not given"
    )
    inputs: Literal["all", "tip"] = choice("all", "all of the data's inputs, or the tip position alone")
    hidden: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = choice(
        (200, 100, 100), "neurons of each hidden layer", "paper", min_length=1, max_length=10
    )
    activation: Activation = choice("sigmoid", "activation", "paper")
    optimiser: Literal["adam", "adamw", "sgd", "levenberg-marquardt"] = choice(
        "adamw",
        "adam couples weight decay to the gradient (C11: on raw inputs sigmoid collapses), adamw does not; "
        "levenberg-marquardt takes all samples in one step of second order: for small networks, without rate, "
        "schedule, beta1 and batch",
    )
    standardise: bool = choice(True, "scale inputs and outputs to zero mean and unit deviation; false: raw")
    learning_rate: float = quantity(0.003, "", "learning rate at the start", "paper T1", gt=0)
    schedule: Literal["constant", "cosine"] = choice("constant", "learning rate over the epochs; cosine falls to zero")
    beta1: float = quantity(0.90, "", "Adam's beta1, sgd's momentum", "paper T1", ge=0, lt=1)
    weight_decay: float = quantity(0.01, "", "weight decay", "paper T1", ge=0)
    batch: int = choice(100, "samples of a batch", "paper", ge=1)
    epochs: int = choice(100, "passes over the training data", "paper", ge=1)
    patience: int = choice(
        0, "stop after so many epochs without a lower validation loss, keep the lowest; 0: train to the end", ge=0
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_from_preset(cls, data: Any) -> Any:
        preset = PRESETS.get(str(data.get("preset"))) if isinstance(data, Mapping) else None
        return {**preset, **data} if preset else data

    @model_validator(mode="after")
    def _second_order_is_for_small_networks(self) -> Self:
        self._solvable(self.hidden)
        return self

    def _solvable(self, hidden: tuple[int, ...]) -> None:
        weights = sum((inputs + 1) * neurons for inputs, neurons in pairwise((2, *hidden, 1)))
        if self.optimiser == "levenberg-marquardt" and weights > MOST_WEIGHTS:
            layers = "-".join(map(str, hidden))
            raise ValueError(
                f"levenberg-marquardt solves for all weights at once, at most {MOST_WEIGHTS}: "
                f"{layers} has {weights}; choose fewer neurons, or adamw"
            )


class NetworkRow(NetworkSettings):
    """One of several networks trained on the same data."""

    name: str = choice("", "its name in tables and metrics", pattern=r"[a-z0-9][a-z0-9-]*")


class Grid(Section):
    """Grid of a search, which tries all combinations. An empty list stands for the section's own value."""

    depths: tuple[Annotated[int, Field(ge=1, le=10)], ...] = choice(
        (1, 2, 3, 4, 5), "hidden layers: `width` neurons in the first, half of that in each other", "paper"
    )
    activations: tuple[Activation, ...] = choice(("sigmoid", "relu", "leaky-relu", "tanh"), "activations", "paper")
    widths: tuple[Annotated[int, Field(ge=2, le=10_000)], ...] = choice(
        (200,), "neurons of the first hidden layer", "paper", min_length=1
    )
    learning_rates: tuple[Annotated[float, Field(gt=0)], ...] = choice((), "learning rates")
    weight_decays: tuple[Annotated[float, Field(ge=0)], ...] = choice((), "weight decays")
    folds: int = choice(5, "parts of the samples, each held out once", "paper", ge=2, le=20)

    def layers(self) -> list[tuple[int, ...]]:
        """Neurons of each hidden layer, for every depth and width."""
        return [(width, *[width // 2] * (depth - 1)) for depth in self.depths for width in self.widths]


class TrainSettings(NetworkSettings):
    """A network from tip position to bend."""

    data: str | None = choice(None, "data run: path, id or latest:gen-data; without one, gen-data's samples are drawn")
    train_share: float = quantity(
        0.75,
        "",
        "share of samples for training; the rest is halved into validation and test",
        "paper",
        gt=0,
        lt=1,
    )
    split: Literal["recording", "sample"] = choice(
        "recording", "of measured data: whole recordings, or samples by themselves, whose neighbours then test them"
    )
    seeds: int = choice(
        1,
        "trainings with different initial weights; the one with the least validation loss is kept",
        ge=1,
        le=100,
    )
    rows: tuple[NetworkRow, ...] = choice((), "several networks side by side, instead of the one above")
    search: bool = choice(False, "choose layers and activation by cross-validation over the grid, then train that")
    grid: Grid = Grid()
    workers: int = choice(0, "processes at once, whose number changes no byte; 0: one for each core", ge=0, le=256)
    device: Literal["auto", "cpu", "cuda"] = choice("cpu", "auto: cuda where there is one; small networks like the cpu")
    resume: str | None = choice(None, "train run that was stopped; its trainings are taken up where they were")

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [row.name for row in self.rows]
        if "" in names or len(set(names)) < len(names):
            raise ValueError("each network of rows needs a name of its own")
        if self.rows and self.search:
            raise ValueError("give rows or search, not both")
        for hidden in self.grid.layers() if self.search else ():
            self._solvable(hidden)
        return self
