"""soromox in two planes: its constant-strain rod in space, bending only; the hand is one more link, rigid.

Mass is spread along the rod and the hand is a rod of twice the offset: the same masses and centres, but rotary inertia
that the wrist's model leaves out, by quadrature (5 points a link). Springs and dampers along both planes and gravity
are the task's; torques act on each plane's bends as the law wants them: no tendons share them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from equations import Segment, sliding_mode  # noqa: E402
from rosenbrock import sampled_loop  # noqa: E402
from soromox.systems.components.links import LinkSpec  # noqa: E402
from soromox.systems.pcs.pcs import PCS  # noqa: E402
from soromox.systems.pcs.structures import PCSStructure  # noqa: E402
from task import BendTask  # noqa: E402

RADIUS = 1e-3
"""Of every link [m]: small, so that cross-sections add no rotary inertia worth the name."""
BENDING = [False, True, True, False, False, False]
"""Strains that are free: about y, toward -z, and about z, toward y."""


def _link(length: float, mass: float, stiffness: tuple[float, float], damping: tuple[float, float]) -> LinkSpec:
    def bending(of_y: float, of_z: float) -> jnp.ndarray:  # of the curvatures; the coordinates are angles
        return jnp.diag(jnp.array([1.0, of_z * length**2, of_y * length**2, 1.0, 1.0, 1.0]))

    return LinkSpec.circular(
        length=length, radius=RADIUS, density=mass / (length * np.pi * RADIUS**2),
        reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], stiffness=bending(*stiffness), damping=bending(*damping),
    )  # fmt: skip


def prepare(task: BendTask, lanes: int, threads: int, steps: int) -> Callable[[int], np.ndarray]:
    """Its forward dynamics inside RODAS3 with the Jacobian by differentiation."""
    length, mass, hand, beyond, _, stiff_y, _, stiff_z, damp_y, _, damp_z, *gravity = map(float, task.plant[:14])
    n, targets = task.segments, jnp.asarray(task.reference[:, 0])
    planes = [Segment(*map(float, values)) for values in (task.model_y, task.model_z)]
    gains = [float(g) for g in task.gains]
    links = [_link(length, mass, (stiff_y, stiff_z), (damp_y, damp_z))] * n
    arm = PCS.from_links(
        [*links, _link(2.0 * beyond, hand, (1.0, 1.0), (1.0, 1.0))],
        gravity=jnp.array(gravity),
        structure=PCSStructure(
            strain_selector=jnp.array(BENDING * n + [False] * 6), scale_rotational_basis_by_length=True
        ),
        base_pose=jnp.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),  # along x
        backend="jax",
    )

    def bends(angles: Any) -> Any:
        return jnp.stack([angles[1::2], -angles[0::2]])

    def drive(state: Any, index: Any) -> Any:
        angles, rates = bends(state[: 2 * n]).sum(axis=1), bends(state[2 * n :]).sum(axis=1)
        wanted = [
            sliding_mode(jnp, known, gains, angles[plane], rates[plane], targets[plane, index])
            for plane, known in enumerate(planes)
        ]
        return (jnp.tile(jnp.stack([-wanted[1], wanted[0]]), n),)

    def rates(state: Any, push: Any) -> Any:
        return arm.forward_dynamics(jnp.array(0.0), state, (jnp.zeros(arm.num_actuators), push))

    run = sampled_loop(task, lanes, steps, rates, drive, lambda state: bends(state[: 2 * n]).T.ravel())
    return lambda ticks: run(ticks).ravel()
