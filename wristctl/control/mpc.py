"""Model predictive control: the best course of torques over the preview within what tendons reach, anew each period.

The one-segment model is cancelled, so what is left to plan is e'' = v - theta_ref'' with v [rad/s^2] in a box: a
quadratic programme with one input of bounded size. It is solved by ADMM with a fixed number of turns (Stellato et al.,
Math. Prog. Comp. 12 (2020) 637), whose linear system is that of an unconstrained tracking problem: one Riccati sweep a
period, two sweeps of vectors a turn, no branch (TinyMPC: Nguyen et al., ICRA 2024). The group's own MPC for this wrist
(arXiv 2510.19541) does not print horizon, weights or period.
"""

from typing import Any

from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain, ahead
from wristctl.control.model import one_segment
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.rows import beyond, lanes_like, part

# Control periods that are planned.
HORIZON = 20
TURNS = 25
_STEPS = (0,) * HORIZON
_RELAXED, _LEAST_DAMPING = 1.6, 2.0**-0.5


@compiled
def riccati(h: Any, weights: Any, by_start: Any, by_speed: Any, share: Any) -> Any:
    """Sweep backward over the horizon at weights (w, zeta) of the error, in periods of h.

    Writes the gains of each step on angle and rate and 1/(effort + B'PB), and returns the weights of a step on angle
    and rate, the price of a change of the plan, and the end's cost to go (p11, p12, p22).
    """
    w, zeta = weights
    w2 = w * w
    by_angle, by_rate = h * w2 * w2, h * (4.0 * zeta * zeta - 2.0) * w2
    span = 1.0 + HORIZON * h * w * (2.0 * zeta + HORIZON * h * w)
    price = 0.05 * span  # by trial, over horizons of 0.4 to 10 of the error's time constants
    effort = h * (1.0 + price)
    p11, p12, p22 = 2.0 * zeta * w2 * w, w2, 2.0 * zeta * w
    end11, end12, end22 = p11, p12, p22
    for step in range(HORIZON):
        k = HORIZON - 1 - step
        b1, b2 = h * (0.5 * h * p11 + p12), h * (0.5 * h * p12 + p22)
        inverse = 1.0 / (effort + h * (0.5 * h * b1 + b2))
        c1, c2 = b1, h * b1 + b2
        share[k] = inverse
        by_start[k] = inverse * c1
        by_speed[k] = inverse * c2
        q11, q12, q22 = p11, p12 + h * p11, p22 + 2.0 * h * p12 + h * h * p11
        p11, p12, p22 = by_angle + q11 - inverse * c1 * c1, q12 - inverse * c1 * c2, by_rate + q22 - inverse * c2 * c2
    return by_angle, by_rate, price, (end11, end12, end22)


@compiled
def plan(now: Any, start: Any, weights: Any, box: Any, kept: Any, turns: int) -> Any:
    """The first of the accelerations [rad/s^2] that bring the double integrator along the reference at least cost.

    From `start` (angle, rate), at weights (w, zeta) the cost over the horizon is sum h ((v - theta_ref'')^2 + w^4 e^2 +
    (4 zeta^2 - 2) w^2 e'^2), its end what a horizon without end would cost: unconstrained, the plan begins with
    theta_ref'' - 2 zeta w e' - w^2 e. `box` is the least and the largest v; `kept` (2 HORIZON,) the plan of the period
    before and its multipliers, of which this begins.
    """
    w, zeta = weights[0], maximum(_LEAST_DAMPING, weights[1])
    low, high = box
    h = now.period
    plans, multipliers = part(kept, 0, _STEPS), part(kept, HORIZON, _STEPS)
    by_start, by_speed, share = lanes_like(plans), lanes_like(plans), lanes_like(plans)
    shift, wished = lanes_like(plans), lanes_like(plans)
    by_angle, by_rate, price, (end11, end12, end22) = riccati(h, (w, zeta), by_start, by_speed, share)

    wished[0] = now.acceleration_ref
    for k in range(1, HORIZON):
        wished[k] = ahead(now, k)[2]

    for _ in range(turns):
        angle_ref, rate_ref, _ = ahead(now, HORIZON)
        g1, g2 = end11 * angle_ref + end12 * rate_ref, end12 * angle_ref + end22 * rate_ref
        for step in range(HORIZON):
            k = HORIZON - 1 - step
            pull = h * (wished[k] + price * (plans[k] - multipliers[k])) + h * (0.5 * h * g1 + g2)
            shift[k] = share[k] * pull
            g1, g2 = g1 - by_start[k] * pull, h * g1 + g2 - by_speed[k] * pull
            if k > 0:
                angle_ref, rate_ref, _ = ahead(now, k)
                g1, g2 = g1 + by_angle * angle_ref, g2 + by_rate * rate_ref
        angle, rate = start
        for k in range(HORIZON):
            v = shift[k] - by_start[k] * angle - by_speed[k] * rate
            angle, rate = angle + h * (rate + 0.5 * h * v), rate + h * v
            relaxed = _RELAXED * v + (1.0 - _RELAXED) * plans[k]
            wanted = relaxed + multipliers[k]
            plans[k] = clip(wanted, low, high)
            multipliers[k] = wanted - plans[k]
    return plans[0]


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """M v + load - d, v the first acceleration of the plan, d the load torque that the momentum shows.

    The box of v is what tendons reach at the present angle, for the whole horizon.
    """
    unmodelled = disturbance(now, wrist, gains.wo, memory, 0)
    inertia, load = one_segment(wrist, now.theta, now.rate)
    box = (now.torque_low - load + unmodelled) / inertia, (now.torque_high - load + unmodelled) / inertia
    kept = beyond(memory, VALUES)
    for k in range(HORIZON - 1):
        kept[k] = kept[k + 1]
        kept[HORIZON + k] = kept[HORIZON + k + 1]
    torque = inertia * plan(now, (now.theta, now.rate), (gains.w, gains.zeta), box, kept, TURNS) + load - unmodelled
    remember(now, wrist, unmodelled, torque, memory, 0)
    return torque


MPC = Controller(
    name="mpc",
    law=law,
    source="our design: condensed by Riccati, ADMM of fixed turns (Nguyen et al., ICRA 2024, TinyMPC)",
    gains={
        "w": Gain("rad/s", "natural frequency of the unconstrained error", 1e-1, 1e5),
        "zeta": Gain("", "its damping ratio; at least sqrt(1/2)", 1e-3, 1e3),
        "wo": Gain("rad/s", "bandwidth of the disturbance observer", 1e-1, 1e5),
    },
    presets={
        "default": {"w": 50.0, "zeta": 1.0, "wo": 50.0},
        "hardware": {"w": 45.0, "zeta": 0.8, "wo": 200.0},
    },
    memory=VALUES + 2 * HORIZON,
    preview=HORIZON,
    notes={"hardware": BY_TRIAL},
    conditions={"default": Conditions((5e-3, 1e-2), (8e3, 1e5)), "hardware": Conditions((5e-3, 1e-2), (2e4, 1e5))},
)
