"""Model reference adaptive control on the reduced one-segment (RPPR) model. The group's own law is not printed."""

from typing import Any

from wristctl.control.clamped_integral import delivered
from wristctl.control.law import BY_STUDY, Conditions, Controller, Gain
from wristctl.control.model import one_segment_terms
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import where, zero_like

LOWEST = (-0.8, -0.9, -0.8, -1.0, -1.0)
# Bounds of the adapted parameters, as deviations from the model: inertia, damping, stiffness and gravity relative to
# the model's (so inertia, damping and stiffness stay positive, gravity keeps its sign), and a constant load [N m].
HIGHEST = (3.0, 5.0, 2.0, 2.0, 1.0)

# Places in memory of the reference model's state and the first adapted parameter.
STARTED, MODEL_ANGLE, MODEL_RATE, PARAMETERS = 0, 1, 2, 3


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """Certainty equivalence Y a_hat - Kd s towards a reference model, a_hat' = -gamma Y^T s - leak (a_hat - a_0).

    The reference model is critically damped, (d/dt + w)^2 (theta_m - theta_ref) = 0: it smooths steps and follows a
    smooth reference without lag. With e = theta - theta_m, v = theta_m' - lambda e and s = rate - v, the regressor Y
    (1 x 5) holds the model's inertia and centrifugal torque M v' + C v, its damping D v, stiffness K theta, gravity G,
    and 1. On a wrist of the model's form V = M s^2/2 + |a_hat - a|^2/(2 gamma) then falls as V' = -Kd s^2 (Slotine
    and Li 1987); the leak (sigma modification, Ioannou) and the projection to bounds keep a_hat finite where it is not
    of that form. Adaptation holds while a tendon saturates.
    """
    frequency, slope, feedback, rate_of_adaptation, leak = gains.w, gains.lambda_, gains.Kd, gains.gamma, gains.leak
    h, zero = now.period, zero_like(now.period)
    started = memory[STARTED] > zero
    lag = where(started, memory[MODEL_ANGLE], now.theta) - now.theta_ref
    lag_rate = where(started, memory[MODEL_RATE], now.rate) - now.rate_ref
    model_angle, model_rate = now.theta_ref + lag, now.rate_ref + lag_rate
    lag_acceleration = -frequency * (frequency * lag + 2.0 * lag_rate)

    error, error_rate = now.theta - model_angle, now.rate - model_rate
    v = model_rate - slope * error
    s = now.rate - v
    inertia, curving, gravity = one_segment_terms(wrist, now.theta)
    moving = inertia * (now.acceleration_ref + lag_acceleration - slope * error_rate) + curving * now.rate * v
    regressor = (moving, wrist.damping * v, wrist.stiffness * now.theta, gravity, 1.0 + zero)
    torque = moving + regressor[1] + regressor[2] + gravity - feedback * s
    for k in range(len(regressor)):
        torque = torque + regressor[k] * memory[PARAMETERS + k]

    learns = delivered(now, torque)
    for k in range(len(regressor)):
        old = memory[PARAMETERS + k]
        adapted = (old - h * rate_of_adaptation * regressor[k] * s) / (1.0 + h * leak)
        memory[PARAMETERS + k] = where(learns, clip(adapted, LOWEST[k] + zero, HIGHEST[k] + zero), old)
    # implicit Euler on the lag: stable for every w
    pole = 1.0 + frequency * h
    lag_rate = (lag_rate - h * frequency * frequency * lag) / (pole * pole)
    lag = lag + h * lag_rate
    memory[STARTED] = 1.0 + zero
    memory[MODEL_ANGLE] = now.theta_ref + h * (now.rate_ref + 0.5 * h * now.acceleration_ref) + lag
    memory[MODEL_RATE] = now.rate_ref + h * now.acceleration_ref + lag_rate
    return torque


MRAC = Controller(
    name="mrac",
    law=law,
    source="our design after Slotine and Li, Int. J. Robotics Research 6 (1987) 49; the paper names an MRAC only",
    gains={
        "w": Gain("rad/s", "double pole of the reference model", 1e-1, 1e5),
        "lambda": Gain("1/s", "weight of the error in s", 1e-1, 1e5),
        "Kd": Gain("N m s/rad", "feedback of s", 1e-4, 1e2),
        "gamma": Gain("1/(J s)", "adaptation gain", 1e-2, 1e4),
        "leak": Gain("1/s", "rate at which parameters return to the model's", 1e-6, 1e0),
    },
    presets={
        "default": {"w": 80.0, "lambda": 80.0, "Kd": 0.5, "gamma": 100.0, "leak": 1e-3},
        "hardware": {"w": 17.7, "lambda": 46.7, "Kd": 8.7e-4, "gamma": 2.95, "leak": 2.3e-3},
    },
    memory=PARAMETERS + len(LOWEST),
    notes={
        "default": "our design; chosen by trial on the four-segment plant at 1 kHz",
        "hardware": BY_STUDY,
    },
    conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
