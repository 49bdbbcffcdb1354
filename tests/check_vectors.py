"""Hold the compiled model against a file of reference vectors: `python tests/check_vectors.py FILE`.

Prints the largest error of each quantity and ends with 1 if one exceeds its tolerance: 1e-9 relative (1e-12 absolute
near zero) for kinematics, mass matrix, bias and tendons, 1e-6 rad for trajectories at the default step. A file whose
cases name the places of tendons is one of the wrist in two planes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.wrist.compiled_model import terms
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import Segments
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import SpatialSegments, rows_of_tendons

RELATIVE, ABSOLUTE, ANGLE = 1e-9, 1e-12, 1e-6


def parameters(given: dict[str, Any], force: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """The file's parameters in the order of Segments; the files' tendons have one span per segment."""
    return np.array(
        Segments(
            length=given["segment_length_m"],
            mass=given["segment_mass_kg"],
            hand_mass=given["hand_mass_kg"],
            hand_offset=given["hand_com_offset_m"],
            gravity_x=given["gravity_m_s2"][0],
            gravity_y=given["gravity_m_s2"][1],
            tendon_offset=given["tendon_offset_m"],
            spans=given.get("spans_per_segment", 1.0),
            stiffness=given["segment_stiffness_nm_rad"],
            damping=given["segment_damping_nms_rad"],
            force_x=force[0],
            force_y=force[1],
        ),
        dtype=float,
    )


def spatial_parameters(given: dict[str, Any], force: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """The file's parameters in the order of SpatialSegments, then its tendons, which all run to the tip."""
    stiffness, damping = given["segment_stiffness_nm_rad"], given["segment_damping_nms_rad"]
    of_segments = SpatialSegments(
        given["segment_length_m"], given["segment_mass_kg"], given["hand_mass_kg"], given["hand_com_offset_m"],
        given["spans_per_segment"], stiffness, 0.0, stiffness, damping, 0.0, damping, *given["gravity_m_s2"], *force,
    )  # fmt: skip
    return np.concatenate([of_segments, rows_of_tendons(given["tendon_places_m"], given["n"])])


def excess(value: Any, expected: Any) -> float:
    """Largest error as a multiple of the tolerance."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    return float(np.max(np.abs(value - expected) / np.maximum(ABSOLUTE, RELATIVE * np.abs(expected))))


def planar_errors(vectors: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Quantities of vectors in one plane with their errors, each as a multiple of its tolerance."""
    for case in vectors["cases"]:
        expect = case["expect"]
        at = terms(parameters(case["parameters"]), case["theta_rad"], case["theta_dot_rad_s"])
        yield "tip", excess(at.tip, expect["tip_x_y_phi"])
        yield "mass matrix", excess(at.mass, expect["mass_matrix"])
        yield "bias", excess(at.bias, expect["coriolis_plus_gravity_nm"])
        for side, name in enumerate(("plus", "minus")):
            yield "tendon length", excess(at.tendon_lengths[:, side].sum(), expect["tendon_length_m"][name])
            yield "moment arm", excess(at.moment_arms[:, side], expect["tendon_moment_arm_m"][name])
    for case in vectors["trajectories"]:
        still = np.zeros(case["parameters"]["n"])
        pulls = [case["tendon_force_n"]["plus"], case["tendon_force_n"]["minus"]]
        force = tuple(case["external_tip_force_n"])
        theta, _ = integrate(PCC, parameters(case["parameters"], force), still, still, pulls, case["t_s"])
        yield "trajectory", float(np.abs(theta - case["theta_rad"]).max()) / ANGLE


def spatial_errors(vectors: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Quantities of vectors in two planes with their errors, each as a multiple of its tolerance."""
    for case in vectors["cases"]:
        expect = case["expect"]
        at = spatial_terms(spatial_parameters(case["parameters"]), case["bend_rad"], case["bend_rate_rad_s"])
        yield "last disc", excess(at.tip, expect["last_disc_m"])
        yield "rotation", excess(at.frame, expect["rotation"])
        yield "mass matrix", excess(at.mass, expect["mass_matrix"])
        yield "bias", excess(at.bias, expect["coriolis_plus_gravity_nm"])
        yield "tendon length", excess(at.lengths, expect["tendon_length_m"])
        yield "moment arm", excess(at.moment_arms, expect["tendon_moment_arm_m"])
    for case in vectors["trajectories"]:
        still, values = (
            np.zeros(2 * case["parameters"]["n"]),
            spatial_parameters(case["parameters"], case["external_force_n"]),
        )
        q, _ = integrate(PCC_IN_SPACE, values, still, still, case["tension_n"], case["t_s"])
        yield "trajectory", float(np.abs(q - case["bend_rad"]).max()) / ANGLE


def largest_errors(path: Path) -> dict[str, float]:
    """Largest error of each quantity over the file, each as a multiple of its tolerance."""
    vectors = json.loads(path.read_text())
    in_space = "tendon_places_m" in vectors["cases"][0]["parameters"]
    worst: dict[str, float] = {}
    for name, error in spatial_errors(vectors) if in_space else planar_errors(vectors):
        worst[name] = max(worst.get(name, 0.0), error if np.isfinite(error) else np.inf)
    return worst


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    worst = largest_errors(Path(sys.argv[1]))
    for name, error in worst.items():
        print(f"{name:14s} largest error {error:9.2e} of its tolerance  {'ok' if error <= 1 else 'TOO LARGE'}")
    return int(any(error > 1.0 for error in worst.values()))


if __name__ == "__main__":
    sys.exit(main())
