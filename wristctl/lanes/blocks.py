"""Between rows of numbers, one per rollout, and blocks of lanes, as compiled code wants them.

A block holds LANES rollouts along its last axis; a rollout alone is a block without that axis. The last block is
filled up with the last rollout.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.lanes.types import LANES


def width(count: int) -> int:
    """Lanes of each block of as many rollouts."""
    return 1 if count == 1 else LANES


def lanes_of(count: int) -> NDArray[np.int64]:
    """The rollout of each block's lanes, (blocks, LANES), or (1,) where there is only one."""
    if count == 1:
        return np.zeros(1, np.int64)
    blocks = -(-count // LANES)
    return np.minimum(np.arange(blocks * LANES), count - 1).reshape(blocks, LANES)


def aligned(shape: tuple[int, ...]) -> Array:
    """Zeros whose lanes each lie in one cache line: a block's lanes fill one, and what crosses two costs twice."""
    size = int(np.prod(shape))
    room = np.zeros(size + LANES)
    first = -(room.ctypes.data // 8) % LANES
    return room[first : first + size].reshape(shape)


def to_blocks(rows: Array) -> Array:
    """(count, variables) -> (blocks, variables, LANES), or (1, variables) where there is only one."""
    if len(rows) == 1:
        return np.array(rows)
    lanes = lanes_of(len(rows))
    blocks = aligned((len(lanes), rows.shape[1], LANES))
    blocks[...] = rows[lanes].transpose(0, 2, 1)
    return blocks


def spread(row: Array, count: int) -> Array:
    """`to_blocks` for as many rollouts, each with the same row (variables,) or with its own (count, variables)."""
    return to_blocks(np.broadcast_to(row, (count, row.shape[-1])))


def to_rows(blocks: Array, count: int) -> Array:
    """(blocks, variables, LANES) or (1, variables) -> (count, variables), the filling dropped."""
    if blocks.ndim == 2:
        return blocks
    return np.ascontiguousarray(blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1])[:count])


def one_block(lanes: Any, number: int) -> Any:
    """One block of NamedTuples of blocks; tuples that are none stay as they are."""
    if hasattr(lanes, "_fields"):
        return type(lanes)(*(one_block(value, number) for value in lanes))
    return lanes if isinstance(lanes, tuple) else lanes[number]
