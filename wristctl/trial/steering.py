"""The controller on hardware: the same compiled laws, allocation and observer as in simulation, tick by tick."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.faults import Faults
from wristctl.config.bench import InjectedFault
from wristctl.config.plant import Sensor
from wristctl.control.belief import Limits
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.control.response import OF_A_PLANE, Controlled, Estimate, Seen, look_ahead, respond, room_like
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.observer import knowing_in_lanes, propagate
from wristctl.trial.rig_belief import RigBelief

# Ticks that a frame may be late.
REMEMBERED = 256
# Seconds by which a frame may be older than the last one of another camera: it is fused there.
_UNEVEN = 0.05


class Answer(NamedTuple):
    """Answer of the laws: torques wanted and commanded (P,) [N m], share reached, and tensions of the axes (4,) [N]."""

    torque_wanted: Array
    torque: Array
    share: float
    tension: Array


class _Observer(NamedTuple):
    """Gain (3 P,), what was delivered (ring, T), and x (3 P,) at the last fused frame and at the present tick."""

    gain: Any
    delivered: Any
    fused: Any
    now: Any


class Steering:
    """Observers and laws of P planes. Ticks are numbered from 0, `period` [s] apart; the wrist rests straight at first.

    `belief` has P planes and T places of tendons.
    """

    def __init__(self, belief: RigBelief, sensor: Sensor, period: float) -> None:
        self._belief, self._known, self._planes = belief, belief.known, len(belief.planes)
        self._alike = belief.known.belief.alike
        wrist, places = belief.wrist, len(self._alike)
        self._bounds = np.concatenate([self._alike * wrist.pretension, self._alike * wrist.tension_limit])
        x = np.zeros(OF_A_PLANE * self._planes)
        self._observer = _Observer(belief.gains(sensor, period), np.zeros((REMEMBERED, places)), x, x.copy())
        self._bends = np.zeros((REMEMBERED, self._planes))
        self._fused_at, self._seen_at, self._period = 0, [0] * self._planes, period
        self._found = np.zeros(places + 2 * self._planes + 1)
        self._missed = np.zeros(self._planes)
        self._law: Any = None
        self._control: Any = None
        self._preview = 0
        self.tick = 0
        self.withheld: Array = np.zeros(self._planes)
        """Torque of the last command that the motors are too slow to deliver, by plane [N m]."""

    @property
    def estimate(self) -> Estimate:
        """As of the present tick; bend, rate and load are (P,) each."""
        return Estimate(*self._observer.now.reshape(self._planes, OF_A_PLANE).T.copy())

    def bend_at(self, captured: float) -> Array:
        """Bend (P,) [rad] as it was believed `captured` seconds after tick 0, as far as it is remembered."""
        since = min(max(captured / self._period, self.tick - REMEMBERED + 1, 0), self.tick)
        tick = math.floor(since)
        before, after = self._bends[tick % REMEMBERED], self._bends[min(tick + 1, self.tick) % REMEMBERED]
        believed: Array = before + (since - tick) * (after - before)
        return believed

    def use(self, controller: Controller, gains: Sequence[float]) -> None:
        """Take up a law in each plane, its memory empty, with motors that have caught up."""
        planes, places = self._planes, len(self._alike)
        self._law = controller.compiled(1, planes, places)
        self.withheld, self._missed, self._preview = np.zeros(planes), np.zeros(planes), controller.preview
        self._control = Controlled(
            self._law, np.zeros((planes, signals_of(controller.preview))), self._known.belief.models,
            np.array([*gains, 0.0]), np.zeros((planes, max(1, controller.memory))), np.zeros((planes, len(REFERENCE))),
        )  # fmt: skip

    def see(self, plane: int, bend: float, captured: float) -> bool:
        """Fuse one plane's bend [rad] seen `captured` seconds after tick 0; False where that is too old or yet to come.

        One that was taken before the last frame of another camera is compared with what was believed then.
        """
        tick = math.floor(captured / self._period)
        late = self._fused_at * self._period - captured
        oldest = max(self._seen_at[plane], self.tick - REMEMBERED + 1)
        if late > _UNEVEN or not oldest <= tick <= self.tick:
            return False
        at = max(tick, self._fused_at)
        ticks = self._fused_at, at, self.tick
        _fuse(self._known, self._observer, ticks, plane, captured - at * self._period, bend, self._period)
        self._fused_at, self._seen_at[plane] = at, tick
        self._bends[self.tick % REMEMBERED] = self._observer.now[::OF_A_PLANE]
        return True

    def respond(self, course: Array, tick: int = 0) -> Answer:
        """The laws' answer, at the present estimate, to a reference (T, P, 3) of bend, rate and acceleration at its
        tick.

        It goes by periods; beyond its end it stays as it is there, for a law that looks ahead. Raises what a plain law
        has raised.
        """
        to_follow, sees = (course, tick, self._preview), Seen(self._observer.now, self.withheld, self._missed)
        _respond(self._control, self._known, self._bounds, sees, to_follow, self._period, self._found)
        self._law.check()
        count, planes = len(self._alike), self._planes
        pulls, torques = self._found[:count], self._found[count:-1].copy()
        tension = self._belief.of_axes(pulls / self._alike)
        return Answer(torques[:planes], torques[planes:], float(self._found[-1]), tension)

    def predict(self, reeled: Array) -> None:
        """Go on to the next tick, with so much (T,) [m] reeled in at each place until then."""
        _predict(self._known, self._observer, self.tick, reeled, self._period)
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
    for i in range(OF_A_PLANE * len(knowing.bend)):
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


class HostFaults(Faults):
    """Faults of the bench that happen in the control loop; times count from the trial's motion."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        super().__init__(faults)
        self.begin(0.0)

    def answer(self, answer: Any, time: float) -> Any:
        """The law's answer, in any planes; NaN under model-nan. Raises ArithmeticError under controller-exception."""
        if self.on("controller-exception", time):
            raise ArithmeticError("injected fault")
        return answer._replace(torque_wanted=math.nan) if self.on("model-nan", time) else answer

    def disk(self, time: float) -> bool:
        """Whether the disk is full."""
        return self.on("disk-full", time)
