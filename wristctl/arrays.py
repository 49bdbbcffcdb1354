"""The arrays that everything is computed with."""

from collections.abc import Hashable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Of 64-bit floats; shapes are in the docstrings."""
_Value = TypeVar("_Value", bound=Hashable)


def distinct(values: Sequence[_Value]) -> tuple[tuple[_Value, ...], NDArray[np.int64]]:
    """Those of the values (N,) that differ, in their order, and which of them each is, (N,)."""
    numbers = dict[_Value, int]()
    which = [numbers.setdefault(each, len(numbers)) for each in values]
    return tuple(numbers), np.array(which, np.int64)
