"""Model predictive control by a solver from elsewhere, OSQP: plain Python, with settings of its own.

With inertia and load of the one-segment model cancelled the angle obeys theta'' = v. The plan v over the horizon is the
least of weighted squares of error, its rate and v - theta_ref'', within what the tendons reach now.
"""

import numpy as np
import osqp
from scipy import sparse

from wristctl.config.section import Parameter
from wristctl.control.design import LawDesign
from wristctl.control.law import Controller
from wristctl.control.plain_model import plain_one_segment


def make(settings):
    """The controller for a horizon and weights."""
    steps = round(settings["horizon"])
    weights = np.tile([settings["angle_weight"], settings["rate_weight"]], steps)

    class Mpc:
        """One rollout's: the solver is made at its first tick, and goes on from each tick's solution at the next."""

        def __init__(self):
            self.solver = None

        def begin(self, h):
            """Angle and rate after each step, x = start + push v, and the programme's constant matrix."""
            step, by_v = np.array([[1.0, h], [0.0, 1.0]]), np.array([0.5 * h * h, h])
            self.push = np.zeros((2 * steps, steps))
            self.drift = np.zeros((2 * steps, 2))
            power = np.eye(2)
            for k in range(steps):
                self.push[2 * k : 2 * k + 2] = step @ self.push[2 * k - 2 : 2 * k] if k else 0.0
                self.push[2 * k : 2 * k + 2, k] = by_v
                power = step @ power
                self.drift[2 * k : 2 * k + 2] = power
            matrix = self.push.T @ (weights[:, None] * self.push) + np.eye(steps)
            self.solver = osqp.OSQP()
            free = np.full(steps, np.inf)
            self.solver.setup(
                sparse.csc_matrix(np.triu(matrix)), np.zeros(steps), sparse.eye(steps, format="csc"), -free, free,
                verbose=False, eps_abs=1e-4, eps_rel=1e-4, max_iter=200,
            )  # fmt: skip

        def __call__(self, now, wrist, gains, memory):
            """M v + load, v the plan's first."""
            if self.solver is None:
                self.begin(now.period)
            to_come = np.array([now.ahead(k) for k in range(1, steps + 1)])
            wished = np.concatenate([[now.acceleration_ref], to_come[:-1, 2]])
            lead = self.drift @ [now.theta, now.rate] - to_come[:, :2].ravel()
            inertia, load = plain_one_segment(wrist, now.theta, now.rate)
            least, most = (now.torque_low - load) / inertia, (now.torque_high - load) / inertia
            self.solver.update(
                q=self.push.T @ (weights * lead) - wished, l=np.full(steps, least), u=np.full(steps, most)
            )
            v = float(self.solver.solve(raise_error=False).x[0])
            return inertia * min(max(v, least), most) + load

    return Controller(
        name="mpc-osqp",
        law=Mpc,
        source="Stellato et al., Math. Prog. Comp. 12 (2020) 637",
        gains={},
        presets={"default": {}},
        preview=steps,
        plain=True,
    )


MPC = LawDesign(
    name="mpc-osqp",
    section={
        "horizon": Parameter(20.0, "", "control periods that are planned"),
        "angle_weight": Parameter(4.0e6, "1/s^4", "of the squared error over that of the squared acceleration"),
        "rate_weight": Parameter(4.0e3, "1/s^2", "of its squared rate"),
    },
    make=make,
)
