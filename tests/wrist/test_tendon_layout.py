"""Layouts of tendons: places, moment arms against rigid geometry, and what is refused."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.directions import ACTIVE, DIRECTIONS
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

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
