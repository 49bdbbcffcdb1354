"""The one-segment wrist for laws of plain Python."""

from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.control.law import wrist_of
from wristctl.control.model import one_segment
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of


@kernel
def _one_segment(wrist: Any, state: Any, output: Any) -> None:
    row, out = rows_of(state), rows_of(output)
    out[0], out[1] = one_segment(wrist_of(wrist), row[0], row[1])


def plain_one_segment(wrist: Any, theta: float, rate: float) -> tuple[float, float]:
    """Inertia [kg m2] and load [N m] at an angle and a rate, as `one_segment`; `wrist` is what a plain law is given."""
    terms: Array = np.empty(2)
    _one_segment(np.array(wrist), np.array([theta, rate]), terms)
    return float(terms[0]), float(terms[1])
