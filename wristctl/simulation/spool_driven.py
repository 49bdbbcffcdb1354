"""Wrists on spools, or on winches that keep a pull, which move as they are told: no controller, no camera.

A winch that keeps a pull P is a spool behind a tendon so soft that nothing the wrist does in a step changes its pull,
reeled in anew before each step: the element with its friction is the same for both.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.lanes.blocks import lanes_of, to_blocks, to_rows
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.processes import cores, stoppable
from wristctl.simulation.nonideal import inner_of, nonideal_of, of_tendons, unmoved
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.dahl import inner_in_lanes, one_block
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import advance_or_stop, bend_of, kernel_of, parameters_of, path_before
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import FROM_ABOVE, FROM_BELOW, HeldTendons, at_rest_with, equilibria_at
from wristctl.wrist.tendon_mechanics import Nonideal, RealTendons, Z, pulls_at_start, read_nonideal, row_of, spool_pull
from wristctl.wrist.tendons import TENDONS_PER_SIDE

_STIFFNESS = len(Nonideal._fields)
# Stiffness of a winch's tendons [N/m]: 1 m/s changes its pull by 1 mN in a millisecond.
_WINCH = 1.0
# Steps of a block of wrists between two looks at what the spools do next.
_CHUNK = 20_000


class SpooledWrist(NamedTuple):
    """A wrist and its tendons, driven at its spools by their positions or, with a `winch`, by their pulls."""

    wrist: WristParameters
    actuator: Actuator
    begin: Array
    """Segments' angles (n,) [rad] at first, when it does not move."""
    winch: bool = False
    z: tuple[float, float] = (0.0, 0.0)
    """State of both sides' bristles at first."""
    plant: TrueWrist = TrueWrist()
    """What else the wrist has: creep, end stops, friction inside it."""
    inner_z: float = 0.0
    """State of that friction's bristles at first."""


class Spooled(NamedTuple):
    """Courses of wrists, (count, T) each; of a side both tendons together."""

    theta: Array
    """Bending angle [rad]."""
    given_plus: Array
    """Length that the + side has reeled in since it was taut and free of tension on the straight wrist [m]."""
    given_minus: Array
    spool_plus: Array
    """Pull at the spool [N]."""
    spool_minus: Array
    wrist_plus: Array
    """Pull at the wrist [N]."""
    wrist_minus: Array
    z_plus: Array
    """State of its bristle."""
    z_minus: Array
    friction: Array
    """Work that tendons have lost to friction so far [J]: pull at the spool less pull at the wrist, along the path."""
    raw: Array
    """Work that the spools have given so far [J]: pull at the spool along the path."""
    damped: Array
    """Work that the wrist's damping has taken so far [J], by its rates at the ends of steps."""


class _Timing(NamedTuple):
    h: float
    first: int
    every: int


class _Lanes(NamedTuple):
    wrist: Any
    tendons: Any
    """Nonideal's values, stiffness, and 1 for a winch."""
    state: Any
    memory: Any
    ends: Any
    """Works so far, and of the last step's end what both sides have reeled in, pull at the spool and at the wrist."""
    inner: Any


_ENDS = 9


