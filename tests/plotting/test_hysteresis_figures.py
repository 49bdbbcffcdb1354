"""Figures of hysteresis show each loop in its unit, the roots of the statics, works by speed, and a measured loop."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from tests.identification.made_loops import SHORT, Measured, made_loop
from wristctl.arrays import Array
from wristctl.commands.analyse import hysteresis_figures as figures
from wristctl.commands.identify.figures import measured as drawn_beside
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.wrist import WristParameters
from wristctl.identification.friction_fit import FrictionFit
from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop, dead_bands, loops
from wristctl.simulation.strokes import FrictionCase, Strokes, strokes

Driven = tuple[Strokes, list[HysteresisLoop], list[DeadBand]]


@pytest.fixture(scope="module")
def driven() -> Driven:
    settings = HysteresisSettings(
        ranges_deg=((0.0, 20.0), (5.0, 15.0)), frequencies=(2.0, 0.5), sheaths=(3.0, 0.0, 1.0), ramp=0.3,
        angles_deg=(5.0, 15.0),
    )  # fmt: skip
    own = strokes(WristParameters(), settings)
    return own, loops(own), dead_bands(own)


def x_of(line: Line2D) -> Array:
    return np.asarray(line.get_xdata(), float)


def y_of(line: Line2D) -> Array:
    return np.asarray(line.get_ydata(), float)


def labelled(axes: Axes, label: str) -> list[Line2D]:
    return [each for each in axes.lines if each.get_label() == label]


def test_outer_loops_stand_by_sheath_with_the_roots_of_the_statics(driven: Driven) -> None:
    own, every, _ = driven
    made = figures.loops(own, every)
    above, below = np.array(made.axes).reshape(2, 3)
    assert [each.get_title("left") for each in above] == [f"mu 0.1, {phi} rad, 20 um" for phi in (0, 1, 3)]
    slow = next(each for each in every if each.case == (FrictionCase(0.1, 3.0, 2e-5), 0.5, 0.0, np.radians(20.0)))
    (line,) = labelled(above[2], "0.5 Hz")
    np.testing.assert_allclose(x_of(line), np.degrees(slow.course.theta))
    np.testing.assert_allclose(y_of(line), slow.course.spool[..., 0] / 2.0)
    (wrist,) = labelled(above[2], "slowest, at the wrist")
    np.testing.assert_allclose(y_of(wrist), slow.course.wrist[..., 0] / 2.0)
    (lag,) = labelled(below[2], "0.5 Hz")
    np.testing.assert_allclose(y_of(lag), np.degrees(slow.course.theta - slow.unhindered))
    low, high = labelled(below[2], "roots of the statics")
    middle = y_of(high)[30] - y_of(low)[30]
    assert middle == pytest.approx(np.degrees(slow.exact_width))
    assert above[0].get_ylabel() == "tension of a + tendon [N]" and below[0].get_ylabel() == "angle less that [deg]"


def test_dead_bands_are_points_on_the_lines_of_the_statics(driven: Driven) -> None:
    own, _, bands = driven
    (axes,) = figures.dead_band(own, bands).axes
    lines = [each for each in axes.lines if str(each.get_label()).endswith("statics")]
    points = labelled(axes, "came to rest")
    assert len(lines) == len(points) == 3 and not labelled(axes, "came to rest, but slid too little")
    widths = np.degrees([each.width for each in bands if each.tendons.sheath == 1.0])
    (own_points,) = [each for each in points if each.get_color() == lines[2].get_color()]
    np.testing.assert_allclose(y_of(own_points), widths)
    assert "held spools" in axes.get_ylabel()


def test_works_are_drawn_over_speed_in_millijoules(driven: Driven) -> None:
    own, every, _ = driven
    (axes,) = figures.work(own, every).axes
    (line,) = labelled(axes, "mu 0.1, 1 rad, 20 um")
    np.testing.assert_allclose(x_of(line), [0.5, 2.0])
    mine = {e.case.frequency: e for e in every if e.case.tendons.sheath == 1.0 and e.case.low == 0.0}
    np.testing.assert_allclose(y_of(line), [1e3 * mine[each].friction_work for each in (0.5, 2.0)])
    drawn = [y_of(each) for each in axes.lines if each.get_color() == line.get_color()]
    np.testing.assert_allclose(drawn[1], [1e3 * mine[each].damped_work for each in (0.5, 2.0)])
    np.testing.assert_allclose(drawn[2], [1e3 * mine[each].raw_work for each in (0.5, 2.0)])
    assert axes.get_ylabel() == "work a cycle [mJ]" and axes.get_xscale() == axes.get_yscale() == "log"


def test_inner_loops_stand_beside_each_other_by_sheath_or_presliding(driven: Driven) -> None:
    own, every, _ = driven
    made = figures.minor_loops(own, every)
    assert [axes.get_title("left") for axes in made.axes] == [f"mu 0.1, {phi} rad, 20 um" for phi in (0, 1, 3)]
    inner = next(e for e in every if e.case == (FrictionCase(0.1, 0.0, 2e-5), 0.5, np.radians(5.0), np.radians(15.0)))
    (line,) = labelled(made.axes[0], "5 to 15 deg")
    np.testing.assert_allclose(y_of(line), inner.course.spool[..., 0] / 2.0)
    more = own.settings.model_copy(update={"preslidings": (1e-4, 5e-6), "frequencies": (2.0,)})
    wider = strokes(own.wrist, more)
    titles = [axes.get_title("left") for axes in figures.minor_loops(wider, loops(wider)).axes]
    assert titles == ["mu 0.1, 1 rad, 5 um", "mu 0.1, 1 rad, 100 um"]


@pytest.mark.parametrize(("what", "rows"), [("spools and tensions", 3), ("spools", 1), ("tensions", 1)])
def test_a_measured_loop_is_drawn_with_the_model_and_what_is_left_over(what: Measured, rows: int) -> None:
    problem = made_loop(FrictionCase(0.1, 1.0, 2e-5), 0, SHORT._replace(what=what))
    x = problem.begin()
    residuals = [m - e for m, e in zip(problem.measured, problem.expected([x])[0], strict=True)]
    made = drawn_beside(FrictionFit(problem, x, residuals, np.ones(rows), np.eye(len(x)), 0.0))
    left, right = np.array(made.axes).reshape(rows, 2).T
    for axes, residual, seen in zip(left, residuals, problem.measured, strict=True):
        measured, model = labelled(axes, "measured")[0], labelled(axes, "model, fitted")[0]
        scale = 1.0 if "tension" in axes.get_ylabel() else 180.0 / np.pi
        gap = y_of(measured) - y_of(model)
        np.testing.assert_allclose(gap, scale * residual, atol=1e-9)
        assert len(seen) == len(gap)
    np.testing.assert_allclose(y_of(right[0].lines[0]), np.degrees(residuals[0]))
    np.testing.assert_allclose(x_of(right[0].lines[0]), problem.loop.time[problem.first :])
    driver, scale = problem.loop.drive[problem.first :, 0], 1.0 if what == "tensions" else 1e3
    np.testing.assert_allclose(x_of(left[0].lines[0]), scale * driver)
    assert left[0].get_xlabel() == ("+ tension [N]" if what == "tensions" else "+ spool [mm]")
