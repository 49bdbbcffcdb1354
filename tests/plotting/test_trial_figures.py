"""Figures of trials show each direction's courses, in degrees and newtons, with their simulation and their push."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.commands.hw_run import figures as trial_figures
from wristctl.commands.hw_run.figures import (
    DIRECTIONS,
    Course,
    LoggedTrial,
    bends_over_time,
    errors,
    lateness,
    paths,
    tensions,
)
from wristctl.config.hw_run import HwRunSettings
from wristctl.simulation.trajectory import Trajectory


@pytest.fixture
def trial(course: Callable[..., Trajectory]) -> Callable[..., LoggedTrial]:
    def made(direction: str = "flexion", repetition: int = 0, push: tuple[float, float] | None = None) -> LoggedTrial:
        one = course("smc/exchanged", network_error=0.02)
        bend, ref, wanted = (angle[:, None] for angle in (one.theta, one.theta_ref, one.theta_desired))
        simulated = Course(1.1 * one.time, 0.9 * bend, 0.1 * bend)
        pulls = {"tendons that pull": one.tension[:, 0], "tendons that hold against": one.tension[:, 1] + 1.0}
        return LoggedTrial(
            direction, one.label, repetition, ("flexion",), one.time, bend, ref, wanted, pulls, simulated, push=push
        )

    return made


def named(axes: Axes, label: str) -> list[Line2D]:
    return [each for each in axes.lines if each.get_label() == label]


def shown(made: Figure) -> list[str]:
    return [axes.get_title("left") for axes in made.axes if axes.get_visible()]


Maker = Callable[..., LoggedTrial]
Drawing = Callable[[Sequence[LoggedTrial], str], Figure]


def test_angles_are_in_degrees_beside_what_was_wanted_and_simulated(trial: Maker) -> None:
    one = trial()
    made = bends_over_time([one], "Trials")
    (axes,) = made.axes
    for label, time, angle in (
        ("smc/exchanged", one.time, one.bend[:, 0]),
        ("desired", one.time, one.wanted[:, 0]),
        ("smc/exchanged, simulated", 1.1 * one.time, 0.9 * one.bend[:, 0]),
    ):
        (line,) = named(axes, label)
        np.testing.assert_array_equal(line.get_xdata(), time)
        np.testing.assert_allclose(np.asarray(line.get_ydata()), np.degrees(angle))
    assert (made.get_supylabel(), axes.get_xlabel()) == ("bending angle [deg]", "time [s]")
    assert made.get_suptitle() == "Trials"


def test_errors_are_angle_less_reference_in_degrees_around_zero(trial: Maker) -> None:
    one = trial()
    made = errors([one])
    (axes,) = made.axes
    measured, simulated = (one.bend - one.bend_ref)[:, 0], 0.1 * one.bend[:, 0]
    for label, error in (("smc/exchanged", measured), ("smc/exchanged, simulated", simulated)):
        (line,) = named(axes, label)
        np.testing.assert_allclose(np.asarray(line.get_ydata()), np.degrees(error))
    assert [0.0, 0.0] in [list(np.asarray(each.get_ydata())) for each in axes.lines]
    assert made.get_supylabel() == "error [deg]"


def test_tensions_are_those_of_the_side_that_pulls_and_of_the_other(trial: Maker) -> None:
    one = trial()
    made = tensions([one])
    (axes,) = made.axes
    pulls, holds = axes.lines
    assert (pulls.get_label(), holds.get_label()) == ("tendons that pull", "tendons that hold against")
    np.testing.assert_array_equal(pulls.get_ydata(), one.tension["tendons that pull"])
    np.testing.assert_array_equal(holds.get_ydata(), one.tension["tendons that hold against"])
    assert pulls.get_color() != holds.get_color() and made.get_supylabel() == "tension [N]"


def test_a_simulation_is_drawn_once_beside_the_first_repetition(trial: Maker) -> None:
    again = [trial(repetition=k) for k in range(3)]
    for draw in (bends_over_time, errors):
        (axes,) = draw(again).axes
        assert len(named(axes, "smc/exchanged")) == 3 and len(named(axes, "smc/exchanged, simulated")) == 1
        alone = draw([again[1]]).axes[0], draw([replace(again[0], simulated=None)]).axes[0]
        assert not any(named(each, "smc/exchanged, simulated") for each in alone)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("draw", [bends_over_time, errors, tensions])
def test_each_direction_has_its_panel_in_the_papers_order(trial: Maker, draw: Drawing, count: int) -> None:
    names = DIRECTIONS[-count:]
    made = draw([trial(each) for each in reversed(names)], "")
    assert shown(made) == list(names)
    made.draw_without_rendering()
    below = [axes for axes in made.axes if axes.get_visible()][-2:]
    assert all(axes.get_xlabel() == "time [s]" for axes in below)
    assert all(any(label.get_text() for label in axes.get_xticklabels()) for axes in below)
    others = [axes for axes in made.axes if axes.get_visible()][:-2]
    assert not any(axes.get_xlabel() for axes in others)
    columns = {round(axes.get_position().x0, 2) for axes in made.axes}
    assert len(columns) == min(2, count), "two beside each other at most"


def test_four_panels_are_no_taller_each_than_two(trial: Maker) -> None:
    tall = [errors([trial(each) for each in DIRECTIONS[:count]]).get_figheight() for count in (2, 3, 4)]
    assert tall[0] < tall[1] == tall[2] < 2.0 * tall[0]


def test_a_push_is_shaded_in_its_own_direction_from_its_beginning_to_its_end(trial: Maker) -> None:
    pushed = [trial("flexion", k, (2.0, 2.5)) for k in range(2)]
    made = errors([*pushed, trial("radial"), trial("ulnar", push=(1.0, 1.2))])
    spans = {axes.get_title("left"): axes.patches for axes in made.axes if axes.get_visible()}
    assert [len(each) for each in spans.values()] == [1, 0, 1], "once however often it was repeated"
    (span,) = spans["flexion"]
    assert (span.get_x(), span.get_width()) == pytest.approx((2.0, 0.5))  # type: ignore[attr-defined]
    assert span.get_label() == "push"
    assert spans["ulnar"][0].get_x() == pytest.approx(1.0)  # type: ignore[attr-defined]


def test_a_legend_names_each_course_once(trial: Maker) -> None:
    made = bends_over_time([trial(each, k, (2.0, 2.5)) for each in DIRECTIONS for k in range(2)])
    (legend,) = made.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert sorted(names) == ["desired", "push", "smc/exchanged", "smc/exchanged, simulated"]


def in_two(trial: Maker, direction: str = "dart-thrower") -> LoggedTrial:
    """The same toward ulnar, and twice as far toward flexion; truly a tenth further."""
    one = trial(direction)
    both: dict[str, np.ndarray] = {
        name: getattr(one, name) * np.array([1.0, 2.0]) for name in ("bend", "bend_ref", "wanted")
    }
    true = Course(one.time, 1.1 * both["bend"], 1.1 * both["bend"] - both["bend_ref"])
    return replace(one, planes=("ulnar", "flexion"), simulated=None, true=true, **both)  # type: ignore[arg-type]


def test_in_two_planes_each_motion_has_a_panel_for_each_plane_with_its_true_course(trial: Maker) -> None:
    one, other = in_two(trial), in_two(trial, "circumduction")
    made = errors([one, other])
    assert shown(made) == [
        f"{name}, toward {plane}" for name in (one.direction, other.direction) for plane in ("ulnar", "flexion")
    ]
    for plane, axes in enumerate(made.axes[:2]):
        (line,), (true,) = named(axes, "smc/exchanged"), named(axes, "true")
        np.testing.assert_allclose(np.asarray(line.get_ydata()), np.degrees(one.bend - one.bend_ref)[:, plane])
        np.testing.assert_allclose(
            np.asarray(true.get_ydata()), np.degrees(1.1 * one.bend - one.bend_ref)[:, plane], atol=1e-9
        )
    assert shown(tensions([one])) == ["dart-thrower"], "tendons are of both planes"


def test_paths_are_drawn_in_the_plane_of_bends_within_what_is_in_reach(trial: Maker) -> None:
    one, reach = in_two(trial), np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]])
    (axes,) = paths([one], reach, "smc").axes
    drawn = {line.get_label(): np.asarray(line.get_xydata()) for line in axes.lines}
    for label, bends in (("in reach", reach), ("measured", one.bend), ("wanted", one.wanted), ("true", 1.1 * one.bend)):
        np.testing.assert_allclose(drawn[label], np.degrees(bends))


@pytest.mark.parametrize(("latest", "end"), [(2e-3, 5.0), (8e-3, 8.0)])
def test_lateness_counts_every_tick_in_ms_up_to_a_period_or_the_latest(latest: float, end: float) -> None:
    late = np.append(np.linspace(0.0, 1e-3, 99), latest)
    (axes,) = lateness(late, 5e-3).axes
    bars = [(bar.get_x(), bar.get_width(), bar.get_height()) for bar in axes.patches]  # type: ignore[attr-defined]
    assert sum(height for _, _, height in bars) == 100
    assert bars[0][0] == pytest.approx(0.0, abs=1e-12) and bars[-1][0] + bars[-1][1] == pytest.approx(end)
    assert sum(height for x, _, height in bars if x < 1.0) == 99 and len(bars) > 40
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("from due to begun [ms]", "ticks [1]")
    assert axes.get_yscale() == "log"


@pytest.mark.parametrize("trial_number", [0, 1])
def test_what_is_true_is_drawn_while_a_bend_is_asked_for_and_not_beyond(trial_number: int) -> None:
    """The emulated rig goes on for some milliseconds after the last tick."""
    time = np.linspace(0.0, 1.0, 11)
    log = pd.DataFrame({"trial": trial_number, "time": time, "theta": time, "theta_ref": time, "theta_desired": time})
    log = log.assign(**{f"tension_{number}": 2.0 + number for number in (1, 2, 4, 5)})
    later = np.linspace(0.0, 1.5, 16)
    truth = pd.concat(pd.DataFrame({"trial": number, "time": later, "theta": later + 0.1}) for number in (0, 1, 2))
    record = {"trial": trial_number, "direction": "flexion", "label": "a/b", "repetition": 0, "push": 0.0}
    twin: Any = SimpleNamespace(trajectory=SimpleNamespace(time=time, bend=time[:, None], bend_ref=time[:, None]))
    made = trial_figures._course(record, log, truth, HwRunSettings(), None, {trial_number: twin})
    assert made.true is not None and made.true.time.max() == 1.0
    np.testing.assert_allclose(made.true.error, 0.1)
