"""Allocation of pulls in two planes: limits, torque, least sum, against linear programs and closed forms."""

from __future__ import annotations

import math
import os
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.linalg import block_diag
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.wrist.allocation import allocated
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

POSES = 10_000 if os.environ.get("WRISTCTL_THOROUGH") else 100
CHUNK = 100
LENGTH, DISCS, RADIUS, LEAST, GREATEST = 0.08, 5, 0.02, 2.0, 60.0
OFFSET = RADIUS / math.sqrt(2.0)


def on_circle(*degrees: float, ends_at: int | None = None) -> tuple[TendonPlace, ...]:
    return tuple(TendonPlace(math.radians(angle), RADIUS, ends_at) for angle in degrees)


def grid() -> TendonLayout:
    """Six tendons in two straight rows: the arms of three at a time end on one line."""
    corners = product((-0.014, 0.014), (-0.014, 0.0, 0.014))
    return TendonLayout(tuple(TendonPlace(math.atan2(z, y), math.hypot(y, z)) for y, z in corners))


LAYOUTS = {
    "three": TendonLayout.three(RADIUS),
    "four": TendonLayout.four(RADIUS),
    "five": TendonLayout.five(RADIUS),
    "six": TendonLayout(on_circle(0, 60, 120, 180, 240, 300)),
    "grid": grid(),
    "uneven": TendonLayout((*on_circle(10, 100, 230, 300), *on_circle(45, 170, ends_at=3))),
}
FINE: Any = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
NAMES = st.sampled_from(sorted(LAYOUTS))


def drawn(name: str, count: int, seed: int) -> tuple[Array, Array]:
    """Arms (P, T, 2) at random poses and random torques (P, 2), of which about half can be reached."""
    rng = np.random.default_rng(seed)
    bend, torque = (
        size[:, None] * np.stack([np.cos(toward), np.sin(toward)], axis=1)
        for size, toward in (
            (rng.uniform(0.0, largest, count), rng.uniform(0.0, math.tau, count))
            for largest in (math.radians(70.0), 2.6)
        )
    )
    return np.array([LAYOUTS[name].moment_arms(u, LENGTH, DISCS) for u in bend]), torque


def solved(arms: Array, torque: Array, least: Array, greatest: Array) -> tuple[Array, Array]:
    """Share of each torque that is reached and the least sum of pulls for it (P,), by two linear programs (HiGHS).

    In units of the radius: HiGHS takes an arm below 1e-9 for none.
    """
    poses, tendons, _ = arms.shape
    limits = list(zip(least.tolist(), greatest.tolist(), strict=True)) * poses
    torque = torque / RADIUS
    by_pulls = block_diag(*(pose.T / RADIUS for pose in arms))
    ray = linprog(
        np.concatenate([np.zeros(poses * tendons), -np.ones(poses)]),
        A_eq=np.hstack([by_pulls, block_diag(*(-wanted[:, None] for wanted in torque))]),
        b_eq=np.zeros(2 * poses),
        bounds=[*limits, *([(0.0, 1.0)] * poses)],
        method="highs",
        options=FINE,
    )
    share = np.array(ray.x)[poses * tendons :]
    within = np.where(share < 1.0 - 1e-9, share - 1e-9, 1.0)
    least_sum = linprog(
        np.ones(poses * tendons),
        A_eq=by_pulls,
        b_eq=(within[:, None] * torque).ravel(),
        bounds=limits,
        method="highs",
        options=FINE,
    )
    return share, np.array(least_sum.x).reshape(poses, tendons).sum(axis=1)


@pytest.mark.parametrize("name", LAYOUTS)
def test_pulls_are_those_of_a_linear_program(name: str) -> None:
    """The largest torque of the wanted direction, and for a torque in reach the least sum to 1e-9 N."""
    arms, torque = drawn(name, POSES, seed=11)
    result = allocated(arms, torque, LEAST, GREATEST)
    reached = np.einsum("pt,ptk->pk", result.pulls, arms)
    worst_share, worst_sum = 0.0, 0.0
    for start in range(0, POSES, CHUNK):
        chunk = slice(start, start + CHUNK)
        limits = np.full((2, arms.shape[1]), [[LEAST], [GREATEST]])
        share, least_sum = solved(arms[chunk], torque[chunk], *limits)
        size, inside = np.hypot(*torque[chunk].T), ~result.saturated[chunk]
        worst_share = max(worst_share, float((size * abs(share - result.share[chunk])).max()))
        worst_sum = max(worst_sum, float(abs(least_sum - result.pulls[chunk].sum(axis=1))[inside].max()))
    more_than_two = (result.pulls > LEAST + 1e-9).sum(axis=1)[~result.saturated] > 2
    error = abs(reached - result.share[:, None] * torque).max(axis=1)
    print(
        f"{name}: {POSES} poses, {np.mean(~result.saturated):.1%} in reach, {more_than_two.sum()} with a third tendon; "
        f"sum within {worst_sum:.1e} N, torque {error[~result.saturated].max():.1e} N m; "
        f"out of reach within {worst_share:.1e} N m of the largest, direction {error.max():.1e} N m"
    )
    assert worst_sum < 1e-9 and worst_share < 1e-9
    assert error[~result.saturated].max() < 1e-12 and error.max() < 1e-7


