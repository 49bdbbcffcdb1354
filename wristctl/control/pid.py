"""The paper's rival: a PID controller, E22 read as a torque (C12) with the sign that stabilises (C7)."""

from typing import Any

from wristctl.control.clamped_integral import held, integrated
from wristctl.control.law import Controller, Gain


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """-(Kp e + Ki int(e) + Kd de/dt) (E22, sign C7); the integral holds while it would drive a saturated tendon on."""
    kp, ki, kd = gains.Kp, gains.Ki, gains.Kd
    error = now.theta - now.theta_ref
    integral = integrated(now, memory[0])
    torque = -(kp * error + ki * integral + kd * (now.rate - now.rate_ref))
    memory[0] = held(now, torque, memory[0], integral)
    return torque


PID = Controller(
    name="pid",
    law=law,
    source="the paper, E22",
    gains={
        "Kp": Gain("N m/rad", "proportional gain", 1e-2, 1e4),
        "Ki": Gain("N m/(rad s)", "integral gain", 1e-2, 1e4),
        "Kd": Gain("N m s/rad", "derivative gain", 1e-2, 1e4),
    },
    presets={"printed": {"Kp": 1e4, "Ki": 5e3, "Kd": 2e3}},
    memory=1,
    notes={"printed": 'the paper\'s "crude tuning", read as torque (C12) with the sign turned (C7)'},
)
