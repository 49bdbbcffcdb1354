"""Closed loops in two planes: a controller's law once for each plane, and pulls by one allocation for both."""

from collections.abc import Sequence
from threading import Event

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.errors import UserError
from wristctl.processes import cores, stoppable
from wristctl.seeds import Entropy
from wristctl.simulation.bend_course import BendCourse
from wristctl.simulation.bend_outcome import BendOutcome, bend_outcome
from wristctl.simulation.bend_paths import BEND_PATHS, turned
from wristctl.simulation.disturbances import acting_in_space
from wristctl.simulation.kernel import Span
from wristctl.simulation.rollout import How
from wristctl.simulation.spatial_batch import SpatialBatch, check_spatial, spatial_batch, spatial_columns
from wristctl.simulation.spatial_kernel import SPATIAL_BRIEFLY, run_spatial
from wristctl.simulation.worlds import World
from wristctl.wrist.allocation import allocated
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import ellipse, spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

# Time between samples of a bend path [s].
SAMPLE = 1e-3
# Integration steps of a block between two looks at whether the user has asked to stop.
_PIECE = 20_000


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
    columns = len(SPATIAL_BRIEFLY) if record == "briefly" else spatial_columns(layout, loop) if record else 0
    lanes = spatial_batch(
        law, gains, references, worlds, layout, _acting(loop, time, force), streams or [(0,)] * count, columns
    )
    _advance(lanes, threads or cores())
    return bend_outcome(lanes, time, worlds)


def _advance(lanes: SpatialBatch, workers: int) -> None:
    """Run all blocks to the end, on so many threads, in pieces between which an interrupt is heard."""
    stop, blocks, samples = Event(), lanes.blocks, lanes.samples
    steps = lanes.setup.ticks * lanes.setup.substeps
    piece = max(1, _PIECE // steps)
    together = max(1, min(_PIECE // (steps * samples), -(-blocks // workers)))

    def run(begin: int) -> None:
        scratch = lanes.scratch()
        for first in range(0, samples, piece):
            if not stop.is_set():
                span = Span(begin, min(begin + together, blocks), first, min(first + piece, samples))
                run_spatial(lanes.setup, lanes.course, lanes.values, lanes.state, scratch, span)

    pieces = range(0, blocks, together)
    if min(workers, len(pieces)) == 1:
        for begin in pieces:
            run(begin)
        return
    with stoppable(min(workers, len(pieces)), stop) as pool:
        for _ in pool.map(run, pieces):
            pass


def _acting(loop: Loop, time: Array, force: Array | None) -> Array:
    """What acts: force on the tip [N] and scale of the stiffness, (4, T)."""
    result = np.zeros((4, len(time)))
    result[3] = 1.0
    if (pushes := acting_in_space(loop.disturbances, time)) is not None:
        result[:] = pushes.T
    if force is not None:
        result[:3] += np.reshape(force, (3, -1))
    return result


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
