"""Time of a control step of each controller on this machine, which `compare` and `study` tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from wristctl.commands.session import Session

if TYPE_CHECKING:
    from wristctl.comparison.step_cost import StepTime
    from wristctl.control.law import Controller

# Seconds in which a controller's step is timed, and in which rankings are drawn.
_TIMED, _DRAWN = 0.065, 1.9


def after_rollouts(controllers: int) -> float:
    """Seconds that rankings, figures and the times of steps take after the rollouts of so many controllers."""
    return _DRAWN + _TIMED * controllers


def timed_steps(session: Session, laws: Mapping[str, tuple[Controller, tuple[float, ...]]]) -> dict[str, StepTime]:
    """Times of the steps of these controllers with these gains, by label; kept in the run."""
    from wristctl.comparison.step_cost import step_time

    times = {}
    with session.progress("timing the control step", len(laws), "controllers") as advance:
        for number, (label, (law, gains)) in enumerate(laws.items(), start=1):
            times[label] = step_time(law, gains, session.study.wrist)
            advance(number)
    session.findings.plain("timing.json", {name: time._asdict() for name, time in times.items()})
    return times
