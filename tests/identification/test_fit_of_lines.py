"""The search on a model whose angle is linear in its coordinates: least squares in closed form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tests.identification.benches import KNOWN, START, TENDONS
from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.identification.fit import fit, linearise
from wristctl.identification.forward import Supposed
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.identification.problem import SPOOL, ZERO, Coordinate, Problem
from wristctl.identification.unknowns import UNKNOWNS

FREE = ("stiffness", "friction", "tendon_radius")
HELD = {name: START[name] for name in UNKNOWNS if name not in FREE} | {"delay": 0.01}
TIME = 0.005 * np.arange(200.0)


class Lines(Problem):
    """Angles that are linear in logarithms of stiffness and radius, in friction, and in the spools' zeros."""

    def simulate(self, trial: MeasuredTrial, candidates: Sequence[Supposed], segments: int | None = None) -> Array:
        rng = np.random.default_rng(len(trial.label))
        own = rng.standard_normal((3, len(TIME))), 50.0 * rng.standard_normal((4, len(TIME)))
        return np.array([self._angle(each, *own) for each in candidates])[..., None]

    def _angle(self, each: Supposed, of: Array, spools: Array) -> Array:
        stiffness = np.log(each.wrist.stiffness / START["stiffness"])
        radius = np.log(each.wrist.tendon_radius / START["tendon_radius"])
        found: Array = 0.1 * np.array([stiffness, each.tendons.friction, radius]) @ of + np.array(each.taut) @ spools
        return found


def trial(run: str, plane: str = "ulnar", seed: int = 0, scale: float = 1.0, label: str = "") -> MeasuredTrial:
    captured = TIME[5::2] + 0.01
    angle = scale * 0.02 * np.random.default_rng(seed).standard_normal(len(captured))
    return MeasuredTrial(label, run, plane, KNOWN, TIME, np.zeros((len(TIME), 4)), captured, angle, 0.0)


def problem(*trials: MeasuredTrial, **settings: object) -> Lines:
    return Lines(trials, START, IdentifySettings.model_validate({"fix": HELD} | settings), TENDONS)


TRIALS = (trial("a", label="1"), trial("a", "flexion", 1, label="22"), trial("b", seed=2, label="333"))


def test_zeros_belong_to_a_run_and_a_plane_and_spools_to_a_run() -> None:
    kinds = list(problem(*TRIALS).coordinates)
    assert kinds[:3] == [Coordinate(name) for name in FREE]
    assert kinds[3:6] == [
        Coordinate(ZERO, run, plane) for run, plane in (("a", "ulnar"), ("a", "flexion"), ("b", "ulnar"))
    ]
    assert set(kinds[6:]) == {Coordinate(SPOOL, run, tendon) for run in "ab" for tendon in (1, 2, 4, 5)}
    assert len(kinds) == 14 and list(problem(*TRIALS).coordinates.values()) == list(range(14))


def test_what_is_known_beforehand_and_how_far_the_search_may_go() -> None:
    asked = problem(*TRIALS, radius_error=0.02, zero_error_deg=0.5, spool_error=1e-4)
    wanted = [0.0, 0.0, 1.0 / 0.02, *[1.0 / np.radians(0.5)] * 3, *[1.0 / 1e-4] * 8]
    np.testing.assert_allclose(asked.prior(), wanted)
    low, high = asked.bounds()
    own = np.array([UNKNOWNS[name].bounds() for name in FREE])
    np.testing.assert_allclose(low, [*own[:, 0], *[-0.2] * 3, *[-2e-3] * 8])
    np.testing.assert_allclose(high, [*own[:, 1], *[0.2] * 3, *[2e-3] * 8])


def test_the_search_begins_at_what_is_believed_and_holds_what_is_fixed() -> None:
    asked = problem(*TRIALS)
    assert asked.free == FREE and asked.values(asked.begin()) == START | {"delay": 0.01}
    x = asked.begin()
    x[:3] = np.log(2.0), 0.7, np.log(0.9)
    changed = {"stiffness": 2.0 * START["stiffness"], "friction": 0.7, "tendon_radius": 0.9 * START["tendon_radius"]}
    assert asked.values(x) == pytest.approx(START | {"delay": 0.01} | changed)
    assert list(asked.values(x)) == list(UNKNOWNS)


def test_a_candidate_has_its_own_runs_spools_and_the_wrist_at_hand() -> None:
    asked = problem(*TRIALS)
    x = asked.begin()
    for place, at in asked.coordinates.items():
        if place.kind == SPOOL:
            x[at] = 1e-4 * float(place.place) * (1.0 if place.run == "a" else -1.0)
    for each in TRIALS:
        found = asked.candidate(each, x)
        sign = 1.0 if each.run == "a" else -1.0
        assert found.taut == pytest.approx(tuple(sign * 1e-4 * tendon for tendon in each.tendons))
        assert found.wrist == KNOWN
        assert found.tendons == TENDONS


def test_the_zero_of_a_plane_moves_its_own_frames_and_no_others() -> None:
    asked = problem(*TRIALS)
    x = asked.begin()
    before = linearise(asked, x)
    x[asked.coordinates[Coordinate(ZERO, "a", "flexion")]] = 0.01
    after = linearise(asked, x)
    for at, (one, other) in enumerate(zip(before.expected, after.expected, strict=True)):
        np.testing.assert_allclose(other - one, 0.01 if at == 1 else 0.0, atol=1e-12)


@pytest.mark.parametrize("scale", [0.1, 1.0, 20.0])
def test_the_search_ends_at_weighed_least_squares_whatever_the_noise(scale: float) -> None:
    """Where the gradient of residuals over their own deviation and of what was known beforehand is nothing."""
    trials = [trial(each.run, each.direction, k, scale, each.label) for k, each in enumerate(TRIALS)]
    found = fit(problem(*trials))
    residual, slopes = np.concatenate(found.residuals), np.concatenate(found.slopes)
    shown = np.concatenate([each.angle for each in trials])
    expected = np.concatenate(linearise(found.problem, found.x).expected)
    np.testing.assert_allclose(residual, shown - expected, atol=1e-12)
    assert found.noise == pytest.approx(np.sqrt(residual @ residual / (len(residual) - 3)))
    assert found.noise == pytest.approx(0.02 * scale, rel=0.15) and 0 < found.evaluations < 60
    prior, (low, high) = found.problem.prior(), found.problem.bounds()
    inside = np.minimum(found.x - low, high - found.x) > 1e-6
    assert inside[3:].all()
    covariance = np.linalg.inv((slopes.T @ slopes / found.noise**2 + np.diag(prior**2))[np.ix_(inside, inside)])
    left = (slopes.T @ residual / found.noise**2 - prior**2 * found.x)[inside]
    off = covariance @ left / np.sqrt(np.diag(covariance))
    assert np.abs(off).max() < 0.3, "in standard deviations: the noise was weighed to 5 %"
