"""Figures of a comparison show every result, failures too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.axes import Axes

from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.paper import T2
from wristctl.report.compare_figures import angle_grid, chattering_bars, rmse_map
from wristctl.simulation.closed_loop import Repeated


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts]


def tick_labels(axes: Axes) -> list[str]:
    return [label.get_text() for label in axes.get_yticklabels()]


def test_grid_has_a_row_for_each_controller_and_a_column_for_each_reference(results: list[ComparedRow]) -> None:
    axes = np.array(angle_grid(results).axes).reshape(6, 3)
    assert axes[0, 0].get_title("left") == "step 30 deg"
    assert texts(axes[3, 2]) == ["pid/\ntuned"]
    for panel, result in zip(axes.flat, results, strict=True):
        every_tenth = np.degrees(result.simulation.trajectory.theta[::10])
        np.testing.assert_array_equal(panel.lines[0].get_ydata(), every_tenth)
    assert "diverged" in texts(axes[1, 0]) and "diverged" not in texts(axes[1, 1])


def test_map_prints_every_rmse_and_marks_what_failed(results: list[ComparedRow]) -> None:
    ours, paper, _ = rmse_map(results).axes
    wanted = ["x" if r.simulation.failed else f"{r.simulation.metrics['rmse']:.2g}" for r in results]
    assert sorted(texts(ours)) == sorted(wanted)
    assert len([patch for patch in ours.patches if patch.get_hatch()]) == 1
    assert texts(paper) == [f"{T2[name].rmse:.2g}" for name in ("smc", "smc", "smc", "pid")]


def test_map_takes_an_error_of_zero_and_a_comparison_in_which_all_failed(results: list[ComparedRow]) -> None:
    for value in (0.0, np.nan):
        bad = [dataclasses.replace(r.simulation, metrics={"rmse": value}) for r in results]
        (ours, *_) = rmse_map(
            [dataclasses.replace(r, repeated=Repeated.once(s)) for r, s in zip(results, bad, strict=True)]
        ).axes
        assert texts(ours) == ["0" if value == 0.0 else "x"] * len(results)


def test_several_inverses_are_rows_of_their_own(results: list[ComparedRow]) -> None:
    both = [*results, *(dataclasses.replace(result, inverse="network") for result in results)]
    names = tick_labels(rmse_map(both).axes[0])
    assert len(names) == 12 and {"smc/tuned, exact", "smc/tuned, network"} <= set(names)


def test_bars_are_medians_over_the_references(results: list[ComparedRow]) -> None:
    (axes,) = chattering_bars(results).axes
    bars = [bar.get_width() for bar in axes.patches]  # type: ignore[attr-defined]
    assert bars == pytest.approx([10.0 * (3 * row + 2) for row in range(6)])
    assert tick_labels(axes)[1] == "smc/exchanged" and axes.patches[1].get_hatch()
