"""soromox: its planar constant-strain rod, bending only; the hand is one more link, rigid.

Mass is spread along the rod and the hand is a rod of twice the offset: the same masses and centres, but rotary inertia
that the wrist's model leaves out, by quadrature (5 points a link). Springs, dampers, gravity, law and limits are the
task's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from equations import Segment, torque  # noqa: E402
from rosenbrock import closed_loop  # noqa: E402
from soromox.systems.components.links import LinkSpec  # noqa: E402
from soromox.systems.pcs.planar_pcs import PlanarPCS  # noqa: E402
from soromox.systems.pcs.structures import PlanarPCSStructure  # noqa: E402
from task import Task  # noqa: E402

RADIUS = 1e-3
"""Of every link [m]: small, so that cross-sections add no rotary inertia worth the name."""


def _link(length: float, mass: float, stiffness: float, damping: float) -> LinkSpec:
    def bending(value: float) -> jnp.ndarray:  # of the curvature; the coordinate is the angle
        return jnp.diag(jnp.array([value * length**2, 1.0, 1.0]))

    density = mass / (length * np.pi * RADIUS**2)
    return LinkSpec.circular(
        length=length, radius=RADIUS, density=density, reference_strain=[0.0, 1.0, 0.0],
        stiffness=bending(stiffness), damping=bending(damping),
    )  # fmt: skip


def prepare(task: Task, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """Its forward dynamics inside RODAS3 with the Jacobian by differentiation."""
    s, n, model = Segment(*map(float, task.plant)), task.segments, Segment(*map(float, task.model))
    links = [_link(s.length, s.mass, s.stiffness, s.damping)] * n + [_link(2.0 * s.hand_offset, s.hand_mass, 1.0, 1.0)]
    arm = PlanarPCS.from_links(
        links,
        gravity=jnp.array([s.gravity_x, s.gravity_y]),
        structure=PlanarPCSStructure(
            strain_selector=jnp.array([True, False, False] * n + [False] * 3), scale_rotational_basis_by_length=True
        ),
        base_pose=jnp.zeros(3),
        backend="jax",
    )

    def rates(state: Any, theta: Any, plus: Any, minus: Any) -> Any:
        push = jnp.full(n, torque(model, theta, plus, minus))
        return arm.forward_dynamics(jnp.array(0.0), state, (jnp.zeros(arm.num_actuators), push))

    return closed_loop(task, lanes, steps, rates)
