"""Units given to workers and their results brought together, in the order of the study whatever the order they end in.

What a unit gave is kept at once. One that fails is tried twice more and then named, and the others go on; one that a
worker died of is tried alone, so that none is blamed for another.
"""

from __future__ import annotations

import secrets
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any, NamedTuple

from wristctl.errors import Argument, UserError
from wristctl.work.executors import EXECUTOR, Pool, Workers
from wristctl.work.worker import (
    Computed,
    Furnish,
    Golden,
    Unit,
    WorkerDiffers,
    compute,
    file_of,
    read_unit,
    same_arrays,
    write_unit,
)

if TYPE_CHECKING:
    import numpy as np

_TRIES = 3
# Characters of an error that a table has room for.
_TOLD = 300
# Errors after which no worker is risked again: several have died of it, since Dask tries by itself.
_FINAL = ("KilledWorker",)
# Seconds between two looks at whether the cluster is still there.
_LOOK = 0.5
RESUMED = Argument("resume")
RESUME = ("go on with ", Argument("resume", "RUN"), ": what is done is kept")


class Poisoned(NamedTuple):
    """A unit that fails wherever it is tried."""

    unit: Unit
    why: str


@dataclass
class UnitsDone:
    """Results of units, in their order. None for a failed unit."""

    arrays: list[dict[str, np.ndarray] | None]
    poisoned: list[Poisoned] = field(default_factory=list)
    found: int = 0
    """Units that were in the folder already."""
    taken_over: list[Unit] = field(default_factory=list)
    """Units that the earlier run had, and that were not computed here."""
    tried_again: Unit | None = None
    """One more of the earlier run's, drawn at random, that was computed here and gave the same."""
    seconds: float = 0.0
    """Time that workers have spent on units in this command, summed [s]."""
    processor: float = 0.0


# Called with each unit that is done; None: it was there already, or in the earlier run.
Told = Callable[[Unit, Computed | None], None]


def perform_units(
    units: Sequence[Unit],
    workers: Workers,
    golden: Golden | None = None,
    folder: Path | None = None,
    earlier: Path | None = None,
    report: Told = lambda unit, computed: None,
    furnish: Furnish | None = None,
) -> UnitsDone:
    """Compute units, those left out that are in `folder` or in the folder of an `earlier` run, which are copied.

    An earlier run may be anybody's: one of its units, drawn at random, is computed all the same, and first. Workers
    elsewhere `furnish` themselves before.

    UserError, with exit code 3, where that unit differs, and then none of the earlier run's is kept; where one of them
    is no plain file; and where the workers compute other numbers or are gone; all that was done by then is in `folder`.
    """
    outcome = UnitsDone([None] * len(units))
    waiting = deque[int]()
    earlier_ones: dict[int, dict[str, np.ndarray]] = {}
    for number, unit in enumerate(units):
        outcome.arrays[number] = read_unit(folder, unit.key) if folder else None
        if outcome.arrays[number] is not None:
            outcome.found += 1
            report(unit, None)
        elif earlier is not None and (arrays := read_unit(earlier, unit.key)) is not None:
            earlier_ones[number] = arrays
        else:
            waiting.append(number)
    drawn = secrets.choice([*earlier_ones]) if earlier_ones else None
    expected = earlier_ones.pop(drawn) if drawn is not None else {}
    for number, arrays in earlier_ones.items():
        if folder is not None:
            write_unit(folder, units[number].key, arrays)
        outcome.arrays[number] = arrays
        outcome.taken_over.append(units[number])
        report(units[number], None)
    if drawn is not None:
        waiting.appendleft(drawn)
    if waiting:
        _Fan(units, workers, golden, folder, report, outcome, waiting, furnish, drawn, expected).run()
    return outcome


