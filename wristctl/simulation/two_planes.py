"""Closed loops in two planes: a controller's law once for each plane, and pulls by one allocation for both."""

from collections.abc import Sequence
from threading import Event

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.plant import in_one_plane_only
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.errors import UserError
from wristctl.processes import cores
from wristctl.seeds import Entropy
from wristctl.simulation.batch import Lanes, batch
from wristctl.simulation.bend_course import BendCourse
from wristctl.simulation.bend_outcome import BendOutcome, bend_outcome
from wristctl.simulation.bend_paths import BEND_PATHS, turned
from wristctl.simulation.kernel import columns_of_brief, columns_of_sample, run_blocks
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.rollout import How, advance_blocks, worlds_of
from wristctl.simulation.worlds import World
from wristctl.wrist.allocation import allocated
from wristctl.wrist.plant import kernel_of
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import ellipse, spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

# Time between samples of a bend path [s].
SAMPLE = 1e-3


def bend_path(name: str, size_deg: float, turn: float, horizon: float, toward_deg: float = 0.0) -> Array:
    """Bends of a named path with two derivatives, (2, 3, T), sampled every millisecond.

    Parameters
    ----------
    name
        One of `wristctl.simulation.bend_paths.BEND_PATHS`.
    size_deg
        Largest bend [deg].
    turn
        Time of a turn [s].
    horizon
        Time of the last sample [s].
    toward_deg
        Angle by which the path is turned, from ulnar toward flexion [deg].

    Raises UserError for another name, or times that are not positive.
    """
    if name not in BEND_PATHS:
        raise UserError(f"no bend path '{name}'", "reference", f"one of {', '.join(BEND_PATHS)}")
    if not (turn > 0.0 and horizon >= SAMPLE):
        raise UserError(f"a turn of {turn:g} s over {horizon:g} s is no motion", "horizon", "positive times")
    time: Array = SAMPLE * np.arange(round(horizon / SAMPLE) + 1.0)
    return turned(BEND_PATHS[name](time, np.deg2rad(size_deg), turn), toward_deg)


