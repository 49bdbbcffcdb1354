"""Which of slack, friction of tendons, friction inside the robot and creep a real robot's recordings want.

Each is added to the model in turn, fitted to one part of the recordings and held against the other. What makes the
error of the predicted part smaller, by a 95 % interval of the ratio paired by blocks, is wanted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from wristctl.identification.arc_fit import ArcFit, fit_arcs
from wristctl.identification.arc_robot import OF_TERM, ArcRecording, ArcRobot, Term
from wristctl.identification.prediction_scores import Score, ratio_of, score_of

# Beginnings of the search for presliding [m] and [rad]: its errors have several minima. Else it begins where the model
# without the term ends.
_BEGINS = ({"presliding": 5e-5, "inner_presliding": 0.01}, {"presliding": 5e-4, "inner_presliding": 0.1})
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


def tried_models(
    robot: ArcRobot, cases: Sequence[Sequence[ArcRecording]], centred: bool, terms: Sequence[Term] | None = None
) -> Iterator[TriedModel]:
    """Models as they are fitted: elastic arcs alone, with slack, then with each other term, last with all wanted ones.

    Parameters
    ----------
    cases : recordings that are fitted together, several times
    centred : whether the mean error of what is predicted does not count
    terms : those of the one model that is fitted beside elastic arcs alone; None: what the data want is looked for
    """
    plain = _tried(robot, cases, centred, (), None)
    yield plain
    if terms is not None:
        if terms:
            yield _tried(robot, cases, centred, tuple(terms), plain)
        return
    base = plain
    if "slack" in robot.terms:
        slack = _tried(robot, cases, centred, ("slack",), plain)
        yield slack
        base = plain if slack.verdict == "unwanted" else slack
    others = list[TriedModel]()
    for term in (term for term in robot.terms if term != "slack"):
        others.append(_tried(robot, cases, centred, (*base.terms, term), base))
        yield others[-1]
    wanted = sorted((model for model in others if model.verdict == "wanted"), key=lambda model: model.score.error)
    if robot.weighed and wanted:
        yield from _held_again(robot, cases, centred, wanted, base)
    elif len(wanted) > 1:
        best, *rest = wanted
        yield _tried(robot, cases, centred, (*best.terms, *(model.terms[-1] for model in rest)), best)


def _held_again(
    robot: ArcRobot, cases: Sequence[Sequence[ArcRecording]], centred: bool, wanted: Sequence[TriedModel],
    base: TriedModel,
) -> Iterator[TriedModel]:  # fmt: skip
    """Slack that was not told and other wanted terms, each beside the best term: without it they may stand for it."""
    best, *rest = wanted
    if base.terms == ("slack",) and base.verdict != "wanted":
        bare = _tried(robot, cases, centred, best.terms[1:], None)
        yield bare
        yield TriedModel((*bare.terms, "slack"), best.fits, bare)
    for model in rest:
        more = _tried(robot, cases, centred, (*best.terms, model.terms[-1]), best)
        yield more
        best = more if more.verdict == "wanted" else best


def chosen_of(models: Sequence[TriedModel]) -> TriedModel:
    """The model with the smallest error among those of which every term is wanted or told by none."""
    fair = [
        model for model in models if model.without is None or model.verdict == "wanted" or model.terms == ("slack",)
    ]
    return min(fair, key=lambda model: model.score.error) if len(models) > 2 else models[-1]


def _tried(
    robot: ArcRobot, cases: Sequence[Sequence[ArcRecording]], centred: bool, terms: tuple[Term, ...],
    without: TriedModel | None,
) -> TriedModel:  # fmt: skip
    added = [name for term in terms for name in OF_TERM[term]]
    begins = _BEGINS if any(name.endswith("presliding") for name in added) else ({},)
    fits = []
    for number, recordings in enumerate(cases):
        before = without.fits[number].values if without else {}
        starts = [{**begin, **before} for begin in begins] + [{}] * (terms == ("slack",))
        # Without inner friction tendons and damping may stand for it.
        if robot.weighed and "slack" in robot.terms and "inner friction" in terms:
            starts += [dict(begin) for begin in begins]
        tried = [fit_arcs(robot, terms, recordings, centred, start) for start in starts]
        fits.append(min(tried, key=lambda fit: fit.cost))
    return TriedModel(terms, tuple(fits), without)
