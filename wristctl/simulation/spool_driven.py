"""Wrists on spools, or on winches that keep a pull, which move as they are told: no controller, no camera.

A winch that keeps a pull P is a spool behind a tendon so soft that nothing the wrist does in a step changes its pull,
reeled in anew before each step: the element with its friction is the same for both.
"""

from collections.abc import Callable, Sequence
from threading import Event
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.lanes.blocks import lanes_of, one_block, to_blocks, to_rows
from wristctl.lanes.compiled import by_type, implements
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.processes import cores, stoppable
from wristctl.simulation.nonideal import faults_of, inner_of, nonideal_of, of_tendons, unmoved
from wristctl.simulation.simulated_drives import SIDES
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import advance_or_stop, bend_of, kernel_of, parameters_of, path_at, path_before
from wristctl.wrist.segments import Segments
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.spatial_segments import SpatialWrist
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import (
    RealTendons,
    Z,
    acting_pulls,
    row_of,
    shortening,
    spool_pull,
    tendons_in_lanes,
)

# Stiffness of a winch's tendons [N/m]: 1 m/s changes its pull by 1 mN in a millisecond.
_WINCH = 1.0
# Steps of a block of wrists between two looks at what the spools do next.
_CHUNK = 20_000


class SpooledWrist(NamedTuple):
    """A wrist and its tendons, driven at its spools by their positions or, with a `winch`, by their pulls.

    Its places of tendons are both sides in one plane, and those of its layout in two.
    """

    wrist: WristParameters
    actuator: Actuator
    begin: Array
    """Coordinates (q,) [rad] at first, when it does not move: in one plane the segments' angles."""
    winch: bool = False
    z: tuple[float, ...] = ()
    """State of the bristles of each place at first; none: all relaxed."""
    plant: TrueWrist = TrueWrist()
    """What else the wrist has: creep, end stops, friction inside it."""
    inner_z: float = 0.0
    """State of that friction's bristles at first."""
    planes: int = 1
    """Planes that it bends in."""


class Spooled(NamedTuple):
    """Courses of wrists, (count, T) each, or (count, T, values); of a place all its tendons together."""

    bends: Array
    """Bend of each plane [rad]."""
    given: Array
    """Length that each place has reeled in since it was taut and free of tension on the straight wrist [m]."""
    spool: Array
    """Pull of each place at the spool [N]."""
    wrist: Array
    """Pull of each place at the wrist [N]."""
    z: Array
    """State of the bristle of each place."""
    friction: Array
    """Work that tendons have lost to friction so far [J]: pull at the spool less pull at the wrist, along the path."""
    raw: Array
    """Work that the spools have given so far [J]: pull at the spool along the path."""
    damped: Array
    """Work that the wrist's damping has taken so far [J], by its rates at the ends of steps."""

    @property
    def theta(self) -> Array:
        """Bending angle in one plane [rad]."""
        return self.bends[..., 0]

    @property
    def spool_plus(self) -> Array:
        """Pull at the spool of the + side, or of the first place [N]."""
        return self.spool[..., 0]

    @property
    def spool_minus(self) -> Array:
        """Pull at the spool of the - side, or of the second place [N]."""
        return self.spool[..., 1]


class _Timing(NamedTuple):
    h: float
    first: int
    every: int


class _Lanes(NamedTuple):
    wrist: Any
    tendons: Any
    winch: Any
    """1 for a winch."""
    state: Any
    ends: Any
    """Works so far; at the last step's end what each place has reeled in, its pull at the spool and at the wrist."""


_WORKS = 3


@by_type
def _squares(plant: Any, rate: Any, sums: Any) -> None:
    """Add the products of rates that damping goes by, summed over the segments, to three rows."""


@implements(_squares, Segments)
def _squares_in_one_plane(plant: Any, rate: Any, sums: Any) -> None:
    for i in range(len(rate)):
        sums[0] = sums[0] + rate[i] * rate[i]


