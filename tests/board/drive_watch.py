"""What four DM542 drives see on the board's pins: counted positions, and every timing their data sheet asks for."""

from __future__ import annotations

from typing import Any

import numpy as np

CLOCK = 16_000_000
MICROSECOND = CLOCK // 1_000_000
# DM542: pulse high and low 2.5 us, DIR 5 us before and after a rising edge, ENA 5 us before DIR and steps.
LEAST = {"high": 2.5, "low": 2.5, "dir_setup": 5.0, "dir_hold": 5.0, "ena_setup": 5.0}
NEVER = -(1 << 40)  # a cycle long before power came on


class DriveWatch:
    """Reads the pin changes of one axis: STEP and DIR are neighbours on port A, ENA is on port C (high = off)."""

    def __init__(self, axis: int) -> None:
        self.step, self.dir, self.ena = 1 << 2 * axis, 2 << 2 * axis, 1 << axis
        self.position = 0
        self.steps = 0
        self.last_rise = NEVER
        self.steps_while_off = 0
        self.was_on = False
        self.least = dict.fromkeys(LEAST, float("inf"))  # us
        self._last_fall = self._last_turn = self._last_on = NEVER
        self._port, self._off = 0, True

    def read(self, events: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Take in the next pin changes; return the cycles at which STEP rose."""
        on_c = events[events["port"] == ord("C")]
        off = np.concatenate(([self._off], (on_c["value"] & self.ena) > 0))
        ena_cycle = np.concatenate(([NEVER], on_c["cycle"].astype(np.int64)))
        on_a = events[events["port"] == ord("A")]
        value = np.concatenate(([self._port], on_a["value"])).astype(np.int64)
        cycle = on_a["cycle"].astype(np.int64)
        changed, now = value[1:] ^ value[:-1], value[1:]
        rise, fall = (changed & now & self.step) > 0, (changed & ~now & self.step) > 0
        rises, falls, turns = cycle[rise], cycle[fall], cycle[(changed & self.dir) > 0]
        ons = ena_cycle[1:][off[:-1] & ~off[1:]]
        self._shortest("high", falls, np.concatenate(([self.last_rise], rises)))
        self._shortest("low", rises, np.concatenate(([self._last_fall], falls)))
        self._shortest("dir_setup", rises, np.concatenate(([self._last_turn], turns)))
        self._shortest("dir_hold", turns, np.concatenate(([self.last_rise], rises)))
        self._shortest("ena_setup", np.sort(np.concatenate((rises, turns))), np.concatenate(([self._last_on], ons)))
        self.steps_while_off += int(off[np.searchsorted(ena_cycle, rises) - 1].sum())
        self.position += int(np.where(now[rise] & self.dir, -1, 1).sum())
        self.steps += len(rises)
        self.last_rise = int(rises[-1]) if len(rises) else self.last_rise
        self._last_fall = int(falls[-1]) if len(falls) else self._last_fall
        self._last_turn = int(turns[-1]) if len(turns) else self._last_turn
        self._last_on = int(ons[-1]) if len(ons) else self._last_on
        self.was_on |= len(ons) > 0
        self._port, self._off = int(value[-1]), bool(off[-1])
        return rises

    def _shortest(self, what: str, at: np.ndarray[Any, Any], earlier: np.ndarray[Any, Any]) -> None:
        """Keep the shortest time from the latest earlier event to each of `at`."""
        if len(at):
            wait = at - earlier[np.searchsorted(earlier, at, side="right") - 1]
            self.least[what] = min(self.least[what], float(wait.min()) / MICROSECOND)

    def violations(self) -> dict[str, float]:
        """Return the timings shorter than the drive allows, in us."""
        return {what: us for what, us in self.least.items() if us < LEAST[what]}
