"""Between rows of numbers, one per rollout, and blocks of lanes, as compiled code wants them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wristctl.lanes.types import LANES

Array = NDArray[np.float64]


def to_blocks(rows: Array) -> Array:
    """(count, variables) -> (blocks, variables, LANES); the last block is filled up with the last rollout."""
    count, variables = rows.shape
    blocks = -(-count // LANES)
    index = np.minimum(np.arange(blocks * LANES), count - 1)
    return np.ascontiguousarray(rows[index].reshape(blocks, LANES, variables).transpose(0, 2, 1))


def to_rows(blocks: Array, count: int) -> Array:
    """(blocks, variables, LANES) -> (count, variables), the filling dropped."""
    return np.ascontiguousarray(blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1])[:count])