@settings(max_examples=200)
@given(
    name=NAMES,
    bend=st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9)),
    torque=st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)),
    least=st.floats(0.0, 40.0),
    room=st.floats(0.0, 120.0),
)
def test_pulls_keep_their_limits_and_a_torque_its_direction(
    name: str, bend: tuple[float, float], torque: tuple[float, float], least: float, room: float
) -> None:
    arms = LAYOUTS[name].moment_arms(bend, LENGTH, DISCS)
    result = allocated(arms, torque, least, least + room)
    pulls, share = result.pulls[0], float(result.share[0])
    assert pulls.min() >= least and pulls.max() <= least + room
    resting, wanted = least * arms.sum(axis=0), np.array(torque)
    on_ray, on_way = share * wanted, resting + share * (wanted - resting)
    reached = pulls @ arms
    assert min(abs(reached - on_ray).max(), abs(reached - on_way).max()) < 1e-6
    assert 0.0 <= share <= 1.0 and bool(result.saturated[0]) == (share < 1.0 - 1e-12)


@pytest.mark.parametrize("sides", [(1.0, 1.0), (1.0, -1.0), (-1.0, 0.3), (-0.2, -1.0)])
def test_four_tendons_on_a_straight_wrist_decouple_along_diagonals(sides: tuple[float, float]) -> None:
    """T5 - T1 = (tau_y + tau_z)/2c, T4 - T2 = (tau_y - tau_z)/2c, the lesser of each at its least."""
    torque = 0.4 * np.array(sides)
    one, two, four, five = allocated(LAYOUTS["four"].cross_section, torque, LEAST, GREATEST).pulls[0]
    assert five - one == pytest.approx(torque.sum() / (2.0 * OFFSET), abs=1e-12)
    assert four - two == pytest.approx((torque[0] - torque[1]) / (2.0 * OFFSET), abs=1e-12)
    assert min(one, five) == pytest.approx(LEAST, abs=1e-12) and min(two, four) == pytest.approx(LEAST, abs=1e-12)


@pytest.mark.parametrize("toward", [0.0, 20.0, 45.0, 133.0, 200.0, 315.0])
def test_four_tendons_on_a_straight_wrist_reach_a_square(toward: float) -> None:
    """|tau_y| + |tau_z| <= 2 c (T_max - T_0)."""
    direction = np.array([math.cos(math.radians(toward)), math.sin(math.radians(toward))])
    edge = 2.0 * OFFSET * (GREATEST - LEAST) / abs(direction).sum()
    result = allocated(
        LAYOUTS["four"].cross_section, np.array([[0.999], [1.0], [2.0]]) * edge * direction, LEAST, GREATEST
    )
    assert result.share == pytest.approx([1.0, 1.0, 0.5], abs=1e-12)
    assert result.saturated.tolist()[0::2] == [False, True]


@settings(max_examples=50)
@given(name=NAMES, toward=st.floats(0.0, math.tau), size=st.floats(0.0, 2.6), turned=st.floats(0.0, math.tau))
def test_a_turned_wrist_is_pulled_alike(name: str, toward: float, size: float, turned: float) -> None:
    """Turn arms and torque: pulls stay. Mirror the order of tendons: they follow, unless three arms share a line."""
    arms = LAYOUTS[name].moment_arms((0.3, -0.5), LENGTH, DISCS)
    turn = np.array([[math.cos(turned), math.sin(turned)], [-math.sin(turned), math.cos(turned)]])
    torque = size * np.array([math.cos(toward), math.sin(toward)])
    plain = allocated(arms, torque, LEAST, GREATEST)
    assert allocated(arms @ turn, torque @ turn, LEAST, GREATEST).pulls == pytest.approx(plain.pulls, abs=1e-8)
    if name != "grid":
        backward = allocated(arms[::-1], torque, LEAST, GREATEST).pulls[:, ::-1]
        assert backward == pytest.approx(plain.pulls, abs=1e-8)


@pytest.mark.parametrize("bend", [(0.0, 0.0), (0.7, 0.0), (0.0, -0.4), (0.3, 0.3), (-0.5, 0.5)])
@pytest.mark.parametrize("name", ["four", "five", "six"])
def test_opposite_arms_on_one_line_are_no_pair(name: str, bend: tuple[float, float]) -> None:
    """A wrist bent along a plane or a diagonal: what two parallel arms seem to carry is rounding."""
    _, torque = drawn(name, 500, seed=4)
    arms = LAYOUTS[name].moment_arms(bend, LENGTH, DISCS)
    result = allocated(arms, torque, LEAST, GREATEST)
    assert result.pulls @ arms == pytest.approx(result.share[:, None] * torque, abs=1e-11)
    assert result.share.min() > 0.3 and not result.saturated.all()


