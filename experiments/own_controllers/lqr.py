"""LQR: the least of weighted squares of error, its rate and the acceleration spent on them.

With inertia and load of the one-segment model cancelled the error obeys e'' = v, for which the Riccati equation has a
closed form (Anderson and Moore, Optimal Control, 1990): v = -sqrt(q) e - sqrt(qd + 2 sqrt(q)) e'.
"""

from wristctl.control.law import Controller, Gain
from wristctl.control.model import one_segment
from wristctl.lanes.lane import sqrt


def law(now, wrist, gains, memory):
    """M (theta_ref'' + v) + load."""
    inertia, load = one_segment(wrist, now.theta, now.rate)
    stiff = sqrt(gains.q)
    damp = sqrt(gains.qd + 2.0 * stiff)
    v = -stiff * (now.theta - now.theta_ref) - damp * (now.rate - now.rate_ref)
    return inertia * (now.acceleration_ref + v) + load


LQR = Controller(
    name="lqr",
    law=law,
    source="Anderson and Moore, Optimal Control, 1990",
    gains={
        "q": Gain("1/s^4", "weight of the squared error over that of the squared acceleration", 1e2, 1e9),
        "qd": Gain("1/s^2", "weight of its squared rate", 1e-2, 1e5),
    },
    presets={"default": {"q": 4.0e6, "qd": 100.0}, "hardware": {"q": 2.0e4, "qd": 100.0}},
)