def reach_of_bends(wrist: WristParameters, layout: TendonLayout, directions: int = 72) -> Array:
    """The largest bend (directions + 1, 2) [rad] that tendons within their limits hold at rest, all around.

    Of the wrist as one segment, to half a degree, up to its range; the last direction is the first again.
    """
    around = np.linspace(0.0, 2.0 * np.pi, directions + 1)
    sizes = np.deg2rad(np.arange(0.0, wrist.range_deg + 0.25, 0.5))
    bends = sizes[:, None, None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
    held = _holds(wrist, layout, bends.reshape(-1, 2)).reshape(len(sizes), -1)
    last = np.cumprod(held, axis=0).sum(axis=0) - 1
    reach: Array = bends[last.clip(0), np.arange(directions + 1)]
    return reach


def _holds(wrist: WristParameters, layout: TendonLayout, bends: Array) -> NDArray[np.bool_]:
    """Whether tendons within their limits hold bends (P, 2) [rad] at rest, (P,)."""
    values = spatial_values(wrist, layout, 1, axis=np.radians(wrist.stiffness_axis_deg))
    at_rest = spatial_terms(values, bends, 0.0 * bends)
    yy, yz, zz = ellipse(wrist.stiffness, wrist.stiffness * wrist.flexion_ratio, np.radians(wrist.stiffness_axis_deg))
    torque = at_rest.bias + bends @ np.array([[yy, yz], [yz, zz]])
    limits = wrist.pretension * layout.multiplicity, wrist.tension_limit * layout.multiplicity
    arms = at_rest.moment_arms.reshape(-1, len(layout.places), 2)
    saturated: NDArray[np.bool_] = allocated(arms, torque, *limits).saturated
    return ~saturated


def first_beyond(wrist: WristParameters, layout: TendonLayout, bends: Array) -> int | None:
    """The first of bends (T, 2) [rad] that tendons within their limits do not hold at rest; None without one."""
    few = np.linspace(0, len(bends) - 1, min(len(bends), 400)).astype(np.int64)
    beyond = np.flatnonzero(~_holds(wrist, layout, bends[few]))
    return int(few[beyond[0]]) if len(beyond) else None


def simulate_two_planes(
    law: Controller,
    gains: Array,
    references: Array,
    wrist: WristParameters | None = None,
    layout: TendonLayout | None = None,
    loop: Loop | None = None,
    force: Array | None = None,
    stream: Entropy = (0,),
) -> BendCourse:
    """Follow a bend path from the straight wrist at rest.

    Parameters
    ----------
    law, gains
        A controller that compiles and its gains (g,), the same for both planes.
    references
        Bends with two derivatives, (2, 3, T), sampled every millisecond or control period.
    wrist
        The wrist as its controller knows it.
    layout
        Places of the tendons; None: as `wrist.tendons` has them.
    loop
        Plant, motors, tendons, camera and timing; None: four segments, ideal motors and sensors.
    force
        Force on the tip (3,) or (3, T) [N], along the base, toward ulnar, toward flexion, beside the loop's own
        disturbances; the laws do not know it.
    stream
        Entropy of the camera's noise.

    Raises UserError for a path beyond the wrist's range, a law in plain Python, or what no loop in two planes has.
    """
    world = World(loop or Loop(), wrist or WristParameters())
    outcome = rollout_bends(law, np.atleast_2d(gains), references, [world], layout, force, [stream], record=True)
    return outcome.courses[0]


def rollout_bends(
    law: Controller,
    gains: Array,
    references: Array,
    worlds: Sequence[World],
    layout: TendonLayout | None = None,
    force: Array | None = None,
    streams: Sequence[Entropy] | None = None,
    threads: int | None = None,
    record: How = False,
) -> BendOutcome:
    """Follow one path by several loops at once, as lanes: gains (count, g), their worlds and streams (count,).

    The loops have one structure, timing, camera and kind of disturbances; parameters as `simulate_two_planes`. Samples
    are recorded as `record` says: none, all with their courses, or briefly, the bends alone, which tell oscillation.
    """
    loop, wrist, count = worlds[0].loop, worlds[0].wrist, len(gains)
    layout = layout or TendonLayout.of(wrist)
    check_bends(law, references[:, 0], wrist, loop)
    time = sample_period(loop.control_period) * np.arange(float(references.shape[2]))
    rows = np.ascontiguousarray(references, float).reshape(-1, len(time))
    followed = Motion(time, Angles.of(rows), np.empty((0, 3)), None, 0.0, len(time) * time[1], len(time) * time[1])
    columns = columns_of_brief(2) if record == "briefly" else spatial_columns(layout, loop) if record else 0
    different, which = worlds_of([world.loop for world in worlds], [world.wrist for world in worlds], count)
    lanes = Lanes(np.zeros(count, np.int64), which, list(streams or [(0,)] * count))
    pushed = None if force is None else np.broadcast_to(np.reshape(force, (3, -1)), (3, len(time)))
    rollouts = batch(law, gains, [followed], different, lanes, PCC_IN_SPACE, None, columns, layout, pushed)
    advance_blocks(rollouts, kernel_of(run_blocks, PCC_IN_SPACE), threads or cores(), lambda share: None, Event())
    return bend_outcome(rollouts, time, worlds, layout)


def spatial_columns(layout: TendonLayout, loop: Loop) -> int:
    """Number of columns of a sample of which all is recorded."""
    return len(columns_of_sample(2, len(layout.places))) + PCC_IN_SPACE.coordinates(loop.plant_segments)


def check_spatial(loop: Loop) -> None:
    """UserError for what a loop has in one plane and not in two."""
    if beyond := in_one_plane_only(loop.plant, loop.plant.actuator):
        key = f"plant.{beyond[0]}"
        raise UserError(f"no loop in two planes has {key}", f"loop.{key}", "leave it at its default")


def check_bends(law: Controller, bends: Array, wrist: WristParameters, loop: Loop) -> None:
    """UserError for a law, bends (2, T) [rad] or a loop that cannot run in two planes."""
    check_spatial(loop)
    if law.plain:
        raise UserError(
            f"{law.name} is plain Python, which no loop in two planes runs", "controller", "one that compiles"
        )
    most = float(np.rad2deg(np.hypot(*bends).max()))
    if most > wrist.range_deg * (1.0 + 1e-12):
        raise UserError(
            f"a bend of {most:.3g} deg is beyond the wrist's range of {wrist.range_deg:g} deg",
            "reference.angle_deg",
            "ask for less, or widen wrist.range_deg",
        )
