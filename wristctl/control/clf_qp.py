"""Control Lyapunov function as a quadratic programme: of the accelerations that the tendons of all planes together can
give the one nearest a regulator's under which the error decays fast enough.

A rapidly exponentially stabilising function V of the error asks for V' <= -lambda V (Ames, Galloway, Sreenath and
Grizzle, IEEE TAC 59 (2014) 876); where the actuators cannot give that, the programme gives as much as they can
(Galloway et al., IEEE Access 3 (2015) 323; of tendon-driven soft robots Pham and Patterson, arXiv 2603.05638). Here the
model of each plane is cancelled, with what a disturbance observer sees, so that V is the value of a linear-quadratic
regulator, the same in every plane, and the programme has as many unknowns as the wrist has planes.
"""

from typing import Any

from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import Conditions, Controller, Gain
from wristctl.control.model import one_segment
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like

_LEAST_DAMPING = 2.0**-0.5
# Area of two arms that is none, over the longest one's square; more than any cost or torque; a pull [N] without limit.
_PARALLEL, _HUGE, _NO_LIMIT = 1e-10, 1e300, 1e9


@compiled
def least_acceleration(decay: Any, slope: Any, price: Any, base: Any, arms: Any, room: Any, out: Any) -> None:
    """Write the accelerations m (P rows) [rad/s^2] with the least |m|^2 + price max(0, decay + slope.m)^2 in reach.

    In reach is `base` (P rows) with the sum of `arms` (P T rows, a plane's after the other's) times anything from 0 to
    `room` (T rows). The least point of all, which has a closed form, is taken where it is in reach. Else the least one
    is on the border: in one plane the nearer end; in two on an edge, which is parallel to an arm while all others give
    nothing or all. On each edge it has a closed form too, and the best of the edges is taken.
    """
    planes, count, zero = len(out), len(room), zero_like(decay)
    violated, size = maximum(decay, 0.0), zero
    for p in range(planes):
        size = size + slope[p] * slope[p]
    for p in range(planes):
        out[p] = -price * violated * slope[p] / (1.0 + price * size)
    if planes == 1:
        low, high = base[0], base[0]
        for t in range(count):
            low = low + where(arms[t] < 0.0, arms[t], 0.0) * room[t]
            high = high + where(arms[t] > 0.0, arms[t], 0.0) * room[t]
        out[0] = clip(out[0], low, high)
    else:
        _best_of_edges(decay, slope, price, base, arms, room, out)


@compiled
def _best_of_edges(decay: Any, slope: Any, price: Any, base: Any, arms: Any, room: Any, out: Any) -> None:
    count, zero = len(room), zero_like(decay)
    square, wanted_y, wanted_z = zero, out[0] - base[0], out[1] - base[1]
    for t in range(count):
        square = maximum(square, arms[t] * arms[t] + arms[count + t] * arms[count + t])
    inside, least, best_y, best_z = zero < 1.0, _HUGE + zero, zero, zero
    for i in range(count):
        arm_y, arm_z = arms[i], arms[count + i]
        length = arm_y * arm_y + arm_z * arm_z
        across, is_arm = arm_y * wanted_z - arm_z * wanted_y, length > _PARALLEL * square
        for side in range(2):
            start_y, start_z, border = base[0], base[1], zero
            for k in range(count):
                area = arm_y * arms[count + k] - arm_z * arms[k]
                beyond_it = area > _PARALLEL * square if side == 0 else area < -(_PARALLEL * square)
                pull = where(beyond_it, room[k], 0.0)
                start_y, start_z = start_y + pull * arms[k], start_z + pull * arms[count + k]
                border = border + pull * area
            inside = inside & ((across <= border if side == 0 else across >= border) | (length <= _PARALLEL * square))
            along = start_y * arm_y + start_z * arm_z
            misses, growth = decay + slope[0] * start_y + slope[1] * start_z, slope[0] * arm_y + slope[1] * arm_z
            free = where(is_arm, -along / where(is_arm, length, 1.0), 0.0)
            pays = misses + growth * free > 0.0
            paid = -(along + price * misses * growth) / (where(is_arm, length, 1.0) + price * growth * growth)
            pull = clip(where(pays, paid, free), 0.0, room[i])
            y, z = start_y + pull * arm_y, start_z + pull * arm_z
            missing = maximum(decay + slope[0] * y + slope[1] * z, 0.0)
            cost = where(is_arm, y * y + z * z + price * missing * missing, _HUGE)
            better = cost < least
            least = where(better, cost, least)
            best_y, best_z = where(better, y, best_y), where(better, z, best_z)
    out[0], out[1] = where(inside, out[0], best_y), where(inside, out[1], best_z)


