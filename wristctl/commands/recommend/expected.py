"""What is tested, the error to expect of its trial, and which fact of the rig leaves that open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.kept_studies import file_of
from wristctl.commands.printed_table import capital, degrees, joined
from wristctl.config.families import Drawn, Family, Range
from wristctl.config.loop import Reference
from wristctl.config.recommend import DELAY, MEASURED, known_delay
from wristctl.config.study import Study

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from wristctl.arrays import Array


# Name of the family of simulated rigs, of which the draws are named.
FAMILY = "recommend"
# Share of rigs that may fall short of an angle, and that a controller must not be shown to lose: those drawn have the
# worst of friction, delay and load.
TOLERATED = 0.05
# Rigs from which 95 % of them are told: of fewer, the ends would be the least and the largest error.
ENOUGH = 40
TUNED, SCALED = "tuned", "scaled preset"
"""Where gains of a candidate are from."""


class Candidate(NamedTuple):
    """A controller with gains that are tested."""

    controller: str
    origin: str
    """`TUNED` or `SCALED`; of feedforward empty."""
    gains: dict[str, float]

    @property
    def label(self) -> str:
        """Controller and origin."""
        return f"{self.controller} ({self.origin})" if self.gains else self.controller

    @property
    def file(self) -> str:
        """Its study file in the run: data/controllers/ct-dob-tuned.yaml."""
        return file_of(self.label)


def spread(errors: Array) -> tuple[float, float, float]:
    """Ends of the range in which another rig errs with a probability of 95 % [rad], and the median between them.

    Of n rigs drawn alike another one stays below the k-th smallest with a probability of k/(n + 1). Of fewer than 39
    rigs the ends are the least and the largest error.
    """
    import numpy as np

    ordered = np.sort(errors)
    first = max(0, int(0.025 * (len(ordered) + 1)) - 1)
    return float(ordered[first]), float(np.median(ordered)), float(ordered[-1 - first])


def share_of(count: int) -> str:
    """How many of the simulated rigs an interval is of; of few the number alone."""
    return f"95 % of {count}" if count >= ENOUGH else f"{count}"


# Ratio of a range's ends up to which nobody is told to measure anything.
_WIDE = 3.0
# Share of the time from which motors count as at their limit.
_AT_LIMIT = 0.1
# Share of a range's upper end that a fact must leave at most to be named.
_NAMED = 0.9


class Fact(NamedTuple):
    """Something by which simulated rigs differ."""

    name: str
    keys: Sequence[str]
    """What of it is drawn."""
    how: str
    """How it becomes known."""


IDENTIFIED = "wristctl identify finds them in trials of hw-run"
FACTS = (
    Fact(
        "stiffness and friction of the tendons",
        ("plant.actuator.tendon_stiffness", "plant.actuator.friction", "plant.actuator.sheath", "plant.tendon_radius"),
        IDENTIFIED,
    ),
    Fact("springs and damping of the wrist", ("plant.stiffness", "plant.damping"), IDENTIFIED),
    Fact(
        "mass in the hand and the push on it",
        ("plant.hand_mass", "plant.payload", "disturbances.load"),
        "wrist.hand_mass, recommend.known",
    ),
    Fact("delay and noise of the camera", (DELAY, "plant.sensor.noise_deg"), IDENTIFIED),
)


class Left(NamedTuple):
    """What would be left of a range, were some facts known."""

    facts: tuple[Fact, ...]
    low: float
    """[rad]"""
    high: float

    @property
    def said(self) -> str:
        """The ends in words."""
        return f"{degrees(self.low)} to {degrees(self.high)} deg"


class Expected(NamedTuple):
    """Error in the trial over the simulated rigs that can follow its motion, and what would narrow its range."""

    low: float
    """Error that 2.5 of 100 of these rigs stay below [rad]; nan of all three where none can follow."""
    median: float
    high: float
    """That 97.5 of 100 stay below."""
    rigs: int
    """Simulated rigs."""
    at_limit: int = 0
    """Those whose motors stand at their limit, so that the wrist falls short."""
    failed: int = 0
    left: tuple[Left, ...] = ()
    """With each fact known alone, then with all that an identification finds; of a narrow range none."""

    @property
    def said(self) -> str:
        """The range, the rigs that it is not of, and what would narrow it, in sentences."""
        counted = self.rigs - self.at_limit - self.failed
        share = f"{share_of(counted)}{' other' * (counted < self.rigs)} simulated rigs"
        within = (
            f"With that motion {share} err by {degrees(self.low)} to {degrees(self.high)} deg, half by at most "
            f"{degrees(self.median)} deg."
        )
        lost = [f"on {self.at_limit} of {self.rigs} rigs the motors are at their limit"] * bool(self.at_limit)
        lost += [f"on {self.failed} of {self.rigs} the wrist fails"] * bool(self.failed)
        words = [f"{capital(joined(lost))}."] * bool(lost) + [within] * bool(counted)
        return " ".join(filter(None, [*words, self.wide]))

    @property
    def wide(self) -> str:
        """Which fact first of all makes the range reach so far, and what is left once it is known; empty of others."""
        alone = [left for left in self.left if len(left.facts) == 1]
        if not alone:
            return ""
        best = min(alone, key=lambda left: left.high)
        (fact,) = best.facts
        if best.high > _NAMED * self.high:
            names = joined([left.facts[0].name for left in alone])
            return f"No fact alone leaves that range so wide; together they do: {names}."
        left = f"{best.said} would be left"
        together = next((left for left in self.left if len(left.facts) > 1 and fact in left.facts), None)
        if together is not None and together.high < best.high:
            others = joined([other.name for other in together.facts if other != fact])
            left += f", {together.said} with {others} known too"
        return f"What leaves that range so wide is first of all the {fact.name}: known, {left} ({fact.how})."


def expected(study: Study, best: Candidate, family: Family, reach_deg: float, planes: int) -> Expected:
    """The error of the recommended gains over the simulated rigs in the trial that `hw-run` makes of them."""
    from wristctl.commands.recommend.rehearsals import motions_of_trial

    motions, horizon = motions_of_trial(study, reach_deg, planes)
    asked = asked_for(family, motions, horizon)
    found = _over_rigs(study, best, asked)
    if not found.high > _WIDE * found.low:
        return found
    left = []
    facts = [fact for fact in FACTS if known_of(asked, [fact]) != asked]
    identified = [fact for fact in facts if fact.how == IDENTIFIED]
    for some in ([fact] for fact in facts):
        left.append(_left(study, best, asked, some))
    if len(identified) > 1:
        left.append(_left(study, best, asked, identified))
    return found._replace(left=tuple(left))


def asked_for(family: Family, motions: Sequence[Reference], horizon: float) -> Family:
    """The rigs asked for these motions alone, of which nothing is drawn, for so long [s]."""
    draw = {key: source for key, source in family.draw.items() if not key.startswith("reference.")}
    return family.model_copy(update={"draw": draw, "references": tuple(motions), "horizon": horizon})


def _left(study: Study, best: Candidate, asked: Family, facts: Sequence[Fact]) -> Left:
    low, _, high, *_ = _over_rigs(study, best, known_of(asked, facts))
    return Left(tuple(facts), low, high)


def known_of(family: Family, facts: Sequence[Fact]) -> Family:
    """The rigs once these facts are known: as an identification leaves them, any other as it is believed."""
    keys, measured = {key for fact in facts for key in fact.keys}, MEASURED | {DELAY: known_delay(family.loop)}
    draw = {
        key: _narrower(source, measured[key]) if key in keys else source
        for key, source in family.draw.items()
        if key not in keys or key in measured
    }
    return family.model_copy(update={"draw": draw})


def _narrower(source: Drawn, measured: str) -> Drawn:
    """What a leaf is drawn from once it is measured; as before where that is no wider."""
    if not isinstance(source, str):
        return measured
    own, other = Range.read(source), Range.read(measured)
    if own.multiple != other.multiple:
        return measured
    wide = [each.high / each.low if each.multiple else each.high - each.low for each in (own, other)]
    return source if wide[0] <= wide[1] else measured


class Rigs(NamedTuple):
    """How simulated rigs follow, (R,) each."""

    errors: Array
    """Root of the mean square of a rig's errors over the motions [rad]."""
    failed: NDArray[np.bool_]
    at_limit: NDArray[np.bool_]
    """Whether its motors stand at their limit, so that the wrist falls short."""

    @property
    def following(self) -> Array:
        """Errors of those that can follow."""
        errors: Array = self.errors[~self.failed & ~self.at_limit]
        return errors


