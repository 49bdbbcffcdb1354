"""Which of slack, friction of tendons, friction inside the robot and creep a real robot's recordings want.

Each is added to the model in turn, fitted to one part of the recordings and held against the other. What makes the
error of the predicted part smaller, by a 95 % interval of the ratio paired by blocks, is wanted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from scipy.stats import norm

from wristctl.identification.arc_fit import ArcFit, fit_arcs
from wristctl.identification.arc_robot import OF_TERM, ArcRecording, ArcRobot, Term
from wristctl.identification.intervals import NORMAL_95
from wristctl.identification.prediction_scores import Score, ratio_of, score_of

# Beginnings of the search for presliding [m] and [rad]: its errors have several minima. Else it begins where the model
# without the term ends.
_BEGINS = ({"presliding": 5e-5, "inner_presliding": 0.01}, {"presliding": 5e-4, "inner_presliding": 0.1})
# Time of a fit with friction of tendons over that of one without, and of one with more than two terms over that of one
# with fewer; fits that are expected once each term was tried alone: those of a robot with both frictions, as most have.
_RUBBING, _LONGER, _FOLLOWING = 1.2, 1.7, 11.0
# Unknowns that are 0 in a model without their term.
_AMOUNTS = ("friction", "sheath", "inner_friction", "creep")
# Share of the error by which a term lessens it at least where it is wanted: less is of nobody's concern.
_LEAST_GAIN = 5e-3


@dataclass(frozen=True)
class TriedModel:
    """A model with some terms, fitted in each case of a robot's recordings."""

    terms: tuple[Term, ...]
    fits: tuple[ArcFit, ...]
    without: TriedModel | None
    """The model that it is held against: it has one term less, or nothing."""

    @property
    def words(self) -> str:
        """The model's name for a table."""
        return self.fits[0].robot.words + "".join(f" + {term}" for term in self.terms)

    @property
    def numbers(self) -> int:
        """Free numbers of what is fitted, of all cases."""
        return sum(fit.numbers for fit in self.fits)

    @cached_property
    def score(self) -> Score:
        """RMS error of the predicted part."""
        return score_of(self.fits)

    @cached_property
    def ratio(self) -> Score | None:
        """Error of the predicted part over that of the model without the last term."""
        return ratio_of(self.fits, self.without.fits) if self.without else None

    @property
    def verdict(self) -> str:
        """Whether the data want the last term."""
        if self.ratio is None:
            return ""
        return "wanted" if self.ratio.high < 1.0 - _LEAST_GAIN else "unwanted" if self.ratio.low > 1.0 else "not told"

    @property
    def likely(self) -> float:
        """Probability that the last term lessens the error, by the interval of the ratio."""
        return 1.0 if self.ratio is None else _likely(self.ratio)

    def extends(self, other: TriedModel) -> bool:
        """Whether it has one term more than another, slack aside."""
        without = self.without.terms if self.without else ()
        return {*without, "slack"} == {*other.terms, "slack"}


def _likely(ratio: Score) -> float:
    """Probability that a ratio of errors is below 1, by its interval."""
    deviation = math.log(ratio.high / ratio.low) / (2.0 * NORMAL_95)
    return float(norm.cdf(-math.log(ratio.error) / deviation)) if deviation else float(ratio.error < 1.0)


class _Work:
    """Fits that were made and that are expected, in those of a model without friction."""

    def __init__(self, told: Callable[[float], object], robot: ArcRobot, cases: int) -> None:
        self._told, self._robot, self._cases = told, robot, cases
        self._done = self._ahead = 0.0

    def expect(self, models: Sequence[tuple[Term, ...]], more: float = 0.0) -> None:
        """Expect these models next, and `more` fits of each case after them."""
        fits = sum(len(_starts(self._robot, terms)) * _effort(terms) for terms in models)
        self._ahead = self._cases * (fits + more)

    def made(self, terms: tuple[Term, ...]) -> None:
        """Tell the share of the work that is done by now, after another fit with these terms."""
        self._done, self._ahead = self._done + _effort(terms), max(0.0, self._ahead - _effort(terms))
        self._told(self._done / (self._done + self._ahead))


def _effort(terms: Sequence[Term]) -> float:
    return _RUBBING ** ("tendon friction" in terms) * _LONGER ** (len(terms) > 2)


def tried_models(
    robot: ArcRobot, cases: Sequence[Sequence[ArcRecording]], centred: bool, terms: Sequence[Term] | None = None,
    told: Callable[[float], object] = lambda share: None,
) -> Iterator[TriedModel]:  # fmt: skip
    """Models as they are fitted: elastic arcs alone, with slack, then with each other term, last with all wanted ones.

    Parameters
    ----------
    cases : recordings that are fitted together, several times
    centred : whether the mean error of what is predicted does not count
    terms : those of the one model that is fitted beside elastic arcs alone; None: what the data want is looked for
    told : called after each fit with the share of the work that is done, as far as it is known by then
    """
    work = _Work(told, robot, len(cases))

    def tried(terms: tuple[Term, ...], without: TriedModel | None) -> TriedModel:
        return _tried(robot, cases, centred, terms, without, work)

    single = [term for term in robot.terms if term != "slack"]
    slack_first: tuple[Term, ...] = ("slack",) if "slack" in robot.terms else ()
    if terms is None:
        work.expect([(), *[slack_first] * len(slack_first), *((*slack_first, term) for term in single)], _FOLLOWING)
    else:
        work.expect([(), tuple(terms)] if terms else [()])
    plain = tried((), None)
    yield plain
    if terms is not None:
        if terms:
            yield tried(tuple(terms), plain)
        return
    base = plain
    if slack_first:
        slack = tried(slack_first, plain)
        yield slack
        base = plain if slack.verdict == "unwanted" else slack
    others = list[TriedModel]()
    for term in single:
        others.append(tried((*base.terms, term), base))
        yield others[-1]
    wanted = sorted((model for model in others if model.verdict == "wanted"), key=lambda model: model.score.error)
    if not wanted:
        return
    best, *rest = wanted
    if robot.weighed:
        yield from _held_again(tried, work, wanted, base)
    elif rest:
        together = (*best.terms, *(model.terms[-1] for model in rest))
        work.expect([together])
        yield tried(together, best)


