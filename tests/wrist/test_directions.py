"""The four directions: what the paper assumes of them, and where it ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.comparison.combinations import compare
from wristctl.config.wrist import WristParameters
from wristctl.study_files.load import load_study
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, TENDONS, Direction, in_plane, tendons_of, toward_words

SETTINGS = (
    "controllers=[{controller: computed-torque, gains: default}]", "inverses=[none]", "horizon=0.8",
    "loops={four-segments: {planes: 1}}", "references=[{duration: 0.5}]",
    "directions=[ulnar, radial, flexion, extension]",
)  # fmt: skip


def courses(*settings: str) -> dict[str, np.ndarray]:
    found = compare(load_study([], [*SETTINGS, *settings], "compare"))
    return {r.reference.split(", ")[1]: r.simulation.trajectory.theta for r in found}


def test_upright_all_four_directions_are_the_same_move() -> None:
    """The symmetry that the paper assumes."""
    theta = courses()
    np.testing.assert_array_equal(theta["ulnar"], theta["flexion"])
    np.testing.assert_array_equal(theta["radial"], theta["extension"])
    np.testing.assert_allclose(theta["ulnar"], -theta["radial"], rtol=0, atol=1e-13)
    assert theta["ulnar"][-1] > 0.5


def test_gravity_across_breaks_the_symmetry_in_its_own_plane_only() -> None:
    theta = courses("wrist.gravity=[0.0, 0.0]", "wrist.gravity_flexion=9.81")
    np.testing.assert_allclose(theta["ulnar"], -theta["radial"], rtol=0, atol=1e-13)
    assert np.abs(theta["flexion"] + theta["extension"]).max() > 1e-5


def test_each_plane_sees_its_own_gravity() -> None:
    wrist = WristParameters(gravity=(-9.0, 2.0), gravity_flexion=3.0)
    assert in_plane(wrist, "radial").gravity == (-9.0, 2.0) and in_plane(wrist, "extension").gravity == (-9.0, 3.0)
    assert in_plane(in_plane(wrist, "flexion"), "flexion") == wrist


def test_each_plane_has_its_own_stiffness() -> None:
    """A wrist that is believed stiffer toward flexion moves there as one that is stiffer everywhere."""
    uneven, stiff = (
        courses("wrist.flexion_ratio=1.25"),
        courses(f"wrist.stiffness={1.25 * WristParameters().stiffness}"),
    )
    even = courses()
    for plane, same in (("ulnar", even), ("radial", even), ("flexion", stiff), ("extension", stiff)):
        np.testing.assert_array_equal(uneven[plane], same[plane])
    assert in_plane(WristParameters(flexion_ratio=0.8), "flexion").flexion_ratio == 1.25


@given(st.floats(0.2, 5.0), st.floats(-90.0, 90.0), st.sampled_from(list(DIRECTIONS.values())))
def test_springs_along_an_oblique_axis_are_as_each_plane_alone_meets_them(
    ratio: float, axis: float, seen: Direction
) -> None:
    """The diagonal of the stiffness whose principal axes are turned."""
    c, s = np.cos(np.radians(axis)), np.sin(np.radians(axis))
    turn, springs = np.array([[c, -s], [s, c]]), np.diag([0.6, 0.6 * ratio])
    of_ulnar, of_flexion = np.diag(turn @ springs @ turn.T)
    own, other = (of_ulnar, of_flexion) if seen.plane == "ulnar" else (of_flexion, of_ulnar)
    wrist = WristParameters(stiffness=0.6, flexion_ratio=ratio, stiffness_axis_deg=axis)
    met = in_plane(wrist, seen.name)
    assert (met.stiffness, met.flexion_ratio) == pytest.approx((own, other / own))
    assert met.stiffness_axis_deg == 0.0


@pytest.mark.parametrize("each", DIRECTIONS.values(), ids=lambda d: d.name)
def test_tendons_that_pull_lie_on_the_side_of_the_bend(each: Direction) -> None:
    axis = 0 if each.plane == "ulnar" else 1
    assert all(TENDONS[number][axis] == each.sign for number in each.tendons)


def test_each_plane_has_the_four_tendons_off_the_centre_on_their_sides() -> None:
    assert ACTIVE == (1, 2, 4, 5)
    for plane, axis in (("ulnar", 0), ("flexion", 1)):
        assert sorted(tendons_of(plane)) == list(ACTIVE)
        assert [TENDONS[tendon][axis] for tendon in tendons_of(plane)] == [1, 1, -1, -1]


@pytest.mark.parametrize(
    ("angle_deg", "words"),
    [(0.0, "ulnar"), (90.0, "flexion"), (180.0, "radial"), (-90.0, "extension"), (360.0, "ulnar"), (1e-9, "ulnar"),
     (30.0, "30 deg from ulnar"), (-28.53, "-28.5 deg from ulnar")],
)  # fmt: skip
def test_a_direction_along_a_plane_has_its_anatomical_name(angle_deg: float, words: str) -> None:
    assert toward_words(angle_deg) == f"toward {words}"
