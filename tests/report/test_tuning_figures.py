"""Figures of a search show what it tried and found."""

from __future__ import annotations

import numpy as np

from wristctl.control.smc import SMC
from wristctl.report.tuning_figures import convergence, gain_history
from wristctl.tuning.search import Search


def test_convergence_shows_best_so_far_and_the_swarms_median(search: Search) -> None:
    (axes,) = convergence([search]).axes
    best, median = (np.asarray(line.get_ydata()) for line in axes.lines)
    np.testing.assert_array_equal(best, np.minimum.accumulate(search.values.min(axis=1)))
    np.testing.assert_array_equal(median, np.median(search.values, axis=1))
    assert np.asarray(axes.lines[0].get_xdata())[0] == 1 and axes.get_yscale() == "log"


def test_gain_history_ends_at_the_gains_that_were_found(search: Search) -> None:
    panels = gain_history(search, SMC.gains).axes
    for panel, found in zip(panels, search.gains.values(), strict=True):
        (best,) = (line for line in panel.lines if line.get_label() == "best so far")
        assert np.asarray(best.get_ydata())[-1] == found
    assert [panel.get_ylabel() for panel in panels] == ["P1 [1/rad]", "P2 [s/rad]", "P3 [1/s]"]


def test_best_gains_change_only_where_the_objective_improves(search: Search) -> None:
    panel = gain_history(search, SMC.gains).axes[0]
    (best,) = (line for line in panel.lines if line.get_label() == "best so far")
    gain, least = np.asarray(best.get_ydata()), np.minimum.accumulate(search.values.min(axis=1))
    np.testing.assert_array_equal(np.diff(gain) != 0.0, np.diff(least) != 0.0)
