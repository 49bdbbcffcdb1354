"""Figures of data sets and trainings, drawn from the tables that runs keep."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from wristctl.commands.train.figures import (
    MOST_PATHS,
    accuracy_against_cost,
    coverage,
    error_over_workspace,
    learning_curves,
    predicted_angles,
)
from wristctl.commands.train.tables import grid_table, predictions_table, samples_table
from wristctl.config.learning import DataSettings, NetworkSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.dataset import Samples, draw_samples
from wristctl.learning.evaluation import error_map
from wristctl.learning.selection import CrossValidated

CURVES = pd.DataFrame(
    {
        "trial": [0, 0, 1, 1],
        "epoch": [1, 2, 1, 2],
        "train_loss": [0.04, 0.01, 0.09, 0.0025],
        "validation_loss": [0.04, 0.02, 0.09, 0.0016],
    }
)


@pytest.fixture
def samples() -> Samples:
    return draw_samples(DataSettings(samples=50), WristParameters(), np.random.default_rng(0))


def labels(figure: Figure) -> list[str]:
    return [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]


def test_coverage_shows_every_sample_in_mm_and_deg(samples: Samples) -> None:
    figure = coverage(samples_table(samples))
    (dots,) = figure.axes[0].collections
    np.testing.assert_allclose(np.asarray(dots.get_offsets()), 1e3 * samples.tip[:, ::-1])
    np.testing.assert_allclose(np.asarray(dots.get_array()), np.degrees(samples.theta))
    assert labels(figure) == ["y [mm]", "x [mm]", "bending angle [deg]"]


def test_learning_curves_are_in_deg_and_the_kept_trial_stands_out() -> None:
    figure = learning_curves(CURVES, kept=1)
    lines = figure.axes[0].get_lines()
    kept = [line for line in lines if not str(line.get_label()).startswith("_")]
    assert [line.get_label() for line in kept] == ["training", "validation"] and len(lines) == 4
    np.testing.assert_allclose(np.asarray(kept[1].get_ydata()), np.degrees([0.3, 0.04]))
    assert kept[0].get_linewidth() > lines[0].get_linewidth()
    assert labels(figure) == ["epoch", "RMSE of the angle [deg]"]
    assert figure.axes[0].get_yscale() == "log"


def test_predicted_angles_show_the_error_beside_the_angle(samples: Samples) -> None:
    theta = samples.theta
    table = predictions_table(samples.tip, (), theta, theta + np.radians(0.3), theta, theta)
    figure = predicted_angles(table)
    left, right = figure.axes
    np.testing.assert_allclose(np.asarray(left.get_lines()[1].get_ydata()), np.degrees(samples.theta) + 0.3)
    np.testing.assert_allclose(np.asarray(right.get_lines()[1].get_ydata()), 0.3)
    assert all("[deg]" in label for label in labels(figure))


def test_error_map_marks_its_greatest_error(samples: Samples) -> None:
    grid = error_map(lambda tip: np.zeros(tip.shape[:-1]), samples.domain, 11, 5)
    figure = error_over_workspace(grid.tip, grid.error)
    mark = figure.axes[0].get_lines()[0]
    (y,), (x,) = (np.asarray(each) for each in mark.get_data())
    assert abs(np.degrees(2 * np.arctan2(y, x))) == pytest.approx(50.0)
    assert figure.axes[0].get_title(loc="left").startswith("greatest error 50 deg")
    assert labels(figure) == ["y [mm]", "x [mm]", "absolute error [deg]"]


def test_coverage_is_coloured_alike_to_both_sides_and_drawn_at_equal_scales(samples: Samples) -> None:
    axes, bar = coverage(samples_table(samples)).axes
    (dots,) = axes.collections
    bend = np.degrees(np.abs(samples.theta).max())
    assert dots.get_clim() == pytest.approx((-bend, bend)) and bar.get_ylim() == pytest.approx((-bend, bend))
    assert axes.get_title("left") == "50 samples of the tip" and axes.get_aspect() == 1.0


def test_a_map_of_the_workspace_ends_a_little_beyond_its_tips(samples: Samples) -> None:
    axes = coverage(samples_table(samples)).axes[0]
    low, high = 1e3 * samples.tip.min(axis=0)[::-1], 1e3 * samples.tip.max(axis=0)[::-1]
    for (near, far), start, end in zip((axes.get_xlim(), axes.get_ylim()), low, high, strict=True):
        assert start - near == pytest.approx(far - end) and 0.02 < (start - near) / (high - low)[0] < 0.06


@pytest.mark.parametrize("spread", [(0.0, 0.0), (0.03, 0.0), (0.0, 0.03), (1e-9, 1e-9)])
@pytest.mark.parametrize("count", [1, 3])
def test_a_map_of_few_samples_shows_each_with_room_around(count: int, spread: tuple[float, float]) -> None:
    tip = np.array([0.08, -0.02]) + np.linspace(0.0, 1.0, count)[:, None] * spread
    few = pd.DataFrame({"x": tip[:, 0], "y": tip[:, 1], "theta": np.zeros(count)})
    for axes in (coverage(few).axes[0], error_over_workspace(tip, np.zeros(count)).axes[0]):
        for (near, far), places in zip((axes.get_xlim(), axes.get_ylim()), 1e3 * tip.T[::-1], strict=True):
            assert near < places.min() <= places.max() < far and far - near >= 1.0 - 1e-9


@pytest.mark.parametrize(("width", "height"), [(0.04, 0.04), (0.04, 0.02), (0.1, 0.02), (0.01, 0.08)])
def test_a_map_is_as_tall_as_equal_scales_need_within_a_page(width: float, height: float) -> None:
    tip = np.array([[0.0, 0.0], [height, width]])
    tall = error_over_workspace(tip, np.zeros(2)).get_figheight()
    assert tall == pytest.approx(np.clip(5.6 * height / width + 1.1, 2.4, 7.0))


@pytest.mark.parametrize(("count", "pixels"), [(MOST_PATHS, False), (MOST_PATHS + 1, True)])
def test_many_dots_are_drawn_as_pixels(count: int, pixels: bool) -> None:
    theta = np.linspace(-0.5, 0.5, count)
    tip = np.column_stack([np.cos(theta), np.sin(theta)])
    own = pd.DataFrame({"x": tip[:, 0], "y": tip[:, 1], "theta": theta, "theta_network": theta})
    assert coverage(own).axes[0].collections[0].get_rasterized() == pixels
    assert error_over_workspace(tip, theta).axes[0].collections[0].get_rasterized() == pixels
    assert all(axes.lines[1].get_rasterized() == pixels for axes in predicted_angles(own).axes)


def test_dots_shrink_as_they_become_many(samples: Samples) -> None:
    few = samples_table(samples)
    many = pd.concat([few] * 100)
    sizes = [float(coverage(each).axes[0].collections[0].get_sizes()[0]) for each in (few, many)]  # type: ignore[attr-defined]
    assert sizes[0] > 2.0 * sizes[1] > 0.0
    assert len(few) == 50 and sizes[0] < 40.0


def test_one_training_is_the_kept_one_and_needs_no_title() -> None:
    alone = learning_curves(CURVES[CURVES["trial"] == 0])
    assert alone.axes[0].get_title("left") == "" and alone.axes[0].get_legend() is not None
    both = learning_curves(CURVES).axes[0]
    assert both.get_title("left") == "trial 0 was kept; faint: trials that were not"
    named = [line for line in both.get_lines() if not str(line.get_label()).startswith("_")]
    np.testing.assert_allclose(np.asarray(named[0].get_ydata()), np.degrees([0.2, 0.1]))
    np.testing.assert_array_equal(named[0].get_xdata(), [1, 2])
    assert [line.get_alpha() is None for line in both.get_lines()] == [True, True, False, False]


def test_predicted_angles_are_held_against_equal_ones(samples: Samples) -> None:
    theta = samples.theta
    left, right = predicted_angles(predictions_table(samples.tip, (), theta, theta + 0.1, theta, theta)).axes
    (x, y), true = left.lines[0].get_data(), np.degrees(theta)
    assert list(np.asarray(x)) == list(np.asarray(y)) == [true.min(), true.max()]
    np.testing.assert_allclose(np.asarray(left.lines[1].get_xdata()), true)
    np.testing.assert_allclose(np.asarray(right.lines[1].get_xdata()), true)
    assert list(np.asarray(right.lines[0].get_ydata())) == [0.0, 0.0]
    assert (left.get_xlabel(), left.get_ylabel()) == ("true angle [deg]", "network's angle [deg]")
    assert (right.get_xlabel(), right.get_ylabel()) == ("true angle [deg]", "error of the network [deg]")
    assert left.get_box_aspect() == right.get_box_aspect() == 1.0


def test_the_error_map_is_of_sizes_in_degrees_at_each_tip() -> None:
    along, across = np.meshgrid([0.07, 0.075, 0.08], [-0.02, 0.0, 0.01, 0.03], indexing="ij")
    error = np.radians(np.arange(12.0).reshape(3, 4) - 8.0)
    made = error_over_workspace(np.stack([along, across], axis=-1), error)
    (cells,) = made.axes[0].collections
    np.testing.assert_allclose(np.asarray(cells.get_array()).ravel(), np.abs(np.arange(12.0) - 8.0))
    places = cells._coordinates  # type: ignore[attr-defined]  # matplotlib has no public name for them
    np.testing.assert_allclose(np.asarray(places), 1e3 * np.stack([across, along], axis=-1))
    assert cells.get_clim() == pytest.approx((0.0, 8.0))
    mark = made.axes[0].lines[0]
    assert (float(np.asarray(mark.get_xdata())[0]), float(np.asarray(mark.get_ydata())[0])) == (-20.0, 70.0)
    assert made.axes[0].get_title("left") == "greatest error 8 deg, at the circle"


def test_errors_at_samples_are_drawn_in_mm_and_degrees_the_greatest_on_top() -> None:
    tip = np.array([[0.08, 0.01], [0.07, -0.02], [0.075, 0.0]])
    made = error_over_workspace(tip, np.radians([1.0, -3.0, 2.0]))
    (dots,) = made.axes[0].collections
    np.testing.assert_allclose(np.asarray(dots.get_array()), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(np.asarray(dots.get_offsets()), [[10.0, 80.0], [0.0, 75.0], [-20.0, 70.0]])
    assert made.axes[0].get_title("left") == "greatest error 3 deg, on the test samples"
    assert labels(made) == ["y [mm]", "x [mm]", "absolute error [deg]"] and dots.get_clim()[0] == 0.0


def test_accuracy_is_drawn_over_cost_by_activation_and_the_chosen_point_is_marked() -> None:
    grid = pd.DataFrame(
        {
            "activation": ["tanh", "tanh", "elu", "elu"], "multiply_adds": [200, 100, 50, 400],
            "rmse_deg": [0.2, 0.5, 0.4, 0.1], "error_deg": [0.02, 0.05, 0.04, 0.01],
        }
    )  # fmt: skip
    (axes,) = accuracy_against_cost(grid, 3).axes
    tanh, elu = axes.containers
    assert (tanh.get_label(), elu.get_label()) == ("tanh", "elu")
    np.testing.assert_array_equal(np.asarray(tanh.lines[0].get_data()), [[100, 200], [0.5, 0.2]])  # type: ignore[attr-defined]
    bars = tanh.lines[2][0].get_segments()  # type: ignore[attr-defined]
    np.testing.assert_allclose([bar[:, 1] for bar in bars], [[0.45, 0.55], [0.18, 0.22]])
    (chosen,) = (line for line in axes.lines if line.get_label() == "chosen")
    assert (np.asarray(chosen.get_xdata())[0], np.asarray(chosen.get_ydata())[0]) == (400, 0.1)
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert labels(axes.figure) == ["multiply-adds of one angle", "cross-validated RMSE [deg]"]  # type: ignore[arg-type]


def test_the_grids_table_is_in_degrees_with_a_column_for_each_fold() -> None:
    settings = NetworkSettings(hidden=(8, 4), activation="tanh", learning_rate=0.01, weight_decay=1e-4)
    rmse = np.radians([0.1, 0.3])
    table = grid_table([CrossValidated(settings, 2, 60, rmse)])
    (row,) = table.to_dict("records")
    assert (row["hidden"], row["depth"], row["multiply_adds"]) == ("8-4", 2, 60)
    assert (row["activation"], row["learning_rate"], row["weight_decay"]) == ("tanh", 0.01, 1e-4)
    assert [row["fold_0_rmse_deg"], row["fold_1_rmse_deg"]] == pytest.approx([0.1, 0.3])
    assert (row["rmse_deg"], row["error_deg"]) == pytest.approx((0.2, 0.1))
