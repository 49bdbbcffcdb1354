"""The arrays that everything is computed with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Of 64-bit floats; shapes are in the docstrings."""
