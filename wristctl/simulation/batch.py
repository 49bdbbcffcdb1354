"""A batch of rollouts as the kernel wants it: its parts as blocks of lanes.

In one plane the places of tendons are the + and the - side; in two they are those of a layout.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import sample_period
from wristctl.config.plant import Disturbances, TendonFacts
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Compensated, Ignored, Places, Sides
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.control.response import OF_A_PLANE
from wristctl.errors import UserError
from wristctl.lanes.blocks import aligned, lanes_of, spread
from wristctl.seeds import Entropy
from wristctl.simulation.cameras import cameras_of
from wristctl.simulation.disturbances import acting_in_space
from wristctl.simulation.kernel import Disturbed, LoopCourse, LoopState, LoopValues, Scratch, Setup, Undisturbed
from wristctl.simulation.motion import DERIVATIVES, Motion
from wristctl.simulation.nonideal import faults_of, inner_of, is_ideal, nonideal_of, unmoved
from wristctl.simulation.simulated_drives import (
    SIDES,
    at_rest,
    believed_of,
    counted_motor,
    drive_with,
    motor_of,
    winding_of,
)
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.simulation.sums import no_sums
from wristctl.simulation.worlds import World, bending_limit, check_stops
from wristctl.wrist.dahl import NoInnerFriction
from wristctl.wrist.directions import in_plane
from wristctl.wrist.plant import PlantModel, path_at
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.co_contraction import least_pulls
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons, PulledTendons, RealTendons

# Pull [N] in two planes for tensions without a limit: no wrist's wants are as large.
_NO_LIMIT = 1e6
# Planes of the two bends, in their order.
PLANES = ("ulnar", "flexion")
Indices = NDArray[np.int64]
# The coordinates (q,) at which a plant begins, at rest.
Start = Callable[[WristParameters], Array]


class Batch(NamedTuple):
    """Arguments of `run_blocks`, with the numbers of blocks and samples."""

    setup: Setup
    course: LoopCourse
    world: LoopValues
    state: LoopState
    blocks: int
    samples: int
    wide: tuple[int, ...]
    """(LANES,), or () for a rollout alone."""

    def scratch(self) -> Scratch:
        """Rows to work on, for one thread."""
        planes = len(self.setup.bend)
        now, target = (aligned((planes, rows, *self.wide)) for rows in (signals_of(self.setup.preview), len(REFERENCE)))
        return Scratch(now, target, aligned((4, *self.wide)))


class Lanes(NamedTuple):
    """Motion, world and stream of each rollout, (count,) each."""

    motion: Indices
    world: Indices
    streams: Sequence[Entropy]


class _Worlds:
    """Rows of the worlds that rollouts have, as blocks of lanes."""

    def __init__(self, worlds: Sequence[World], which: Indices, layout: TendonLayout | None) -> None:
        self.worlds, self.which, self.count, self.layout = list(worlds), which, len(which), layout
        self.actual = [world.plant for world in worlds]
        self.actuators = [world.actuator for world in worlds]
        self.loop = worlds[0].loop
        self.period, self.level = self.loop.control_period, self.loop.actuator.level
        self.alike = np.array(SIDES) if layout is None else layout.multiplicity.astype(float)
        self.counted = [
            counted_motor(world.loop.actuator, actuator) for world, actuator in zip(worlds, self.actuators, strict=True)
        ]
        self.windings = [
            winding_of(world.loop.actuator, actuator, world.wrist.pretension, world.loop.plant.actuator.creep)
            for world, actuator in zip(worlds, self.actuators, strict=True)
        ]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return 1 if self.count == 1 else len(lanes_of(self.count))

    @property
    def wide(self) -> tuple[int, ...]:
        """(LANES,), or () for a rollout alone."""
        return lanes_of(self.count).shape[1:]

    def rows(self, row: Callable[[int], Array]) -> Array:
        """A row of each world's as blocks; of one world as one block for all."""
        if len(self.worlds) == 1:
            return spread(row(0), max(1, *self.wide, 1))[:1]
        return self.of_each(row)

    def of_each(self, row: Callable[[int], Array]) -> Array:
        """A row of each world's as blocks, which rollouts may change."""
        return spread(np.array([row(index) for index in range(len(self.worlds))])[self.which], self.count)

    def limits(self, index: int) -> Array:
        """Least and greatest pull at each place [N], then the bend [rad] beyond which a wrist has failed."""
        loop, wrist = self.worlds[index]
        free = np.inf if self.layout is None else _NO_LIMIT
        greatest = self.alike * (wrist.tension_limit if loop.limits else free)
        return np.append([self.least(index), greatest], bending_limit(self.actual[index], loop.plant.end_stop_deg))

    def least(self, index: int) -> Array:
        """Least pull at each place [N]: pretension, and what tendons pull against each other."""
        world = self.worlds[index]
        pulls: Array = self.alike * world.wrist.pretension
        return pulls if world.loop.stiffness is None else least_pulls(world.wrist, world.loop, self.layout)

    def stiffness(self, index: int) -> Array:
        """Believed stiffness of all tendons of each place [N/m]."""
        stiffness: Array = self.alike * self.counted[index].stiffness
        return stiffness

    def offsets(self, index: int) -> Array:
        """Scale of the motors' counts, and the offset of each place [m]."""
        winding, facts = self.windings[index], self.worlds[index].loop.plant.actuator
        slack = np.zeros(len(self.alike)) if self.layout is None else _slack(facts, len(self.alike))
        return np.array([winding.scale, *(winding.offset - slack)])

    def path(self, model: PlantModel, index: int, at: Array) -> Array:
        """Path of the tendons of a wrist at rest at coordinates (q,), as `travel` of the plant has it.

        That compiles code; of tendons that are not wound it is of no use, and 0.
        """
        wrist, places = self.actual[index], len(self.alike)
        if not self.loop.actuator.winds:
            return np.zeros(3 if self.layout is None else 2 * places)
        if self.layout is None:
            return np.append(wrist.length - model.taut(wrist, at), np.abs(at).sum())
        return path_at(model, model.values(wrist, self.loop.plant_segments), at, places)

    def believed(self, index: int) -> Array:
        """Motors as their host reckons with them."""
        return np.array(believed_of(self.worlds[index].loop.actuator))

    @property
    def remembered(self) -> int:
        """Rates or targets that each motor remembers."""
        believed = [believed_of(world.loop.actuator).delay for world in self.worlds]
        delays = [*believed, *(motor.delay for motor in self.counted)]
        return remembered_commands(max(delays), self.period)

    def motors(self, index: int, travel: Array) -> Array:
        """State of the motors at rest where the tendons' paths are so much shorter than on the straight wrist (T,)."""
        wrist = self.actual[index]
        motor, believed = self.counted[index], self.believed(index)
        drive = drive_with(self.level, motor, self.stiffness(index), believed, self.remembered)
        pulls = self.least(index) if self.worlds[index].loop.stiffness else self.alike * wrist.pretension
        planes = 1 if self.layout is None else 2
        return at_rest(drive, pulls, wrist.length, wrist.length - travel, self.windings[index].scale, planes)


