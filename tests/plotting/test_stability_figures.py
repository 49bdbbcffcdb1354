"""Figures of a linearised loop show what was found, in degrees, hertz and decades."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D

from tests.stability.conftest import PID, row
from wristctl.arrays import Array
from wristctl.commands.analyse.figures import bode, locus, portrait, sensitivity, step
from wristctl.config.loop import Loop
from wristctl.plotting.style import BLUE, VERMILLION
from wristctl.stability.loop_analysis import LoopAnalysis, RootLocus
from wristctl.stability.phase_portrait import Approach, PhasePortrait

TURN = 2.0 * math.pi


def _x(line: Line2D) -> Array:
    return np.asarray(line.get_xdata(), float)


def _y(line: Line2D) -> Array:
    return np.asarray(line.get_ydata(), float)


@pytest.fixture(scope="module")
def found() -> list[LoopAnalysis]:
    """A PID loop at two angles."""
    return [each for each in (row("pid", PID, Loop()).analysed(angle) for angle in (0.0, 0.3)) if each is not None]


@pytest.mark.slow
def test_the_bode_plot_has_each_angles_gain_and_phase_and_where_it_begins_to_oscillate(
    found: list[LoopAnalysis],
) -> None:
    gain, phase = bode(found, (0.0, 17.0), "pid").axes
    assert [line.get_label() for line in gain.lines if str(line.get_label()).startswith("at ")] == [
        "at 0 deg",
        "at 17 deg",
    ]
    first = found[0]
    drawn = first.omega / TURN >= 0.02
    np.testing.assert_allclose(_y(gain.lines[0]), np.abs(first.response[drawn]))
    np.testing.assert_allclose(
        np.exp(1j * np.radians(_y(phase.lines[0]))), (first.response / np.abs(first.response))[drawn]
    )
    limit, crossed = gain.lines[1], gain.lines[2]
    assert _x(limit)[0] == pytest.approx(500.0) and _y(limit)[0] == 1.0 / first.margins.most.value
    assert _x(crossed)[0] == pytest.approx(first.margins.gain_crossings[0].omega / TURN)
    assert (gain.get_xscale(), gain.get_yscale(), gain.get_title("left")) == ("log", "log", "pid")


def test_a_loop_that_feeds_nothing_back_is_shown_as_its_plant(found: list[LoopAnalysis]) -> None:
    still = replace(found[0], response=0.0 * found[0].response)
    gain, _ = bode([still], (0.0,), "plant").axes
    assert gain.get_ylabel() == "angle per torque [rad/(N m)]" and len(gain.lines) == 1
    np.testing.assert_allclose(_y(gain.lines[0])[0], abs(still.plant[still.omega / TURN >= 0.02][0]))


def test_sensitivities_add_up_to_one(found: list[LoopAnalysis]) -> None:
    (axes,) = sensitivity(found[:1], (0.0,)).axes
    own, other = (_y(line) for line in axes.lines[:2])
    assert own.max() == pytest.approx(found[0].margins.sensitivity.value, rel=1e-3)
    amplified = 1.0 / (1.0 + found[0].response[found[0].omega / TURN >= 0.02])
    np.testing.assert_allclose(other, np.abs(1.0 - amplified))


def test_steps_are_drawn_where_loops_are_stable_until_they_have_settled(found: list[LoopAnalysis]) -> None:
    bad = replace(found[1], margins=replace(found[1].margins, stable=False))
    (axes,) = step([found[0], bad], (0.0, 17.0)).axes
    assert len(axes.lines) == 2  # one course, and where it should end
    assert axes.get_xlim()[1] >= 2.0 * found[0].step.settling
    np.testing.assert_array_equal(_y(axes.lines[0]), found[0].step.angle)


def test_poles_are_drawn_by_growth_and_frequency_and_those_of_the_loop_as_it_is_are_ringed() -> None:
    factors = np.geomspace(0.1, 10.0, 5)
    poles = [np.array([[-10.0 + 3.0 * k, 2.0 * k], [-40.0, 0.0]]) for k in range(5)]
    made = locus(RootLocus("Kp", factors, poles, 0.0, 5.0, (math.nan, 6.0)))
    axes = made.axes[0]
    every, own = axes.collections
    assert len(np.asarray(every.get_offsets())) == 10 and axes.get_title("left") == "Root locus over Kp"
    np.testing.assert_allclose(np.asarray(own.get_offsets()), poles[2])
    np.testing.assert_allclose(np.asarray(every.get_array()), np.repeat(np.log10(factors), 2))
    assert axes.get_xlim()[0] < -40.0 < 2.0 < axes.get_xlim()[1]


def test_a_course_is_reaching_until_it_is_in_the_layer_for_good() -> None:
    time = 0.1 * np.arange(5.0)
    error = np.radians([4.0, 3.0, 2.0, 1.0, 0.0])
    courses = [Approach(time, error, -error, error, 0.2), Approach(time, -error, error, -error, math.nan)]
    made = portrait(PhasePortrait(2.0, math.radians(1.0), courses))
    axes = made.axes[0]
    first, second = [each for each in axes.collections if isinstance(each, LineCollection)][:2]
    assert np.array_equal(np.array(first.get_color()), [to_rgba(each) for each in (VERMILLION, BLUE, BLUE, BLUE)])
    assert (np.array(second.get_color()) == to_rgba(VERMILLION)).all()
    np.testing.assert_allclose(np.asarray(first.get_segments()[0]), [[4.0, -4.0], [3.0, -3.0]])
    surface = next(line for line in axes.lines if str(line.get_label()).startswith("sliding"))
    np.testing.assert_allclose(_y(surface), -2.0 * _x(surface))
