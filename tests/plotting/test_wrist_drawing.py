"""The drawn wrist is the model's: arcs, straight tendons, discs across the backbone."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.text import Annotation

from wristctl.config.wrist import WristParameters
from wristctl.plotting.wrist_drawing import RIM, directions, draw_wrist, stroboscope
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.directions import DIRECTIONS, TENDONS
from wristctl.wrist.kinematics import arcs_backbone, chain_tip, discs, offset_points

WRIST = WristParameters()
L, C = WRIST.length, WRIST.tendon_offset


@pytest.mark.parametrize("angles", [[0.0], [0.7], [-1e-9], [0.3, -0.2, 0.5, 0.1], [1.0, 1.0, 1.0]])
def test_last_disc_sits_at_the_tip_and_stands_across_it(angles: list[float]) -> None:
    theta = np.array(angles)
    centres, normals = discs(arcs_backbone, theta, WRIST)
    x, y = chain_tip(theta[None], L)[0]
    assert centres[-1] == pytest.approx(x + 1j * y, abs=1e-15)
    assert normals[-1] == pytest.approx(np.exp(1j * theta.sum()))
    assert centres[0] == 0.0 and normals[0] == 1.0


def test_backbone_keeps_its_length_and_its_tangent() -> None:
    theta = np.array([0.3, -0.2, 0.5, 0.1])
    at = np.linspace(0.0, L, 4001)
    points, tangents = arcs_backbone(WRIST, theta, at)
    steps = np.diff(points)
    assert np.abs(steps).sum() == pytest.approx(L, rel=1e-6)
    assert np.abs(steps / np.abs(steps) - tangents[:-1]).max() < 1e-3


@pytest.mark.parametrize("theta", [0.6, -0.4])
def test_drawn_tendons_have_the_models_length(theta: float) -> None:
    frames = discs(arcs_backbone, np.array([theta]), WRIST)
    for sign in (1, -1):
        drawn = np.abs(np.diff(offset_points(frames, sign * C))).sum()
        assert drawn == pytest.approx(2 * 4 * (L / theta - sign * C) * np.sin(theta / 8), rel=1e-12)


def test_pulling_tendons_are_those_of_the_paper_and_lie_on_the_side_of_the_bend() -> None:
    pulled = {each.name: each.tendons for each in DIRECTIONS.values()}
    assert pulled == {"ulnar": (4, 5), "radial": (1, 2), "flexion": (2, 5), "extension": (1, 4)}
    for each in DIRECTIONS.values():
        axis = 0 if each.plane == "ulnar" else 1
        assert all(TENDONS[number][axis] == each.sign for number in each.tendons)


def test_hand_without_an_offset_is_left_out() -> None:
    shown, hidden = (directions(WRIST.model_copy(update={"hand_offset": h})) for h in (0.06, 0.0))
    assert len(shown.axes[0].patches) > len(hidden.axes[0].patches)


def test_stroboscope_shows_the_move_from_start_to_rest(course: Callable[..., Trajectory]) -> None:
    made = stroboscope(course("smc/tuned", tau=0.3), WRIST, count=4)
    ticks = made.axes[1].get_yticks()
    assert len(ticks) == 4 and ticks[0] == 0.0
    assert ticks[-1] == pytest.approx(0.3 * np.log(50.0), abs=0.025)


def test_stroboscope_of_a_diverging_move_shows_what_is_known(course: Callable[..., Trajectory]) -> None:
    made = stroboscope(course("smc/tuned", diverges=True), WRIST)
    assert 0.0 < made.axes[1].get_yticks()[-1] < 2.0


def test_stroboscope_of_a_wrist_that_stays_still_covers_the_whole_time(course: Callable[..., Trajectory]) -> None:
    moved = course("smc/printed")
    still = dataclasses.replace(moved, theta=0.0 * moved.theta, segment_theta=0.0 * moved.segment_theta)
    assert stroboscope(still, WRIST).axes[1].get_yticks()[-1] == pytest.approx(moved.time[-1])


def lines(axes: Axes) -> list[np.ndarray]:
    """Each line of a drawing as complex positions x + iy [m], x up and y to the right."""
    return [1e-3 * (np.asarray(each.get_ydata()) + 1j * np.asarray(each.get_xdata())) for each in axes.lines]


def outlines(axes: Axes) -> list[np.ndarray]:
    """The same of filled parts: the hand's, then the discs, then what holds the base."""
    parts = [np.asarray(each.get_xy()) for each in axes.patches if isinstance(each, Polygon)]
    return [1e-3 * (each[:-1, 1] + 1j * each[:-1, 0]) for each in parts]


def drawn(theta: float, pulling: int = 0, edge_on: bool = False) -> Axes:
    axes = Figure().subplots()
    draw_wrist(axes, np.array([theta]), WRIST, pulling, edge_on)
    return axes


