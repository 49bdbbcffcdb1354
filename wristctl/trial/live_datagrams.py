"""Wanted bends, one JSON object a datagram: what is refused, and the reference that follows.

Nothing is ever sent back. Whoever can send to the socket, or has the stream, moves the wrist, within the limits of the
reference: a socket is bound to this computer alone unless a setting asks for more.
"""

import math
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.simulation.live_reference import FOLLOWED, IN_TWO_PLANES, LimitedReference, LiveLimits
from wristctl.trial.wanted_sources import LONGEST, source_of

# Where wanted bends are listened for, if no setting says so.
LISTEN = "127.0.0.1:5005"
# Datagrams that one sample reads at most.
_AT_ONCE = 256

Refusal = Literal["malformed", "not finite", "old", "out of range", "jump", "other sender"]
# Kinds of refused datagrams, and what each is.
REFUSALS: dict[Refusal, str] = {
    "malformed": 'no JSON object with "bend": one number, or two; or longer than 1024 bytes',
    "not finite": "a bend or a time that is nan or infinite",
    "old": "seq is not above the last one's, or t goes back",
    "out of range": "a bend beyond reference.limit_deg or the wrist's range",
    "jump": "further than reference.jump_deg from the bend before, which the next one did not confirm",
    "other sender": "from another address and port while the first one still sends",
}
# State of the reference at a sample.
WAITING, FOLLOWING, HOLDING, HOME, ENDING = "waiting", "following", "holding", "home", "ending"


class _Refused(Exception):
    def __init__(self, kind: Refusal) -> None:
        self.kind = kind


class _Content(BaseModel):
    model_config = ConfigDict(strict=True)

    bend: float | tuple[float, float]
    seq: int | None = None
    t: float | None = None


class WantedBends:
    """The newest wanted bend of P planes; `plane` is that of a loop in one. `counts` has datagrams by kind."""

    def __init__(self, limits: LiveLimits, planes: int, plane: str = "ulnar") -> None:
        self._limits, self._planes, self._component = limits, planes, int(plane == "flexion")
        self.counts: Counter[str] = Counter()
        self.begin()

    def begin(self) -> None:
        """Forget what was wanted, and who sent it."""
        self.wanted: Array | None = None
        """Newest bend that is followed (P,) [rad]; None before the first."""
        self.heard = -math.inf
        """When it came [s]."""
        self._forget()

    def _forget(self) -> None:
        self._sender: Any = None
        self._seq: float | None = None
        self._time: float | None = None
        self._unconfirmed: Array | None = None
        self._speaks = False

    def take(self, data: bytes, sender: Any, now: float) -> None:
        """One datagram that came `now` [s]: followed, or refused and counted.

        After a silence any sender is heard, with numbers and bends of its own.
        """
        if now - self.heard > self._limits.silence:
            self._forget()
        try:
            bend = self._bend_of(data, sender)
        except _Refused as refused:
            self.counts[refused.kind] += 1
            return
        self.counts["followed"] += 1
        self.wanted, self.heard, self._sender, self._speaks = bend, now, sender, True

    def _bend_of(self, data: bytes, sender: Any) -> Array:
        if self._speaks and sender != self._sender:
            raise _Refused("other sender")
        sent, seq, when = self._parsed(data)
        if not (np.isfinite(sent).all() and (when is None or math.isfinite(when))):
            raise _Refused("not finite")
        if (seq is not None and self._seq is not None and seq <= self._seq) or (
            when is not None and self._time is not None and when < self._time
        ):
            raise _Refused("old")
        self._seq, self._time = (seq if seq is not None else self._seq), (when if when is not None else self._time)
        bend = sent if len(sent) == self._planes else sent[self._component :][:1]
        if np.hypot.reduce(bend) > self._limits.range:
            raise _Refused("out of range")
        if self._speaks and self._far(bend, self.wanted) and self._far(bend, self._unconfirmed):
            self._unconfirmed = bend
            raise _Refused("jump")
        self._unconfirmed = None
        return bend

    def _far(self, bend: Array, other: Array | None) -> bool:
        return other is None or float(np.hypot.reduce(bend - other)) > self._limits.jump

    def _parsed(self, data: bytes) -> tuple[Array, int | None, float | None]:
        """Bend, one number or a pair [rad], seq and t of a datagram."""
        try:
            content = _Content.model_validate_json(data)
        except ValidationError:
            raise _Refused("malformed") from None
        bend = np.atleast_1d(content.bend)
        if len(data) > LONGEST or len(bend) < self._planes:
            raise _Refused("malformed")
        return np.radians(bend), content.seq, content.t


