"""What a study asks of a computer, before anything is allocated: steps to integrate, and memory for its courses."""

from collections.abc import Sequence
from typing import NamedTuple

from wristctl.config.loop import Loop
from wristctl.errors import UserError
from wristctl.processes import cores
from wristctl.simulation.batch import sample_period

MOST_STEPS = 1e10
"""Integration steps of one rollout: an hour and more."""
MOST_IN_ALL = 1e13
"""Integration steps of all rollouts: a month on one core."""
RATE = 3e6
"""Integration steps a second on a core, of four segments side by side."""
MOST_BYTES = 4e9
"""For the courses that one rollout leaves, in memory and on their way to a file."""
_COLUMNS = 40
"""Numbers a sample has then: recorded, as a trajectory, and as columns of its table."""


class Size(NamedTuple):
    """Rollouts over `horizon` [s], as many of each of the loops."""

    loops: Sequence[Loop]
    horizon: float
    rollouts: float = 1.0

    @property
    def steps(self) -> float:
        """Integration steps of all, where none needs a shorter step."""
        each = [self.horizon / loop.control_period * loop.steps for loop in self.loops]
        return self.rollouts * sum(each) / len(each)


def check_size(size: Size) -> None:
    """UserError, with the most that there is room for, where rollouts ask for too much one by one or together."""
    horizon = size.horizon
    for loop in size.loops:
        steps = horizon / loop.control_period * loop.steps
        if steps > MOST_STEPS:
            most, what = MOST_STEPS * loop.control_period / loop.steps, f"{steps:.2g} integration steps of a rollout"
            fix = f"at most {most:.3g} s with this control_period and substeps, or a longer control_period"
            raise UserError(f"{what}, {_lasting(steps, 1)}, are more than {MOST_STEPS:g}", "horizon", fix)
        bytes_ = 8.0 * (_COLUMNS + loop.plant_segments) * horizon / sample_period(loop.control_period)
        if bytes_ > MOST_BYTES:
            what = f"a course of {horizon:g} s needs {bytes_ / 1e9:.2g} GB, more than {MOST_BYTES / 1e9:g}"
            raise UserError(what, "horizon", f"at most {horizon * MOST_BYTES / bytes_:.3g} s")
    check_steps(size.steps, size.rollouts)


def check_steps(steps: float, rollouts: float) -> None:
    """UserError where so many steps of so many rollouts together are too many."""
    if steps > MOST_IN_ALL:
        what = f"{steps:.2g} integration steps of {rollouts:.3g} rollouts, {_lasting(steps, cores())}"
        fix = f"at most {rollouts * MOST_IN_ALL / steps:.2g} such rollouts, fewer substeps, or a shorter horizon"
        raise UserError(f"{what}, are more than {MOST_IN_ALL:g}", "", fix)


def _lasting(steps: float, many: int) -> str:
    hours = steps / (RATE * many * 3600.0)
    told = f"{hours:.2g} hours" if hours < 48.0 else f"{hours / 24.0:.2g} days"
    return f"some {told} on {many} core{'s' * (many > 1)}"