def batch(
    controller: Controller,
    gains: Array,
    motions: Sequence[Motion],
    worlds: Sequence[World],
    lanes: Lanes,
    model: PlantModel,
    start: Start | None,
    columns: int,
    force: Array | None = None,
) -> Batch:
    """The batch of `rollout`, which records so many columns; all worlds have the same structure and timing.

    A force (3, T) [N] on the tip acts beside the loops' own disturbances.
    """
    layout = None if model.planes == 1 else TendonLayout.of(worlds[0].wrist)
    filmed, (worlds, body) = worlds, _bodies(worlds)
    references = np.empty((len(motions), DERIVATIVES * model.planes, len(motions[0].time)))
    for target, followed_motion in zip(references, motions, strict=True):
        followed_motion.angles.into(target)
    check_stops(worlds, np.linalg.norm(references[:, ::DERIVATIVES], axis=1))
    of = _Worlds(worlds, body[lanes.world], layout)
    loop, count, planes, places = of.loop, len(gains), model.planes, len(of.alike)
    k = model.coordinates(loop.plant_segments)
    ticks, samples = max(1, round(sample_period(of.period) / of.period)), references.shape[2]
    followed, blocks, wide = lanes_of(count), of.blocks, of.wide
    coordinates = np.zeros((len(worlds), k)) if start is None else np.array([start(wrist) for wrist in of.actual])
    paths = [of.path(model, index, at) for index, at in enumerate(coordinates)]
    motors = [of.motors(index, path[:places]) for index, path in enumerate(paths)]
    tendons = _tendons(of, coordinates, paths, [state[: 2 * places : 2] for state in motors])
    starts = model.angle(coordinates).reshape(-1, planes)
    watch, frames = cameras_of(filmed, lanes.world, lanes.streams, motions[0].horizon, starts[body], layout)
    belief: Sides | Places
    if layout is None:
        belief = Sides(of.rows(lambda index: segments(of.worlds[index].wrist, 1))[:, None], of.rows(lambda _: of.alike))
    else:
        belief = _beliefs_in_space(of)
    ends = references[:, ::DERIVATIVES, -1]
    goals = [followed_motion.goals_at(end) for followed_motion, end in zip(motions, ends, strict=True)]
    values = LoopValues(
        plant=of.rows(lambda index: model.values(of.actual[index], loop.plant_segments)),
        belief=belief,
        limits=of.rows(of.limits),
        drive=drive_with(
            of.level,
            of.rows(lambda index: np.array(of.counted[index])),
            of.rows(of.stiffness),
            of.rows(of.believed),
            of.remembered,
        ),
        lead=of.rows(lambda index: np.array([float(of.worlds[index].loop.spool_lead)])),
        winding=of.rows(of.offsets),
        gains=spread(gains.reshape(count, -1), count),
        goals=spread(np.array([each.rows for each in goals])[lanes.motion], count),
        schedule=frames,
    )
    kinds = list(dict.fromkeys(world.loop.disturbances for world in worlds))
    cases = [_acting(kind, motions[0].time, planes, force) for kind in kinds]
    case = np.array([kinds.index(world.loop.disturbances) for world in worlds])[of.which]
    memory = max(1, controller.memory)
    state = LoopState(
        which=lanes.motion[followed].reshape(blocks, -1),
        case=case[followed].reshape(blocks, -1),
        memory=spread(np.zeros(planes * memory), count).reshape(blocks, planes, memory, *wide),
        coordinates=spread(np.concatenate([coordinates, np.zeros_like(coordinates)], axis=1)[of.which], count),
        motors=spread(np.array(motors)[of.which], count),
        tendons=tendons,
        sums=spread(no_sums(planes, places), count),
        record=np.empty((blocks, samples if columns else 0, columns, *wide)),
        watch=watch,
    )
    course = LoopCourse(references, _disturbances(cases, samples))
    setup = Setup(
        controller.compiled(count, planes, places), model, (0,) * k, (0,) * planes, (0,) * places,
        (0,) * (planes * places), (0,) * (OF_A_PLANE * planes), of.period, loop.steps, ticks, controller.preview,
    )  # fmt: skip
    return Batch(setup, course, values, state, blocks, samples, wide)


