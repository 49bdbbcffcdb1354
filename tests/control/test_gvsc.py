"""The strain model against finely segmented wrists: statics, shape and inertia."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.control import gvsc
from wristctl.control.gvsc import strain_model
from wristctl.control.law import wrist_of
from wristctl.control.model import one_segment
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.segments import segments

FINE = 32
POSES = [(-9.81, 0.0), (9.81, 0.0), (0.0, -9.81), (-8.0, 3.0)]


@kernel
def _strain(wrist: Any, theta: Any, out: Any) -> None:
    angle, result = rows_of(theta), rows_of(out)
    result[0], result[1], result[2], result[3] = strain_model(wrist_of(wrist), angle[0])
    result[4], result[5] = one_segment(wrist_of(wrist), angle[0], 0.0 * angle[0])


def strain(wrist: WristParameters, theta: float) -> np.ndarray:
    """Inertia, slope, torque and beta of the strain model, then inertia and torque of one segment."""
    out = np.zeros(6)
    _strain(segments(wrist, 1), np.array([theta]), out)
    return out


def equilibrium_at(wrist: WristParameters, theta: float, n: int) -> tuple[np.ndarray, float]:
    """Angles of n segments that sum to theta, and the torque, equal on every segment, that holds them there."""
    angles, torque, zero = np.full(n, theta / n), 0.0, np.zeros(n)
    for _ in range(30):
        r, tangent, _ = linearised(segments(wrist, n), angles, zero, zero, np.zeros(2))
        matrix = np.block([[tangent, -np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
        change = np.linalg.solve(matrix, np.append(torque - r, theta - angles.sum()))
        angles, torque = angles + change[:n], torque + change[n]
    return angles, float(torque)


@pytest.mark.parametrize("gravity", POSES)
@pytest.mark.parametrize("theta", [-0.87, 0.0, 0.2, 0.52])
@pytest.mark.slow
def test_statics_match_a_finely_segmented_wrist(gravity: tuple[float, float], theta: float) -> None:
    wrist = WristParameters(gravity=gravity)
    _, slope, torque, beta, _, _ = strain(wrist, theta)
    angles, wanted = equilibrium_at(wrist, theta, FINE)
    assert torque == pytest.approx(wanted, abs=5e-4)
    u = (np.arange(FINE) + 0.5) / FINE
    fitted = float(3.0 * FINE * np.mean(angles * (2.0 * u - 1.0)))
    assert beta == pytest.approx(fitted, abs=0.02 * abs(fitted) + 2e-3)
    step = 1e-4
    numeric = (strain(wrist, theta + step)[3] - strain(wrist, theta - step)[3]) / (2 * step)
    assert slope == pytest.approx(numeric, abs=1e-4)


def test_statics_are_five_times_closer_than_one_segment() -> None:
    wrist = WristParameters()
    for theta in (0.2, 0.52, 0.87):
        found, wanted = strain(wrist, theta), equilibrium_at(wrist, theta, FINE)[1]
        assert abs(found[2] - wanted) < 0.2 * abs(found[5] - wanted)


@pytest.mark.parametrize("theta", [0.0, 0.5])
def test_inertia_matches_a_finely_segmented_wrist_that_moves_through_equilibria(theta: float) -> None:
    wrist = WristParameters()
    step = 1e-4
    ahead, behind = (equilibrium_at(wrist, theta + d, FINE)[0] for d in (step, -step))
    along = (ahead - behind) / (2 * step)
    mass = terms(segments(wrist, FINE), equilibrium_at(wrist, theta, FINE)[0], np.zeros(FINE)).mass
    assert strain(wrist, theta)[0] == pytest.approx(along @ mass @ along, rel=5e-3)


def test_nodes_and_weights_of_its_quadrature_are_the_exact_ones_rounded_on_every_processor() -> None:
    with mpmath.workdps(40):
        count = len(gvsc._NODES)
        roots = [mpmath.findroot(lambda x: mpmath.legendre(count, x), 2.0 * node - 1.0) for node in gvsc._NODES]
        slopes = [mpmath.diff(lambda x: mpmath.legendre(count, x), root) for root in roots]
        nodes = [(root + 1) / 2 for root in roots]
        powers = mpmath.matrix([[node**k for k in range(count)] for node in nodes])
        moments = mpmath.matrix([[node ** (k + 1) / (k + 1) for k in range(count)] for node in nodes])
        partial = moments * powers**-1
        assert tuple(map(float, nodes)) == gvsc._NODES
        weights = (1 / ((1 - root**2) * slope**2) for root, slope in zip(roots, slopes, strict=True))
        assert tuple(map(float, weights)) == gvsc._WEIGHTS
        assert tuple(float(partial[i, k]) for i in range(count) for k in range(count)) == gvsc._PARTIAL
