"""Figures of a study over worlds show each row at its numbers, and what must not be used as that."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from tests.comparison.test_fair_answer import HARD, WORLDS, ranked, row
from wristctl.commands.study.figures import pareto, terms_by_rig, world_map
from wristctl.comparison.bootstrap import GeometricMean
from wristctl.comparison.tuned_ranking import TermValue
from wristctl.comparison.world_ranking import RankedRow
from wristctl.plotting.ranking_figures import probability_of_better, ranking_intervals
from wristctl.plotting.style import BLACK, BLUE, SILVER, VERMILLION, colour, for_paper


def priced(label: str, factor: float, chattering: float, energy: float, swings: int = 0) -> RankedRow:
    """A row with its RMSE in every world, as many times that of the others, and its price."""
    one = row(label, factor, spread=0.0, swings=swings)
    prices = {"chattering": np.full((1, WORLDS), chattering), "energy": np.full((1, WORLDS), energy)}
    return replace_measured(one, **prices)


def replace_measured(one: RankedRow, **metrics: Any) -> RankedRow:
    return one._replace(measured=replace(one.measured, metrics={**one.measured.metrics, **metrics}))


ROWS = (
    priced("smc/tuned", 0.1, 1000.0, 3.0),
    priced("pid/tuned", 0.5, 100.0, 2.0),
    priced("mrac/tuned", 1.0, 500.0, 0.5),
    priced("gvsc/tuned", 0.01, 1e5, 1e3, swings=9),
)
MEAN = float(np.degrees(np.exp(np.log(HARD).mean())))
"""Geometric mean of the RMSE of a row of factor 1 [deg]."""


def xy(line: Line2D) -> tuple[np.ndarray, np.ndarray]:
    x, y = line.get_data()
    return np.ravel(np.asarray(x, float)), np.ravel(np.asarray(y, float))


def points(axes: Axes) -> dict[str, Line2D]:
    return {str(line.get_label()): line for line in axes.lines if line.get_marker() not in ("None", "", None)}


@pytest.mark.parametrize(
    ("panel", "cost", "front"),
    [
        (0, {"smc": 1000.0, "pid": 100.0, "mrac": 500.0, "gvsc": 1e5, "feedforward": 1.0}, [1.0, 100.0, 1000.0]),
        (1, {"smc": 3.0, "pid": 2.0, "mrac": 0.5, "gvsc": 1e3, "feedforward": 1.0}, [0.5, 2.0, 3.0]),
    ],
)
def test_a_line_joins_what_no_other_beats_and_every_sound_row_is_within_the_axes(
    panel: int, cost: dict[str, float], front: list[float]
) -> None:
    axes = pareto(ranked(*ROWS)).axes[panel]
    error = {"smc": 0.1, "pid": 0.5, "mrac": 1.0, "gvsc": 0.01, "feedforward": 4.0}
    shown = {label.partition("/")[0]: line for label, line in points(axes).items()}
    assert shown.keys() == cost.keys()
    for name, line in shown.items():
        assert xy(line)[0] == pytest.approx([cost[name]]) and xy(line)[1] == pytest.approx([error[name] * MEAN])
        assert line.get_color() == colour(name) and (line.get_markerfacecolor() == "none") == (name == "gvsc")
    (joined,) = [line for line in axes.lines if line not in shown.values()]
    assert xy(joined)[0].tolist() == front, "from the cheapest on, without what must not be used"
    assert (np.diff(xy(joined)[1]) < 0.0).all()
    sound = [name for name in cost if name != "gvsc"]
    for (low, high), values in (
        (axes.get_xlim(), [cost[name] for name in sound]),
        (axes.get_ylim(), [error[name] * MEAN for name in sound]),
    ):
        assert 0.5 * min(values) < low < min(values) and max(values) < high < 2.0 * max(values)
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_worlds_stand_from_the_easiest_on_each_with_its_ratio_to_the_best_one_there() -> None:
    rows = (row("smc/tuned", 1.0), row("pid/tuned", 2.0, failed=3), row("gvsc/tuned", 3.0, swings=9))
    ranking = ranked(*rows)
    axes = world_map(ranking).axes[0]
    (drawn,) = axes.images
    ratios = np.ma.filled(np.ma.masked_invalid(np.asarray(drawn.get_array(), float)), np.nan)
    assert ratios.shape == (4, WORLDS)
    scores = np.array([ranking.rows[index].rmse for index in ranking.standing.order])
    easiest_first = np.argsort(scores.min(axis=0))
    wanted = (scores / scores.min(axis=0))[:, easiest_first]
    np.testing.assert_allclose(ratios, np.where(np.isfinite(wanted), wanted, np.nan))
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == [ranking.labels[index] for index in ranking.standing.order]
    fails, swings = axes.lines
    assert (fails.get_marker(), swings.get_marker()) == ("x", ".")
    for line, name, worlds in ((fails, "pid/tuned", 3), (swings, "gvsc/tuned", 9)):
        across, down = xy(line)
        assert set(down) == {names.index(name)}
        assert set(easiest_first[across.astype(int)]) == set(range(worlds))


def test_a_term_that_helps_one_that_harms_and_one_that_nobody_can_tell_differ_in_colour() -> None:
    times = {
        "a": GeometricMean(2.0, 1.5, 3.0, 0.95),
        "b": GeometricMean(0.5, 0.4, 0.7, 0.95),
        "c": GeometricMean(1.1, 0.9, 1.3, 0.95),
    }
    values = [TermValue(name, "bench", "x", "y", mean, (0, 0)) for name, mean in times.items()]
    (axes,) = terms_by_rig(values).axes
    marks = [line for line in axes.lines if line.get_marker() == "o"]
    bars = [line for line in axes.lines if line.get_linewidth() == 3.0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c"]
    for place, (mean, mark, bar, shade) in enumerate(
        zip(times.values(), marks, bars, (BLUE, VERMILLION, SILVER), strict=True)
    ):
        assert (xy(mark)[0].tolist(), xy(mark)[1].tolist()) == ([mean.value], [place])
        assert (xy(bar)[0].tolist(), xy(bar)[1].tolist()) == ([mean.low, mean.high], [place, place])
        assert mark.get_color() == bar.get_color() == shade
    (one,) = [line for line in axes.lines if line not in (*marks, *bars)]
    assert set(xy(one)[0]) == {1.0}


def test_a_ranking_has_each_mean_with_its_interval_and_its_worlds_best_on_top() -> None:
    ranking = ranked(*ROWS)
    axes = ranking_intervals(ranking).axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    order = ranking.standing.order
    assert names == [ranking.labels[index].replace("feedforward/default", "feedforward") for index in order]
    assert axes.yaxis_inverted() and axes.get_xscale() == "log"
    for place, index in enumerate(order):
        mine = [line for line in axes.lines if len(xy(line)[1]) and set(xy(line)[1]) == {place}]
        (worlds,) = [line for line in mine if len(xy(line)[0]) == WORLDS]
        np.testing.assert_allclose(xy(worlds)[0], np.degrees(ranking.rows[index].rmse))
        mean = np.degrees(ranking.means[index][:3])
        bad = ranking.labels[index].startswith("gvsc")
        drawn = {line.get_marker(): line for line in mine if len(xy(line)[0]) == 1 and xy(line)[0] == mean[0]}
        assert ("x" in drawn) == bad and ("o" in drawn) != bad
        if bad:
            assert drawn["x"].get_color() == BLACK
        (interval,) = [line for line in mine if len(xy(line)[0]) == 2]
        assert sorted(xy(interval)[0]) == pytest.approx(sorted(mean[1:]))


@pytest.mark.parametrize("width", [None, 1.6])
def test_how_often_one_is_better_stands_in_its_cell_where_there_is_room(width: float | None) -> None:
    """Of 40 worlds the second is better than the third in 30; in a narrow figure nobody could read numbers."""
    rows = [row(f"law{k}/tuned", 0.1 + 0.01 * k, spread=0.0) for k in range(3)]
    mixed = np.where(np.arange(WORLDS) < 30, 1.05, 0.5) * rows[1].rmse
    rows[2] = replace_measured(rows[2]._replace(rmse=mixed), rmse=mixed[None])
    with for_paper(width):
        axes = probability_of_better(ranked(*rows), "here").axes[0]
    downward = [label.get_text() for label in axes.get_yticklabels()]
    across = [label.get_text() for label in axes.get_xticklabels()]
    shown = {tuple(map(round, text.get_position()[::-1])): text.get_text() for text in axes.texts}
    every = {(downward[y], across[x]): text for (y, x), text in shown.items()}
    if width is not None:
        assert every == {}
        return
    assert len(every) == 6 and downward[1:] == across[:-1] and across[-1] == "feedforward", "each pair once"
    assert every.get(("law1/tuned", "law2/tuned")) == "75" or every.get(("law2/tuned", "law1/tuned")) == "25"
    assert every["law0/tuned", "feedforward"] == every["law1/tuned", "feedforward"] == "100"