class LiveReference:
    """A reference that is followed while it comes, sample by sample every `period` [s] over the horizon [s].

    Parameters
    ----------
    reference
        A live one: its address and limits.
    wrist
        The wrist whose range it stays within.
    planes, plane
        Planes of the loop, and the one plane of a loop in one: a pair of bends has its bend there.
    horizon, period
        Duration of the motion, in whose last moments it comes to rest, and time between two samples [s].
    paced
        Whether samples wait for the wall clock, where the loop's own clock is virtual.
    clock, sleep
        The wall clock [s].

    Raises UserError for limits that are none, and where the socket cannot be bound.
    """

    def __init__(
        self, reference: Reference, wrist: WristParameters, planes: int, plane: str, horizon: float, period: float,
        paced: bool = False, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep,
    ) -> None:  # fmt: skip
        self.limits = LiveLimits.of(reference, wrist, period)
        self.bends = WantedBends(self.limits, planes, plane)
        self._limited = LimitedReference(self.limits, planes, period)
        self._planes, self._period, self._paced, self._clock, self._sleep = planes, period, paced, clock, sleep
        samples = round(horizon / period)
        self._ending = samples - math.ceil(2.0 * self.limits.smoothing / period)
        self.course = np.zeros((samples, planes, len(FOLLOWED)))
        """Bend, rate and acceleration of each plane at each sample so far (T, P, 3); 0 at the others."""
        self._wanted = np.full((samples, planes), math.nan)
        self.states = [WAITING] * samples
        self.filled = 0
        """Samples so far."""
        self._began: float | None = None
        self.behind = 0.0
        """Longest time by which a paced sample was behind the wall clock [s]."""
        self.source = source_of(reference.listen or LISTEN)
        """Where wanted bends come from."""

    @property
    def address(self) -> str:
        """HOST:PORT that is listened at, or the stream's name."""
        return self.source.address

    @property
    def bend(self) -> Array:
        """Followed bend at the newest sample (P,) [rad]."""
        return self._limited.bend

    def fill(self, course: Array, sample: int) -> None:
        """Follow up to a sample; the course (T, P, 3) has all samples up to it then.

        What was sent before the first sample is passed over. Samples that a late loop has missed go by the same wanted
        bend.
        """
        if self._began is None:
            while self.source.received() is not None:
                pass
            self.bends.begin()
            self._began = self._clock()
        if self._paced:
            ahead = self._began + sample * self._period - self._clock()
            if ahead > 0.0:
                self._sleep(ahead)
            self.behind = max(self.behind, -ahead)
        now = self._clock()
        for _ in range(_AT_ONCE):
            if (came := self.source.received()) is None:
                break
            self.bends.take(*came, now)
        first = self.filled
        while self.filled <= min(sample, len(self.course) - 1):
            self._one(self.filled, now)
            self.filled += 1
        course[first : self.filled] = self.course[first : self.filled]

    def _one(self, sample: int, now: float) -> None:
        wanted, silent, limits = self.bends.wanted, now - self.bends.heard, self.limits
        state = FOLLOWING if silent <= limits.silence else HOLDING if silent <= limits.silence + limits.hold else HOME
        if sample >= self._ending:
            state = ENDING
        elif wanted is None:
            state = WAITING
        if sample and state == FOLLOWING and wanted is not None:
            self._limited.toward(wanted)
        elif sample and state == HOME:
            self._limited.toward(np.zeros(self._planes))
        elif sample:
            self._limited.brake()
        self.course[sample] = np.stack([self._limited.bend, self._limited.rate, self._limited.acceleration], axis=1)
        if state == FOLLOWING and wanted is not None:
            self._wanted[sample] = wanted
        self.states[sample] = state

    def listen(self) -> None:
        """Follow all samples by the wall clock, where no loop asks for them."""
        whole = np.zeros_like(self.course)
        for sample in range(len(whole)):
            self.fill(whole, sample)

    def record(self) -> tuple[dict[str, Any], dict[str, str], dict[str, str]]:
        """Columns, units and meanings of the samples so far, which `reference.file` replays."""
        count, names = self.filled, FOLLOWED if self._planes == 1 else IN_TWO_PLANES
        rows = self.course[:count].reshape(count, -1).T
        wanted = ("wanted",) if self._planes == 1 else ("wanted_ulnar", "wanted_flexion")
        columns: dict[str, Any] = {"time": self._period * np.arange(count, dtype=np.float64)}
        columns |= dict(zip(names, rows, strict=True)) | dict(zip(wanted, self._wanted[:count].T, strict=True))
        columns["state"] = np.array(self.states[:count])
        units = {name: "rad/s^2" if name[0] == "a" else "rad/s" if name[0] == "r" else "rad" for name in columns}
        meaning = {
            "time": "since the motion began",
            **dict.fromkeys(names, "of the reference that was followed"),
            **dict.fromkeys(wanted, "newest wanted bend; empty where none is followed"),
            "state": f"{WAITING} for the first, {FOLLOWING}, {HOLDING}, going {HOME}, or {ENDING}",
        }
        return columns, units | {"time": "s", "state": ""}, meaning

    def said(self) -> str:
        """How many datagrams were followed, and how many refused for what."""
        counts = self.bends.counts
        refused = ", ".join(f"{counts[kind]} {kind}" for kind in REFUSALS if counts[kind])
        slow = f"; up to {self.behind:.2g} s behind the wall clock" if self.behind > self.limits.silence else ""
        return f"live reference: {counts['followed']} datagrams followed, {refused or 'none'} refused{slow}"

    def close(self) -> None:
        """Give the source back."""
        self.source.close()