@pytest.mark.parametrize("name", ["three", "six"])
def test_without_an_upper_limit_every_torque_is_reached(name: str) -> None:
    arms, torque = drawn(name, 8, seed=3)
    for size in (1e-6, 1.0, 1e5):
        result = allocated(arms, size * torque, LEAST, np.inf)
        assert not result.saturated.any()
        assert np.einsum("pt,ptk->pk", result.pulls, arms) == pytest.approx(size * torque, rel=1e-9, abs=1e-12)


def reachable_torques(arms: np.ndarray, least: ArrayLike, greatest: ArrayLike) -> np.ndarray:
    """Corners of the torques that pulls within limits give, counterclockwise: the hull of all extreme pulls'."""
    each = (np.broadcast_to(limit, len(arms)) for limit in (least, greatest))
    extremes = np.array(list(product(*zip(*each, strict=True)))) @ arms
    return extremes[ConvexHull(extremes).vertices]


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_pull_has_limits_of_its_own(name: str) -> None:
    """As after the loss of a tendon, or with a weaker motor: the linear program with these limits agrees."""
    arms, torque = drawn(name, 24, seed=5)
    tendons = arms.shape[1]
    least, greatest = np.full(tendons, LEAST), np.linspace(20.0, 60.0, tendons)
    least[-1] = greatest[-1] = 0.0 if tendons > 3 else LEAST
    result = allocated(arms, 0.2 * torque, least, greatest)
    assert (result.pulls >= least).all() and (result.pulls <= greatest).all()
    resting, wanted, reached = least @ arms, 0.2 * torque, np.einsum("pt,ptk->pk", result.pulls, arms)
    on_ray = abs(reached - result.share[:, None] * wanted).max(axis=1) < 1e-9
    share, least_sum = solved(arms[on_ray], wanted[on_ray], least, greatest)
    assert on_ray.sum() > 5 and result.share[on_ray] == pytest.approx(share, abs=1e-8)
    inside = ~result.saturated[on_ray]
    assert result.pulls[on_ray].sum(axis=1)[inside] == pytest.approx(least_sum[inside], abs=1e-9)
    off = np.flatnonzero(~on_ray)
    assert len(off) > 1 or tendons != 4
    on_way = resting[off] + result.share[off, None] * (wanted - resting)[off]
    assert reached[off] == pytest.approx(on_way, abs=1e-9)
    for number in off:
        further = resting[number] + (result.share[number] + 1e-6) * (wanted - resting)[number]
        corners = reachable_torques(arms[number], least, greatest)
        sides = np.roll(corners, -1, axis=0) - corners
        across = sides[:, 0] * (further - corners)[:, 1] - sides[:, 1] * (further - corners)[:, 0]
        assert across.min() < 0.0


def test_a_pull_at_its_greatest_is_not_rounded_beyond() -> None:
    least, greatest = 15.7, 50.1
    assert least + (greatest - least) > greatest
    result = allocated(LAYOUTS["three"].cross_section, [9.0, 9.0], least, greatest)
    assert result.pulls.max() == greatest


def test_with_one_of_three_lost_a_torque_that_needs_it_is_left_on_the_way() -> None:
    """Tendons at 0 and 120 deg span what lies between them; nothing pulls toward 240 deg."""
    arms = LAYOUTS["three"].cross_section
    limits = (np.zeros(3), np.array([GREATEST, GREATEST, 0.0]))
    toward = [np.radians(degrees) for degrees in (60.0, 0.0, 240.0)]
    result = allocated(arms, 0.5 * np.array([[math.cos(angle), math.sin(angle)] for angle in toward]), *limits)
    assert result.share == pytest.approx([1.0, 1.0, 0.0], abs=1e-12)
    assert result.pulls[0, :2] == pytest.approx(0.5 / RADIUS, rel=1e-12)
    assert result.pulls[1] == pytest.approx([0.5 / RADIUS, 0.0, 0.0], abs=1e-9)
    assert not result.pulls[2].any()


@pytest.mark.parametrize("name", LAYOUTS)
def test_what_lies_beyond_the_hull_of_all_extreme_pulls_is_not_reached(name: str) -> None:
    arms = LAYOUTS[name].moment_arms((0.4, 0.2), LENGTH, DISCS)
    corners = reachable_torques(arms, LEAST, GREATEST)
    result = allocated(arms, 1.001 * corners, LEAST, GREATEST)
    assert result.saturated.all() and result.share == pytest.approx(1.0 / 1.001, abs=1e-9)


@pytest.mark.parametrize(
    ("least", "greatest", "problem"),
    [(-1.0, 60.0, "pull 1"), ([2.0, 2.0, 70.0, 2.0], 60.0, "pull 3"), (2.0, [60.0, math.nan, 60.0, 60.0], "pull 2")],
)
def test_limits_that_are_none_are_refused(least: float, greatest: float, problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        allocated(LAYOUTS["four"].cross_section, [0.1, 0.2], least, greatest)
