"""The paper's numbers (T2: simulation, ulnar, 30 deg) and what counts as having reproduced them."""

import math
from decimal import Decimal
from typing import NamedTuple


class Ends(NamedTuple):
    """The least and the greatest that a number may be."""

    low: float
    high: float


def rounded(printed: float) -> Ends:
    """Ends of what is printed so: half a unit of the last digit either way, as the shortest decimal shows it."""
    value = Decimal(repr(printed))
    digits = value.to_integral_value() if value == value.to_integral_value() else value
    half = Decimal(5).scaleb(int(digits.as_tuple().exponent) - 1)
    return Ends(float(value - half), float(value + half))


class Printed(NamedTuple):
    """One row of T2: RMSE [rad], settling time [s], steady-state error [rad]."""

    rmse: float
    settling: float
    steady_state: float


T2: dict[str, Printed] = {
    "smc": Printed(2.7e-4, 1.2, 2.31e-4),
    "pid": Printed(1.5e-3, 3.0, 2.48e-3),
    "mrac": Printed(1.2e-3, 2.8, 1.3e-3),
    "gvsc": Printed(2.9e-2, 3.18, 1.4e-2),
    "nc": Printed(5.0e-2, 1.02, 1.9e-2),
}

# The experiment: the mean of the directions, and two with a person's push (whose units are printed as m and s).
EXPERIMENT: dict[str, Printed] = {
    "four directions": Printed(0.157, 3.0, 0.032),
    "pushed, radial": Printed(0.207, 3.0, 0.029),
    "pushed, flexion": Printed(0.291, 3.0, 0.031),
}


class TrainingColumn(NamedTuple):
    """One column of T1; the paper says of neither loss nor gradient on what scale it is."""

    gradient_norm: float
    accuracy: float
    """[%], undefined (C8)"""
    train_loss: float
    validation_loss: float


T1: dict[str, TrainingColumn] = {
    "sigmoid": TrainingColumn(0.0012, 99.7, 0.05, 0.01),
    "relu": TrainingColumn(0.097, 95.5, 0.55, 0.25),
    "leaky-relu": TrainingColumn(0.041, 97.1, 0.31, 0.10),
    "tanh": TrainingColumn(0.011, 98.8, 0.22, 0.09),
}

# RMSE and settling time within this factor of the paper's, steady-state error not above that, count as reproduced.
#
# The factor counts from the ends of what the printed digits may stand for (`rounded`). The paper states neither
# reference, nor sampling, nor limits (C10), so a tighter band would claim more than it says.
FACTOR = 1.5


def verdict(controller: str, rmse: float, settling: float, steady_state: float) -> str:
    """`reproduced`, `not reproduced`, or "" for a controller that the paper does not have."""
    if controller not in T2:
        return ""
    printed = [rounded(number) for number in T2[controller]]
    within = all(
        math.isfinite(ours) and paper.low / FACTOR <= ours <= paper.high * FACTOR
        for ours, paper in zip((rmse, settling), printed, strict=False)
    )
    return "reproduced" if within and steady_state <= FACTOR * printed[2].high else "not reproduced"
