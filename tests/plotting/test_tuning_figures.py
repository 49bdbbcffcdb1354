"""Figures of a search show what it tried and found."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from wristctl.commands.tune.figures import convergence, gain_history
from wristctl.control.smc import SMC
from wristctl.tuning.search import Search


def test_convergence_shows_each_search_and_their_median_against_the_budget(search: Search) -> None:
    (axes,) = convergence([search]).axes
    iterations, candidates = search.tried.values.shape
    best = search.best_so_far
    *each, median, feedforward = (np.asarray(line.get_ydata()) for line in axes.lines)
    assert len(each) == (len(best) if len(best) > 1 else 0)
    np.testing.assert_array_equal(median, np.median(best, axis=0))
    assert list(feedforward) == [0.0, 0.0] and axes.get_xscale() == axes.get_yscale() == "linear"
    own = axes.lines[-2]
    np.testing.assert_array_equal(own.get_xdata(), candidates * np.arange(1, iterations // search.restarts + 1))


def test_convergence_shows_every_candidate_and_its_axis_reaches_three_quarters_of_them(search: Search) -> None:
    (axes,) = convergence([search]).axes
    (dots,) = axes.collections
    shown = np.asarray(dots.get_offsets())
    np.testing.assert_array_equal(shown[:, 1], search.tried.values.ravel())
    shown = shown[np.isfinite(shown[:, 1])]
    low, high = axes.get_ylim()
    assert np.mean((low < shown[:, 1]) & (shown[:, 1] < high)) >= 0.75 and low < search.tried.values.min()


def test_convergence_says_where_feedforward_lies_beyond_its_axis(search: Search) -> None:
    far = dataclasses.replace(search, tried=search.tried._replace(values=search.tried.values - 100.0))
    (axes,) = convergence([far]).axes
    assert axes.lines[-1].get_label() == "feedforward (0, beyond the axis)"


def test_convergence_shows_a_thin_line_for_each_restart(search: Search) -> None:
    twice = dataclasses.replace(search, restarts=2)
    (axes,) = convergence([twice]).axes
    for line, own in zip(axes.lines[:2], twice.best_so_far, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), own)
        assert line.get_linewidth() < axes.lines[2].get_linewidth()


def test_gain_history_ends_at_the_gains_that_were_found(search: Search) -> None:
    panels = gain_history(search, SMC.gains).axes
    for panel, found in zip(panels, search.gains.values(), strict=True):
        (best,) = (line for line in panel.lines if line.get_label() == "best so far")
        assert np.asarray(best.get_ydata())[-1] == found
    assert [panel.get_ylabel() for panel in panels] == ["P1 [1/rad]", "P2 [s/rad]", "P3 [1/s]"]


def test_best_gains_change_only_where_the_objective_improves(search: Search) -> None:
    panel = gain_history(search, SMC.gains).axes[0]
    (best,) = (line for line in panel.lines if line.get_label() == "best so far")
    gain, least = np.asarray(best.get_ydata()), np.minimum.accumulate(search.tried.values.min(axis=1))
    np.testing.assert_array_equal(np.diff(gain) != 0.0, np.diff(least) != 0.0)


def test_convergence_names_each_controller_and_what_it_is_measured_by(search: Search) -> None:
    (axes,) = convergence([search, dataclasses.replace(search, controller="pid")]).axes
    assert [line.get_label() for line in axes.lines] == ["smc", "pid", "feedforward"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("candidates tried [1]", "objective [decades beside feedforward]")
    assert len({line.get_color() for line in axes.lines}) == 3


def test_gain_history_shows_the_swarms_middle_and_its_80_in_100_within_the_search_box(search: Search) -> None:
    made = gain_history(search, SMC.gains)
    for at, (panel, gain) in enumerate(zip(made.axes, SMC.gains.values(), strict=True)):
        (median,) = (line for line in panel.lines if line.get_label() == "median of the swarm")
        np.testing.assert_allclose(np.asarray(median.get_ydata()), np.median(search.tried.gains[:, :, at], axis=1))
        (band,) = panel.collections
        assert band.get_label() == "10-90 % of the swarm"
        ends = np.percentile(search.tried.gains[:, :, at], [10.0, 90.0], axis=1)
        places = np.asarray(band.get_paths()[0].vertices)
        for k in range(12):
            own = places[places[:, 0] == k + 1, 1]
            assert (own.min(), own.max()) == pytest.approx((ends[0, k], ends[1, k]))
        low, high = panel.get_ylim()
        assert low < gain.low < gain.high < high and low > 0.5 * gain.low and high < 2.0 * gain.high
        assert panel.get_yscale() == "log"
    assert [panel.get_xlabel() for panel in made.axes] == ["", "", "iteration"]
    titles = [panel.get_title("left") for panel in made.axes]
    assert titles == ["Gains of smc in their search boxes", "", ""]
    ticks = made.axes[-1].get_xticks()
    assert np.all(ticks == np.round(ticks)), "iterations are whole"


def test_the_best_so_far_of_each_iteration_is_the_candidate_that_had_it(search: Search) -> None:
    panels = gain_history(search, SMC.gains).axes
    for at, panel in enumerate(panels):
        (best,) = (line for line in panel.lines if line.get_label() == "best so far")
        np.testing.assert_array_equal(best.get_xdata(), np.arange(1, 13))
        for k, gain in enumerate(np.asarray(best.get_ydata())):
            place = np.unravel_index(search.tried.values[: k + 1].argmin(), search.tried.values[: k + 1].shape)
            assert gain == search.tried.gains[(*place, at)]
