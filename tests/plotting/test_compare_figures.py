"""Figures of a comparison show every result, failures too."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.plotting.conftest import result as compared_row
from wristctl.commands.compare.figures import rmse_map, variation_dots
from wristctl.commands.printed_table import degrees
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.paper import T2
from wristctl.plotting.loop_figures import over_time, spread_of_sizes
from wristctl.plotting.style import WIDTH, for_paper
from wristctl.simulation.repetitions import Repeated


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


def tick_labels(axes: Axes) -> list[str]:
    return [label.get_text() for label in axes.get_yticklabels()]


def test_map_prints_every_rmse_and_marks_what_failed(results: list[ComparedRow]) -> None:
    ours, paper, _ = rmse_map(results).axes
    wanted = ["x" if r.simulation.failed else degrees(r.simulation.metrics["rmse"]) for r in results]
    assert sorted(texts(ours)) == sorted(wanted)
    assert len([patch for patch in ours.patches if patch.get_hatch()]) == 1
    assert texts(paper) == [degrees(T2[name].rmse) for name in ("smc", "smc", "smc", "pid")]


def test_map_takes_an_error_of_zero_and_a_comparison_in_which_all_failed(results: list[ComparedRow]) -> None:
    for value in (0.0, np.nan):
        bad = [dataclasses.replace(r.simulation, metrics={"rmse": value}) for r in results]
        (ours, *_) = rmse_map(
            [dataclasses.replace(r, repeated=Repeated.once(s)) for r, s in zip(results, bad, strict=True)]
        ).axes
        assert texts(ours) == ["<0.001" if value == 0.0 else "x"] * len(results)


def repeated(values: list[float], failed: int = 0) -> Repeated:
    """Repetitions with these RMSE, as large errors, and a hundred thousand times as much chattering as degrees."""
    flags = np.arange(len(values)) < failed
    rmse = np.where(flags, np.nan, values)
    metrics = {"rmse": rmse, "chattering": 1e5 * np.degrees(values)}
    return dataclasses.replace(one_result().repeated, metrics=metrics, failed=flags)


def one_result() -> ComparedRow:
    return compared_row("smc/tuned", "step 30 deg", 1e-3)


def test_of_repetitions_map_and_bars_show_the_median_with_its_interval_and_what_failed() -> None:
    """Of twelve the interval of the median ends at the third and the tenth (Conover, table of the sign test)."""
    values = [math.radians(0.1 * k) for k in range(1, 13)]
    row = dataclasses.replace(one_result(), repeated=repeated(values))
    assert texts(rmse_map([row]).axes[0]) == ["0.65\n0.3 to 1"]
    (axes,) = variation_dots([row]).axes
    dot, median, whisker = axes.lines
    assert median.get_xdata() == pytest.approx([6.5e4] * 2)
    assert dot.get_xdata() == pytest.approx([6.5e4]) and whisker.get_xdata() == pytest.approx([3e4, 10e4])
    one_failed = dataclasses.replace(row, repeated=repeated(values, failed=1))
    assert texts(rmse_map([one_failed]).axes[0]) == ["0.75\n0.4 to 1.1\n1 of 12 failed"]
    assert [variation_dots([each]).axes[0].lines[0].get_marker() for each in (row, one_failed)] == ["o", "x"]
    few = dataclasses.replace(row, repeated=repeated(values[:3]))
    assert texts(rmse_map([few]).axes[0]) == ["0.2"]


def test_errors_of_repetitions_are_their_median_with_its_interval_at_every_moment() -> None:
    time = one_result().simulation.trajectory.time
    errors = np.outer(np.arange(1.0, 13.0) * (-1.0) ** np.arange(12), np.linspace(1.0, 2.0, len(time)))
    own = dataclasses.replace(one_result().repeated, errors=errors, failed=np.arange(12) < 2)
    (axes,) = over_time([own.first.trajectory], spread_of_sizes([own])).axes
    median, _zero = axes.lines
    drawn = np.radians(np.asarray(median.get_ydata(), float))
    np.testing.assert_allclose(drawn, 6.5 * np.linspace(1.0, 2.0, len(time)))
    (band,) = axes.collections
    places = np.radians(np.asarray(band.get_paths()[0].vertices))
    assert places[:, 1].min() == pytest.approx(3.0) and places[:, 1].max() == pytest.approx(20.0)
    assert axes.get_ylabel() == "median |error| of 12 [deg]" and median.get_label() == "smc/tuned, 2 failed"
    diverged = dataclasses.replace(own, errors=np.where(np.arange(12)[:, None] < 7, np.nan, errors))
    assert np.isnan(
        np.asarray(over_time([own.first.trajectory], spread_of_sizes([diverged])).axes[0].lines[0].get_ydata())
    ).all()


def test_several_inverses_are_rows_of_their_own(results: list[ComparedRow]) -> None:
    both = [*results, *(dataclasses.replace(result, inverse="network") for result in results)]
    names = tick_labels(rmse_map(both).axes[0])
    assert len(names) == 12 and {"smc/tuned, closed-form", "smc/tuned, network"} <= set(names)


def test_loops_may_be_the_columns_of_one_reference(results: list[ComparedRow]) -> None:
    one = [each for each in results if each.reference == "step 30 deg"]
    stiff = [dataclasses.replace(each, loop="stiff") for each in one]
    ours = rmse_map([*one, *stiff], across="loop").axes[0]
    assert [label.get_text() for label in ours.get_xticklabels()] == ["four-\nsegments", "stiff"]


def test_figures_grow_with_their_rows_and_columns(results: list[ComparedRow]) -> None:
    many = [dataclasses.replace(results[0], reference=f"r{k}") for k in range(12)]
    small, wide = rmse_map(results[:1]), rmse_map(many)
    assert wide.get_figwidth() > 1.5 * small.get_figwidth() and wide.get_figheight() == small.get_figheight()
    assert small.get_figwidth() == rmse_map(results[:2]).get_figwidth() == WIDTH
    for each in (rmse_map, variation_dots):
        assert each(results).get_figheight() > 1.5 * each(results[:3]).get_figheight()


def test_every_cell_of_the_map_stands_at_its_row_and_column(results: list[ComparedRow]) -> None:
    made = rmse_map(results, "Loop default")
    ours, paper, bar = made.axes
    values = np.array([each.simulation.metrics["rmse"] for each in results]).reshape(6, 3)
    np.testing.assert_allclose(np.asarray(ours.images[0].get_array(), float), np.degrees(values))
    at = {text.get_position(): text.get_text() for text in ours.texts}
    for (row, column), value in np.ndenumerate(values):
        assert at[column, row] == ("x" if np.isnan(value) else degrees(value))
    (hatched,) = (patch for patch in ours.patches if patch.get_hatch())
    assert hatched.get_xy() == (-0.5, 0.5)  # type: ignore[attr-defined]  # first column, second row
    assert {text.get_position(): text.get_text() for text in paper.texts} == {
        (0, row): degrees(T2[name].rmse) for row, name in enumerate(("smc", "smc", "smc", "pid"))
    }
    colours = pytest.approx((1e-3, math.degrees(T2["pid"].rmse)))
    assert ours.images[0].get_clim() == colours == paper.images[0].get_clim(), "from what can be measured"
    assert bar.get_ylabel() == "RMSE [deg]" and ours.get_title("left") == "Loop default"
    assert [label.get_text() for label in paper.get_xticklabels()] == ["the paper's\nT2"]
    assert list(paper.get_xticks()) == [0]


@pytest.mark.slow
def test_numbers_of_the_map_lie_within_their_cells_on_a_page_of_180_mm(results: list[ComparedRow]) -> None:
    """Eight references and the paper's column; in a column of 88 mm colours have to do."""
    wide = [
        dataclasses.replace(results[0], reference=f"minimum jerk {k} s", repeated=Repeated.once(
            dataclasses.replace(results[0].simulation, metrics={"rmse": 1.1e-7 * 3.1**k})))
        for k in range(8)
    ]  # fmt: skip
    with for_paper(180.0 / 25.4):
        made = rmse_map(wide)
        made.draw_without_rendering()
        ours = made.axes[0]
        cell = ours.get_window_extent().width / 8.0
        assert len(ours.texts) == 8 and all(text.get_window_extent().width < cell for text in ours.texts)
    with for_paper(88.0 / 25.4):
        assert not any(axes.texts for axes in rmse_map(wide).axes)


