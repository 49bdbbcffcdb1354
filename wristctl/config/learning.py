"""Data sets and networks."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wristctl.config.section import Section, choice, quantity

Activation = Literal["sigmoid", "relu", "leaky-relu", "tanh", "silu"]


class DataSettings(Section):
    """Samples of tip positions and bending angles from the constant-curvature model (E1)."""

    source: Literal["pcc"] = choice("pcc", "where samples come from", "paper")
    samples: int = choice(1000, "number of samples", "paper", ge=10, le=10_000_000)
    sampling: Literal["uniform", "latin-hypercube", "sobol"] = choice(
        "sobol", "how angle and stretch are drawn"
    )
    stretch: tuple[float, float] = quantity(
        (0.9, 1.1), "", "range of arc length over the wrist's length", "assumed"
    )

    @model_validator(mode="after")
    def _stretch_in_order(self) -> Self:
        low, high = self.stretch
        if not 0 < low <= high:
            raise ValueError(f"stretch must be 0 < low <= high, not ({low}, {high})")
        return self


class TrainSettings(Section):
    """A multilayer perceptron from tip position (x, y) to bending angle; defaults are the paper's network."""

    data: str | None = choice(None, "data run: path, id or latest:gen-data")
    hidden: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = choice(
        (200, 100, 100), "neurons of each hidden layer", "paper", min_length=1, max_length=10
    )
    activation: Activation = choice("sigmoid", "activation", "paper")
    optimiser: Literal["adam", "adamw", "sgd"] = choice(
        "adamw", "adam couples weight decay to the gradient (as printed, C11: collapses), adamw does not"
    )
    standardise: bool = choice(
        True, "scale inputs and outputs to zero mean and unit deviation; false: raw, as printed"
    )
    learning_rate: float = quantity(0.003, "", "learning rate", "paper T1", gt=0)
    beta1: float = quantity(0.90, "", "Adam's beta1, sgd's momentum", "paper T1", ge=0, lt=1)
    weight_decay: float = quantity(0.01, "", "weight decay", "paper T1", ge=0)
    batch: int = choice(100, "samples of a batch", "paper", ge=1)
    epochs: int = choice(100, "passes over the training data", "paper", ge=1)
    train_share: float = quantity(
        0.75,
        "",
        "share of samples for training; the rest is halved into validation and test",
        "paper",
        gt=0,
        lt=1,
    )
    seeds: int = choice(
        1,
        "trainings with different initial weights; the one with the least validation loss is kept",
        ge=1,
        le=100,
    )
