"""MuJoCo: the rigid chain by its explicit fourth-order method, which one segment's damping allows."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import mujoco_chain
import numpy as np

prepare: Callable[..., Callable[[int], np.ndarray]] = partial(mujoco_chain.prepare, integrator="RK4")
