"""The chain of hinges against its geometry, an independent Lagrangian, and the wrist of arcs that it becomes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of, square_like
from wristctl.wrist.dynamics import equation_of_motion
from wristctl.wrist.hinges import HINGES, Hinges
from wristctl.wrist.integrator import step
from wristctl.wrist.pcc import PCC
from wristctl.wrist.tendon_mechanics import NoTendons, travel

WRIST = WristParameters(gravity=(-8.1, 4.3), taper=3.0)
_read = tuple_of(Hinges)


@kernel
def _terms(parameters: Any, state: Any, out: Any, cut: Any) -> None:
    plant, result, n = _read(rows_of(parameters)), rows_of(out), len(cut)
    rows = rows_of(state)
    q, rate, pulls = part(rows, 0, cut), part(rows, n, cut), beyond(rows, 2 * n)
    mass, r = square_like(q), lanes_like(q)
    equation_of_motion(plant, q, rate, pulls[0], pulls[1], mass, r)
    plus, minus, bend = travel(plant, q)
    result[0], result[1], result[2] = plus, minus, bend
    for i in range(n):
        result[3 + i] = r[i]
        for j in range(n):
            result[3 + n + n * i + j] = mass[i, j]


@kernel
def _steps(parameters: Any, state: Any, h: float, count: int, cut: Any) -> None:
    plant, rows, n = _read(rows_of(parameters)), rows_of(state), len(cut)
    q, rate, pulls = part(rows, 0, cut), part(rows, n, cut), beyond(rows, 2 * n)
    for _ in range(count):
        step(plant, q, rate, (pulls[0], pulls[1]), NoTendons(), h + zero_like(pulls[0]))


def terms(values: Array, q: Array, rate: Array, pulls: Array) -> tuple[Array, Array, Array]:
    """Travel and bend (3,), residual without acceleration (n,) and mass (n, n)."""
    n, out = len(q), np.empty(3 + len(q) + len(q) ** 2)
    _terms(values, np.concatenate([q, rate, pulls]), out, (0,) * n)
    return out[:3], out[3 : 3 + n], out[3 + n :].reshape(n, n)


def moved(values: Array, q: Array, rate: Array, pulls: Array, seconds: float, h: float = 1e-3) -> tuple[Array, Array]:
    state = np.concatenate([q, rate, pulls])
    _steps(values, state, h, round(seconds / h), (0,) * len(q))
    return state[: len(q)], state[len(q) : 2 * len(q)]


def discs(wrist: WristParameters, q: Array) -> tuple[Array, Array]:
    """Centres and tangents of the n + 1 discs, complex, link by link."""
    half, place, along = 0.5 * wrist.length / len(q), [0j], [1.0 + 0j]
    for angle in q:
        hinge = place[-1] + half * along[-1]
        along.append(along[-1] * np.exp(1j * angle))
        place.append(hinge + half * along[-1])
    return np.array(place), np.array(along)


def holes_apart(wrist: WristParameters, q: Array) -> Array:
    """Lengths of both sides' tendons from hole to hole, (2,)."""
    place, along = discs(wrist, q)
    sides = [place + sign * 1j * wrist.tendon_offset * along for sign in (1.0, -1.0)]
    return np.array([np.abs(np.diff(side)).sum() for side in sides])


def springs(wrist: WristParameters, n: int) -> Array:
    """Stiffness from the base to the tip by hand: a geometric row whose compliances sum to the whole's."""
    row = np.geomspace(wrist.taper, 1.0, n) if n > 1 else np.ones(1)
    stiffness: Array = row * (wrist.stiffness * (1.0 / row).sum())
    return stiffness


def points(wrist: WristParameters, q: Array) -> tuple[Array, Array]:
    """Masses and their places, complex: the chords' middles, and the hand."""
    place, along = discs(wrist, q)
    where = np.append(0.5 * (place[1:] + place[:-1]), place[-1] + wrist.hand_offset * along[-1])
    return np.append(np.full(len(q), wrist.mass / len(q)), wrist.hand_mass), where