def law(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    """M (theta_ref'' + m) + load - d in each plane, m of the programme, d the load torque that the momentum shows.

    With the weights (w, zeta) of the error V = sum of 2 zeta w^3 e^2 + 2 w^2 e e' + 2 zeta w e'^2 is the cost to go of
    the regulator m = -w^2 e - 2 zeta w e'. The programme keeps to that where V falls by itself as fast as lambda asks
    and the tendons reach it. An error of less than `slack` may let V fall more slowly, so that m stays finite where it
    does not change V.
    """
    planes, count = len(torque), len(tendons.least)
    w, zeta = gains.w, maximum(_LEAST_DAMPING, gains.zeta)
    arms, room = lanes_like(tendons.arms), lanes_like(tendons.least)
    base, slope, acceleration = lanes_like(torque), lanes_like(torque), lanes_like(torque)
    inertia, free, load = lanes_like(torque), lanes_like(torque), lanes_like(torque)
    decay = zero_like(w)
    for t in range(count):
        room[t] = minimum(tendons.greatest[t] - tendons.least[t], _NO_LIMIT)
    for p in range(planes):
        view = now[p]
        unmodelled = disturbance(view, wrist[p], gains.wo, memory[p], 0)
        mass, held = one_segment(wrist[p], view.theta, view.rate)
        inertia[p], load[p] = mass, unmodelled
        free[p] = mass * view.acceleration_ref + held - unmodelled
        resting, lowest = zero_like(w), zero_like(w)
        for t in range(count):
            arm = tendons.arms[count * p + t]
            resting = resting + arm * tendons.least[t]
            lowest = lowest + arm * (tendons.least[t] + where(arm < 0.0, room[t], 0.0))
            arms[count * p + t] = arm / mass
        spent = where(view.torque_low > -_HUGE, lowest - view.torque_low, 0.0)  # on what the planes do to each other
        error, error_rate = view.theta - view.theta_ref, view.rate - view.rate_ref
        tied = w * (2.0 * zeta * w * error + error_rate)
        pushed = w * (w * error + 2.0 * zeta * error_rate)
        slope[p] = 2.0 * pushed
        base[p] = (resting - spent - free[p]) / mass + pushed
        decay = decay + 2.0 * w * tied * error_rate + gains.lambda_ * (w * tied * error + pushed * error_rate)
        decay = decay - 2.0 * pushed * pushed
    price = 1.0 / (gains.slack * w * w * w) ** 2
    least_acceleration(decay, slope, price, base, arms, room, acceleration)
    for p in range(planes):
        torque[p] = inertia[p] * (acceleration[p] - 0.5 * slope[p]) + free[p]
        remember(now[p], wrist[p], load[p], torque[p], memory[p], 0)


CLF_QP = Controller(
    name="clf-qp",
    law=law,
    source="Pham and Patterson, arXiv 2603.05638; Ames et al., IEEE TAC 59 (2014) 876; with a disturbance observer",
    gains={
        "w": Gain("rad/s", "natural frequency of the regulator whose cost is the Lyapunov function", 1e-1, 1e5),
        "zeta": Gain("", "its damping ratio; at least sqrt(1/2)", 1e-3, 1e3),
        "lambda": Gain("1/s", "rate at which the Lyapunov function has to fall", 1e-1, 1e5),
        "slack": Gain("rad", "error below which it may fall more slowly", 1e-7, 1e-1),
        "wo": Gain("rad/s", "bandwidth of the disturbance observer", 1e-1, 1e5),
    },
    presets={
        "default": {"w": 50.0, "zeta": 1.0, "lambda": 50.0, "slack": 1e-4, "wo": 50.0},
        "hardware": {"w": 36.0, "zeta": 0.71, "lambda": 1.2, "slack": 6e-4, "wo": 230.0},
    },
    memory=VALUES,
    planes=2,
    notes={
        "hardware": "behind a 60 Hz camera, steppers and tendons of 8 to 100 kN/m: tuned on worlds of that rig, in few "
        "digits"
    },
    conditions={"default": Conditions((5e-3, 1e-2), (2e4, 1e5)), "hardware": Conditions((5e-3, 1e-2), (2e4, 1e5))},
)
