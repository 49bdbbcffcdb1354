"""Figures of loops show the numbers of their trajectories."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wristctl.report.loop_figures import angles, errors, tensions
from wristctl.simulation.trajectory import Trajectory

Course = Callable[..., Trajectory]


def line(axes: Axes, label: str) -> Line2D:
    (found,) = (each for each in axes.lines if each.get_label() == label)
    return found


def labels(axes: Axes) -> list[str]:
    return [str(each.get_label()) for each in axes.lines]


def test_angles_are_drawn_in_degrees_against_the_desired_angle(course: Course) -> None:
    one = course("smc/tuned")
    (axes,) = angles([one]).axes
    np.testing.assert_array_equal(line(axes, "smc/tuned").get_ydata(), np.degrees(one.theta))
    np.testing.assert_allclose(np.asarray(line(axes, "desired").get_ydata()), 30.0)


def test_reference_is_drawn_where_a_network_makes_it_differ_from_the_desired_angle(course: Course) -> None:
    assert "reference" not in labels(angles([course("smc/tuned")]).axes[0])
    (axes,) = angles([course("smc/tuned", network_error=0.01)]).axes
    np.testing.assert_allclose(np.asarray(line(axes, "reference").get_ydata()), 30.0 + np.degrees(0.01))


def test_loop_that_diverges_is_named_so_and_hides_no_other(course: Course) -> None:
    (axes,) = angles([course("smc/tuned"), course("pid/printed", diverges=True)]).axes
    assert "pid/printed (diverged)" in labels(axes)
    assert axes.get_ylim()[1] <= 45.0


def test_errors_are_drawn_in_radians(course: Course) -> None:
    one = course("smc/printed")
    (axes,) = errors([one], "SMC").axes
    np.testing.assert_array_equal(line(axes, "smc/printed").get_ydata(), one.error)
    assert axes.get_title("left") == "SMC"


def test_logarithmic_errors_are_positive_and_leave_out_what_is_too_small(course: Course) -> None:
    one = course("smc/printed", tau=0.1)
    (axes,) = errors([one], log=True).axes
    drawn = np.asarray(line(axes, "smc/printed").get_ydata())
    known = np.abs(one.error) >= 1e-8
    np.testing.assert_array_equal(drawn[known], np.abs(one.error)[known])
    assert axes.get_yscale() == "log" and np.isnan(drawn[~known]).all() and not known.all()


def test_tensions_show_both_sides_and_both_torques_with_a_close_up_of_the_end(course: Course) -> None:
    one = course("smc/exchanged")
    plus, close, minus, _, torque, _ = tensions(one).axes
    np.testing.assert_array_equal(plus.lines[0].get_ydata(), one.tension[:, 0])
    np.testing.assert_array_equal(minus.lines[0].get_ydata(), one.tension[:, 1])
    np.testing.assert_array_equal(line(torque, "wanted by the law").get_ydata(), one.torque_wanted)
    np.testing.assert_array_equal(line(torque, "of the commanded tensions").get_ydata(), one.torque)
    np.testing.assert_array_equal(close.lines[0].get_ydata(), one.tension[-20:, 0])
    assert np.asarray(close.lines[0].get_xdata())[0] == pytest.approx(1e3 * (one.time[-20] - one.time[-1]))
    assert labels(plus) == ["commanded"]


def test_a_long_course_of_tensions_is_drawn_by_samples_of_its_own_that_keep_every_peak(course: Course) -> None:
    short = course("smc/exchanged")
    rng = np.random.default_rng(0)
    time, tension = np.arange(20_007.0) * 1e-3, rng.uniform(2.0, 60.0, (20_007, 2))
    torque = 0.04 * (tension[:, 0] - tension[:, 1])
    one = replace(short, time=time, tension=tension, torque=torque, torque_wanted=torque)
    drawn = tensions(one).axes[0].lines[0]
    at = np.searchsorted(time, np.asarray(drawn.get_xdata()))
    np.testing.assert_array_equal(drawn.get_ydata(), tension[at, 0])
    assert len(at) < 1100 and (np.diff(at) > 0).all()
    for first in range(0, 20_000, 400):  # ten parts: peaks stay where they are
        whole, kept = tension[first : first + 400, 0], tension[at[(at >= first) & (at < first + 400)], 0]
        assert (kept.min(), kept.max()) == (whole.min(), whole.max())


def test_what_the_controller_sees_and_what_acts_are_drawn_where_they_differ(course: Course) -> None:
    one = course("smc/exchanged")
    seen, acting = np.roll(one.theta, 3), 0.5 * one.tension
    late = replace(one, seen=seen, acting=acting)
    (axes,) = angles([late]).axes
    np.testing.assert_array_equal(line(axes, "smc/exchanged as seen").get_ydata(), np.degrees(seen))
    (axes,) = errors([late]).axes
    np.testing.assert_array_equal(line(axes, "smc/exchanged as seen").get_ydata(), seen - late.theta_ref)
    plus, _, minus, *_ = tensions(late).axes
    for side, drawn in enumerate((plus, minus)):
        np.testing.assert_array_equal(line(drawn, "commanded").get_ydata(), late.tension[:, side])
        np.testing.assert_array_equal(line(drawn, "acting").get_ydata(), acting[:, side])
    same = replace(one, seen=one.theta, acting=one.tension)
    assert labels(angles([same]).axes[0]) == ["smc/exchanged", "desired"]
    assert "acting" not in labels(tensions(same).axes[0])