def test_numbers_on_dark_cells_are_white_and_on_bright_ones_black(results: list[ComparedRow]) -> None:
    ours = rmse_map(results).axes[0]
    ink = {text.get_text(): text.get_color() for text in ours.texts}
    assert (ink["<0.001"], ink["0.01"]) == ("w", "k")
    assert ink["0.0029"] == "w", "dark as the middle of the logarithm is 0.0093"


def test_chattering_shows_each_reference_beside_the_median(results: list[ComparedRow]) -> None:
    uneven = [
        dataclasses.replace(
            r, repeated=Repeated.once(dataclasses.replace(r.simulation, metrics={"chattering": float(10.0 ** (k % 3))}))
        )
        for k, r in enumerate(results)
    ]
    (axes,) = variation_dots(uneven, "Loop default").axes
    dots, medians = axes.lines[::2], axes.lines[1::2]
    for row, (dot, median) in enumerate(zip(dots, medians, strict=True)):
        np.testing.assert_allclose(np.asarray(dot.get_data()), np.array([[1.0, 10.0, 100.0], [row] * 3]))
        np.testing.assert_allclose(np.asarray(median.get_data()), np.array([[10.0, 10.0], [row - 0.3, row + 0.3]]))
    assert [dot.get_marker() for dot in dots] == ["o", "x", "o", "o", "o", "o"] and tick_labels(axes)[
        0
    ] == "smc/printed"
    assert axes.get_xscale() == "log" and axes.yaxis_inverted() and axes.get_title("left") == "Loop default"
    assert "[N/s]" in axes.get_xlabel() and not axes.patches, "a bar's length says nothing on a logarithmic axis"


def test_the_papers_column_stands_where_it_is_asked_for_alone(results: list[ComparedRow]) -> None:
    assert len(rmse_map(results).axes) == 3 and len(rmse_map(results, beside=False).axes) == 2
    others = [each for each in results if each.controller not in T2]
    assert len(rmse_map(others).axes) == 2, "no column without a number in it"


@pytest.mark.slow
def test_cells_of_many_rows_and_columns_are_large_enough_to_read_and_no_larger(
    results: list[ComparedRow],
) -> None:
    rows = [dataclasses.replace(results[0], reference=f"r{k}", gains=f"g{k}") for k in range(12)]
    made = rmse_map(rows)
    made.draw_without_rendering()
    box = made.axes[0].get_window_extent().transformed(made.dpi_scale_trans.inverted())
    assert 0.7 < box.width / 12 < 1.2 and 0.25 < box.height / 12 < 0.45, "in inches"
