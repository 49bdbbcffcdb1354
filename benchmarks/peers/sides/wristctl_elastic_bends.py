"""wristctl in two planes with motors that reel elastic tendons, which slide freely."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import wristctl_bends

prepare: Callable[..., Callable[[int], np.ndarray]] = partial(wristctl_bends.prepare, actuator="tendon")