@dataclass
class _Fan:
    """The units on their way."""

    units: Sequence[Unit]
    workers: Workers
    golden: Golden | None
    folder: Path | None
    told: Told
    done: UnitsDone
    waiting: deque[int]
    furnish: Furnish | None
    drawn: int | None = None
    expected: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Arrays of the earlier run for the `drawn` unit."""
    alone: deque[int] = field(default_factory=deque)
    """Units that were under way when a worker died."""
    suspected: set[int] = field(default_factory=set)
    """Those of them that were handed out again, each of which has the pool for itself."""
    failures: Counter[int] = field(default_factory=Counter)
    running: dict[Future[Any], int] = field(default_factory=dict)

    breaks: int = 0
    """Number of pools that broke with no unit under way."""

    def run(self) -> None:
        """Until all are done or poisoned, with a new pool where one breaks."""
        while self.waiting or self.alone or self.running:
            with self.workers.open() as pool:
                while (self.waiting or self.alone or self.running) and not self._broken(pool):
                    pass
        self.done.poisoned.sort(key=lambda failure: self.units.index(failure.unit))

    def _broken(self, pool: Pool) -> bool:
        """Hand out what there is room for and take what is done; whether the pool broke meanwhile."""
        try:
            self._hand_out(pool)
        except BrokenProcessPool:
            return self._blame([])
        ended, _ = wait(self.running, timeout=_LOOK, return_when=FIRST_COMPLETED)
        if loss := pool.lost():
            raise UserError(loss, EXECUTOR, RESUME, exit_code=3)
        numbers = [(future, self.running.pop(future)) for future in ended]
        died = [number for future, number in numbers if not self._take(future, number, pool)]
        return bool(died) and self._blame(died)

    def _hand_out(self, pool: Pool) -> None:
        """Fill the pool; a unit under suspicion has it for itself from its beginning to its end."""
        while source := self.alone or self.waiting:
            single = source is self.alone or not self.suspected.isdisjoint(self.running.values())
            if len(self.running) >= (1 if single else pool.width()):
                return
            if source is self.alone:
                self.suspected.add(source[0])
            unit = self.units[source[0]]
            first = (self.golden, self.furnish) if pool.apart else (None, None)
            future = pool.executor.submit(compute, unit.does, dict(unit.spec), *first)
            self.running[future] = source.popleft()

    def _take(self, future: Future[Any], number: int, pool: Pool) -> bool:
        """Take in what a unit gave or how it failed; False where its worker died."""
        unit = self.units[number]
        try:
            computed: Computed = future.result()
        except WorkerDiffers as error:
            fix = ("workers of the same version and kind of processor; then ", *RESUME)
            raise UserError(str(error), EXECUTOR, fix, exit_code=3) from error
        except BrokenProcessPool:
            return False
        except CancelledError as error:
            loss = pool.lost() or "the executor has dropped a unit"
            raise UserError(loss, EXECUTOR, RESUME, exit_code=3) from error
        except Exception as error:
            notes = " ".join(getattr(error, "__notes__", ()))
            self._failed(number, f"{type(error).__name__}: {error} {notes}", type(error).__name__ in _FINAL)
            return True
        if number == self.drawn:
            self._compare(unit, computed.arrays)
        if self.folder is not None:
            write_unit(self.folder, unit.key, computed.arrays)
        self.done.arrays[number] = dict(computed.arrays)
        self.done.seconds += computed.seconds
        self.done.processor += computed.processor
        self.told(unit, computed)
        return True

    def _compare(self, unit: Unit, arrays: Mapping[str, np.ndarray]) -> None:
        """UserError where the earlier run has something else for a unit; none of its units is kept then."""
        if same_arrays(self.expected, arrays):
            self.done.tried_again = unit
            return
        if self.folder is not None:
            for resumed in self.done.taken_over:
                file_of(self.folder, resumed.key).unlink(missing_ok=True)
        problem = f"{unit.name or unit.key[:12]} gives other numbers here than the run to resume has"
        raise UserError(problem, RESUMED, "begin anew, without it: somebody has changed its units", exit_code=3)

    def _failed(self, number: int, why: str, final: bool = False) -> None:
        self.failures[number] += 1
        if self.failures[number] < _TRIES and not final:
            self.alone.append(number)
        else:
            self.done.poisoned.append(Poisoned(self.units[number], shorten(why, _TOLD, placeholder=" ...")))

    def _blame(self, died: Sequence[int]) -> bool:
        """Mark the unit that was under way when a worker died as failed. Several units are tried one by one."""
        suspects = sorted({*died, *self.running.values()})
        self.running.clear()
        if len(suspects) == 1:
            self._failed(suspects[0], "its worker process died")
        else:
            self.alone.extend(suspects)
        self.breaks += not suspects
        if self.breaks >= _TRIES:
            raise UserError("worker processes die as they begin", EXECUTOR, "fewer of them, or serial", 3)
        return True