def rigs_asked(study: Study, best: Candidate, asked: Family) -> Rigs:
    """How the test's rigs follow the motions with these gains."""
    import numpy as np

    from wristctl.control.table import controller
    from wristctl.simulation.cases import measure
    from wristctl.simulation.drawn_worlds import drawn_cases

    law, tests = controller(best.controller), study.recommend.tests
    cases = drawn_cases(asked, FAMILY, "test", study.seed, tests, study.wrist)
    measured = measure(law, np.array([law.values(best.gains)]), cases, study.wrist, ["rmse", "saturation"])
    failed = np.any(measured.failed.reshape(tests, -1), axis=1)
    at_limit = np.any(measured.metrics["saturation"].reshape(tests, -1) > _AT_LIMIT, axis=1) & ~failed
    errors = np.sqrt((measured.metrics["rmse"].reshape(tests, -1) ** 2).mean(axis=1))
    return Rigs(errors, failed, at_limit)


def _over_rigs(study: Study, best: Candidate, asked: Family) -> Expected:
    """The error over all rigs that can follow."""
    rigs = rigs_asked(study, best, asked)
    ends = spread(rigs.following) if len(rigs.following) else (math.nan,) * 3
    return Expected(*ends, len(rigs.errors), int(rigs.at_limit.sum()), int(rigs.failed.sum()))
