"""The settling time that is left when the reference's own motion is over."""

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.metrics import SETTLING, Metric, Totals


def _settling_after(of: Totals) -> Array:
    assert SETTLING.of_totals is not None
    return np.maximum(SETTLING.of_totals(of) - of.goals["rest"], 0.0)


SETTLING_AFTER = Metric(
    "s",
    "settling time from when the reference rests; 0 where the angle is within +-2 % by then; never: nan",
    _settling_after,
    never=lambda horizon: horizon,
    floor=0.01,
)
