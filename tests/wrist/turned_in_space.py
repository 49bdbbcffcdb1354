"""A wrist in space turned about its base's tangent, by the values of any of its models."""

from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array


def turned(fields: Sequence[str], values: Array, by: float) -> Array:
    """Parameters of the wrist turned by an angle [rad]: these fields first, then three numbers for each tendon."""
    c, s = np.cos(by), np.sin(by)
    turn = np.array([[c, -s], [s, c]])
    count = len(fields)
    out = dict(zip(fields, values[:count].tolist(), strict=True))
    for name in ("gravity", "force"):
        out[f"{name}_y"], out[f"{name}_z"] = turn @ [out[f"{name}_y"], out[f"{name}_z"]]
    for name in ("stiffness", "damping"):
        yz = out[f"{name}_yz"]
        matrix = turn @ np.array([[out[f"{name}_yy"], yz], [yz, out[f"{name}_zz"]]]) @ turn.T
        out[f"{name}_yy"], out[f"{name}_yz"], out[f"{name}_zz"] = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    tendons = values[count:].reshape(-1, 3).copy()
    tendons[:, :2] = tendons[:, :2] @ turn.T
    return np.concatenate([np.array(list(out.values())), tendons.ravel()])
