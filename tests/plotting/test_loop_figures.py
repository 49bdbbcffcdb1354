"""Figures of loops show the numbers of their trajectories."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from wristctl.plotting.loop_figures import envelope, one_motion, over_time, tensions
from wristctl.simulation.trajectory import Trajectory

Course = Callable[..., Trajectory]


def line(axes: Axes, label: str) -> Line2D:
    (found,) = (each for each in axes.lines if each.get_label() == label)
    return found


def labels(axes: Axes) -> list[str]:
    return [str(each.get_label()) for each in axes.lines]


def test_angles_are_drawn_in_degrees_against_the_desired_angle(course: Course) -> None:
    one = course("smc/tuned")
    (axes,) = over_time([one], "angle").axes
    np.testing.assert_array_equal(line(axes, "smc/tuned").get_ydata(), np.degrees(one.theta))
    np.testing.assert_allclose(np.asarray(line(axes, "desired").get_ydata()), 30.0)


def test_reference_is_drawn_where_a_network_makes_it_differ_from_the_desired_angle(course: Course) -> None:
    assert "reference" not in labels(over_time([course("smc/tuned")], "angle").axes[0])
    (axes,) = over_time([course("smc/tuned", network_error=0.01)], "angle").axes
    np.testing.assert_allclose(np.asarray(line(axes, "reference").get_ydata()), 30.0 + np.degrees(0.01))


def test_loop_that_diverges_is_named_so_and_hides_no_other(course: Course) -> None:
    (axes,) = over_time([course("smc/tuned"), course("pid/printed", diverges=True)], "angle").axes
    assert "pid/printed (diverged)" in labels(axes)
    assert axes.get_ylim()[1] <= 45.0


def test_errors_are_drawn_in_degrees(course: Course) -> None:
    one = course("smc/printed")
    (axes,) = over_time([one], "error", heading="SMC").axes
    np.testing.assert_array_equal(line(axes, "smc/printed").get_ydata(), np.degrees(one.error))
    assert axes.get_title("left") == "SMC"


def test_logarithmic_errors_are_positive_and_leave_out_what_is_too_small(course: Course) -> None:
    one = course("smc/printed", tau=0.1)
    (axes,) = over_time([one], "size").axes
    drawn = np.asarray(line(axes, "smc/printed").get_ydata())
    known = np.abs(one.error) >= 1e-8
    np.testing.assert_allclose(drawn[known], np.degrees(np.abs(one.error))[known], rtol=1e-12)
    assert axes.get_yscale() == "log" and np.isnan(drawn[~known]).all() and not known.all()


def test_tensions_show_both_sides_and_both_torques_with_a_close_up_of_the_end(course: Course) -> None:
    one = course("smc/exchanged")
    plus, close, minus, _, torque, _ = tensions(one).axes
    np.testing.assert_array_equal(plus.lines[0].get_ydata(), one.tension[:, 0])
    np.testing.assert_array_equal(minus.lines[0].get_ydata(), one.tension[:, 1])
    np.testing.assert_array_equal(line(torque, "torque wanted").get_ydata(), one.torque_wanted)
    np.testing.assert_array_equal(line(torque, "torque of the tensions").get_ydata(), one.torque)
    np.testing.assert_array_equal(close.lines[0].get_ydata(), one.tension[-20:, 0])
    assert np.asarray(close.lines[0].get_xdata())[0] == pytest.approx(1e3 * (one.time[-20] - one.time[-1]))
    assert labels(plus) == ["tension of the + side"] and labels(minus) == ["tension of the - side"]


def test_a_long_course_is_a_line_of_means_in_a_band_that_keeps_every_peak(course: Course) -> None:
    rng = np.random.default_rng(0)
    time, tension = np.arange(20_007.0) * 1e-3, rng.uniform(2.0, 60.0, (20_007, 2))
    torque = 0.04 * (tension[:, 0] - tension[:, 1])
    one = replace(course("smc/exchanged"), time=time, tension=tension, torque=torque, torque_wanted=torque)
    panel = tensions(one).axes[0]
    at, mean = (np.asarray(values) for values in panel.lines[0].get_data())
    (band,) = (np.asarray(each.get_paths()[0].vertices) for each in panel.collections)
    assert len(at) == 500 and (np.diff(at) > 0).all()
    for k in (0, 250, 499):  # samples of a part, and the band above and below its mean
        part = tension[40 * k : 40 * k + 40, 0]
        assert mean[k] == pytest.approx(part.mean()) and at[k] == pytest.approx(time[40 * k : 40 * k + 40].mean())
        edges = band[np.isclose(band[:, 0], at[k]), 1]
        assert (edges.min(), edges.max()) == pytest.approx((part.min(), part.max()))


def test_an_envelope_is_of_samples_of_the_course_and_keeps_every_peak() -> None:
    time, course = np.arange(20_007.0) * 1e-3, np.random.default_rng(0).uniform(2.0, 60.0, 20_007)
    drawn_time, kept_values = envelope(time, course)
    at = np.searchsorted(time, drawn_time)
    np.testing.assert_array_equal(kept_values, course[at])
    assert len(at) < 1100 and (np.diff(at) > 0).all()
    for first in range(0, 20_000, 400):  # ten parts: peaks stay where they are
        whole, kept = course[first : first + 400], course[at[(at >= first) & (at < first + 400)]]
        assert (kept.min(), kept.max()) == (whole.min(), whole.max())


def test_one_motion_has_angle_error_and_tensions_below_each_other(course: Course) -> None:
    seen = course("smc/exchanged", 0.4).theta
    one = replace(course("smc/exchanged"), seen=seen)
    above, middle, below = one_motion(one, "Loop fast").axes
    assert [axes.get_ylabel() for axes in (above, middle, below)] == ["angle [deg]", "error [deg]", "tension [N]"]
    assert above.get_title("left") == "Loop fast" and below.get_xlabel() == "time [s]"
    assert labels(above) == ["smc/exchanged", "as seen", "desired"] and labels(below) == ["+ side", "- side"]
    np.testing.assert_array_equal(middle.lines[0].get_ydata(), np.degrees(one.error))
    np.testing.assert_array_equal(middle.lines[1].get_ydata(), np.degrees(seen - one.theta_ref))
    for axes, tension in zip(below.lines, one.tension.T, strict=True):
        np.testing.assert_array_equal(axes.get_ydata(), tension)


def test_what_the_controller_sees_and_what_acts_are_drawn_where_they_differ(course: Course) -> None:
    one = course("smc/exchanged")
    seen, acting = np.roll(one.theta, 3), 0.5 * one.tension
    late = replace(one, seen=seen, acting=acting)
    (axes,) = over_time([late], "angle").axes
    np.testing.assert_array_equal(line(axes, "smc/exchanged as seen").get_ydata(), np.degrees(seen))
    (axes,) = over_time([late], "error").axes
    np.testing.assert_array_equal(line(axes, "smc/exchanged as seen").get_ydata(), np.degrees(seen - late.theta_ref))
    plus, _, minus, *_ = tensions(late).axes
    for side, drawn in enumerate((plus, minus)):
        name = f"tension of the {'+-'[side]} side"
        np.testing.assert_array_equal(line(drawn, name).get_ydata(), late.tension[:, side])
        np.testing.assert_array_equal(line(drawn, "tension that acts").get_ydata(), acting[:, side])
    same = replace(one, seen=one.theta, acting=one.tension)
    assert labels(over_time([same], "angle").axes[0]) == ["smc/exchanged", "desired"]
    assert "tension that acts" not in labels(tensions(same).axes[0])


def test_angles_are_named_and_have_their_units(course: Course) -> None:
    (axes,) = over_time([course("smc/tuned")], "angle", heading="Loop fast").axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "bending angle [deg]")
    assert axes.get_title("left") == "Loop fast"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_diverging_angle_is_shown_to_half_a_move_beyond_what_is_desired(course: Course, sign: float) -> None:
    one = course("pid/printed", diverges=True)
    far = replace(
        one, theta=sign * np.tan(one.time), theta_ref=sign * one.theta_ref, theta_desired=sign * one.theta_ref
    )
    low, high = over_time([far], "angle").axes[0].get_ylim()
    assert (low, high) == pytest.approx((-15.0, 45.0) if sign > 0.0 else (-45.0, 15.0))


def test_an_axis_of_angles_is_no_wider_than_what_is_drawn(course: Course) -> None:
    low, high = over_time([course("smc/tuned")], "angle").axes[0].get_ylim()
    assert -3.0 < low < 0.0 and 30.0 < high < 33.0


def test_a_small_move_is_shown_to_5_deg_beyond_it(course: Course) -> None:
    one = course("pid/printed", diverges=True)
    far = replace(one, theta=np.tan(one.time), theta_ref=0.1 * one.theta_ref, theta_desired=0.1 * one.theta_desired)
    assert over_time([far], "angle").axes[0].get_ylim() == pytest.approx((-5.0, 8.0))


def test_a_reference_is_drawn_once_however_many_loops_follow_it(course: Course) -> None:
    loops = [course(name, network_error=0.01) for name in ("smc/tuned", "pid/tuned")]
    assert labels(over_time(loops, "angle").axes[0]) == ["smc/tuned", "pid/tuned", "desired", "reference"]
    mixed = [course("smc/tuned"), course("pid/tuned", network_error=0.01), course("mrac/tuned", network_error=0.02)]
    (axes,) = over_time(mixed, "angle").axes
    drawn = [float(np.asarray(each.get_ydata())[0]) for each in axes.lines if each.get_label() == "reference"]
    assert labels(axes).count("reference") == 2 and len(set(drawn)) == 2


def test_the_desired_angle_is_that_of_the_first_loop(course: Course) -> None:
    other = replace(course("pid/tuned"), theta_desired=0.5 * course("pid/tuned").theta_desired)
    (axes,) = over_time([course("smc/tuned"), other], "angle").axes
    desired = line(axes, "desired")
    np.testing.assert_allclose(np.asarray(desired.get_ydata()), 30.0)
    np.testing.assert_array_equal(desired.get_xdata(), other.time)


def test_errors_are_measured_around_zero_and_a_diverging_one_hides_no_other(course: Course) -> None:
    (axes,) = over_time([course("smc/printed")], "error").axes
    assert axes.get_ylim()[0] < -30.0 and axes.get_yscale() == "linear"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "error [deg]")
    assert [0.0, 0.0] in [list(np.asarray(each.get_ydata())) for each in axes.lines]
    one, half = course("pid/printed", diverges=True), np.linspace(0.1, 0.5, 200) * course("pid/printed").theta_ref
    for sign in (1.0, -1.0):
        wild = replace(one, theta=sign * np.tan(one.time))
        reach = 2.0 * 30.0
        low, high = over_time([replace(wild, theta_ref=half), wild], "error").axes[0].get_ylim()
        assert (low, high) == pytest.approx((-reach, reach), abs=1.0)
        assert low < -reach < reach < high, "a whole move to either side, and a little more"


def test_the_logarithm_of_an_error_is_of_its_size_alone(course: Course) -> None:
    one = course("smc/printed")
    late = replace(one, seen=np.roll(one.theta, 3))
    (axes,) = over_time([late], "size").axes
    assert labels(axes) == ["smc/printed"] and axes.get_ylabel() == "|error| [deg]"


def test_the_side_on_which_tensions_are_named_and_begin_at_zero(course: Course) -> None:
    one = course("smc/exchanged")
    plus, close, minus, _, torque, last = (made := tensions(one)).axes
    assert [each.get_ylabel() for each in made.axes] == ["tension [N]", "", "tension [N]", "", "torque [N m]", ""]
    assert [each.get_xlabel() for each in made.axes[4:]] == ["time [s]", "to the end [ms]"]
    assert plus.get_title("left") == "smc/exchanged"
    assert close.get_title("left") == "last 20 samples"
    for each in (plus, minus):
        low, high = each.get_ylim()
        assert low == 0.0 and 60.0 < high < 66.0, "the largest tension of both sides"
    assert len(made.legends) == 1 and not any(each.get_legend() for each in made.axes)
    for each in (torque, last):
        np.testing.assert_array_equal(
            line(each, "torque wanted").get_ydata(),
            one.torque_wanted[-len(each.lines[0].get_xdata()) :],  # type: ignore[arg-type]
        )
    assert np.asarray(last.lines[0].get_xdata())[-1] == 0.0
    assert np.asarray(last.lines[0].get_xdata())[0] == pytest.approx(-19 * 25.0), "in ms"


def test_tensions_that_act_are_shown_beside_those_commanded_with_a_legend(course: Course) -> None:
    one = course("smc/exchanged")
    made = tensions(replace(one, acting=2.0 * one.tension))
    plus, close, minus, close_minus, *_ = made.axes
    assert [text.get_text() for text in made.legends[0].get_texts()].count("tension that acts") == 1
    assert 120.0 < plus.get_ylim()[1] < 132.0 and plus.get_ylim() == minus.get_ylim()
    for side, panel in enumerate((close, close_minus)):
        np.testing.assert_array_equal(line(panel, "tension that acts").get_ydata(), 2.0 * one.tension[-20:, side])


def test_a_torque_that_the_law_wants_beyond_all_tensions_does_not_flatten_the_one_given(course: Course) -> None:
    one = course("smc/exchanged")
    wild = replace(one, torque_wanted=100.0 * one.torque - 50.0 * np.arange(200.0))
    low, high = tensions(wild).axes[4].get_ylim()
    most = np.abs(one.torque).max()
    assert low == pytest.approx(-2.0 * most) and high == pytest.approx(2.0 * most)


def test_a_torque_within_its_limits_is_drawn_as_large_as_it_is(course: Course) -> None:
    one = course("smc/exchanged")
    low, high = tensions(replace(one, torque_wanted=one.torque)).axes[4].get_ylim()
    assert high < 1.2 * np.abs(one.torque).max() and -0.2 * high < low < 0.0


@pytest.mark.parametrize("count", [1999, 2000])
def test_a_course_is_drawn_sample_by_sample_until_there_are_four_in_a_pixel(course: Course, count: int) -> None:
    tension = np.random.default_rng(0).uniform(2.0, 60.0, (count, 2))
    torque = 0.04 * (tension[:, 0] - tension[:, 1])
    time = 1e-3 * np.arange(float(count))
    one = replace(course("smc/exchanged"), time=time, tension=tension, torque=torque, torque_wanted=torque)
    panel = tensions(one).axes[0]
    assert len(np.asarray(panel.lines[0].get_xdata())) == (count if count < 2000 else 500)
    assert len(panel.collections) == (count == 2000)


def test_what_differs_by_less_than_a_millionth_is_not_drawn_twice(course: Course) -> None:
    one = course("smc/exchanged")
    for share, apart in ((0.9e-6, False), (1.1e-6, True)):
        seen = one.theta + share * one.theta.max()
        assert ("smc/exchanged as seen" in labels(over_time([replace(one, seen=seen)], "angle").axes[0])) == apart


def test_errors_below_a_hundred_millionth_are_left_out(course: Course) -> None:
    one = course("smc/printed")
    theta = one.theta_ref + np.where(np.arange(200) % 2, 1.1e-8, -0.9e-8)
    drawn = np.asarray(over_time([replace(one, theta=theta)], "size").axes[0].lines[0].get_ydata())
    assert np.isnan(drawn[::2]).all() and np.isfinite(drawn[1::2]).all()