def _bodies(worlds: Sequence[World]) -> tuple[list[World], Indices]:
    """Group worlds that differ only in their cameras: one representative per group, and each world's group index."""
    bodies, which = dict[tuple[object, ...], tuple[int, World]](), []
    for world in worlds:
        loop = world.loop
        parts = (
            id(world.wrist), id(loop.plant), id(loop.actuator), id(loop.disturbances), loop.limits, loop.spool_lead,
            loop.stiffness, loop.stiffness_over_deg,
        )  # fmt: skip
        which.append(bodies.setdefault(parts, (len(bodies), world))[0])
    return [world for _, world in bodies.values()], np.array(which)


def _tendons(of: _Worlds, coordinates: Array, paths: Sequence[Array], counts: Sequence[Array]) -> object:
    """Tendons between the motors, which have counted so much, and wrists at rest at coordinates with these `paths`."""
    plants, planes = [world.loop.plant for world in of.worlds], 1 if of.layout is None else 2
    facts = [plant.actuator for plant in plants]
    nonideals = [
        nonideal_of(*known, of.period / of.loop.steps) for known in zip(plants, of.actuators, facts, strict=True)
    ]
    inner = inner_of(
        plants,
        coordinates,
        np.zeros(len(plants)),
        lambda rows: spread(np.ascontiguousarray(rows[of.which]), of.count),
        planes,
    )
    elastic, pulls = of.loop.actuator.winds, (0,) * len(of.alike)

    stiffness = of.rows(lambda index: of.alike * motor_of(of.actuators[index]).stiffness)
    if all(map(is_ideal, nonideals)) and isinstance(inner, NoInnerFriction):
        return ElasticTendons(stiffness, pulls) if elastic else NoTendons()

    def resting(index: int) -> Array:
        winding, path = of.offsets(index), paths[index]
        reeled = winding[0] * counts[index] + winding[1:]
        return unmoved(reeled, path, np.maximum(reeled - path[: len(reeled)], 0.0), coordinates[index])

    nonideal, state = of.rows(lambda index: np.array(nonideals[index])), of.of_each(resting)
    faults = of.rows(lambda index: faults_of(of.actuators[index], facts[index], of.alike).ravel())
    if elastic:
        return RealTendons(stiffness, nonideal, faults, state, inner, pulls, (0,) * len(paths[0]))
    return PulledTendons(nonideal, faults, state, inner, pulls)