def test_springs_backbone_and_tendons_run_from_disc_to_disc_and_from_end_to_end() -> None:
    centres, normals = discs(arcs_backbone, np.array([0.6]), WRIST)
    *springs, backbone, plus, minus = lines(drawn(0.6))
    assert len(springs) == 3 * 4
    for at, offset in enumerate((-C, 0.0, C)):
        ends = centres + 1j * offset * normals
        for k, spring in enumerate(springs[4 * at : 4 * at + 4]):
            assert spring[[0, -1]] == pytest.approx(ends[[k, k + 1]])
            across = ((spring - spring[0]) / (spring[-1] - spring[0])).imag * abs(spring[-1] - spring[0])
            assert 0.1 * C < abs(across).max() < 0.2 * C, "a coil is narrower than the room between springs"
    assert backbone[[0, -1]] == pytest.approx(centres[[0, -1]]) and len(backbone) > 50
    assert plus == pytest.approx(centres + 1j * C * normals)
    assert minus == pytest.approx(centres - 1j * C * normals)


@pytest.mark.parametrize("pulling", [1, -1, 0])
def test_tendons_that_pull_stand_out(pulling: int) -> None:
    plus, minus = drawn(0.5, pulling).lines[-2:]
    thin = min(plus.get_linewidth(), minus.get_linewidth())
    assert [each.get_linewidth() > thin for each in (plus, minus)] == [pulling == 1, pulling == -1]
    assert (plus.get_color() == minus.get_color()) == (pulling == 0)


def test_discs_are_plates_that_hold_all_tendons_and_stand_across_the_backbone() -> None:
    centres, normals = discs(arcs_backbone, np.array([0.6]), WRIST)
    plates = outlines(drawn(0.6))[-6:-1]
    for plate, centre, normal in zip(plates, centres, normals, strict=True):
        own = (plate - centre) / normal
        low, high = np.min([own.real, own.imag], axis=1), np.max([own.real, own.imag], axis=1)
        assert low == pytest.approx(-high), "the disc's centre is the plate's"
        assert high[1] == pytest.approx(RIM * WRIST.tendon_radius) and 1.0 < RIM < 1.5
        assert high[0] < 0.25 * high[1] and 2.0 * high[0] < L / 8.0
        assert {(round(one.real / high[0]), round(one.imag / high[1])) for one in own} == {
            (-1, -1), (1, -1), (1, 1), (-1, 1),
        }  # fmt: skip
        steps = np.abs(np.diff(own, append=own[:1]))
        assert steps == pytest.approx(np.tile([2.0 * high[0], 2.0 * high[1]], 2)), "its outline does not cross itself"


def test_the_base_is_clamped_below_the_first_disc_in_something_wider() -> None:
    *_, first, _, _, _, _, clamp = outlines(drawn(0.6))
    assert clamp.real.max() <= first.real.min() + 1e-9 and clamp.real.max() > -0.1 * L
    assert clamp.imag.max() == pytest.approx(-clamp.imag.min())
    assert 1.5 < clamp.imag.max() / first.imag.max() < 3.0


@pytest.mark.parametrize("theta", [0.0, 0.6, -0.6])
def test_the_hand_goes_on_where_the_last_disc_ends(theta: float) -> None:
    centres, normals = discs(arcs_backbone, np.array([theta]), WRIST)
    own = np.concatenate([(each - centres[-1]) / normals[-1] for each in outlines(drawn(theta))[:-6]])
    assert own.real.min() == pytest.approx(0.0, abs=0.001) and own.real.max() == pytest.approx(0.12, rel=0.1)
    assert abs(own.imag).max() < 0.06


def test_the_hand_is_seen_on_the_palm_unless_edge_on() -> None:
    assert len(outlines(drawn(0.0))) == 6 + 6 and len(outlines(drawn(0.0, edge_on=True))) == 3 + 6


def test_directions_are_drawn_at_30_deg_to_their_own_side_with_their_tendons() -> None:
    made = directions(WRIST)
    above, below = np.array(made.axes).reshape(2, 4)
    for panel, section, each in zip(above, below, DIRECTIONS.values(), strict=True):
        first, second = each.tendons
        said = f"{each.name}, {30 * each.sign:+d} deg\ntendons {first} and {second} pull"
        assert panel.get_title("left") == said
        theta = np.radians(30.0 * each.sign)
        (x, y) = chain_tip(np.array([[theta]]), L)[0]
        *_, backbone, _, _ = lines(panel)
        assert backbone[-1] == pytest.approx(x + 1j * y) and y * each.sign > 0.0
        pulled, other = (panel.lines[-2], panel.lines[-1])[:: each.sign]
        assert pulled.get_linewidth() > other.get_linewidth()
        assert len(outlines(panel)) == (3 if each.plane == "flexion" else 6) + 6
        assert panel.get_xlabel() == f"y [mm], + {each.plane}" and section.get_xlabel() == "X [mm], + ulnar"
    labels = [panel.get_ylabel() for panel in made.axes]
    assert labels == ["x [mm]", "", "", "", "Y [mm], + flexion", "", "", ""]


