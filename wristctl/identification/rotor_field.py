"""How far a stepper's rotor gives way to its tendon's pull: a magnetic field is a spring that softens.

The rotor stands turn/(2 pi) asin(pull/holding) behind its field (Acarnley, Stepping Motors, 4th ed., ch. 4), as a
length of tendon. To first order that is a spring in series with the tendon, and part of the tendon stiffness that is
found. What is beyond it is known where the motors' holding torque is.
"""

import math
from typing import Any, NamedTuple

from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import minimum
from wristctl.lanes.lane import zero_like
from wristctl.simulation.nonideal import electrical_turn
from wristctl.wrist.tendon_mechanics import spool_pull


class Field(NamedTuple):
    """Length of tendon in one radian of the field [m], and one over the pull that it holds [1/N]."""

    radian: Any
    per_newton: Any


def field_of(motors: Actuator, holding: float) -> Field:
    """The field of motors that hold a torque [N m]; inf: it gives no way."""
    return Field(electrical_turn(motors) / (2.0 * math.pi), motors.pulley_radius / holding)


@compiled
def on_rotor(field: Any, tendons: Any, spooled: Any, t: int, shortened: Any) -> Any:
    """Length [m] that a tendon has on a spool whose field stands at `spooled`: less than that beyond the first order.

    asin(s) - s by its series up to the ninth order: within 0.002 of a radian up to three quarters of what it holds.
    """
    pull = spool_pull(tendons, spooled, t, shortened)
    share = minimum(pull * field.per_newton, zero_like(pull) + 1.0)
    square = share * share
    beyond = 1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0 + square * (105.0 / 3456.0)))
    return spooled - field.radian * (share * square * beyond)
