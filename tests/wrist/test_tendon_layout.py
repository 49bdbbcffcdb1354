"""Layouts of tendons: places, moment arms against rigid geometry, and what is refused."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wristctl
from wristctl.arrays import Array
from wristctl.commands.compare.command import COMPARE
from wristctl.commands.perform import prepare
from wristctl.commands.tune.command import TUNE
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.planes import Asked, planes_of
from wristctl.study_files.error_messages import located
from wristctl.study_files.load import load_study, read_study
from wristctl.study_files.resolved import changed_yaml, resolved_yaml
from wristctl.wrist.directions import ACTIVE, DIRECTIONS
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace, off_both_sides, wound_by

WRIST = WristParameters()
THREE = TendonLayout.three(0.02, first=0.3)
INNER = TendonLayout((*THREE.places, TendonPlace(2.0, 0.015, ends_at=3), TendonPlace(4.0, 0.01, ends_at=4)))
LAYOUTS = {"three": THREE, "four": TendonLayout.four(0.02), "five": TendonLayout.five(0.02), "inner": INNER}


def path_lengths(layout: TendonLayout, bend: Array, length: float, discs: int) -> Array:
    """Lengths (T,) of straight tendons through the holes of discs that stand on one arc."""
    angle = float(np.hypot(*bend))
    toward = np.array([0.0, *(bend / angle)])
    out = np.zeros(len(layout.places))
    frames = []
    for k in range(discs):
        turned, arc = angle * k / (discs - 1), length / angle
        tangent = np.array([math.cos(turned), 0.0, 0.0]) + math.sin(turned) * toward
        along = np.array([-math.sin(turned), 0.0, 0.0]) + math.cos(turned) * toward
        frames.append((arc * np.array([math.sin(turned), *((1.0 - math.cos(turned)) * toward[1:])]), tangent, along))
    across = np.cross([1.0, 0.0, 0.0], toward)
    for t, (c, place) in enumerate(zip(layout.cross_section, layout.places, strict=True)):
        c_along, c_across = float(c @ toward[1:]), float(c @ across[1:])
        holes = [centre + c_along * along + c_across * across for centre, _, along in frames]
        last = place.ends_at or discs
        out[t] = sum(np.linalg.norm(b - a) for a, b in pairwise(holes[:last]))
    return out


@given(size=st.floats(1e-3, 1.5), toward=st.floats(0.0, math.tau), name=st.sampled_from(sorted(LAYOUTS)))
def test_moment_arms_are_how_fast_tendons_shorten_between_rigid_discs(size: float, toward: float, name: str) -> None:
    layout, bend, step = LAYOUTS[name], size * np.array([math.cos(toward), math.sin(toward)]), 1e-4
    by_bend = np.empty((len(layout.places), 2))
    for axis in range(2):
        nudge = step * np.eye(2)[axis]
        ahead, behind = (path_lengths(layout, bend + side * nudge, 0.08, 5) for side in (1.0, -1.0))
        by_bend[:, axis] = (behind - ahead) / (2.0 * step)
    assert layout.moment_arms(bend, 0.08, 5) == pytest.approx(by_bend, abs=2e-9)


def test_a_straight_wrist_is_bent_about_the_places_themselves() -> None:
    """A tendon that ends at disc 3 of 5 spans half of the wrist, and turns its end by half as much."""
    assert THREE.moment_arms((0.0, 0.0), 0.08, 5) == pytest.approx(THREE.cross_section, abs=1e-18)
    share = INNER.moment_arms((0.0, 0.0), 0.08, 5)[3:] / INNER.cross_section[3:]
    assert share == pytest.approx(np.array([[0.5, 0.5], [0.75, 0.75]]), abs=1e-12)


def test_arms_do_not_jump_where_their_series_ends() -> None:
    around = [LAYOUTS["four"].moment_arms((0.16 * factor, 0.0), 0.08, 5) for factor in (1 - 1e-9, 1 + 1e-9)]
    assert around[0] == pytest.approx(around[1], abs=1e-11)


def test_four_tendons_pull_where_the_anatomical_directions_say() -> None:
    arms = dict(zip(ACTIVE, LAYOUTS["four"].cross_section, strict=True))
    for direction in DIRECTIONS.values():
        axis = 0 if direction.plane == "ulnar" else 1
        for tendon, arm in arms.items():
            assert math.copysign(1.0, direction.sign * arm[axis]) == (1.0 if tendon in direction.tendons else -1.0)
            assert abs(arm[axis]) == pytest.approx(WRIST.tendon_offset, rel=1e-15)


def test_the_centre_tendon_of_five_bends_nothing() -> None:
    arms = LAYOUTS["five"].cross_section
    assert not arms[2].any() and np.array_equal(np.delete(arms, 2, axis=0), LAYOUTS["four"].cross_section)


def test_the_planar_wrist_is_two_places_of_two_tendons() -> None:
    pair = TendonLayout.pair_of_sides(WRIST.tendon_offset)
    assert pair.planes == 1 and pair.multiplicity.tolist() == [2, 2]
    assert np.array_equal(pair.cross_section, WRIST.tendon_offset * np.array([[1.0, 0.0], [-1.0, 0.0]]))


@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts_of_the_field_bend_in_two_planes(name: str) -> None:
    assert LAYOUTS[name].planes == 2


def test_tendons_end_after_whole_segments() -> None:
    assert INNER.ends(5, 4).tolist() == [4, 4, 4, 2, 3]
    assert THREE.ends(5, 1).tolist() == [1, 1, 1]
    assert TendonLayout((*THREE.places, TendonPlace(2.0, 0.015, ends_at=3))).ends(5, 2).tolist() == [2, 2, 2, 1]
    with pytest.raises(UserError, match="tendon 5 ends at disc 4 of 5, within one of 2 segments"):
        INNER.ends(5, 2)
    with pytest.raises(UserError, match="tendon 5 ends at disc 4 of 3"):
        INNER.ends(3, 2)


def places(*degrees: float, radius: float = 0.02) -> tuple[TendonPlace, ...]:
    return tuple(TendonPlace(math.radians(angle), radius) for angle in degrees)


@pytest.mark.parametrize(
    ("layout", "problem"),
    [
        (places(), "0 tendons off the axis"),
        (places(0, 120), "2 tendons off the axis"),
        (places(90, 270), "2 tendons off the axis"),
        (places(0, 120, radius=0.02) + places(0, radius=0.0), "2 tendons off the axis"),
        (places(10, 90, 170), "no tendon pulls toward 270 deg: there is none in 200 deg"),
        (places(0, 90, 180), "no tendon pulls toward 270 deg"),
        (places(0, 120, 240, 120), "tendons 2 and 4 are at one place"),
        (places(0, 120, 240, 480), "tendons 2 and 4 are at one place"),
        (places(0, 120) + places(math.nan), "tendon 3 is nowhere"),
        (places(0, 120) + places(240, radius=-0.01), "tendon 3 is nowhere"),
        ((*places(0, 120), TendonPlace(4.0, 0.02, ends_at=1)), "tendon 3 ends at disc 1"),
        ((*places(0, 120), TendonPlace(4.0, 0.02, multiplicity=0)), "tendon 3 stands for 0 tendons"),
    ],
)
def test_a_layout_that_cannot_hold_a_wrist_says_why(layout: tuple[TendonPlace, ...], problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        TendonLayout(layout)


def test_two_tendons_at_one_place_that_end_at_different_discs_are_two() -> None:
    layout = TendonLayout((*THREE.places, TendonPlace(THREE.places[1].angle, 0.02, ends_at=3)))
    assert layout.cross_section[1].tolist() == layout.cross_section[3].tolist()


def test_a_study_names_its_layout_or_lists_the_places() -> None:
    listed = (
        "wrist.tendons=[{angle_deg: 90}, {angle_deg: 210, radius: 0.01, ends_at: 3}, {angle_deg: 330, multiplicity: 2}]"
    )
    layout = TendonLayout.of(load_study([], ["wrist.tendon_radius=0.03", listed]).wrist)
    expected = [[0.0, 0.03], [-0.01 * math.sqrt(0.75), -0.005], [0.03 * math.sqrt(0.75), -0.015]]
    assert layout.cross_section == pytest.approx(np.array(expected), abs=1e-15)
    assert layout.multiplicity.tolist() == [1, 1, 2] and layout.shares(5).tolist() == [1.0, 0.5, 1.0]
    for name, count in (("three", 3), ("four", 4), ("five", 5), ("six", 6)):
        named = TendonLayout.of(load_study([], [f"wrist.tendons={name}"]).wrist)
        assert len(named.places) == count and named.cross_section.max() <= WRIST.tendon_radius
    assert TendonLayout.of(WRIST) == TendonLayout.four(WRIST.tendon_radius)


def test_a_list_of_places_is_written_out_as_it_was_read(tmp_path: Path) -> None:
    study = load_study(
        [], ["wrist.tendons=[{angle_deg: 0}, {angle_deg: 120, radius: 0.013}, {angle_deg: 240, ends_at: 4}]"]
    )
    for written in (resolved_yaml, changed_yaml):
        file = tmp_path / "config.yaml"
        file.write_text(written(study, "simulate"), encoding="utf-8")
        assert load_study([file]).wrist == study.wrist


def test_six_tendons_are_at_60_deg_from_each_other_the_first_toward_ulnar() -> None:
    angles = np.degrees([place.angle for place in TendonLayout.of(load_study([], ["wrist.tendons=six"]).wrist).places])
    assert angles == pytest.approx([0.0, 60.0, 120.0, 180.0, 240.0, 300.0], abs=1e-9)


@pytest.mark.parametrize("wrist", ["wrist=[{length: 0.04}, {length: 0.04}]", "wrist.sections=[{length: 0.04}]"])
def test_several_sections_in_series_are_refused_plainly(wrist: str) -> None:
    with pytest.raises(UserError) as refused:
        load_study([], [wrist])
    assert str(refused.value).startswith("several sections in series are not simulated - --set wrist")
    assert "one section from base to hand" in str(refused.value)


SQUARE = "[{angle_deg: 45}, {angle_deg: 135}, {angle_deg: 225}, {angle_deg: 315}]"


@pytest.mark.parametrize(
    "tendons", ["four", "five", SQUARE, SQUARE.replace("45", "405", 1)[:-1] + ", {angle_deg: 0, radius: 0}]"]
)
def test_one_plane_takes_two_sides_of_two_tendons(tendons: str) -> None:
    wrist = load_study([], [f"wrist.tendons={tendons}"]).wrist
    assert off_both_sides(wrist) is None and planes_of(wrist, [Asked(Loop(), Reference())]) == 1


@pytest.mark.parametrize(
    ("tendons", "odd"),
    [
        ("three", 1),
        ("six", 1),
        (SQUARE.replace("315", "320"), 4),
        (SQUARE.replace("135}", "135, radius: 0.019}"), 2),
        (SQUARE.replace("135}", "135, ends_at: 4}"), 2),
        (SQUARE.replace("135}", "135, multiplicity: 2}"), 2),
        ("[{angle_deg: 45}, {angle_deg: 135}, {angle_deg: 225}, {angle_deg: 315}, {angle_deg: 0}]", 5),
    ],
)
def test_other_layouts_bend_in_two_planes_and_commands_in_one_say_what_takes_them(tendons: str, odd: int) -> None:
    study = load_study([], [f"wrist.tendons={tendons}"])
    assert planes_of(study.wrist, [Asked(Loop(), Reference())]) == 2
    with pytest.raises(
        UserError, match=rf"tendon {odd} of this wrist is elsewhere .* bends this wrist in two"
    ) as ended:
        wristctl.audit(study)
    assert str(ended.value).startswith("paper audit judges the claims of the paper, whose wrist has four tendons")
    with pytest.raises(UserError, match=r"and the loop in one - .*: simulate\.loop\.planes - fix: loop\.planes"):
        wristctl.simulate(load_study([], [f"wrist.tendons={tendons}", "simulate.loop.planes=1"]))


def test_a_command_that_pulls_no_tendons_takes_any() -> None:
    study = load_study([], ["wrist.tendons=three", "gen-data={samples: 20}"])
    assert len(wristctl.gen_data(study).samples.inputs) == 20


@pytest.mark.parametrize("procedure", [TUNE, COMPARE])
def test_a_sweep_over_layouts_bends_each_in_its_own_planes(procedure: Any) -> None:
    study = load_study([], ["sweep=['wrist.tendons=four,three']"])
    assert "2 points" in prepare(procedure, study, Path("results")).plan()


@pytest.mark.parametrize(
    ("tendons", "problem"),
    [
        ("[{angle_deg: 45}, {angle_deg: 135}, {angle_deg: 270, radius: 0}]", "2 tendons off the axis"),
        (SQUARE.replace("315}", "225, ends_at: 5}"), "tendons 3 and 4 are at one place"),
        (SQUARE.replace("]", ", {angle_deg: 45, ends_at: 5}]"), "tendons 1 and 5 are at one place"),
        ("[{angle_deg: 0, multiplicity: 2}, {angle_deg: 180, multiplicity: 2}]", "tendon_radius: 0.02828"),
    ],
)
def test_what_no_command_bends_is_refused_with_what_would_do(tendons: str, problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        wristctl.simulate(load_study([], [f"wrist.tendons={tendons}"]))


def test_an_error_has_the_line_of_the_place(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    lines = [
        "wrist:",
        "  tendons:",
        "    - {angle_deg: 0}",
        "    - {angle_deg: 120}",
        "    - {angle_deg: 240, ends_at: 7}",
    ]
    file.write_text("\n".join(lines), encoding="utf-8")
    study, origins = read_study([file])
    with pytest.raises(UserError) as refused:
        TendonLayout.of(study.wrist)
    assert located(refused.value, origins).where == f"{file}:5: wrist.tendons.2"
    file.write_text("\n".join(lines).replace("240", "left"), encoding="utf-8")
    with pytest.raises(UserError, match=r"'left' should be a valid number .*study.yaml:5: wrist.tendons.2.angle_deg"):
        load_study([file])


@pytest.mark.parametrize(
    ("tendons", "wound"),
    [
        ("four", None), ("five", None), ("three", 3),
        ([{"angle_deg": 225}, {"angle_deg": 135}, {"angle_deg": 315}, {"angle_deg": 45}], None),
        ([{"angle_deg": 45}, {"angle_deg": 135}, {"angle_deg": 225}, {"angle_deg": 315}], 4),
        ([{"angle_deg": 225, "radius": 0.015}, {"angle_deg": 135}, {"angle_deg": 315}, {"angle_deg": 45}], 4),
        ([{"angle_deg": 0, "radius": 0}, {"angle_deg": 0}, {"angle_deg": 120}, {"angle_deg": 240}], 3),
    ],
)  # fmt: skip
def test_four_axes_wind_any_tendons_off_the_axis_in_their_order(tendons: Any, wound: int | None) -> None:
    """None: the paper's four, which the axes have had all along."""
    wrist = load_study([], [f"wrist.tendons={json.dumps(tendons)}"]).wrist
    layout = wound_by(wrist, 4)
    assert (layout and len(layout.places)) == wound
    if layout is not None:
        off_the_axis = [place for place in TendonLayout.of(wrist).places if place.radius > 0.0]
        assert list(layout.places) == off_the_axis


@pytest.mark.parametrize(
    ("tendons", "said"),
    [
        ("six", "6 tendons off its axis"),
        ([{"angle_deg": 0, "multiplicity": 2}, {"angle_deg": 120}, {"angle_deg": 240}], "two tendons at one place"),
        ([{"angle_deg": 0}, {"angle_deg": 180}], "in one plane"),
        ([{"angle_deg": 0, "ends_at": 3}, {"angle_deg": 120}, {"angle_deg": 240}], "ends inside the wrist"),
        ([{"angle_deg": 0, "multiplicity": 3}, {"angle_deg": 120}, {"angle_deg": 240}], "5 tendons off its axis"),
    ],
)
def test_what_four_axes_do_not_wind_one_by_one_is_refused(tendons: Any, said: str) -> None:
    with pytest.raises(UserError, match=said) as refused:
        wound_by(load_study([], [f"wrist.tendons={json.dumps(tendons)}"]).wrist, 4)
    assert "wrist.tendons" in str(refused.value) and refused.value.fix
