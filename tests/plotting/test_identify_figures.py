"""Figures of an identification show measured and expected angles, what is left over, and what depends on what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from wristctl.arrays import Array
from wristctl.commands.identify.figures import _short, angles, correlations, residuals
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.identification.fit import Fit
from wristctl.identification.intervals import Knowledge
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import UNKNOWNS

COUNT = len(UNKNOWNS) - 1
"""Parameters that trials of one plane tell."""
KNOWN = Knowledge(np.ones(COUNT), np.diag([1.0, 4.0, 9.0, *[1.0] * (COUNT - 3)]), 123.4, 0.1, 77.7, np.zeros(COUNT))


def fit(left_over: list[Array], noise: float = 2e-3) -> Fit:
    """Trials of a swing of 20 deg seen 60 times a second, with these residuals [rad]."""
    trials = []
    for k, each in enumerate(left_over):
        time = np.arange(float(len(each))) / 60.0
        own = "run", "ulnar", WristParameters(), time, np.zeros((len(time), 4))
        trials.append(MeasuredTrial(f"trial {k}", *own, time, np.radians(20.0) * np.sin(time + k), 0.0))
    return Fit(Problem(trials, {}, IdentifySettings(), Actuator(level="tendon")), np.zeros(0), noise, left_over, [], 1)


def noise(count: int, frames: int = 40) -> list[Array]:
    """Residuals that grow from trial to trial."""
    rng = np.random.default_rng(count)
    return [1e-3 * (k + 1) * rng.standard_normal(frames) for k in range(count)]


def rows(made: Figure) -> list[str]:
    return [axes.get_title("left") for axes in made.axes[::2]]


def test_titles_of_trials_leave_out_what_all_share() -> None:
    one = "20261125T093454Z-hw-run-identify-3a8c89"
    assert _short([f"{one}, trial 0: ulnar", f"{one}, trial 1: radial"]) == ["trial 0: ulnar", "trial 1: radial"]
    assert _short([f"{one}, trial 0: ulnar", "20261125-hw-run-bbbbbb, trial 0: ulnar"]) == [
        "3a8c89, trial 0: ulnar", "bbbbbb, trial 0: ulnar",
    ]  # fmt: skip


def test_marker_and_model_are_drawn_in_degrees_with_their_difference_beside() -> None:
    one = fit(noise(3))
    made = angles(one)
    for k, (left, right) in enumerate(np.array(made.axes).reshape(3, 2)):
        trial, residual = one.problem.trials[k], one.residuals[k]
        marker, model = left.lines
        assert (marker.get_label(), model.get_label()) == ("marker", "model")
        np.testing.assert_allclose(marker.get_ydata(), np.degrees(trial.angle))
        np.testing.assert_allclose(model.get_ydata(), np.degrees(trial.angle) - np.degrees(residual))
        np.testing.assert_allclose(right.lines[0].get_ydata(), np.degrees(residual))
        for each in (marker, model, right.lines[0]):
            np.testing.assert_array_equal(each.get_xdata(), trial.captured)
        assert left.get_ylabel() == "angle [deg]"
    assert rows(made) == ["trial 0", "trial 1", "trial 2"]
    assert [axes.get_title("left") for axes in made.axes[1::2]] == ["difference [deg]", "", ""]
    assert [axes.get_xlabel() for axes in made.axes] == ["", "", "", "", "time [s]", "time [s]"]


def test_differences_share_one_scale_that_holds_the_largest() -> None:
    one = fit(noise(3))
    most = max(np.abs(np.degrees(each)).max() for each in one.residuals)
    for right in angles(one).axes[1::2]:
        low, high = right.get_ylim()
        assert low == -high and most < high < 1.2 * most


def test_of_bends_each_plane_is_drawn_by_itself_and_tensions_are_not() -> None:
    """Readings of both bends, and of a tension whose residuals are large, in turn; four trials of many."""
    one = fit([np.where(np.arange(60) % 3 == 2, 9.0, 1e-3 * (k + 1)) for k in range(9)])
    turn = np.arange(60) % 3
    trials = [
        MeasuredTrial(
            trial.label, trial.run, "both", trial.wrist, trial.time, trial.reeled, trial.captured,
            trial.angle, 0.0, (1, 2), turn, 1.0,
        )
        for trial in one.problem.trials
    ]  # fmt: skip
    made = angles(replace(one, problem=replace(one.problem, trials=trials)))
    assert rows(made) == [f"trial {k}" for k in (0, 3, 5, 8)]
    for k, (left, right) in zip((0, 3, 5, 8), np.array(made.axes).reshape(4, 2), strict=True):
        measured, models = left.lines[::2], left.lines[1::2]
        assert [line.get_label() for line in models] == ["model, ulnar", "model, flexion"]
        for plane, (line, model) in enumerate(zip(measured, models, strict=True)):
            angle = np.degrees(trials[k].angle[turn == plane])
            np.testing.assert_allclose(line.get_ydata(), angle)
            np.testing.assert_allclose(model.get_ydata(), angle - np.degrees(1e-3 * (k + 1)))
        low, high = right.get_ylim()
        assert low == -high and np.degrees(9e-3) < high < 1.2 * np.degrees(9e-3)
        assert left.get_ylabel() == "bend [deg]"


@pytest.mark.parametrize(
    ("count", "shown"), [(1, [0]), (8, list(range(8))), (9, [0, 1, 2, 3, 5, 6, 7, 8]), (15, list(range(0, 15, 2)))]
)
def test_of_many_trials_eight_are_drawn_from_the_first_to_the_last(count: int, shown: list[int]) -> None:
    assert rows(angles(fit(noise(count)))) == [f"trial {k}" for k in shown]


def test_the_distribution_is_in_degrees_beside_a_normal_one_of_the_fits_noise() -> None:
    one = fit(noise(3, frames=200))
    left = residuals(one, KNOWN).axes[0]
    every, sd = np.degrees(np.concatenate(one.residuals)), np.degrees(2e-3)
    bars = [each for each in left.patches if isinstance(each, Rectangle)]
    assert bars[0].get_x() == pytest.approx(every.min())
    assert bars[-1].get_x() + bars[-1].get_width() == pytest.approx(every.max())
    assert sum(each.get_height() * each.get_width() for each in bars) == pytest.approx(1.0)
    x, y = (np.asarray(each) for each in left.lines[0].get_data())
    assert np.trapezoid(y, x) == pytest.approx(1.0, abs=1e-3), "a distribution"
    assert x[0] == pytest.approx(-x[-1]) and 3.0 < x[-1] / sd < 5.0 and len(x) > 100
    assert np.trapezoid(y * x**2, x) == pytest.approx(sd**2, rel=0.01)
    at = np.searchsorted(x, sd)
    assert y[at] / y.max() == pytest.approx(np.exp(-0.5 * (x[at] / sd) ** 2), rel=0.01)
    legend = left.get_legend()
    assert legend is not None and [each.get_text() for each in legend.get_texts()] == [
        "residuals, sd 0.115 deg",
        "normal",
    ]
    assert (left.get_xlabel(), left.get_ylabel()) == ("marker less model [deg]", "density [1/deg]")


def test_the_autocorrelation_of_residuals_that_alternate_does_so_within_each_trial() -> None:
    alternating = np.resize([1e-3, -1e-3], 60)
    right = residuals(fit([alternating, alternating[:10]]), KNOWN).axes[1]
    (stems,) = (each for each in right.collections if isinstance(each, LineCollection))
    lags, heights = np.array([segment[1] for segment in stems.get_segments()]).T
    assert list(lags) == list(range(1, 31))
    assert all(segment[0][1] == 0.0 for segment in stems.get_segments())
    pairs = (60 - lags) + np.maximum(10 - lags, 0)
    assert heights == pytest.approx((-1.0) ** lags * pairs / 70.0)
    assert (right.get_xlabel(), right.get_ylabel()) == ("lag [frames]", "autocorrelation")
    assert right.get_title("left") == "worth 78 independent frames of 70"


def test_the_band_holds_95_in_100_lags_of_white_noise() -> None:
    right = residuals(fit(noise(1, frames=400)), KNOWN).axes[1]
    (band,) = (each for each in right.patches if isinstance(each, Rectangle))
    assert band.get_y() == pytest.approx(-0.098) and band.get_height() == pytest.approx(0.196)


def test_correlations_are_those_of_the_parameters_that_were_searched_for() -> None:
    information = np.eye(COUNT) + 0.3 * np.eye(COUNT, k=1) + 0.3 * np.eye(COUNT, k=-1)
    known = Knowledge(np.ones(COUNT), information, 123.4, 0.1, 77.7, np.zeros(COUNT))
    one = fit(noise(2))
    names = list(one.problem.free)
    axes, bar = correlations(one, known).axes
    covariance = np.linalg.inv(information)
    sd = np.sqrt(np.diag(covariance))
    expected = (covariance / np.outer(sd, sd))[: len(names), : len(names)]
    np.testing.assert_allclose(np.asarray(axes.images[0].get_array()), expected, atol=1e-9)
    assert axes.images[0].get_clim() == (-1.0, 1.0) and bar.get_ylabel() == "correlation"
    for axis in (axes.xaxis, axes.yaxis):
        assert [label.get_text() for label in axis.get_ticklabels()] == names
    for text in axes.texts:
        column, row = (int(each) for each in text.get_position())
        assert text.get_text() == f"{expected[row, column]:.2f}"
        if row == column or abs(expected[row, column]) < 0.5:
            assert (text.get_color() == "w") == (row == column), "readable on a dark cell"
    assert len(axes.texts) == len(names) ** 2 and axes.get_title("left") == "condition number 123"
    assert not any(line.get_visible() for line in axes.get_xgridlines())
