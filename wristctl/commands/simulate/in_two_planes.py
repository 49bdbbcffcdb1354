"""One closed loop in two planes, with pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.inputs_of_loops import identified, tuned_gains
from wristctl.commands.loop_warnings import warn_if_coarse, warn_outside_conditions
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.simulation.bend_course import BendCourse
    from wristctl.simulation.bend_loops import RepeatedBends


@dataclass(frozen=True, repr=False, eq=False)
class SimulatedBends(StudyResult):
    """One closed loop in two planes, as often as the study says, and whether the wrist ever left its range."""

    kind = "simulate"

    repeated: RepeatedBends
    """Metrics of every repetition."""
    short_of: str = ""
    """Reason why the loop does not arrive at its reference; empty where it does."""
    advice: Sequence[str] = ()
    """What may help where it does not."""

    @property
    def fault(self) -> UserError | None:
        """Error of a wrist that left its range; None where it stayed within."""
        if not self.repeated.failure:
            return None
        fix = "look at the figures; try other gains or a slower motion"
        return UserError(f"the wrist {self.repeated.failure}", self.place, fix, exit_code=3)

    @property
    def answer(self) -> Answer:
        """The scenario and how it ends, errors by plane and as one norm."""
        from wristctl.commands.simulate.bend_answer import answer

        return answer(self.study, self.repeated, self.short_of, self.advice)

    @property
    def marks(self) -> list[str]:
        """Verdicts on the loop: failed, does not arrive, limit cycle, chatters, not physical, not converged."""
        return self.repeated.marks

    @property
    def course(self) -> BendCourse:
        """What the wrist did in the first repetition."""
        return self.repeated.first

    def courses(self) -> Mapping[str, Mapping[str, Any]]:
        """The columns of the first repetition."""
        return {"bends": self.course.columns()}

    def frame(self) -> pd.DataFrame:
        """The first repetition: time, bends by plane, tip, pulls by tendon, ...; SI units."""
        return self.course.frame()


def in_two_planes(study: Study) -> bool:
    """Whether the loop of the study's `simulate` section bends in two planes."""
    from wristctl.simulation.bend_loops import planes_of

    return planes_of(study.simulate.loop, study.simulate.reference) == 2


def check_two_planes(study: Study) -> None:
    """UserError for what can be known of a loop in two planes before it runs."""
    from wristctl.control.table import controller
    from wristctl.simulation.bend_loops import bends_of
    from wristctl.simulation.two_planes import check_bends

    chosen = study.simulate
    bends = bends_of(chosen.reference, chosen.direction, study.wrist, chosen.horizon, 0.01)
    check_bends(controller(chosen.controller), bends[:, 0], study.wrist, chosen.loop)
    if chosen.start != "straight":
        raise UserError("a loop in two planes begins straight", "start", "start: straight")


def simulate_in_two_planes(session: Session) -> SimulatedBends:
    """Simulate one closed loop in two planes and draw it."""
    from wristctl.commands.truth_table import truth_heading, truth_tables
    from wristctl.plotting.bend_figure import bend_motion
    from wristctl.simulation.bend_course import column_meanings
    from wristctl.simulation.bend_loops import simulate_bends
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.two_planes import reach_of_bends
    from wristctl.simulation.worlds import Draws

    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    settings, wrist = study.simulate, study.wrist
    warn_if_coarse([settings.loop])
    warn_outside_conditions([settings], [settings.loop])
    with session.progress("compiling and simulating the loop"):
        repeated = simulate_bends(study, tuned_gains(session.inputs))
    scenario = scenario_of(settings.reference, settings.direction)
    findings.note_streams(Draws(study.seed).names([settings.loop], [scenario]))
    findings.numerics(planes=2, substeps=repeated.substeps, drift=repeated.drift)
    course = repeated.first
    columns = course.columns()
    meanings = column_meanings(list(columns))
    units, meaning = ({name: column[i] for name, column in meanings.items()} for i in range(2))
    findings.table("data/bends.csv", columns, units=units, meaning=meaning)
    tables = [_table(findings, study, repeated), *truth_tables(wrist, {"simulate": settings.loop})]
    with session.progress("drawing"):
        reach = reach_of_bends(wrist, repeated.layout)
        caption = "The plane of bends with what the tendons reach; errors of both planes and pulls over time"
        findings.overview.figure = "bends"
        findings.figure("bends", bend_motion, course, reach, truth_heading(wrist, settings.loop), caption=caption)
    short_of, advice = ("", []) if repeated.failure or repeated.arrives else _short_of(study, repeated)
    return SimulatedBends(session.study, findings, tables, repeated, short_of, advice)


def _short_of(study: Study, repeated: RepeatedBends) -> tuple[str, list[str]]:
    """Why the loop does not arrive, and what may help."""
    from wristctl.simulation.two_planes import first_beyond

    course, wrist = repeated.first, study.wrist
    off = math.degrees(course.metrics()["steady_state"])
    beyond = first_beyond(wrist, repeated.layout, course.bend_ref) if study.simulate.loop.limits else None
    if beyond is not None:
        ulnar, flexion = (math.degrees(bend) for bend in course.bend_ref[beyond])
        reason = (
            f"does not arrive, {off:.2g} deg off at the end: tensions of {wrist.tension_limit:g} N do not hold "
            f"{ulnar:.3g} deg toward ulnar with {flexion:.3g} deg toward flexion"
        )
        fix = "No gains can help: a larger tension_limit or tendon_radius, or a smaller angle_deg."
        return reason, [fix]
    return f"does not arrive: {off:.2g} deg off at the end", ["Other gains or another controller may hold it."]


def _table(findings: Findings, study: Study, repeated: RepeatedBends) -> Table:
    """Every metric: its value, or of several repetitions the median with its 95 % interval."""
    import numpy as np

    from wristctl.comparison.repetition_spread import spread
    from wristctl.simulation.bend_course import BEND_METRICS

    findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "largest_error", "tip_rmse", "peak_tension")
    chosen, count = study.simulate, len(repeated.failed)
    label = f"{chosen.controller}/{chosen.gains if isinstance(chosen.gains, str) else 'given'} in two planes"
    rows = list[tuple[object, ...]]()
    for name, metric in BEND_METRICS.items():
        estimate = spread(repeated.metrics[name])
        if count == 1:
            value = float(repeated.metrics[name][0])
            findings.metric(name, value, metric.unit, "lower", meaning=metric.formula)
            rows.append((name, value, metric.unit, metric.formula))
        else:
            meaning = f"{metric.formula}; median"
            findings.metric(name, estimate.median, metric.unit, "lower", estimate.n, estimate.interval, meaning)
            rows.append((name, estimate.median, estimate.low, estimate.high, metric.unit, metric.formula))
    if count == 1:
        return Table(label, ("metric", "value", "unit", "meaning"), rows)
    every = {"repetition": np.arange(count), "failed": repeated.failed, **repeated.metrics}
    findings.table("data/repetitions.csv", every, {name: metric.unit for name, metric in BEND_METRICS.items()})
    heads = ("metric", "median", "95 % low", "95 % high", "unit", "meaning")
    return Table(f"{label}, {count} repetitions", heads, rows)
