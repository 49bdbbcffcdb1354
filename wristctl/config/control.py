"""What is tuned, compared and simulated: controllers with their gains."""

from __future__ import annotations

from typing import Literal

from wristctl.config.loop import LOOPS, DirectionName, Loop, Loops, Reference, Scenario
from wristctl.config.section import Section, choice, quantity

GainsChoice = str | dict[str, float]


class Row(Section):
    """One controller with one set of gains."""

    controller: str = choice("smc", "name in the table of controllers")
    gains: GainsChoice = choice("default", "a preset's name, `tuned` (from a tune run), or every gain by name")

    @property
    def gains_name(self) -> str:
        """The preset, `tuned`, or the values themselves."""
        return self.gains if isinstance(self.gains, str) else " ".join(f"{k}={v:g}" for k, v in self.gains.items())

    @property
    def label(self) -> str:
        """controller/gains"""
        return f"{self.controller}/{self.gains_name}"


class Objective(Section):
    """Weights of the tuning objective; each term is averaged over the tuning scenarios."""

    rmse: float = quantity(1.0, "1/rad", "weight of the RMSE", ge=0)
    settling: float = quantity(0.01, "1/s", "weight of the settling time (the horizon where it never settles)", ge=0)
    chattering: float = quantity(
        1e-6, "s/N", "weight of the total variation of tension per second", "paper: output error and chattering", ge=0
    )
    saturation: float = quantity(0.0, "", "weight of the share of time in saturation", ge=0)


class TuneSettings(Section):
    """A search for gains: the same budget, optimiser, objective and start for every controller."""

    controllers: tuple[str, ...] = choice(("smc",), "controllers to tune", min_length=1)
    optimiser: Literal["pso", "differential-evolution", "random"] = choice("pso", "ask/tell optimiser", "paper")
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
    network: str | None = choice(None, "train run: path, id or latest:train")
    tuned: str | None = choice(None, "tune run: path, id or latest:tune")
    tuning: TuneSettings | None = choice(None, "a search for the rows with gains: tuned, in place of a tune run")


class SimulateSettings(Section):
    """One closed loop."""

    controller: str = choice("smc", "name in the table of controllers")
    gains: GainsChoice = choice("exchanged", "a preset's name, `tuned` (from a tune run), or every gain by name")
    loop: Loop = Loop()
    reference: Reference = Reference()
    direction: DirectionName = choice("ulnar", "direction of bending; the reference's angle counts toward it")
    start: Literal["straight", "equilibrium"] = choice(
        "straight", "state at rest before the move: straight, or the static equilibrium at pretension"
    )
    horizon: float = quantity(5.0, "s", "duration of the rollout", "assumed", gt=0)
    network: str | None = choice(None, "train run behind a reference with inverse: network")
    tuned: str | None = choice(None, "tune run behind gains: tuned")
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")