def _held_again(
    tried: Callable[[tuple[Term, ...], TriedModel | None], TriedModel], work: _Work, wanted: Sequence[TriedModel],
    base: TriedModel,
) -> Iterator[TriedModel]:  # fmt: skip
    """Slack that was not told and other wanted terms, each beside the best term: without it they may stand for it."""
    best, *rest = wanted
    alone = [best.terms[1:]] if base.terms == ("slack",) and base.verdict != "wanted" else []
    work.expect([*alone, *((*best.terms, model.terms[-1]) for model in rest)])
    for terms in alone:
        bare = tried(terms, None)
        yield bare
        yield TriedModel((*bare.terms, "slack"), best.fits, bare)
    for model in rest:
        more = tried((*best.terms, model.terms[-1]), best)
        yield more
        best = more if more.verdict == "wanted" else best


def chosen_of(models: Sequence[TriedModel]) -> TriedModel:
    """The model with the smallest error among those of which every term is wanted or told by none."""
    fair = [
        model for model in models if model.without is None or model.verdict == "wanted" or model.terms == ("slack",)
    ]
    return min(fair, key=lambda model: model.score.error) if len(models) > 2 else models[-1]


def whole_fit(models: Sequence[TriedModel], recordings: Sequence[ArcRecording]) -> ArcFit:
    """The chosen model fitted to all that is marked as fitted, with intervals that other models widen.

    Another model is the right one with the probability that it predicts better. By that, times the square of the shift
    that it makes, an unknown's variance grows (Buckland, Burnham and Augustin, Biometrics 53 (1997) 603). Others are
    those with a term more, which is not told, and rivals: those with another term in place of one, that predict as
    well. Terms come together, rivals in place of each other, and some rivals are in both: the larger growth counts.
    """
    chosen = chosen_of(models)
    first = chosen.fits[0]
    fit = fit_arcs(first.robot, chosen.terms, recordings, begin=first.values)
    variances = {name: max(_by_terms(models, chosen, name), _by_rivals(models, chosen, name)) for name in fit.values}
    return replace(fit, left_open={name: math.sqrt(variance) for name, variance in variances.items()})


def _by_terms(models: Sequence[TriedModel], chosen: TriedModel, name: str) -> float:
    """Variance of an unknown by terms that the data leave open."""
    variance = 0.0
    for model in models:
        if model.verdict == "not told" and model.terms[-1] not in chosen.terms and model.extends(chosen):
            before = model.without.fits[0].values if model.without else {}
            if name in before:
                variance += model.likely * (model.fits[0].values[name] - before[name]) ** 2
    return variance


def _by_rivals(models: Sequence[TriedModel], chosen: TriedModel, name: str) -> float:
    """Variance of an unknown by models without a term of the chosen one, none of which predicts worse beyond chance."""
    odds, sum_of_squares = 0.0, 0.0
    value = chosen.fits[0].values[name]
    for model in {model.terms: model for model in models if not {*chosen.terms} <= {*model.terms}}.values():
        ratio = ratio_of(model.fits, chosen.fits)
        if ratio.low < 1.0:
            share = _likely(ratio) / max(1.0 - _likely(ratio), 1e-3)
            other = model.fits[0].values.get(name, 0.0 if name in _AMOUNTS else value)
            odds, sum_of_squares = odds + share, sum_of_squares + share * (other - value) ** 2
    return sum_of_squares / (1.0 + odds)


def _starts(robot: ArcRobot, terms: tuple[Term, ...]) -> list[tuple[Mapping[str, float], bool]]:
    """Beginnings of the searches for a model, and whether each goes on from the model without its last term."""
    added = [name for term in terms for name in OF_TERM[term]]
    begins = _BEGINS if any(name.endswith("presliding") for name in added) else ({},)
    starts: list[tuple[Mapping[str, float], bool]] = [(begin, True) for begin in begins]
    if terms == ("slack",):
        starts.append(({}, False))
    # Without inner friction tendons and damping may stand for it.
    if robot.weighed and "slack" in robot.terms and "inner friction" in terms:
        starts += [(begin, False) for begin in begins]
    return starts


def _tried(
    robot: ArcRobot, cases: Sequence[Sequence[ArcRecording]], centred: bool, terms: tuple[Term, ...],
    without: TriedModel | None, work: _Work,
) -> TriedModel:  # fmt: skip
    fits = []
    for number, recordings in enumerate(cases):
        before = without.fits[number].values if without else {}
        found = list[ArcFit]()
        for begin, goes_on in _starts(robot, terms):
            found.append(fit_arcs(robot, terms, recordings, centred, {**begin, **(before if goes_on else {})}))
            work.made(terms)
        fits.append(min(found, key=lambda fit: fit.cost))
    return TriedModel(terms, tuple(fits), without)
