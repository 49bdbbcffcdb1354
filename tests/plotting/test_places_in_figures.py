"""Figures show a row as what the answer says it is: one definition of what has a place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.commands.conftest import repeated
from wristctl.api import load_study
from wristctl.commands.compare.class_figures import answer_figure, error_against_variation
from wristctl.comparison.bootstrap import MEASURABLE
from wristctl.comparison.class_standing import ClassStanding, class_standings
from wristctl.comparison.combinations import ComparedRow

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


def stand(rows: list[ComparedRow]) -> ClassStanding:
    study = load_study(None, "compare.loops={a: {}}")
    (found,) = class_standings(rows, study.compare, study.wrist)
    return found


@pytest.mark.parametrize(
    ("moves", "expected"),
    [
        (MOVES, ["best, or tied with it", "behind it", "fails, swings or chatters", "does not arrive", "not physical"]),
        (3, ["too few to tell", "fails, swings or chatters", "does not arrive", "not physical"]),
    ],
)
def test_the_figure_of_the_answer_marks_each_row_by_what_becomes_of_it(moves: int, expected: list[str]) -> None:
    found = stand(rows_of_every_fate(moves))
    made = answer_figure([found])
    (legend,) = made.legends
    assert [text.get_text() for text in legend.get_texts()] == expected
    panel = made.axes[0]
    names = [label.get_text() for label in panel.get_yticklabels()]
    marks: dict[str, str] = {}
    for line in panel.lines:
        if len(line.get_xdata()) == 1:  # type: ignore[arg-type]
            marks[names[int(np.ravel(line.get_ydata())[0])]] = str(line.get_marker())
    assert marks == {"pid": "o", "mrac": "o", "smc": "x", "gvsc": "x", "nc": "v", "lqi": "^"}
    assert min(np.ravel(line.get_xdata()).min() for line in panel.lines) >= np.degrees(MEASURABLE) * (1.0 - 1e-9)


def test_errors_against_variation_have_a_cross_where_the_answer_has_no_place() -> None:
    rows = rows_of_every_fate()
    found = stand(rows)
    made = error_against_variation(rows, [found])
    crosses = sum(line.get_marker() == "x" and len(np.ravel(line.get_xdata())) == 1 for line in made.axes[0].lines)
    placed = [row for group in found.standing.groups for row in group]
    assert crosses == len(found.labels) - len(placed) == 4
