"""The controller on hardware in two planes: the same compiled laws, allocation and observer as in simulation."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Limits
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.control.response import FULL, OF_A_PLANE, Controlled, Estimate, Seen, look_ahead, respond, room_like
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.observer import knowing_in_lanes, propagate
from wristctl.simulation.stationary_filter import Belief, as_pairs, stationary_gains
from wristctl.trial.spatial_belief import PLANES, known_of_axes, layout_of_axes
from wristctl.trial.steering import REMEMBERED
from wristctl.wrist.directions import in_plane

# Seconds by which a frame may be older than the last one of the other camera: it is fused there.
_UNEVEN = 0.05


class SpatialAnswer(NamedTuple):
    """Answer of the laws: torques wanted and commanded (2,) [N m], share reached, and tensions of the axes (4,) [N]."""

    torque_wanted: Array
    torque: Array
    share: float
    tension: Array

    @property
    def saturated(self) -> bool:
        """Whether the wanted torque is out of the tendons' reach."""
        return not self.share >= FULL


class _Observer(NamedTuple):
    """Gain (6,), what was delivered (ring, 4), and x (6,) at the last fused frame and at the present tick."""

    gain: Any
    delivered: Any
    fused: Any
    now: Any


class SpatialSteering:
    """Observers and laws of both bending planes. Ticks are numbered from 0, `period` [s] apart."""

    def __init__(self, wrist: WristParameters, actuator: Actuator, sensor: Sensor, period: float) -> None:
        layout = layout_of_axes(wrist)
        self._known = known_of_axes(wrist, actuator)
        self._bounds = np.repeat([wrist.pretension, wrist.tension_limit], AXES)
        beliefs = [
            Belief(sensor, actuator, as_pairs(in_plane(wrist, plane), layout, axis), period)
            for axis, plane in enumerate(PLANES)
        ]
        gain = np.concatenate([stationary_gains([belief])[0] for belief in beliefs])
        x = np.zeros(2 * OF_A_PLANE)
        self._observer = _Observer(gain, np.zeros((REMEMBERED, AXES)), x, x.copy())
        self._bends = np.zeros((REMEMBERED, 2))
        self._fused_at, self._period, self._found = 0, period, np.zeros(AXES + 5)
        self._missed = np.zeros(2)
        self._law: Any = None
        self._control: Any = None
        self._preview = 0
        self.tick = 0
        self.withheld: Array = np.zeros(2)
        """Torque of the last command that the motors are too slow to deliver, by plane [N m]."""

    @property
    def estimate(self) -> Estimate:
        """As of the present tick; bend, rate and load are (2,) each."""
        return Estimate(*self._observer.now.reshape(2, OF_A_PLANE).T.copy())

    def bend_at(self, captured: float) -> Array:
        """Bend (2,) [rad] as it was believed `captured` seconds after tick 0, as far as it is remembered."""
        since = min(max(captured / self._period, self.tick - REMEMBERED + 1, 0), self.tick)
        tick = math.floor(since)
        before, after = self._bends[tick % REMEMBERED], self._bends[min(tick + 1, self.tick) % REMEMBERED]
        believed: Array = before + (since - tick) * (after - before)
        return believed

    def use(self, controller: Controller, gains: Sequence[float]) -> None:
        """Take up a law in both planes, its memory empty, with motors that have caught up."""
        self._law = controller.compiled(1, 2, AXES)
        self.withheld, self._missed, self._preview = np.zeros(2), np.zeros(2), controller.preview
        self._control = Controlled(
            self._law, np.zeros((2, signals_of(controller.preview))), self._known.belief.models,
            np.array([*gains, 0.0]), np.zeros((2, max(1, controller.memory))), np.zeros((2, len(REFERENCE))),
        )  # fmt: skip

    def see(self, plane: int, bend: float, captured: float) -> bool:
        """Fuse one plane's bend [rad] seen `captured` seconds after tick 0; False where that is too old or yet to come.

        One that was taken before the last frame of the other camera is compared with what was believed then.
        """
        tick = math.floor(captured / self._period)
        late = self._fused_at * self._period - captured
        if late > _UNEVEN or not max(0, self.tick - REMEMBERED + 1) <= tick <= self.tick:
            return False
        at = max(tick, self._fused_at)
        ticks = self._fused_at, at, self.tick
        _fuse(self._known, self._observer, ticks, plane, captured - at * self._period, bend, self._period)
        self._fused_at = at
        self._bends[self.tick % REMEMBERED] = self._observer.now[::OF_A_PLANE]
        return True

    def respond(self, course: Array, tick: int = 0) -> SpatialAnswer:
        """The laws' answer, at the present estimate, to a reference (T, 2, 3) of bend, rate and acceleration at its
        tick.

        It goes by periods; beyond its end it stays as it is there, for a law that looks ahead. Raises what a plain law
        has raised.
        """
        to_follow, sees = (course, tick, self._preview), Seen(self._observer.now, self.withheld, self._missed)
        _respond(self._control, self._known, self._bounds, sees, to_follow, self._period, self._found)
        self._law.check()
        found = self._found.copy()
        return SpatialAnswer(found[AXES : AXES + 2], found[AXES + 2 : AXES + 4], float(found[AXES + 4]), found[:AXES])

    def predict(self, *reeled: float) -> None:
        """Go on to the next tick, with each axis reeled in by so much [m] until then."""
        _predict(self._known, self._observer, self.tick, np.array(reeled, np.float64), self._period)
        self.tick += 1
        self._bends[self.tick % REMEMBERED] = self._observer.now[::OF_A_PLANE]


