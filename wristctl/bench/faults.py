"""Faults between the board's pins and the tendons: wires, drives, rotors, pulleys."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES
from wristctl.config.bench import FaultKind, InjectedFault


class Faults:
    """Schedule of faults by the board's clock [s]; those of trials are on only once a trial begins."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        self._faults = tuple(faults)
        self._starts = {"power-on": 0.0, "first trial": math.inf, "trial": math.inf}

    def begin(self, start: float) -> None:
        """A trial's motion starts at this time."""
        self._starts["trial"] = start
        self._starts["first trial"] = min(start, self._starts["first trial"])

    def on(self, kind: FaultKind, time: float) -> bool:
        """Whether such a fault is on."""
        return self.since(kind, time) is not None

    def since(self, kind: FaultKind, time: float) -> float | None:
        """When the earliest fault of this kind that is on began; None where none is."""
        return min((self.begun(fault) for fault in self.active((kind,), time)), default=None)

    def next(self, kind: FaultKind, after: float) -> float:
        """When the next fault of this kind begins after a time; infinite where none does."""
        return min((time for fault in self.of((kind,)) if (time := self.begun(fault)) > after), default=math.inf)

    def of(self, kinds: Sequence[FaultKind]) -> list[InjectedFault]:
        """Faults of these kinds, on or not."""
        return [fault for fault in self._faults if fault.kind in kinds]

    def active(self, kinds: Sequence[FaultKind], time: float) -> list[InjectedFault]:
        """Faults of these kinds that are on."""
        return [fault for fault in self.of(kinds) if 0.0 <= time - self.begun(fault) < (fault.duration or math.inf)]

    def begun(self, fault: InjectedFault) -> float:
        """When a fault begins; infinite where what it counts from has not come."""
        return self._starts[fault.since] + fault.at


class CameraFaults(Faults):
    """Those of a schedule that are one camera's, 1 or 2."""

    def __init__(self, faults: Faults, camera: int) -> None:
        self._whole, self._camera = faults, camera
        self._starts = faults._starts

    def of(self, kinds: Sequence[FaultKind]) -> list[InjectedFault]:
        """Faults of these kinds of this camera, on or not."""
        return [fault for fault in self._whole.of(kinds) if fault.camera == self._camera]


# (E, 3) changes of output latches: cycle, port, value.
Edges = NDArray[np.int64]

_PORT_A, _PORT_C = ord("A"), ord("C")
_ALL_OFF = (1 << AXES) - 1
_WIRES: tuple[FaultKind, ...] = ("direction-flipped", "direction-stuck", "motor-stalled", "drive-off", "supply-off")
_DRIVES: tuple[FaultKind, ...] = ("drive-rescaled", "torque-lost")
_POWER: tuple[FaultKind, ...] = ("drive-off", "supply-off")
_TENDONS: tuple[FaultKind, ...] = ("tendon-detached", "tendon-slipped")
# Slack of a tendon that is off its pulley [m].
_OFF = 1.0
# Seconds of creep that are paid out at once.
_CREEPS_BY = 5e-3