def _move(model: Any, lanes: Any, driven: Any, timing: Any, out: Any, cut: Any) -> None:
    segment, values = parameters_of(model, rows_of(lanes.wrist)), rows_of(lanes.tendons)
    zero = zero_like(values[_STIFFNESS])
    tendons = RealTendons(values[_STIFFNESS], read_nonideal(values), rows_of(lanes.memory), inner_in_lanes(lanes.inner))
    winch, memory, ends, n = values[_STIFFNESS + 1], rows_of(lanes.memory), rows_of(lanes.ends), len(cut)
    q, rate = part(rows_of(lanes.state), 0, cut), part(rows_of(lanes.state), n, cut)
    bend, speed = lanes_like(part(q, 0, (0,))), lanes_like(part(q, 0, (0,)))
    alive = 1.0 + zero
    for k in range(driven.shape[0]):
        tick, now = timing.first + k, rows_of(driven[k])
        path = path_before(tendons, segment, q)
        reeled = (
            where(winch > 0.0, now[0] / tendons.stiffness + path[0], now[0]),
            where(winch > 0.0, now[1] / tendons.stiffness + path[1], now[1]),
        )
        spool_plus, spool_minus = spool_pull(tendons, reeled[0], 0, path[0]), spool_pull(tendons, reeled[1], 1, path[1])
        plus, minus = pulls_at_start(tendons, reeled, path)
        if tick == 0:
            ends[3], ends[4], ends[5], ends[6], ends[7], ends[8] = *reeled, spool_plus, spool_minus, plus, minus
        if tick % timing.every == 0:  # between two steps what is held over them jumps: its mean is what it is there
            row = rows_of(out[tick // timing.every])
            bend_of(segment, q, rate, bend, speed)
            row[0] = bend[0]
            row[1], row[2] = 0.5 * (reeled[0] + ends[3]), 0.5 * (reeled[1] + ends[4])
            row[3], row[4] = 0.5 * (spool_plus + ends[5]), 0.5 * (spool_minus + ends[6])
            row[5], row[6] = 0.5 * (plus + ends[7]), 0.5 * (minus + ends[8])
            row[7], row[8] = memory[row_of(0, Z)], memory[row_of(1, Z)]
            row[9], row[10], row[11] = ends[0], ends[1], ends[2]
        rates = zero
        for i in range(n):
            rates = rates + rate[i] * rate[i]
        alive, _ = advance_or_stop(segment, q, rate, reeled, tendons, timing.h + zero, alive)
        for i in range(n):
            rates = rates + rate[i] * rate[i]
        end = path_before(tendons, segment, q)
        ends[3], ends[4] = reeled
        ends[5], ends[6] = spool_pull(tendons, reeled[0], 0, end[0]), spool_pull(tendons, reeled[1], 1, end[1])
        ends[7], ends[8] = pulls_at_start(tendons, reeled, end)
        raw = (spool_plus + ends[5]) * (end[0] - path[0]) + (spool_minus + ends[6]) * (end[1] - path[1])
        left = (plus + ends[7]) * (end[0] - path[0]) + (minus + ends[8]) * (end[1] - path[1])
        ends[0], ends[1] = ends[0] + 0.5 * (raw - left), ends[1] + 0.5 * raw
        ends[2] = ends[2] + 0.5 * timing.h * segment.damping * rates


# From times (T,) [s] and which wrists (L,) to what drives both sides of each: spools [m], or pulls [N]; (T, 2, L).
Told = Callable[[Array, NDArray[np.int64]], Array]


def spooled(wrists: Sequence[SpooledWrist], inputs: Told, steps: int, h: float, every: int = 1) -> Spooled:
    """Move wrists, all of as many segments, in so many steps of h [s]; every so many of them are in the result.

    `inputs` is asked for what is held over each step, at its middle. A wrist that bends a segment beyond a full turn
    stays where it was.
    """
    count, cut = len(wrists), (0,) * len(wrists[0].begin)
    blocks, which = _lanes(wrists, h), np.atleast_2d(lanes_of(count))
    wide, samples = blocks.wrist.shape[2:], -(-steps // every)
    out, move = np.empty((len(which), samples, len(Spooled._fields), *wide)), kernel_of(_move, PCC)
    stop = Event()

    def run(block: int) -> None:
        parts = {name: rows[block] for name, rows in blocks._asdict().items() if name != "inner"}
        block_lanes = _Lanes(**parts, inner=one_block(blocks.inner, block))
        for first in range(0, steps, _CHUNK):
            if stop.is_set():
                return
            last = min(first + _CHUNK, steps)
            middle = h * np.arange(first + 0.5, last)
            driven = inputs(middle, which[block]).reshape(last - first, 2, *wide)
            move(PCC, block_lanes, np.ascontiguousarray(driven), _Timing(h, first, every), out[block], cut)

    with stoppable(cores(), stop) as pool:
        list(pool.map(run, range(len(which))))
    rows: Array = to_rows(out.reshape(len(out), -1, *wide), count).reshape(count, samples, -1)
    return Spooled(*np.moveaxis(rows, 2, 0))


def _lanes(wrists: Sequence[SpooledWrist], h: float) -> _Lanes:
    rows = []
    for driven in wrists:
        nonideal = nonideal_of(driven.plant, driven.actuator, TendonFacts(), h)
        stiffness = _WINCH if driven.winch else TENDONS_PER_SIDE * driven.actuator.tendon_stiffness
        path = np.array([*(driven.wrist.length - PCC.taut(driven.wrist, driven.begin)), np.abs(driven.begin).sum()])
        memory = unmoved(np.zeros(2), path, np.zeros(2), driven.begin)
        of_tendons(memory, 2)[:, Z] = driven.z
        rows.append(
            (
                PCC.values(driven.wrist, len(driven.begin)),
                np.array([*nonideal, stiffness, float(driven.winch)], float),
                np.concatenate([driven.begin, 0.0 * driven.begin]),
                memory,
                np.zeros(_ENDS),
            )
        )
    begin, bent = np.array([driven.begin for driven in wrists]), np.array([driven.inner_z for driven in wrists])
    inner = inner_of([driven.plant for driven in wrists], begin, bent, to_blocks)
    of_wrist, of_tendons_, state, memories, ends = (to_blocks(np.array(column)) for column in zip(*rows, strict=True))
    return _Lanes(of_wrist, of_tendons_, state, memories, ends, inner)


# Step between two angles at which the statics are solved [rad]; chords between them are 1e-10 m off.
_FINE = math.radians(0.05)


class FrictionCase(NamedTuple):
    """Friction of a wrist's tendons: coefficient, the sheath's angle [rad], the path in which it turns round [m]."""

    friction: float
    sheath: float
    presliding: float


@dataclass(frozen=True)
class Strokes:
    """Spools and pulls that hold a wrist without friction at angles (G,) [rad]; of a side both tendons together."""

    wrist: WristParameters
    settings: HysteresisSettings
    angle: Array
    theta: Array
    """Segments' angles (G, n) [rad]."""
    reeled: Array
    """(G, 2) [m]"""
    pulls: Array
    """(G, 2) [N]"""

    @property
    def winch(self) -> bool:
        """Whether pulls are held instead of spools."""
        return self.settings.drive == "tensions"

    def given(self, angle: Array) -> Array:
        """Input of both sides at angles (...): spools [m], or pulls of winches [N]; (2, ...)."""
        course = self.pulls if self.winch else self.reeled
        return np.stack([np.interp(angle, self.angle, side) for side in course.T])

    def told(self, angle: Array) -> Array:
        """Input of both sides at angles (T, L), as `spooled` takes it: (T, 2, L)."""
        return np.moveaxis(self.given(angle), 0, 1)

    def theta_at(self, angle: Array) -> Array:
        """Segments' angles at angles (...), (..., n)."""
        return np.stack([np.interp(angle, self.angle, column) for column in self.theta.T], axis=-1)

    def lane(self, tendons: FrictionCase, begin: float) -> SpooledWrist:
        """A wrist that rests at this angle [rad] at first."""
        return SpooledWrist(self.wrist, self.settings.actuator(*tendons), self.theta_at(np.array(begin)), self.winch)

    def exact(self, tendons: Sequence[FrictionCase], angle: Array) -> Array:
        """Angles at rest from below and from above (B, 2) [rad] where without friction they are `angle` (B,)."""
        values = np.tile(segments(self.wrist, self.settings.segments), (len(angle), 1))
        stiffness = 0.0 if self.winch else TENDONS_PER_SIDE * self.settings.tendon_stiffness
        friction, sheath, _ = np.array(tendons, float).T
        held = HeldTendons(self.given(angle).T, np.full(len(angle), stiffness), friction, sheath)
        guess = self.theta_at(angle)
        ends = [at_rest_with(values, held, z, guess).sum(axis=1) for z in (FROM_BELOW, FROM_ABOVE)]
        return np.stack(ends, axis=1)


def strokes(wrist: WristParameters, settings: HysteresisSettings) -> Strokes:
    """Strokes over all angles of all ranges. Raises UserError where the wrist cannot be held there."""
    ends = np.radians(settings.ranges_deg)
    angle = np.linspace(ends.min(), ends.max(), 1 + math.ceil(float(np.ptp(ends)) / _FINE))
    if math.degrees(float(np.abs(angle).max())) > wrist.range_deg:
        problem = f"a loop goes beyond the wrist's range, {wrist.range_deg:g} deg"
        raise UserError(problem, "hysteresis.ranges_deg", "smaller ranges")
    values = np.tile(segments(wrist, settings.segments), (len(angle), 1))
    balance = equilibria_at(values, settings.segments, angle, TENDONS_PER_SIDE * wrist.pretension)
    if settings.drive == "tensions" and not balance.stable.all():
        raise UserError("the wrist buckles on held pulls", "hysteresis.drive", "drive: spools, or a lighter hand")
    most = float(balance.pulls.max()) / TENDONS_PER_SIDE
    if most > wrist.tension_limit:
        problem = f"it takes {most:.3g} N a tendon, above wrist.tension_limit ({wrist.tension_limit:g} N)"
        raise UserError(problem, "hysteresis.ranges_deg", "smaller ranges")
    taut = terms(values, balance.theta, 0.0 * balance.theta).tendon_lengths.sum(axis=1)
    reeled = balance.pulls / (TENDONS_PER_SIDE * settings.tendon_stiffness) + wrist.length - taut
    return Strokes(wrist, settings, angle, balance.theta, reeled, balance.pulls)
