"""Settings of `tune`: a search for gains."""

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import AfterValidator, model_validator

from wristctl.config.choices import METRICS, OPTIMISERS
from wristctl.config.controller_row import REPETITIONS, ControllerName
from wristctl.config.families import TuningWorlds
from wristctl.config.loop import CAMERA, LOOPS, Loops, Reference, Scenario
from wristctl.config.section import OneOf, OpenSection, Parameter, Section, choice, kept_settings, quantity
from wristctl.errors import Unfitting


class Objective(OpenSection):
    """Weights of the tuning objective, in decades better or worse than `feedforward` on the same case.

    A term is log10((metric + floor) / (feedforward's metric + floor)), the floor being the metric's own below which no
    difference is of interest (docs/choices.md), averaged over all cases.
    """

    rmse: float = choice(1.0, "weight of the RMSE", ge=0)
    steady_state: float = choice(0.1, "weight of the error at the end", ge=0)
    oscillation: float = choice(0.1, "weight of the oscillation at rest", ge=0)
    chattering: float = choice(0.02, "weight of the total variation of tension per second", ge=0)
    worst: float = choice(0.0, "weight of the worst case's terms, beside the mean's 1", ge=0)
    swinging: float = choice(
        0.5, "times the root of the share of cases that swing by more than 0.1 deg, or chatter [decades]", ge=0
    )
    margin: float = choice(
        1.0,
        "times the root of the share that fails, swings or chatters of the loop tuned for with its torque x 0.67 or "
        "x 1.5, a frame later, springs x 0.6 or x 1.4 [decades]; 0: no such changes are tried",
        ge=0,
    )

    def added(self) -> Mapping[str, Parameter]:
        """A weight for every other metric of the table."""
        added_metrics = {name: METRICS[name] for name in METRICS if name not in type(self).model_fields}
        return {name: Parameter(0.0, "", f"weight of {metric.formula}") for name, metric in added_metrics.items()}

    def weights(self) -> dict[str, float]:
        """The weight of each metric that has one, by name."""
        weight_of = {name: getattr(self, name) for name in type(self).model_fields} | (self.model_extra or {})
        return {name: float(weight) for name, weight in weight_of.items() if weight != 0.0 and name in METRICS}

    @model_validator(mode="after")
    def _none_negative(self) -> Self:
        below = [name for name, weight in (self.model_extra or {}).items() if weight < 0.0]
        if below:
            raise ValueError(f"the weight of {below[0]} is negative")
        return self


def _each_once(names: tuple[str, ...]) -> tuple[str, ...]:
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise Unfitting(f"{twice[0]} is named twice: it would be searched twice", "name each once")
    return names


# Motions searched on where none are named: a move, and a sine to both sides.
_MOTIONS = (
    Reference(kind="minimum-jerk", angle_deg=20.0, duration=1.5),
    Reference(kind="two-sided-sine", angle_deg=20.0, frequency=0.5),
)


def _scenarios(loop: str) -> tuple[Scenario, ...]:
    return tuple(Scenario(loop=loop, reference=reference) for reference in _MOTIONS)


Controllers = Annotated[tuple[ControllerName, ...], AfterValidator(_each_once)]


class TuneSettings(Section):
    """A search for gains: the same budget, optimiser, objective and start for every controller."""

    controllers: Controllers = choice(("smc",), "controllers to tune (or file.py:NAME)", min_length=1)
    optimiser: Annotated[str, OneOf(OPTIMISERS)] = choice("pso", "ask/tell optimiser (or file.py:NAME)", "paper")
    candidates: int = choice(40, "candidates per iteration (particles of the swarm)", "assumed", ge=2, le=10_000)
    iterations: int = choice(60, "iterations of each search", "assumed", ge=1, le=100_000)
    restarts: int = choice(1, "searches, the first from a preset, the others from the middle of the box", ge=1, le=100)
    finalists: int = choice(
        50, "best candidates that are evaluated anew, with the presets, to choose from", ge=1, le=1000
    )
    objective: Objective = Objective()
    worlds: TuningWorlds = TuningWorlds()
    scenarios: tuple[Scenario, ...] = choice(
        _scenarios("camera"),
        "tuning scenarios, where no worlds are named; without any, two motions on the first of the loops; compare "
        "refuses any of them",
        min_length=1,
    )
    loops: Loops = choice(
        {"camera": CAMERA, **LOOPS},
        "the loops that scenarios may name, on the others of which the gains are tried when they are found; naming any "
        "replaces these (`exact: {}` is the built-in one)",
        min_length=1,
    )
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, REPETITIONS + " and candidates", ge=1, le=1000)
    network: str | None = choice(None, "train run behind references with inverse: network")
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")
    kept: tuple[str, ...] = kept_settings()
    resume: str | None = choice(None, "tune run that was cut short: what it has tried is not run again")

    @model_validator(mode="after")
    def _on_the_first_loop(self) -> Self:
        """Settings that name loops and no scenario have the usual motions on the first of these loops."""
        if "scenarios" not in self.model_fields_set and "loops" in self.model_fields_set:
            self.__dict__["scenarios"] = _scenarios(next(iter(self.loops)))
        return self
