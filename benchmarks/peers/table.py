"""The table of sides: a newcomer is one file in sides/, its pinned requirements and one line here."""

from __future__ import annotations

from dataclasses import dataclass, field

SAME = "the same equations"
RIGID = "easier: rigid links, one hinge a segment, no arcs"
FIRST = "first order, implicit in damping"


@dataclass(frozen=True)
class Side:
    """One measured program."""

    name: str
    module: str
    """File in sides/."""
    venv: str | None
    """Name of the requirements file; None: wristctl's own environment."""
    problem: str = SAME
    steps: dict[int, int] = field(default_factory=lambda: {1: 1, 4: 1})
    """Integration steps in one control period, by number of segments; a side without a number is left out."""
    fine: dict[int, int] | None = None
    """Steps of its own reference trajectory, where it solves other equations than wristctl."""
    most_lanes: int = 1024
    """Beyond this the rate is that of fewer lanes: its loop over lanes is Python's."""
    width: int | None = None
    """Lanes side by side in the C loop."""


SIDES = (
    Side("wristctl", "wristctl_side", None),
    Side("wristctl, small steps", "wristctl_side", None, steps={1: 5, 4: 5}),
    Side("C, 16 lanes", "c_side", None, width=16),
    Side("C, 8 lanes", "c_side", None, width=8),
    Side("JAX, lane layout", "jax_lanes", "jax"),
    Side("JAX, vmap", "jax_vmap", "jax", "the same equations; Jacobian by differentiation"),
    Side("NumPy", "numpy_side", None),
    Side(
        "soromox", "soromox_arm", "soromox",
        "another rod: mass spread along it, hand a rigid rod with rotary inertia; RODAS3, Jacobian by differentiation",
        fine={1: 8, 4: 8},
    ),
    Side("MuJoCo, chain", "mujoco_chain", "mujoco", f"{RIGID}; {FIRST}", fine={1: 2048, 4: 2048}),
    Side("MuJoCo, chain, small steps", "mujoco_chain", "mujoco", f"{RIGID}; {FIRST}", {4: 256}, {4: 2048}),
    Side("MuJoCo, chain, RK4", "mujoco_rk4", "mujoco", f"{RIGID}; unstable for n = 4", {1: 1}, {1: 16}),
    Side("MuJoCo, tendons", "mujoco_tendons", "mujoco", f"{RIGID}; spatial tendons", {4: 1}, {4: 2048}),
    Side(
        "Pinocchio", "pinocchio_chain", "pinocchio", f"{RIGID}; RK4 at n = 1, else implicit Euler, in Python",
        fine={1: 16, 4: 256}, most_lanes=1,
    ),
)  # fmt: skip
