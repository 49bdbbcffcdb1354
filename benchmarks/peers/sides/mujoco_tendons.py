"""MuJoCo: the rigid chain pulled by two spatial tendons through its discs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import mujoco_chain
import numpy as np

prepare: Callable[..., Callable[[int], np.ndarray]] = partial(mujoco_chain.prepare, tendons=True)
