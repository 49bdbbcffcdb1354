"""Figures show a row as what the answer says it is: one definition of what has a place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.commands.conftest import repeated
from wristctl.api import load_study
from wristctl.commands.compare.figures import error_against_variation
from wristctl.comparison.bootstrap import MEASURABLE
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import Ranking, class_rankings
from wristctl.plotting.ranking_figures import answer_figure, paired_ratios, performance_profile, probability_of_better
from wristctl.plotting.style import BLACK, colour

MOVES = 8


def rows_of_every_fate(moves: int = MOVES) -> list[ComparedRow]:
    """pid is best, mrac behind it; smc fails once, gvsc swings, nc does not arrive once, lqi pulls too hard."""
    found = []
    for law, rmse in {"pid": 1e-4, "mrac": 2e-4, "smc": 1e-5, "gvsc": 1e-5, "nc": 1e-5, "lqi": 1e-5}.items():
        for move in range(moves):
            oscillation = 0.01 * (law == "gvsc")
            one = repeated(law, [rmse], failed=law == "smc" and move == 1, oscillation=oscillation, peak_tension=50.0)
            if law == "nc" and move == 1:
                course = one.first.trajectory
                one = replace(one, first=replace(one.first, trajectory=replace(course, theta=0.5 * course.theta)))
            one = replace(one, bears=40.0 if law == "lqi" else 60.0)
            found.append(ComparedRow("a", f"move {move}", "none", law, "default", one))
    return found


def stand(rows: list[ComparedRow]) -> Ranking:
    study = load_study(None, "compare.loops={a: {}}")
    (found,) = class_rankings(rows, study.compare, study.wrist)
    return found


@pytest.mark.parametrize("moves", [MOVES, 3])
def test_the_figure_of_the_answer_crosses_out_in_black_what_must_not_be_used(moves: int) -> None:
    """On one axis; of three moves nothing is ranked, and what may be used still has its own colour and mark."""
    found = stand(rows_of_every_fate(moves))
    made = answer_figure([found], {"sampled": "somewhere"})
    (axes,) = made.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["somewhere"]
    points = [line for line in axes.lines if len(np.ravel(line.get_xdata())) == 1 and line.get_marker() != "None"]
    assert [(line.get_marker(), line.get_color()) for line in points] == [
        ("o", colour("pid")), ("o", colour("mrac")), *[("x", BLACK)] * 4,
    ]  # fmt: skip
    heights = [float(np.ravel(line.get_ydata())[0]) for line in points]
    assert heights == sorted(heights), "best first"
    assert min(np.ravel(line.get_xdata()).min() for line in points) >= np.degrees(MEASURABLE) * (1.0 - 1e-9)
    assert "must not be used" in [text.get_text() for text in made.legends[0].get_texts()]
    assert colour("smc") != BLACK


def test_ratios_to_a_baseline_are_those_of_the_same_cases() -> None:
    """mrac has twice pid's error in every case."""
    found = stand(rows_of_every_fate())
    (axes,) = paired_ratios([found], "pid/default", {"sampled": "somewhere"}).axes
    place = [label.get_text() for label in axes.get_yticklabels()].index("mrac/default")
    drawn = [
        np.ravel(np.asarray(line.get_xdata(), float)) for line in axes.lines if np.ravel(line.get_ydata())[0] == place
    ]
    by_length = {len(ratios): ratios for ratios in drawn}
    assert by_length[MOVES] == pytest.approx(found.scores[1] / found.scores[0])
    assert by_length[1] == pytest.approx([2.0])


def test_a_profile_is_full_where_a_controller_is_best_and_starts_at_the_factor_of_the_second() -> None:
    found = stand([row for row in rows_of_every_fate() if row.controller in ("pid", "mrac")])
    made = performance_profile([found], {"sampled": "somewhere"})
    lines = {line.get_label(): line for line in made.axes[0].lines}
    shares = {name: np.asarray(line.get_ydata(), float) for name, line in lines.items()}
    factors = np.asarray(lines["pid/default"].get_xdata(), float)
    assert (shares["pid/default"] == 100.0).all()
    assert (shares["mrac/default"] == np.where(factors >= 2.0 * (1.0 - 1e-9), 100.0, 0.0)).all()


def test_who_beats_whom_is_shown_for_what_may_be_used_each_pair_once() -> None:
    made = probability_of_better(stand(rows_of_every_fate()), "somewhere")
    (image,) = made.axes[0].images
    shares = image.get_array()
    assert shares is not None and np.asarray(shares).tolist() == [[100.0]]
    assert [label.get_text() for label in made.axes[0].get_yticklabels()] == ["pid/default"]
    assert [label.get_text() for label in made.axes[0].get_xticklabels()] == ["mrac/default"]


def test_errors_against_variation_have_a_cross_where_the_answer_has_no_place() -> None:
    rows = rows_of_every_fate()
    found = stand(rows)
    made = error_against_variation(rows, [found])
    crosses = sum(line.get_marker() == "x" and len(np.ravel(line.get_xdata())) == 1 for line in made.axes[0].lines)
    placed = [row for group in found.standing.groups for row in group]
    assert crosses == len(found.labels) - len(placed) == 4