@implements(_squares, SpatialWrist)
def _squares_in_space(plant: Any, rate: Any, sums: Any) -> None:
    for k in range(len(rate) // 2):
        y, z = rate[2 * k], rate[2 * k + 1]
        sums[0], sums[1], sums[2] = sums[0] + y * y, sums[1] + y * z, sums[2] + z * z


@by_type
def _damped(plant: Any, h: float, sums: Any) -> Any:
    """Work [J] that damping takes in a step of h [s] with these sums at its begin and its end together."""


@implements(_damped, Segments)
def _damped_in_one_plane(plant: Any, h: float, sums: Any) -> Any:
    return 0.5 * h * plant.damping * sums[0]


@implements(_damped, SpatialWrist)
def _damped_in_space(plant: Any, h: float, sums: Any) -> Any:
    segment = plant.segment
    power = segment.damping_yy * sums[0] + 2.0 * segment.damping_yz * sums[1] + segment.damping_zz * sums[2]
    return 0.5 * h * power


def _move(model: Any, lanes: Any, driven: Any, timing: Any, out: Any, cut: Any, bends: Any, pulls: Any) -> None:
    segment, tendons = parameters_of(model, rows_of(lanes.wrist), pulls), tendons_in_lanes(lanes.tendons)
    winch, ends, n, planes, count = rows_of(lanes.winch)[0], rows_of(lanes.ends), len(cut), len(bends), len(pulls)
    q, rate = part(rows_of(lanes.state), 0, cut), part(rows_of(lanes.state), n, cut)
    bend, speed = lanes_like(part(q, 0, bends)), lanes_like(part(q, 0, bends))
    places = part(ends, _WORKS, pulls)
    reeled, spool, wrist = lanes_like(places), lanes_like(places), lanes_like(places)
    sums, zero = lanes_like(part(ends, 0, (0, 0, 0))), zero_like(winch)
    alive = 1.0 + zero
    for k in range(driven.shape[0]):
        tick, now = timing.first + k, rows_of(driven[k])
        path = path_before(tendons, segment, q)
        for t in range(count):
            held = now[t] / tendons.stiffness[t] + shortening(path, t)
            reeled[t] = where(winch > 0.0, held, now[t])
            spool[t] = spool_pull(tendons, reeled[t], t, shortening(path, t))
        acting_pulls(tendons, reeled, path, wrist)
        if tick == 0:
            for t in range(count):
                ends[_WORKS + t], ends[_WORKS + count + t], ends[_WORKS + 2 * count + t] = reeled[t], spool[t], wrist[t]
        if tick % timing.every == 0:  # between two steps what is held over them jumps: its mean is what it is there
            row = rows_of(out[tick // timing.every])
            bend_of(segment, q, rate, bend, speed)
            for p in range(planes):
                row[p] = bend[p]
            for t in range(count):
                row[planes + t] = 0.5 * (reeled[t] + ends[_WORKS + t])
                row[planes + count + t] = 0.5 * (spool[t] + ends[_WORKS + count + t])
                row[planes + 2 * count + t] = 0.5 * (wrist[t] + ends[_WORKS + 2 * count + t])
                row[planes + 3 * count + t] = tendons.state[row_of(t, Z)]
            for i in range(_WORKS):
                row[planes + 4 * count + i] = ends[i]
        for i in range(_WORKS):
            sums[i] = zero
        _squares(segment, rate, sums)
        alive, _ = advance_or_stop(segment, q, rate, reeled, tendons, timing.h + zero, alive)
        _squares(segment, rate, sums)
        end = path_before(tendons, segment, q)
        raw, left = zero, zero
        acting_pulls(tendons, reeled, end, part(ends, _WORKS + 2 * count, pulls))
        for back in range(count):
            t = count - 1 - back
            at_spool, moved = (
                spool_pull(tendons, reeled[t], t, shortening(end, t)),
                shortening(end, t) - shortening(path, t),
            )
            raw = raw + (spool[t] + at_spool) * moved
            left = left + (wrist[t] + ends[_WORKS + 2 * count + t]) * moved
            ends[_WORKS + t], ends[_WORKS + count + t] = reeled[t], at_spool
        ends[0], ends[1] = ends[0] + 0.5 * (raw - left), ends[1] + 0.5 * raw
        ends[2] = ends[2] + _damped(segment, timing.h, sums)


# From times (T,) [s] and which wrists (L,) to what drives all places of each: spools [m], or pulls [N]; (T, places, L).
Told = Callable[[Array, NDArray[np.int64]], Array]


def spooled(wrists: Sequence[SpooledWrist], inputs: Told, steps: int, h: float, every: int = 1) -> Spooled:
    """Move wrists, all of as many segments, in so many steps of h [s]; every so many of them are in the result.

    `inputs` is asked for what is held over each step, at its middle. A wrist that bends a segment beyond a full turn
    stays where it was.
    """
    count, planes = len(wrists), wrists[0].planes
    cut, model = (0,) * len(wrists[0].begin), PCC if planes == 1 else PCC_IN_SPACE
    blocks, which = _lanes(wrists, h), np.atleast_2d(lanes_of(count))
    places, wide, samples = _places(wrists[0]), blocks.wrist.shape[2:], -(-steps // every)
    columns = np.cumsum([planes, places, places, places, places, 1, 1])
    out = np.empty((len(which), samples, columns[-1] + 1, *wide))
    move, stop = kernel_of(_move, model), Event()

    def run(block: int) -> None:
        block_lanes = one_block(blocks, block)
        for first in range(0, steps, _CHUNK):
            if stop.is_set():
                return
            last = min(first + _CHUNK, steps)
            middle = h * np.arange(first + 0.5, last)
            driven = np.ascontiguousarray(inputs(middle, which[block]).reshape(last - first, places, *wide))
            timing = _Timing(h, first, every)
            move(model, block_lanes, driven, timing, out[block], cut, (0,) * planes, (0,) * places)

    with stoppable(cores(), stop) as pool:
        list(pool.map(run, range(len(which))))
    rows: Array = to_rows(out.reshape(len(out), -1, *wide), count).reshape(count, samples, -1)
    bends, given, spool, wrist, z, *works = np.split(rows, columns, axis=2)
    friction, raw, damped = (work[..., 0] for work in works)
    return Spooled(bends, given, spool, wrist, z, friction, raw, damped)


def _places(driven: SpooledWrist) -> int:
    return len(SIDES) if driven.planes == 1 else len(TendonLayout.of(driven.wrist).places)


def _lanes(wrists: Sequence[SpooledWrist], h: float) -> _Lanes:
    planes, places = wrists[0].planes, _places(wrists[0])
    model = PCC if planes == 1 else PCC_IN_SPACE
    rows = []
    for driven in wrists:
        layout = None if planes == 1 else TendonLayout.of(driven.wrist)
        alike = np.array(SIDES) if layout is None else layout.multiplicity.astype(float)
        nonideal = nonideal_of(driven.plant, driven.actuator, TendonFacts(), h)
        stiffness = np.full(places, _WINCH) if driven.winch else alike * driven.actuator.tendon_stiffness
        values = model.values(driven.wrist, len(driven.begin) // planes)
        if layout is None:
            path = np.array([*(driven.wrist.length - PCC.taut(driven.wrist, driven.begin)), np.abs(driven.begin).sum()])
        else:
            path = path_at(model, values, driven.begin, places)
        memory = unmoved(np.zeros(places), path, np.zeros(places), driven.begin)
        of_tendons(memory, places)[:, Z] = driven.z or np.zeros(places)
        begin, faults = (
            np.concatenate([driven.begin, 0.0 * driven.begin]),
            faults_of(driven.actuator, TendonFacts(), alike),
        )
        ends = np.zeros(_WORKS + 3 * places)
        rows.append((values, stiffness, np.array(nonideal, float), faults.ravel(), memory, [driven.winch], begin, ends))
    begin, bent = np.array([driven.begin for driven in wrists]), np.array([driven.inner_z for driven in wrists])
    inner = inner_of([driven.plant for driven in wrists], begin, bent, to_blocks, planes)
    columns = (to_blocks(np.array(column, float)) for column in zip(*rows, strict=True))
    values, stiffness, nonideals, of_faults, memories, winch, state, ends = columns
    shape = (0,) * places, (0,) * len(path)
    tendons = RealTendons(stiffness, nonideals, of_faults, memories, inner, *shape)
    return _Lanes(values, tendons, winch, state, ends)
