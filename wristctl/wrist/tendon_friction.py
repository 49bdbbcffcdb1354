"""Friction of a tendon on what it is wrapped around: the capstan's exp(-mu phi z), z the state of Dahl's bristle.

Pull at the wrist = pull at the spool x exp(-mu phi z), phi the angle that the tendon is wrapped by (the wrist's bend
and a sheath's), z in [-1, 1]. Dahl (A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1, 1968): dz/dx =
(1 - z sign(dx))/s, so that z is a function of the path alone, z = sg + (z0 - sg) exp(-|x - x0|/s): at rest it keeps its
state (stiction), after a turn it needs some s to turn round (presliding), and how fast it goes does not matter.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import exp, expm1_of_negative
from wristctl.lanes.lane import where


@compiled
def bristle(z: Any, travel: Any, slope: Any) -> Any:
    """The bristle's state after its tendon has moved by `travel` [m], positive towards the spool; slope 1/s [1/m]."""
    sign = where(travel < 0.0, -1.0, 1.0)
    return z - expm1_of_negative(-slope * abs(travel)) * (sign - z)


@compiled
def capstan(friction: Any, wrapped: Any, z: Any) -> Any:
    """Pull at the wrist over pull at the spool."""
    return exp(-friction * wrapped * z)


@compiled
def bristle_slope(z: Any, speed: Any, slope: Any) -> Any:
    """dz/dx [1/m] where the tendon moves at this speed; between both directions' where it is at rest."""
    sign = where(speed > 0.0, 1.0, where(speed < 0.0, -1.0, 0.0))
    return (1.0 - z * sign) * slope
