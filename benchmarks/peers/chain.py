"""The pseudo-rigid stand-in for the wrist: straight links, one hinge in the middle of each segment.

A rigid-body engine knows no constant-curvature arc. Hinge k sits where chord k's middle is, with that segment's mass;
the hand hangs on the last link; springs, dampers, gravity, law and limits are the task's. Fewer terms than the arc (an
easier problem) with the same stiffness in time.
"""

from __future__ import annotations

from collections.abc import Sequence

from task import BendTask, Task


def mjcf(task: Task, steps: int, tendons: bool, integrator: str) -> str:
    """MuJoCo's model: a motor on each hinge, or a spatial tendon on each side through all discs."""
    s, n = task.plant, task.segments
    length, mass, hand, beyond, gx, gy, offset, _, stiffness, damping = s[:10]

    def sites(disc: int, x: float) -> str:
        places = (("plus", offset), ("minus", -offset))
        return "".join(f'<site name="{side}{disc}" pos="{x} {y} 0"/>' for side, y in places)

    bodies, ends = "", ""
    for k in range(1, n + 1):
        inertial = (hand, 0.5 * length + beyond) if k == n else (mass, length)
        bodies += (
            f'<body pos="{0.5 * length if k == 1 else length} 0 0"><joint name="hinge{k}" type="hinge" axis="0 0 1" '
            f'stiffness="{stiffness}" damping="{damping}"/><inertial mass="{inertial[0]}" pos="{inertial[1]} 0 0" '
            f'diaginertia="1e-12 1e-12 1e-12"/>{sites(k, 0.5 * length)}'
        )
        ends += "</body>"
    if tendons:
        routes = "".join(
            f'<spatial name="{side}">' + "".join(f'<site site="{side}{disc}"/>' for disc in range(n + 1)) + "</spatial>"
            for side in ("plus", "minus")
        )
        motors = "".join(f'<motor tendon="{side}" gear="-1"/>' for side in ("plus", "minus"))
        drive = f"<tendon>{routes}</tendon><actuator>{motors}</actuator>"
    else:
        drive = "<actuator>" + "".join(f'<motor joint="hinge{k}"/>' for k in range(1, n + 1)) + "</actuator>"
    options = _options(task.period / steps, integrator, (gx, gy, 0.0))
    return f"<mujoco>{options}<worldbody>{sites(0, 0.0)}{bodies}{ends}</worldbody>{drive}</mujoco>"


def universal(task: BendTask, steps: int, integrator: str) -> str:
    """MuJoCo's model in two planes: hinges toward +y and +z in the middle of each segment, a motor on each.

    Of springs and dampers along both planes.
    """
    length, mass, hand, beyond, _, stiff_y, _, stiff_z, damp_y, _, damp_z, *gravity = task.plant[:14]
    n, bodies, motors = task.segments, "", ""
    for k in range(1, n + 1):
        inertial = (hand, 0.5 * length + beyond) if k == n else (mass, length)
        bodies += f'<body pos="{0.5 * length if k == 1 else length} 0 0">'
        for name, axis, stiffness, damping in (("y", "0 0 1", stiff_y, damp_y), ("z", "0 -1 0", stiff_z, damp_z)):
            bodies += (
                f'<joint name="{name}{k}" type="hinge" axis="{axis}" stiffness="{stiffness}" damping="{damping}"/>'
            )
            motors += f'<motor joint="{name}{k}"/>'
        bodies += f'<inertial mass="{inertial[0]}" pos="{inertial[1]} 0 0" diaginertia="1e-12 1e-12 1e-12"/>'
    world = f"<worldbody>{bodies}{'</body>' * n}</worldbody><actuator>{motors}</actuator>"
    return f"<mujoco>{_options(task.period / steps, integrator, gravity)}{world}</mujoco>"


def _options(step: float, integrator: str, gravity: Sequence[float]) -> str:
    return (
        f'<compiler autolimits="true"/><option timestep="{step:.17g}" integrator="{integrator}" '
        f'gravity="{" ".join(map(str, gravity))}"><flag contact="disable" constraint="disable"/></option>'
    )
