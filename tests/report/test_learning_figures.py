"""Figures of data sets and trainings, drawn from the tables that runs keep."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.angle_errors import error_map
from wristctl.learning.dataset import Samples, draw_samples
from wristctl.report.learning_figures import coverage, error_over_workspace, learning_curves, predicted_angles
from wristctl.report.learning_tables import predictions_table, samples_table

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