def test_directions_show_the_whole_wrist_and_mirror_each_other() -> None:
    panels = directions(WRIST).axes[:4]
    for panel in panels:
        (left, right), (low, high) = panel.get_xlim(), panel.get_ylim()
        assert left < right and low < high
        everything = 1e3 * np.concatenate([*lines(panel), *outlines(panel)[:-1]])
        assert left < everything.imag.min() and everything.imag.max() < right
        assert low < everything.real.min() and everything.real.max() < high
        assert np.ptp(everything.imag) > 0.6 * (right - left) and np.ptp(everything.real) > 0.7 * (high - low)
    for plus, minus in (panels[:2], panels[2:]):
        assert plus.get_xlim() == pytest.approx(tuple(-np.array(minus.get_xlim())[::-1]))


def test_sections_number_the_tendons_fill_those_that_pull_and_point_to_where_they_bend() -> None:
    for section, each in zip(directions(WRIST).axes[4:], DIRECTIONS.values(), strict=True):
        rim, *circles = section.patches
        assert isinstance(rim, Circle) and rim.radius == pytest.approx(1e3 * RIM * WRIST.tendon_radius)
        numbers = {text.get_text(): text for text in section.texts if text.get_text()}
        assert set(numbers) == {str(number) for number in TENDONS}
        for circle, (number, place) in zip(circles, TENDONS.items(), strict=True):
            assert isinstance(circle, Circle) and 0.1 < circle.radius / rim.radius < 0.3
            assert circle.center == pytest.approx(tuple(1e3 * C * np.array(place)))
            assert numbers[str(number)].get_position() == pytest.approx(circle.center)
            assert (circle.get_facecolor() != (1.0, 1.0, 1.0, 1.0)) == (number in each.tendons)
        (arrow,) = (text for text in section.texts if not text.get_text())
        assert isinstance(arrow, Annotation)
        axis = 0 if each.plane == "ulnar" else 1
        tip, tail = np.array(arrow.xy), np.array(arrow.xyann)
        assert tip[1 - axis] == tail[1 - axis] == 0.0
        assert each.sign * tip[axis] > each.sign * tail[axis] > rim.radius
        assert abs(tip[axis]) < section.get_xlim()[1] == section.get_ylim()[1] == -section.get_xlim()[0]


def test_stroboscope_draws_the_wrist_at_its_instants_and_the_paths_of_its_tip(
    course: Callable[..., Trajectory],
) -> None:
    one = course("smc/tuned")
    axes = stroboscope(one, WRIST).axes[0]
    instants = np.searchsorted(one.time, stroboscope(one, WRIST).axes[1].get_yticks() - 1e-9)
    assert len(instants) == 7
    *wrists, tip, desired = lines(axes)
    for at, own in zip(instants, np.array_split(np.arange(len(wrists)), 7), strict=True):
        backbone, *plates = (wrists[k] for k in own)
        centres, normals = discs(arcs_backbone, one.segment_theta[at], WRIST)
        assert backbone[[0, -1]] == pytest.approx(centres[[0, -1]], abs=1e-12)
        for plate, centre, normal in zip(plates, centres, normals, strict=True):
            half = RIM * WRIST.tendon_radius
            assert (plate - centre) / normal == pytest.approx([-1j * half, 1j * half])
    assert tip == pytest.approx(one.tip @ [1.0, 1.0j])
    assert desired == pytest.approx(one.tip_desired @ [1.0, 1.0j])
    assert [each.get_label() for each in axes.lines[-2:]] == ["tip", "desired tip"]
    assert all(each.get_markevery() == [-1] for each in axes.lines[-2:]), "a mark where they end"
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title("left")) == ("y [mm]", "x [mm]", "smc/tuned")


def test_stroboscope_tells_the_time_by_colour(course: Callable[..., Trajectory]) -> None:
    axes, bar = stroboscope(course("smc/tuned"), WRIST).axes
    low, high = bar.get_ylim()
    assert low == 0.0 and high == pytest.approx(bar.get_yticks()[-1]) and bar.get_ylabel() == "time [s]"
    colours = list(dict.fromkeys(str(each.get_color()) for each in axes.lines[:-2]))
    assert len(colours) == 7


def test_stroboscope_of_a_wrist_that_stays_bent_covers_the_whole_time(course: Callable[..., Trajectory]) -> None:
    moved = course("smc/printed")
    bent = dataclasses.replace(moved, theta=0.0 * moved.theta + 0.4, segment_theta=0.0 * moved.segment_theta + 0.1)
    assert stroboscope(bent, WRIST).axes[1].get_yticks()[-1] == pytest.approx(moved.time[-1])
