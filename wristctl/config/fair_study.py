"""The study of all laws: which are tuned and judged on which families of worlds, and at what budget."""

from typing import Annotated, Self

from pydantic import model_validator

from wristctl.config.choices import OPTIMISERS
from wristctl.config.controller_row import ControllerName, Row
from wristctl.config.families import TOLERATED
from wristctl.config.section import OneOf, Section, choice
from wristctl.config.tune import Objective


class StudyBudget(Section):
    """Computing budget, equal for every controller and family."""

    candidates: int = choice(10, "candidates per iteration of a search", ge=2, le=10_000)
    iterations: int = choice(8, "iterations of a search", ge=1, le=100_000)
    finalists: int = choice(8, "best candidates that are evaluated anew on other worlds", ge=1, le=1000)
    tunings: int = choice(
        3, "searches of each controller on each family, each on worlds of its own and with another start", ge=2, le=1000
    )
    draws: int = choice(16, "worlds of a family that a search runs on", ge=1, le=10_000)
    validation: int = choice(16, "other worlds that its gains are chosen by", ge=1, le=10_000)
    worlds: int = choice(20, "held-out worlds of a family that all are tested on", ge=8, le=100_000)
    noises: int = choice(1, "streams of camera noise that each motion in each of these meets", ge=1, le=1000)


class StudyVariant(Section):
    """Another way to tune, to see whether the order of the controllers depends on it."""

    optimiser: str = choice("", "another optimiser; empty: the study's")
    objective: Objective | None = choice(None, "another objective; null: the study's")
    share: float = choice(1.0, "of the study's iterations", gt=0, le=10)
    beside: str = choice("", "the variant that it is held against; empty: the study's own way")

    @model_validator(mode="after")
    def _a_known_optimiser(self) -> Self:
        if self.optimiser:
            OPTIMISERS.named(self.optimiser)
        return self


class FairStudySettings(Section):
    """Controllers tuned with the same budget on each family of worlds, and tested on worlds that no search has seen."""

    laws: tuple[ControllerName, ...] = choice(
        ("pd-ff", "pid-ff"), "controllers that are tuned", min_length=1, alias="controllers"
    )
    families: tuple[str, ...] = choice((), "families of worlds, by their names in `families`; none: all")
    presets: tuple[Row, ...] = choice((), "controllers with their gains, tested beside the tuned ones")
    terms: dict[str, tuple[str, str]] = choice(
        {}, "questions: in words, and the controllers without and with the term, as pid-ff/tuned"
    )
    optimiser: Annotated[str, OneOf(OPTIMISERS)] = choice("differential-evolution", "ask/tell optimiser of searches")
    objective: Objective = Objective()
    tolerated: float = choice(
        TOLERATED,
        "share of the worlds in which a controller may fail, swing or chatter; shown to do so in more, it is not "
        "recommended",
        ge=0,
        lt=1,
    )
    variants: dict[str, StudyVariant] = choice({}, "other ways to tune, by name")
    varied: str = choice("", "the family that the variants are tried on; empty: the first")
    budget: str = choice("small", "which of the budgets")
    budgets: dict[str, StudyBudget] = choice({"small": StudyBudget()}, "budgets by name", min_length=1)
    resume: str | None = choice(None, "study run that was cut short: its results are kept")

    @model_validator(mode="after")
    def _laws_once(self) -> Self:
        twice = sorted({law for law in self.laws if self.laws.count(law) > 1})
        if twice:
            raise ValueError(f"{twice[0]} is named twice")
        return self

    @model_validator(mode="after")
    def _held_against_another(self) -> Self:
        for name, variant in self.variants.items():
            other_variants = sorted(self.variants.keys() - {name})
            if variant.beside and variant.beside not in other_variants:
                raise ValueError(f"{name} beside '{variant.beside}': one of {', '.join(other_variants) or 'no other'}")
        return self
