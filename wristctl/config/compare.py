"""Settings of `compare`: controllers under the same conditions."""

from wristctl.config.controller_row import REPETITIONS, Row
from wristctl.config.families import Worlds
from wristctl.config.loop import LOOPS, DirectionName, InverseName, Loops, Reference
from wristctl.config.section import Section, choice, quantity
from wristctl.config.tune import TuneSettings


class CompareSettings(Section):
    """Controllers x loops x references x inverses, beside the paper's T2."""

    rows: tuple[Row, ...] = choice(
        (Row(controller="smc", gains="printed"),), "controllers with their gains", min_length=1, alias="controllers"
    )
    loops: Loops = choice(
        LOOPS,
        "the loops to compare on; naming any replaces these (`exact: {}` is the built-in one)",
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
    inverses: tuple[InverseName, ...] = choice(
        ("network", "closed-form"), "how tip targets become angles; overrides the references' own", min_length=1
    )
    directions: tuple[DirectionName, ...] = choice(
        ("ulnar",), "directions of bending, each by its own plane", min_length=1
    )
    worlds: Worlds = Worlds()
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, REPETITIONS, ge=1, le=1000)
    network: str | None = choice(None, "train run: path, id or latest:train")
    tuned: str | None = choice(None, "tune run: path, id or latest:tune")
    tuning: TuneSettings | None = choice(None, "a search for the controllers with gains: tuned, in place of a tune run")