def potential(wrist: WristParameters, q: Array, pulls: Array) -> float:
    mass, where = points(wrist, q)
    weight = (mass * (where.conj() * complex(*wrist.gravity)).real).sum()
    spring = 0.5 * (springs(wrist, len(q)) * q**2).sum()
    return float(spring - weight + pulls @ holes_apart(wrist, q))


def mass_matrix(wrist: WristParameters, q: Array, h: float = 1e-4) -> Array:
    weights = {1: 8.0 / 12.0, -1: -8.0 / 12.0, 2: -1.0 / 12.0, -2: 1.0 / 12.0}
    nudged = ((points(wrist, q + s * h * e)[1] * w / h for s, w in weights.items()) for e in np.eye(len(q)))
    j = np.stack([np.sum(list(each), axis=0) for each in nudged])
    found: Array = ((j * points(wrist, q)[0]) @ j.conj().T).real
    return found


def energy(wrist: WristParameters, q: Array, rate: Array, pulls: Array) -> float:
    return float(0.5 * rate @ mass_matrix(wrist, q) @ rate) + potential(wrist, q, pulls)


def some(n: int, seed: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.6, 0.6, n), rng.normal(0.0, 3.0, n), np.array([35.0, 8.0])


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([1, 2, 5]), st.integers(0, 10_000))
@pytest.mark.slow
def test_tendons_are_as_long_as_their_holes_are_apart(n: int, seed: int) -> None:
    q, rate, pulls = some(n, seed)
    apart = holes_apart(WRIST, q)
    np.testing.assert_allclose(HINGES.taut(WRIST, q), apart, rtol=1e-12)
    found = terms(HINGES.values(WRIST, n), q, rate, pulls)[0]
    np.testing.assert_allclose(found, [*(WRIST.length - apart), np.abs(q).sum()], atol=1e-14)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_motion_is_lagranges_by_differences_of_the_energies(n: int) -> None:
    for seed in range(3):
        (q, rate, pulls), h = some(n, seed), 1e-4
        _, r, mass = terms(HINGES.values(WRIST, n), q, rate, pulls)
        np.testing.assert_allclose(mass, mass_matrix(WRIST, q), rtol=1e-8, atol=1e-12)
        nudges = h * np.eye(n)
        by_q = np.stack([(mass_matrix(WRIST, q + e) - mass_matrix(WRIST, q - e)) / (2 * h) for e in nudges])
        slope = [(potential(WRIST, q + e, pulls) - potential(WRIST, q - e, pulls)) / (2 * h) for e in nudges]
        whirling = np.einsum("kij,k,j->i", by_q, rate, rate) - 0.5 * np.einsum("kij,i,j->k", by_q, rate, rate)
        np.testing.assert_allclose(r, whirling + slope + WRIST.damping * n * rate, rtol=1e-6, atol=1e-7)


@pytest.mark.slow
def test_energy_stays_without_damping_and_what_dampers_take_is_missing() -> None:
    """Of a wrist that is let go; the light parts beat at 1e3 1/s, whence the steps."""
    free, pulls, bent, still = (
        WRIST.model_copy(update={"damping": 0.0}),
        np.array([6.0, 4.0]),
        np.full(2, 0.2),
        np.zeros(2),
    )
    begin = energy(free, bent, still, pulls)
    errors = []
    for h in (2e-5, 1e-5):
        at, rate = moved(HINGES.values(free, 2), bent, still, pulls, 0.05, h)
        errors.append(abs(energy(free, at, rate, pulls) - begin))
        assert 0.5 * rate @ mass_matrix(free, at) @ rate > 1e-3
    assert errors[0] < 1e-5 and errors[1] < 0.2 * errors[0], errors
    at, rate = moved(HINGES.values(WRIST, 2), bent, still, pulls, 0.05)
    assert energy(WRIST, at, rate, pulls) < begin - 1e-3


