"""The table of sides: a newcomer is one file in sides/, its pinned requirements and one line here."""

from __future__ import annotations

from dataclasses import dataclass, field

SAME = "the same equations"
RIGID = "easier: rigid links, one hinge a segment, no arcs"
UNIVERSAL = "easier: rigid links, one universal joint a segment, no arcs, no tendons"
OURS = "wristctl"


@dataclass(frozen=True)
class Side:
    """One measured program."""

    name: str
    peer: str
    """Whose program it is: several sides may be ways to use the same one."""
    module: str
    """File in sides/."""
    venv: str | None
    """Name of the requirements file; None: wristctl's own environment."""
    problem: str = SAME
    fine: dict[int, int] | None = None
    """Steps a tick of its own reference trajectory by number of segments, where it solves other equations."""
    most_steps: int = 1
    """Most integration steps a tick that may be tried to reach wristctl's error."""
    most_lanes: int = 1024
    """Beyond this the rate is that of fewer lanes: its loop over lanes is Python's."""
    width: int | None = None
    """Lanes side by side in the C loop."""
    segments: tuple[int, ...] = field(default=(1, 4))


def _mujoco_chains(problem: str, implicit: str, explicit: str) -> tuple[Side, Side]:
    """MuJoCo's two integrators on a chain of rigid links, by their modules."""
    return (
        Side(
            "MuJoCo, chain", "MuJoCo", implicit, "mujoco", f"{problem}; first order, implicit in damping",
            fine={1: 4096, 4: 4096}, most_steps=512,
        ),
        Side(
            "MuJoCo, chain, RK4", "MuJoCo", explicit, "mujoco", f"{problem}; explicit, fourth order",
            fine={1: 64, 4: 2048}, most_steps=512,
        ),
    )  # fmt: skip


SIDES = (
    Side(OURS, OURS, "wristctl_side", None),
    Side("C, 16 lanes", "C", "c_side", None, width=16),
    Side("C, 8 lanes", "C", "c_side", None, width=8),
    Side("JAX, lane layout", "JAX", "jax_lanes", "jax"),
    Side("JAX, vmap", "JAX", "jax_vmap", "jax", "the same equations; Jacobian by differentiation"),
    Side("NumPy", "NumPy", "numpy_side", None),
    Side(
        "soromox", "soromox", "soromox_arm", "soromox",
        "another rod: mass spread along it, hand a rigid rod with rotary inertia; RODAS3, Jacobian by differentiation",
        fine={1: 8, 4: 8}, most_steps=2,
    ),
    *_mujoco_chains(RIGID, "mujoco_chain", "mujoco_rk4"),
    Side(
        "MuJoCo, tendons", "MuJoCo", "mujoco_tendons", "mujoco", f"{RIGID}; spatial tendons; first order",
        fine={4: 2048}, segments=(4,),
    ),
    Side(
        "Pinocchio", "Pinocchio", "pinocchio_chain", "pinocchio",
        f"{RIGID}; RK4 at n = 1, else implicit Euler, in Python", fine={1: 16, 4: 256}, most_steps=16, most_lanes=1,
    ),
)  # fmt: skip

ELASTIC = "elastic tendons"
BEND_SIDES = (
    Side(OURS, OURS, "wristctl_bends", None),
    Side(
        "wristctl, elastic tendons", ELASTIC, "wristctl_elastic_bends", None,
        "the same wrist pulled by elastic tendons that motors reel in", fine={1: 16, 4: 16},
    ),
    Side("C, 8 lanes", "C", "c_bends", None, width=8),
    Side(
        "soromox", "soromox", "soromox_bends", "soromox",
        "easier: no tendons; mass spread along the rod; RODAS3, Jacobian by differentiation", fine={1: 8, 4: 8},
        most_steps=2,
    ),
    *_mujoco_chains(UNIVERSAL, "mujoco_bends", "mujoco_bends_rk4"),
)  # fmt: skip
"""Of the wrist that bends in two planes."""
