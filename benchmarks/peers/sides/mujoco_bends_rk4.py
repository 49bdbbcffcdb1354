"""MuJoCo in two planes: the rigid chain by its explicit fourth-order method."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import mujoco_bends
import numpy as np

prepare: Callable[..., Callable[[int], np.ndarray]] = partial(mujoco_bends.prepare, integrator="RK4")