@kernel
def _respond(control: Any, known: Any, bounds: Any, sees: Any, to_follow: Any, period: float, found: Any) -> None:
    knowing, row, bound = knowing_in_lanes(known), rows_of(found), rows_of(bounds)
    bend, pulls = knowing.bend, part(row, 0, known.pulls)
    course, tick, preview = to_follow
    for ahead in range(preview, -1, -1):  # the present last: it is what the laws follow
        control.reference[:] = course[min(tick + ahead, course.shape[0] - 1)]
        if ahead > 0:
            look_ahead(control, bend, ahead, 0.0)
    count = len(pulls)
    limits = Limits(part(bound, 0, known.pulls), part(bound, count, known.pulls))
    seen = Seen(rows_of(sees.rows), rows_of(sees.withheld), rows_of(sees.missed))
    room = room_like(bend, knowing.arms)
    share = respond(control, knowing.belief, seen, limits, room, 0.0, period, pulls)
    for p in range(len(bend)):
        row[count + p] = room.wanted[p]
        row[count + len(bend) + p] = room.torque[p]
    row[count + 2 * len(bend)] = share


@compiled
def _go_over(observer: Any, knowing: Any, x: Any, ticks: Any, h: float) -> None:
    """Advance x over the ticks from the first up to the last, by what is remembered as delivered."""
    first, last = ticks
    counts = lanes_like(knowing.pulls)
    for past in range(first, last):
        before = rows_of(observer.delivered[past % observer.delivered.shape[0]])
        for t in range(len(counts)):
            counts[t] = before[t]
        propagate(knowing, x, counts, h)


@kernel
def _fuse(known: Any, observer: Any, ticks: Any, plane: int, since: float, bend: float, h: float) -> None:
    knowing = knowing_in_lanes(known)
    before, captured, tick = ticks
    gain, fused, now = rows_of(observer.gain), rows_of(observer.fused), rows_of(observer.now)
    _go_over(observer, knowing, fused, (before, captured), h)
    first = OF_A_PLANE * plane
    innovation = bend - fused[first] - since * fused[first + 1]
    for i in range(first, first + OF_A_PLANE):
        fused[i] = fused[i] + gain[i] * innovation
    for i in range(2 * OF_A_PLANE):
        now[i] = fused[i]
    _go_over(observer, knowing, now, (captured, tick), h)


@kernel
def _predict(known: Any, observer: Any, tick: int, reeled: Any, h: float) -> None:
    knowing = knowing_in_lanes(known)
    counts, now = part(rows_of(reeled), 0, known.pulls), rows_of(observer.now)
    sent = rows_of(observer.delivered[tick % observer.delivered.shape[0]])
    for t in range(len(counts)):
        sent[t] = counts[t]
    propagate(knowing, now, counts, h)
