"""Controllers in plain Python: what they cost, said before anything starts."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from wristctl.commands.procedure import Procedure
from wristctl.commands.progress import duration
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.control.law import Controller

log = logging.getLogger(__name__)


def warn_of_plain(procedure: Procedure[Any], study: Study) -> None:
    """Say for each controller in plain Python how many cases it has, how long they take, and which loops are left out.

    Loops with another control period than it was written for are told too. UserError where a comparison leaves none of
    its loops to it.
    """
    from wristctl.control.law import Controller
    from wristctl.control.table import CONTROLLERS

    section = procedure.section(study)
    rows = [section] if hasattr(section, "controller") else getattr(section, "rows", ())
    names = [row.controller for row in rows if hasattr(row, "controller")] or getattr(section, "controllers", [])
    for name in dict.fromkeys(names):
        law = CONTROLLERS.get(name)
        if isinstance(law, Controller) and law.plain:
            remark = _cost(procedure, study, law) if procedure.size else "its control steps take Python's time"
            log.warning("%s is plain Python: %s", name, remark)
            if others := _other_periods(procedure, study, law):
                own, here = (f"{1e3 * each:g}" for each in (law.period or 0.0, others[0]))
                said = "%s was written for control periods of %s ms, and runs every %s ms here: its own time is another"
                log.warning(said, name, own, here)


def _other_periods(procedure: Procedure[Any], study: Study, law: Controller) -> list[float]:
    """Control periods of the loops that it runs in which are not its own [s]."""
    if law.period is None:
        return []
    section = procedure.section(study)
    loops = procedure.size(_alone(procedure.kind, study, law)[0]).loops if procedure.size else [section]
    periods = {getattr(loop, "control_period", law.period) for loop in loops}
    return sorted(period for period in periods if abs(period - law.period) > 1e-9)


def _cost(procedure: Procedure[Any], study: Study, law: Controller) -> str:
    from wristctl.comparison.step_cost import step_time
    from wristctl.control.law import LEAST_PLAIN_PERIOD

    assert procedure.size is not None
    alone, left_out = _alone(procedure.kind, study, law)
    size = procedure.size(alone)
    ticks = size.rollouts * size.horizon * sum(1.0 / loop.control_period for loop in size.loops) / len(size.loops)
    gains = [law.values(preset) for preset in law.presets.values()]
    middle = tuple((gain.low * gain.high) ** 0.5 for gain in law.gains.values())
    try:
        seconds = 1e-6 * step_time(law, gains[-1] if gains else middle, study.wrist).median * ticks
        time = f"take{'s' * (size.rollouts == 1)} about {duration(max(1.0, seconds))}"
    except UserError:  # the run that comes fails of it, and keeps what it said
        time = "take a time that is not known, for it fails when it is timed"
    cases = f"{size.rollouts:.0f} case{'s' * (size.rollouts > 1)}"
    remark = f"left out on {', '.join(left_out)} (a tick below {LEAST_PLAIN_PERIOD:g} s); " if left_out else ""
    return f"{remark}{cases} {time}"


def _alone(command: str, study: Study, law: Controller) -> tuple[Study, list[str]]:
    """The study with this controller alone, on the loops that it is run on, and the names of the others."""
    from wristctl.control.law import LEAST_PLAIN_PERIOD

    if command == "tune":
        return study.model_copy(update={"tune": study.tune.model_copy(update={"controllers": (law.name,)})}), []
    if command != "compare" or study.compare.worlds.family:
        return study, []
    settings = study.compare
    loops = {name: loop for name, loop in settings.loops.items() if law.keeps_up(loop.control_period)}
    if not loops:
        fix = f"a loop with a control_period of {LEAST_PLAIN_PERIOD:g} s or more, or a controller that compiles"
        raise UserError(f"no loop is left for {law.name}, which is plain Python", "compare.loops", fix)
    rows = tuple(row for row in settings.rows if row.controller == law.name)
    alone = settings.model_copy(update={"rows": rows, "loops": loops})
    return study.model_copy(update={"compare": alone}), [name for name in settings.loops if name not in loops]
