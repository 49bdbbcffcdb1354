"""Figures of rankings recorded for a run: the answer at once, and three that show how sure it is."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.ranking_answer import condition, winner
from wristctl.commands.results import Findings

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking
    from wristctl.comparison.world_ranking import WorldRanking


def draw_rankings(findings: Findings, rankings: Sequence[Ranking], later: bool = False) -> None:
    """Draw the answer, performance profiles, ratios to feedforward, and who beats whom under each condition.

    All but the answer are drawn when somebody asks for them, where `later`; who beats whom always is.
    """
    from wristctl.plotting.ranking_figures import (
        answer_figure,
        paired_ratios,
        performance_profile,
        probability_of_better,
    )

    if not rankings:
        return
    places = {ranking.name: condition(ranking) for ranking in rankings}
    caption = "RMSE of every controller under each condition, the best on top; black crosses must not be used"
    findings.figure("answer", answer_figure, rankings, places_of(rankings), caption=caption)
    findings.overview.figure = "answer"
    unit = rankings[0].unit
    caption = f"Share of the {unit}s in which a controller's RMSE is within a factor of the least one there"
    findings.figure("performance-profile", performance_profile, rankings, places, caption=caption, later=later)
    baseline = next((one.labels[one.yardstick] for one in rankings if one.yardstick is not None), None)
    if baseline is not None and any(len(one.labels) > 1 for one in rankings):
        caption = f"RMSE over feedforward's in the same {unit}s: geometric mean with 95 % interval, and every {unit}"
        findings.figure("ratio-to-feedforward", paired_ratios, rankings, baseline, places, caption=caption, later=later)
    for ranking in rankings:
        name, place = re.sub(r"[^A-Za-z0-9.-]+", "-", ranking.name), places[ranking.name]
        caption = f"Probability that a controller (row) has less RMSE than another (column) in a {unit}: {place}"
        findings.figure(f"probability-{name}", probability_of_better, ranking, place, caption=caption, later=True)


def keep_error(findings: Findings, name: str, ranking: Ranking, row: int, meaning: str = "") -> None:
    """Keep the geometric mean of a row's RMSE, with its interval if it has one, as a metric."""
    mean = ranking.means[row]
    ends = (mean.low, mean.high) if math.isfinite(mean.high) else None
    findings.metric(name, mean.value, "rad", "lower", ranking.count, ends, meaning)


def draw_intervals(findings: Findings, ranking: WorldRanking, end: str) -> None:
    """Draw every row of a ranking over worlds with its interval; `end` follows `ranking` in the figure's name."""
    from wristctl.plotting.ranking_figures import ranking_intervals

    caption = f"RMSE of every controller on {ranking.name}, with 95 % intervals over worlds"
    findings.figure(f"ranking{end}", ranking_intervals, ranking, caption=caption)


def places_of(rankings: Sequence[Ranking]) -> dict[str, str]:
    """Words of each condition, by the name of its ranking, with its best controller in a second line."""
    best = {one.name: one.labels[row] for one in rankings if (row := winner(one, rankings)) is not None}
    return {one.name: condition(one) + (f"\nbest: {best[one.name]}" if one.name in best else "") for one in rankings}
