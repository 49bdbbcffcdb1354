"""What a study asks of a computer, before anything is allocated: steps to integrate, and memory for its courses."""

from __future__ import annotations

from collections.abc import Iterable

from wristctl.config.errors import UserError
from wristctl.config.loop import Loop
from wristctl.simulation.batch import sample_period

MOST_STEPS = 1e10
"""Integration steps of one rollout: a quarter of an hour and more."""
MOST_BYTES = 4e9
"""For the courses that one rollout leaves, in memory and on their way to a file."""
_COLUMNS = 40
"""Numbers a sample has then: recorded, as a trajectory, and as columns of its table."""


def check_size(loops: Iterable[Loop], horizon: float) -> None:
    """UserError, with the largest horizon that there is room for, where a loop over `horizon` [s] asks for too much."""
    for loop in loops:
        steps = horizon / loop.control_period * loop.steps
        if steps > MOST_STEPS:
            most, what = MOST_STEPS * loop.control_period / loop.steps, f"{steps:.2g} integration steps of a rollout"
            fix = f"at most {most:.3g} s with this control_period and substeps, or a longer control_period"
            raise UserError(f"{what} are more than {MOST_STEPS:g}", "horizon", fix)
        bytes_ = 8.0 * (_COLUMNS + loop.plant_segments) * horizon / sample_period(loop.control_period)
        if bytes_ > MOST_BYTES:
            what = f"a course of {horizon:g} s needs {bytes_ / 1e9:.2g} GB, more than {MOST_BYTES / 1e9:g}"
            raise UserError(what, "horizon", f"at most {horizon * MOST_BYTES / bytes_:.3g} s")
