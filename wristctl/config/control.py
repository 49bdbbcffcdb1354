"""What is tuned, compared and simulated: controllers with their gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import model_validator

from wristctl.config.choices import CONTROLLERS, METRICS, OPTIMISERS
from wristctl.config.loop import LOOPS, DirectionName, Loop, Loops, Reference, Scenario
from wristctl.config.section import OneOf, OpenSection, Parameter, Section, choice, quantity

GainsChoice = str | dict[str, float]
ControllerName = Annotated[str, OneOf(CONTROLLERS)]

_REPETITIONS = "repetitions, each with noise and drawn plants of its own, the same for all rows"


class Row(Section):
    """One controller with one set of gains."""

    controller: ControllerName = choice("smc", "name in the table of controllers")
    gains: GainsChoice = choice("default", "a preset's name, `tuned` (from a tune run), or every gain by name")

    @property
    def gains_name(self) -> str:
        """The preset, `tuned`, or the values themselves."""
        return self.gains if isinstance(self.gains, str) else " ".join(f"{k}={v:g}" for k, v in self.gains.items())

    @property
    def label(self) -> str:
        """controller/gains"""
        return f"{self.controller}/{self.gains_name}"


class Objective(OpenSection):
    """Weights of the tuning objective; each term is averaged over the tuning scenarios and repetitions."""

    rmse: float = quantity(1.0, "1/rad", "weight of the RMSE", ge=0)
    settling: float = quantity(0.01, "1/s", "weight of the settling time (the horizon where it never settles)", ge=0)
    chattering: float = quantity(
        1e-6, "s/N", "weight of the total variation of tension per second", "paper: output error and chattering", ge=0
    )
    saturation: float = quantity(0.0, "", "weight of the share of time in saturation", ge=0)

    def added(self) -> Mapping[str, Parameter]:
        """A weight for every other metric of the table."""
        others = {name: METRICS[name] for name in METRICS if name not in type(self).model_fields}
        return {
            name: Parameter(0.0, f"1/({each.unit})" if each.unit else "", f"weight of {each.formula}")
            for name, each in others.items()
        }

    def weights(self) -> dict[str, float]:
        """The weight of each metric that has one, by name."""
        given = {name: getattr(self, name) for name in type(self).model_fields} | (self.model_extra or {})
        return {name: float(weight) for name, weight in given.items() if weight != 0.0}

    @model_validator(mode="after")
    def _none_negative(self) -> Self:
        below = [name for name, weight in (self.model_extra or {}).items() if weight < 0.0]
        if below:
            raise ValueError(f"the weight of {below[0]} is negative")
        return self


class TuneSettings(Section):
    """A search for gains: the same budget, optimiser, objective and start for every controller."""

    controllers: tuple[ControllerName, ...] = choice(("smc",), "controllers to tune", min_length=1)
    optimiser: Annotated[str, OneOf(OPTIMISERS)] = choice("pso", "ask/tell optimiser", "paper")
    candidates: int = choice(40, "candidates per iteration (particles of the swarm)", "assumed", ge=2, le=10_000)
    iterations: int = choice(60, "iterations", "assumed", ge=1, le=100_000)
    objective: Objective = Objective()
    scenarios: tuple[Scenario, ...] = choice(
        (
            Scenario(reference=Reference(kind="step", angle_deg=20.0)),
            Scenario(reference=Reference(kind="minimum-jerk", angle_deg=20.0, duration=1.5)),
        ),
        "tuning scenarios; compare refuses to judge on any of them",
        min_length=1,
    )
    loops: Loops = choice(
        LOOPS,
        "the loops that scenarios may name; naming any replaces these (`exact: {}` is the built-in one)",
        min_length=1,
    )
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, _REPETITIONS + " and candidates", ge=1, le=1000)
    network: str | None = choice(None, "train run behind references with inverse: network")
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")


class CompareSettings(Section):
    """Controllers x loops x references x inverses, beside the paper's T2."""

    rows: tuple[Row, ...] = choice((Row(controller="smc", gains="printed"),), "controllers and gains", min_length=1)
    loops: Loops = choice(
        LOOPS,
        "the loops to judge on, each a block of the table; naming any replaces these (`exact: {}` is the built-in one)",
        min_length=1,
    )
    references: tuple[Reference, ...] = choice(
        (
            Reference(kind="step"),
            Reference(kind="minimum-jerk", duration=1.0),
            Reference(kind="minimum-jerk", duration=2.0),
        ),
        "references, each followed from rest",
        min_length=1,
    )
    inverses: tuple[Literal["none", "exact", "network"], ...] = choice(
        ("network", "exact"), "how tip targets become angles; overrides the references' own", min_length=1
    )
    directions: tuple[DirectionName, ...] = choice(
        ("ulnar",), "directions of bending, each by its own plane", min_length=1
    )
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, _REPETITIONS, ge=1, le=1000)
    network: str | None = choice(None, "train run: path, id or latest:train")
    tuned: str | None = choice(None, "tune run: path, id or latest:tune")
    tuning: TuneSettings | None = choice(None, "a search for the rows with gains: tuned, in place of a tune run")


class SimulateSettings(Section):
    """One closed loop."""

    controller: ControllerName = choice("smc", "name in the table of controllers")
    gains: GainsChoice = choice("exchanged", "a preset's name, `tuned` (from a tune run), or every gain by name")
    loop: Loop = Loop()
    reference: Reference = Reference()
    direction: DirectionName = choice("ulnar", "direction of bending; the reference's angle counts toward it")
    start: Literal["straight", "equilibrium"] = choice(
        "straight", "state at rest before the move: straight, or the static equilibrium at pretension"
    )
    horizon: float = quantity(5.0, "s", "duration of the rollout", "assumed", gt=0)
    repetitions: int = choice(1, "rollouts, each with noise and a drawn plant of its own", ge=1, le=10_000)
    network: str | None = choice(None, "train run behind a reference with inverse: network")
    tuned: str | None = choice(None, "tune run behind gains: tuned")
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")
