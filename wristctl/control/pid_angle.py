"""The paper's rival as it is printed: E22 gives a bending angle (C12's second reading)."""

from typing import Any

from wristctl.control.clamped_integral import held, integrated
from wristctl.control.law import Controller
from wristctl.control.model import one_segment
from wristctl.control.pid import PID
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import zero_like

_FURTHEST = 3.141592653589793


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque that would hold theta_bf = -(Kp e + Ki int(e) + Kd de/dt) at rest (E22, sign C7).

    theta_bf is kept within half a turn. The integral holds while it would drive a saturated tendon on.
    """
    kp, ki, kd = gains.Kp, gains.Ki, gains.Kd
    error = now.theta - now.theta_ref
    integral = integrated(now, memory[0])
    angle = -(kp * error + ki * integral + kd * (now.rate - now.rate_ref))
    angle = -maximum(-_FURTHEST, -maximum(-_FURTHEST, angle))
    _, torque = one_segment(wrist, angle, zero_like(angle))
    memory[0] = held(now, torque, memory[0], integral)
    return torque


PID_ANGLE = Controller(
    name="pid-angle",
    law=law,
    source="the paper, E22 as printed; how its angle becomes a torque is our design",
    gains=PID.gains,
    presets=PID.presets,
    memory=1,
    notes={"printed": 'the paper\'s "crude tuning", read as an angle (C12) with the sign turned (C7)'},
)
