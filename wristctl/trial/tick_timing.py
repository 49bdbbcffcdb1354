"""When the ticks of a loop began, against when they were due; who made them late; and when that must end a trial."""

import math
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wristctl.config.hw_run import Safety
from wristctl.trial.camera_pace import CameraPace
from wristctl.trial.safety import SafetyStop

# Seconds that are judged together.
_WINDOW = 0.5
# Ticks from one look at them to the next.
_EVERY = 4
# Share of a period that the board's answer may take without being blamed.
_SOUND = 0.6

SCHEDULING, LINK, WORK = "the computer woke the loop late", "the board's answers took long", "the loop's own work did"
# Who makes ticks late, and what to do about it.
FIX = {
    SCHEDULING: "close other programs, or give the loop priority: hw-run --priority",
    LINK: "the USB adapter's latency timer or a hub: wristctl hw check --rig; or a longer control_period",
    WORK: "a longer control_period, or a faster computer",
}


class _Tick(NamedTuple):
    round_trip: float
    skipped: int
    culprit: str


@dataclass
class TickTiming:
    """Timing of a run's ticks and of the camera's pictures beside them."""

    period: float
    late: list[float] = field(default_factory=list)
    """Lateness of the ticks [s]."""
    overruns: int = 0
    """Ticks that were skipped because one before took too long."""
    culprits: Counter[str] = field(default_factory=Counter)
    """Who made how many ticks end after the next was due."""
    camera: CameraPace = field(default_factory=CameraPace)

    def __post_init__(self) -> None:
        self._most = round(_WINDOW / self.period)
        self._recent: deque[_Tick] = deque()
        self._due = 0

    def jitter(self, share: float) -> float:
        """This quantile of lateness [s]."""
        return float(np.quantile(self.late, share)) if self.late else math.nan

    def tick(self, late: float, woken: float, round_trip: float, took: float, skipped: int) -> None:
        """A tick has ended: it began `late`, of which the computer slept on for `woken` seconds; it took so long, of
        which the board's answer took `round_trip`; and so many after it are skipped."""
        shares = {SCHEDULING: woken, LINK: round_trip - _SOUND * self.period, WORK: took - round_trip}
        culprit = max(shares, key=lambda who: shares[who])
        if late + took > self.period:
            self.culprits[culprit] += 1
        self.late.append(late)
        self.overruns += skipped
        self._recent.append(_Tick(round_trip, skipped, culprit))
        self._due += 1 + skipped
        while self._due - 1 - self._recent[0].skipped >= self._most:
            self._due -= 1 + self._recent.popleft().skipped

    def judge(self, limits: Safety) -> None:
        """Raises SafetyStop where too many of the last half second's ticks were skipped, or spent on the board."""
        if self._due < self._most or len(self.late) % _EVERY:
            return
        skipped = self._due - len(self._recent)
        trip = float(np.median([tick.round_trip for tick in self._recent]))
        if trip > limits.round_trip * self.period:
            problem = f"the board's answers take {1e3 * trip:.1f} ms of a tick's {1e3 * self.period:g} ms"
            raise SafetyStop(problem, fix=FIX[LINK])
        share = skipped / self._due
        if share > limits.skipped:
            blamed = Counter(tick.culprit for tick in self._recent if tick.skipped)
            who = blamed.most_common(1)[0][0]
            problem = f"{100 * share:.0f} % of the last half second's ticks were skipped: {who}"
            raise SafetyStop(problem, fix=FIX[who])

    def said(self) -> str:
        """In words."""
        median, late, most = (f"{1e3 * self.jitter(share):.2f} ms" for share in (0.5, 0.99, 1.0))
        blamed = "; ".join(f"{who} ({count} ticks)" for who, count in self.culprits.most_common())
        return (
            f"{len(self.late)} ticks of {1e3 * self.period:g} ms, late by {median} (p50), {late} (p99), {most} at "
            f"most; {self.overruns} overruns" + (f"; {blamed}" if blamed else "")
        )
