"""Hold the compiled model against a file of reference vectors: `python tests/check_vectors.py FILE`.

Prints the largest error of each quantity and ends with 1 if one exceeds its tolerance: 1e-9 relative (1e-12 absolute
near zero) for kinematics, mass matrix, bias and tendons, 1e-6 rad for trajectories at the default step.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.wrist.compiled_model import integrate, terms
from wristctl.wrist.segments import Segments

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


def excess(value: Any, expected: Any) -> float:
    """Largest error as a multiple of the tolerance."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    return float(np.max(np.abs(value - expected) / np.maximum(ABSOLUTE, RELATIVE * np.abs(expected))))


def largest_errors(path: Path) -> dict[str, float]:
    """Largest error of each quantity over the file, each as a multiple of its tolerance."""
    vectors = json.loads(path.read_text())
    worst: dict[str, float] = {}

    def note(name: str, error: float) -> None:
        worst[name] = max(worst.get(name, 0.0), error if np.isfinite(error) else np.inf)

    for case in vectors["cases"]:
        expect = case["expect"]
        at = terms(parameters(case["parameters"]), case["theta_rad"], case["theta_dot_rad_s"])
        note("tip", excess(at.tip, expect["tip_x_y_phi"]))
        note("mass matrix", excess(at.mass, expect["mass_matrix"]))
        note("bias", excess(at.bias, expect["coriolis_plus_gravity_nm"]))
        for side, name in enumerate(("plus", "minus")):
            note("tendon length", excess(at.tendon_lengths[:, side].sum(), expect["tendon_length_m"][name]))
            note("moment arm", excess(at.moment_arms[:, side], expect["tendon_moment_arm_m"][name]))
    for case in vectors["trajectories"]:
        still = np.zeros(case["parameters"]["n"])
        pulls = [case["tendon_force_n"]["plus"], case["tendon_force_n"]["minus"]]
        force = tuple(case["external_tip_force_n"])
        theta, _ = integrate(parameters(case["parameters"], force), still, still, pulls, case["t_s"])
        note("trajectory", float(np.abs(theta - case["theta_rad"]).max()) / ANGLE)
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
