"""Load cells tared and scaled by a known weight; the motors stay off."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, Pulls
from wristctl.config.hw_run import LoadCells
from wristctl.errors import UserError
from wristctl.wrist.directions import ACTIVE

# Standard gravity [m/s^2]; that of a place differs by 0.3 % at most.
GRAVITY = 9.80665
# Seconds of one weighing, between two looks, for which amplifiers may be starting, and in which they settle on a new
# weight: 0.4 at ten conversions a second.
_WEIGHED, _LOOK, _STARTING, _SETTLES = 2.0, 0.01, 1.0, 0.5
# Age [s] that the board has for a cell that gives nothing.
_SILENT = 0.255
# Counts from which an amplifier is at an end of its range: a wire of the cell is broken, or it is overloaded.
_END = 32_700
# Counts that a weight makes at least.
_LEAST = 50.0


class Weighing(NamedTuple):
    """Readings of the four cells in counts (256 of an amplifier's 24 bits); nan of one that is silent."""

    counts: Array
    """Means, (4,)."""
    scatter: Array
    """Standard deviations, (4,)."""


class _Kept:
    """Keeps what load cells read."""

    def __init__(self) -> None:
        self.readings: list[Pulls] = []

    def take(self, pulls: Pulls) -> None:
        self.readings.append(pulls)

    def judge(self) -> None:
        """Nothing moves."""


def weigh(board: Board) -> Weighing:
    """Read the cells of a board for some seconds."""
    kept, clock = _Kept(), board.transport
    board.cells = kept
    clock.wait(max(_SETTLES, _STARTING - board.read().time))
    kept.readings.clear()
    end = clock.now() + _WEIGHED
    while clock.now() < end:
        board.read()
        clock.wait(_LOOK)
    counts = np.array([pulls.counts for pulls in kept.readings], float)
    silent = (np.array([pulls.age for pulls in kept.readings]) >= _SILENT) | at_an_end(counts)
    counts[:, silent.any(axis=0)] = np.nan
    return Weighing(counts.mean(axis=0), counts.std(axis=0))


def tared(cells: LoadCells, empty: Weighing) -> LoadCells:
    """Cells whose present readings are those of no pull; of silent ones the offset stays."""
    both = zip(cells.offset, empty.counts.tolist(), strict=True)
    offset = [old if np.isnan(new) else round(new, 1) for old, new in both]
    return cells.model_copy(update={"offset": tuple(offset)})


def scaled(cells: LoadCells, axis: int, mass: float, empty: Weighing, loaded: Weighing) -> LoadCells:
    """Cells with the counts per newton of one axis, by a mass [kg] that hangs on it alone.

    Raises UserError where the cell is silent, shows nothing, or another one shows more.
    """
    more = loaded.counts - empty.counts
    if np.isnan(more[axis]):
        problem = f"the load cell of axis {axis} (tendon {ACTIVE[axis]}) is silent"
        raise UserError(problem, fix="see its wires (documentation: Load cells)")
    most = int(np.nanargmax(np.abs(more)))
    if most != axis:
        problem = f"the weight hangs on the load cell of axis {most} (tendon {ACTIVE[most]}), not of axis {axis}"
        raise UserError(problem, fix="hang it there, or exchange the cells' plugs")
    if abs(more[axis]) < _LEAST:
        problem = f"{mass:g} kg make {more[axis]:.0f} counts on axis {axis} (tendon {ACTIVE[axis]})"
        raise UserError(problem, fix="a heavier weight; or the cell is mounted across, or not wired to A+ and A-")
    scale = list(cells.counts_per_newton)
    scale[axis] = float(f"{more[axis] / (mass * GRAVITY):.5g}")
    return cells.model_copy(update={"counts_per_newton": tuple(scale)})


def at_an_end(counts: Array) -> NDArray[np.bool_]:
    """Which counts are at an end of an amplifier's range."""
    ended: NDArray[np.bool_] = np.abs(counts) >= _END
    return ended


def newtons(cells: LoadCells, counts: Array) -> Array:
    """Pulls (4,) [N] that these cells show by their counts (4,)."""
    pulls: Array = (counts - np.array(cells.offset)) / np.array(cells.counts_per_newton)
    return pulls


def silent_axes(weighing: Weighing) -> list[int]:
    """Axes whose cells give nothing, or are at an end of their range."""
    return [axis for axis in range(AXES) if np.isnan(weighing.counts[axis])]