def _beliefs_in_space(of: _Worlds) -> Places:
    def models(index: int) -> Array:
        return np.concatenate([segments(in_plane(of.worlds[index].wrist, plane), 1) for plane in PLANES])

    rows, places = of.rows(models), len(of.alike)
    return Places(
        rows.reshape(len(rows), len(PLANES), -1, *rows.shape[2:]),
        of.rows(lambda _: of.alike),
        of.rows(lambda index: PCC_IN_SPACE.values(of.worlds[index].wrist, 1)),
        (0,) * (OF_A_TENDON * places),
        (0,) * places,
        Compensated() if of.loop.coupling == "compensated" else Ignored(),
    )


def _slack(facts: TendonFacts, places: int) -> Array:
    slack = np.zeros(places)
    if len(facts.slack) > places:
        what = f"{len(facts.slack)} tendons with slack of {places}"
        raise UserError(what, "loop.plant.actuator.slack", f"at most {places} values")
    slack[: len(facts.slack)] = facts.slack
    return slack


def _acting(settings: Disturbances, time: Array, planes: int, force: Array | None) -> Array | None:
    """Force on the tip (3) [N] and scale of the stiffness, (4, T); None where nothing acts.

    In one plane all of a force acts toward that plane.
    """
    pushes = acting_in_space(settings if planes == 2 else settings.model_copy(update={"toward_deg": 0.0}), time)
    if pushes is None and force is None:
        return None
    table = np.tile([[0.0], [0.0], [0.0], [1.0]], len(time)) if pushes is None else pushes.T.copy()
    if force is not None:
        table[:3] += force
    return table


def _disturbances(cases: Sequence[Array | None], samples: int) -> Disturbed | Undisturbed:
    """Disturbances of all cases, of which one where nothing acts is None."""
    if all(case is None for case in cases):
        return Undisturbed()
    nothing = np.tile([[0.0], [0.0], [0.0], [1.0]], samples)
    return Disturbed(np.array([nothing if case is None else case for case in cases]))