class MotorFaults:
    """Changes what the motors hear of the board, and says when tendons give way.

    `order` says to which axis of the board each motor's cable is connected.
    """

    def __init__(self, faults: Faults, order: Sequence[int]) -> None:
        self._faults, self._order = faults, tuple(order)
        self._enabled, self._until = _ALL_OFF, 0
        self._given_way: set[tuple[int, float]] = set()

    def hear(self, edges: Edges, until: int) -> Edges:
        """The edges up to a cycle as the motors see them, and those of supplies that went and came meanwhile."""
        edges = self._exchanged(edges, self._order)
        for fault in self._faults.of(("motors-exchanged",)):
            begin, end = self._ends(fault)
            during = (edges[:, 0] >= begin) & (edges[:, 0] < end)
            order = list(range(AXES))
            order[fault.axis], order[round(fault.size)] = round(fault.size), fault.axis
            edges = np.concatenate([edges[~during], self._exchanged(edges[during], order)])
            edges = edges[np.argsort(edges[:, 0], kind="stable")]
        power = [cycle for fault in self._faults.of(_POWER) for cycle in self._ends(fault)]
        switched = sorted(cycle for cycle in power if self._until < cycle <= until)
        if switched:
            more = np.array([(cycle, _PORT_C, self._at(edges, cycle)) for cycle in switched], np.int64)
            edges = np.concatenate([edges, more])
            edges = edges[np.argsort(edges[:, 0], kind="stable")]
        is_c = edges[:, 1] == _PORT_C
        if is_c.any():
            self._enabled = int(edges[is_c, 2][-1])
        for fault in self._faults.of(_WIRES):
            begin, end = self._ends(fault)
            during = (edges[:, 0] >= begin) & (edges[:, 0] < end)
            if during.any():
                edges = edges.copy()
                self._distort(fault, edges, during)
        self._until = until
        return edges

    def give_way(self, time: float) -> list[tuple[int, float]]:
        """Axes whose tendons give way up to a time [s], and by how much [m]; each once."""
        detached = []
        for number, fault in enumerate(self._faults.of(_TENDONS)):
            begun = self._faults.begun(fault)
            if begun <= time and (number, begun) not in self._given_way:
                self._given_way.add((number, begun))
                detached.append((fault.axis, _OFF if fault.kind == "tendon-detached" else 1e-3 * fault.size))
        return detached

    def next(self, after: float) -> float:
        """When a tendon gives way, a drive or the load of the hand changes next, after a time [s]; inf: never."""
        creep = after + _CREEPS_BY if self.creeping(after) else self._faults.next("tendon-creeps", after)
        laid = [
            end for fault in self._faults.of(("payload-taken",))
            if (end := self._faults.begun(fault) + (fault.duration or math.inf)) > after
        ]  # fmt: skip
        kinds: tuple[FaultKind, ...] = *_TENDONS, *_DRIVES, "payload-taken"
        return min(creep, *laid, *(self._faults.next(kind, after) for kind in kinds))

    def rescaled(self, time: float) -> list[float]:
        """Times of the way that each drive makes with a step at a time [s], (4,)."""
        scale = [1.0] * AXES
        for fault in self._faults.active(("drive-rescaled",), time):
            scale[fault.axis] *= fault.size
        return scale

    def holding(self, time: float) -> float:
        """Largest pull [N] of any motor at a time [s], as far as faults bound it."""
        return min((fault.size for fault in self._faults.active(("torque-lost",), time)), default=math.inf)

    def carried(self, time: float) -> float:
        """What the hand has taken up at a time [s], in kg."""
        return sum(fault.size for fault in self._faults.active(("payload-taken",), time))

    def creeping(self, time: float) -> list[tuple[int, float]]:
        """Axes whose tendons slip on at a time [s], and how fast they pay out [m/s]."""
        return [(fault.axis, 1e-3 * fault.size) for fault in self._faults.active(("tendon-creeps",), time)]

    @staticmethod
    def _exchanged(edges: Edges, order: Sequence[int]) -> Edges:
        if tuple(order) == tuple(range(AXES)) or not len(edges):
            return edges
        edges = edges.copy()
        for port, width in ((_PORT_A, 2), (_PORT_C, 1)):
            on_port, field = edges[:, 1] == port, (1 << width) - 1
            levels = edges[on_port, 2]
            heard = levels & ~((1 << width * AXES) - 1)
            for motor, axis in enumerate(order):
                heard |= (levels >> width * axis & field) << width * motor
            edges[on_port, 2] = heard
        return edges

    def _ends(self, fault: InjectedFault) -> tuple[float, float]:
        begin = self._faults.begun(fault)
        return tuple(
            math.inf if math.isinf(time) else round(time * FREQUENCY)
            for time in (begin, begin + (fault.duration or math.inf))
        )  # type: ignore[return-value]

    def _at(self, edges: Edges, cycle: float) -> int:
        before = edges[(edges[:, 1] == _PORT_C) & (edges[:, 0] <= cycle), 2]
        return int(before[-1]) if len(before) else self._enabled

    @staticmethod
    def _distort(fault: InjectedFault, edges: Edges, during: NDArray[np.bool_]) -> None:
        a, c = during & (edges[:, 1] == _PORT_A), during & (edges[:, 1] == _PORT_C)
        step = 1 << 2 * fault.axis
        if fault.kind == "direction-flipped":
            edges[a, 2] ^= 2 * step
        elif fault.kind == "direction-stuck":
            edges[a, 2] &= ~(2 * step)
        elif fault.kind == "motor-stalled":
            edges[a, 2] &= ~step
        elif fault.kind == "drive-off":
            edges[a, 2] &= ~step
            edges[c, 2] |= 1 << fault.axis
        else:
            edges[a, 2] &= 0b10101010
            edges[c, 2] |= _ALL_OFF