@pytest.mark.parametrize("n", [2, 5])
@pytest.mark.slow
def test_it_comes_to_rest_where_no_energy_is_lower(n: int) -> None:
    tensions = (9.0, 3.0)
    rest = HINGES.rest(WRIST, n, tensions)
    pulls = 2.0 * np.array(tensions)
    at, rate = moved(HINGES.values(WRIST, n), np.zeros(n), np.zeros(n), pulls, 8.0)
    np.testing.assert_allclose(at, rest, atol=1e-9)
    assert np.abs(rate).max() < 1e-9 and rest.sum() > 0.1
    lowest = potential(WRIST, rest, pulls)
    for seed in range(20):
        nudge = 1e-3 * np.random.default_rng(seed).standard_normal(n)
        assert potential(WRIST, rest + nudge, pulls) > lowest


def test_hinges_become_the_wrist_of_arcs_as_the_square_of_their_number() -> None:
    """Tips at rest under tendons and gravity, and on the way there, to those of 32 arcs."""
    even = WRIST.model_copy(update={"taper": 1.0, "discs": 33})
    fine = PCC.rest(even, 32, (12.0, 2.0))
    tip = PCC.tips(even, fine[None])[0]
    errors = []
    for n in (2, 4, 8, 16):
        rest = HINGES.rest(even, n, (12.0, 2.0))
        errors.append(np.linalg.norm(HINGES.tips(even, rest[None])[0] - tip))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] > 1e-4 and (np.abs(orders - 2.0) < 0.2).all(), (errors, orders)


def test_uneven_springs_in_series_bend_by_their_own_stiffness_and_sum_to_the_same_compliance() -> None:
    """Tendons that push as much as they pull bend every hinge alike: K_k q_k = c (P+ - P-) cos(q_k/2)."""
    wrist = WristParameters(gravity=(0.0, 0.0), taper=4.0)
    own, couple = springs(wrist, 5), wrist.tendon_offset * 2.0 * 2.0 * 3.0
    assert own[0] / own[-1] == pytest.approx(4.0) and (1.0 / own).sum() == pytest.approx(1.0 / wrist.stiffness)
    rest = HINGES.rest(wrist, 5, (3.0, -3.0))
    by_hand = [brentq(lambda q, k=k: k * q - couple * np.cos(0.5 * q), 0.0, 1.0) for k in own]
    np.testing.assert_allclose(rest, by_hand, rtol=1e-9)
    assert rest.sum() == pytest.approx(couple / wrist.stiffness, rel=0.01)
    softer_base = HINGES.rest(wrist.model_copy(update={"taper": 0.25}), 5, (3.0, -3.0))
    np.testing.assert_allclose(softer_base, rest[::-1], rtol=1e-9)


def test_arcs_refuse_a_taper_that_they_cannot_have_and_one_part_has_none() -> None:
    with pytest.raises(UserError, match="equally stiff"):
        PCC.values(WRIST, 2)
    assert PCC.values(WRIST, 1).tolist() == PCC.values(WRIST.model_copy(update={"taper": 1.0}), 1).tolist()
    assert Hinges(*HINGES.values(WRIST, 1)).stiffness == WRIST.stiffness


def test_a_wrist_of_hinges_that_buckles_is_refused() -> None:
    with pytest.raises(UserError, match="buckles"):
        HINGES.rest(WristParameters(hand_mass=2.0), 4, (2.0, 2.0))


def test_its_line_is_straight_between_hinges_and_turns_at_each() -> None:
    q = np.array([0.4, -0.2, 0.3])
    place, along = discs(WRIST, q)
    line, tangent = HINGES.backbone(WRIST, q, np.linspace(0.0, WRIST.length, 4))
    np.testing.assert_allclose(line, place, atol=1e-15)
    np.testing.assert_allclose(tangent, along, atol=1e-15)
    sixth = WRIST.length / 6.0
    quarter, _ = HINGES.backbone(WRIST, q, np.array([0.5 * sixth, sixth, 1.5 * sixth]))
    np.testing.assert_allclose(quarter, [0.5 * sixth, sixth, sixth + 0.5 * sixth * np.exp(0.4j)], atol=1e-15)
