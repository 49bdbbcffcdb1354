"""One closed loop in two planes, with pictures, and its answer: errors by plane and as one norm, and how it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.inputs_of_loops import identified, network_for, tuned_gains, wrist_identified
from wristctl.commands.loop_warnings import bend_not_held, warn_if_coarse, warn_if_outside, warn_outside_conditions
from wristctl.commands.printed_table import degrees, joined, two
from wristctl.commands.session import Session
from wristctl.commands.simulate.answer import (
    figure_of,
    figures_table,
    loop_words,
    motion_words,
    outcome,
    wrist_words,
)
from wristctl.commands.simulate.results import SimulatedLoop, metrics_table, trajectory_table
from wristctl.config.study import Study
from wristctl.errors import under

if TYPE_CHECKING:
    from wristctl.simulation.planes import Asked
    from wristctl.simulation.repetitions import Repeated


# Figures of the table: metric, heading, and for an angle how many times it is shown.
_FIGURES = (
    ("rmse_ulnar", "RMSE toward ulnar [deg]", 1.0),
    ("rmse_flexion", "RMSE toward flexion [deg]", 1.0),
    ("rmse", "RMSE over both planes [deg]", 1.0),
    ("largest_error", "largest error [deg]", 1.0),
    ("steady_state", "error at the end [deg]", 1.0),
    ("oscillation", "swing at the end, peak to peak [deg]", 2.0),
    ("tip_rmse_mm", "RMS distance of the tip [mm]", None),
    ("peak_tension", "largest tension [N]", None),
    ("saturation", "share of time out of reach", None),
)


@dataclass(frozen=True, repr=False, eq=False)
class SimulatedBends(SimulatedLoop):
    """One closed loop in two planes, as often as the study says, and whether the wrist ever left its range."""

    @property
    def answer(self) -> Answer:
        """The scenario and how it ends, errors by plane and as one norm."""
        return _answer(self.simulated or self.study, self.repeated, self.short_of, self.advice, self.wrist)


def in_two_planes(study: Study) -> bool:
    """Whether the loop of the study's `simulate` section bends in two planes. Raises UserError."""
    from wristctl.simulation.planes import planes_of

    with under("simulate"):
        return planes_of(study.wrist, asked_for_by(study)) == 2


def asked_for_by(study: Study) -> list[Asked]:
    """The motion of the study's `simulate` section."""
    from wristctl.simulation.planes import Asked

    return [Asked(study.simulate.loop, study.simulate.reference, study.simulate.direction)]


# Time between two samples of a reference by which it is checked before a run [s].
_CHECKED = 0.01


def check_two_planes(study: Study) -> None:
    """UserError for what can be known of a loop in two planes before it runs."""
    from wristctl.simulation.closed_loop import asked_of
    from wristctl.simulation.reference import by_angles

    reference = by_angles(study.simulate.reference)
    asked_of(
        study.model_copy(update={"simulate": study.simulate.model_copy(update={"reference": reference})}), _CHECKED
    )


def simulate_in_two_planes(session: Session) -> SimulatedBends:
    """Simulate one closed loop in two planes and draw it."""
    from wristctl.commands.truth_table import truth_heading, truth_tables
    from wristctl.plotting.bend_figure import bend_motion
    from wristctl.plotting.spatial_view import motion_in_space
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.closed_loop import simulate as run_simulation
    from wristctl.simulation.metrics import metrics_in
    from wristctl.simulation.worlds import Draws, plant_of
    from wristctl.wrist.spatial.held_bends import reach_of_bends
    from wristctl.wrist.tendon_layout import TendonLayout

    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    settings, wrist = study.simulate, study.wrist
    warn_if_coarse([settings.loop])
    warn_outside_conditions([settings], [settings.loop])
    network = network_for(session.inputs, wrist, [settings.loop], planes=2)
    with session.progress("compiling and simulating the loop"):
        repeated = run_simulation(study, network, tuned_gains(session.inputs))
    scenario = scenario_of(settings.reference, settings.direction)
    findings.note_streams(Draws(study.seed).names([settings.loop], [scenario]))
    course = repeated.first.trajectory
    warn_if_outside(course.outside)
    findings.numerics(planes=2, substeps=int(repeated.metrics["substeps"].max()), drift=repeated.drift)
    trajectory_table(findings, "bends", course)
    findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "largest_error", "tip_rmse_mm", "peak_tension")
    label = f"{settings.controller}/{settings.gains if isinstance(settings.gains, str) else 'given'} in two planes"
    tables = [
        metrics_table(findings, label, metrics_in(2), repeated),
        *truth_tables(wrist, {"simulate": settings.loop}),
    ]
    with session.drawing():
        reach = reach_of_bends(wrist, TendonLayout.of(wrist))
        caption = "The plane of bends with what the tendons reach; errors of both planes and pulls over time"
        findings.overview.figure = "bends"
        world = truth_heading(wrist, settings.loop)
        findings.figure("bends", bend_motion, course, reach, world, caption=caption)
        caption = "The wrist in space where it is bent most, and the path of its tip, wanted and reached"
        own = settings.loop.plant
        findings.figure("space", motion_in_space, course, plant_of(wrist, own), world, own.model, caption=caption)
    short_of, advice = ("", []) if repeated.failure or repeated.arrives else _short_of(study, repeated)
    words = wrist_identified(session.inputs)
    return SimulatedBends(session.study, findings, tables, repeated, short_of, advice, study, words)


def _short_of(study: Study, repeated: Repeated) -> tuple[str, list[str]]:
    """Why the loop does not arrive, and what may help."""
    from wristctl.simulation.oscillation import at_rest

    course = repeated.first.trajectory
    off = math.degrees(repeated.first.metrics["steady_state"])
    if reason := bend_not_held(study.wrist, study.simulate.loop, course.bend_ref):
        fix = "No gains can help: a larger tension_limit or tendon_radius, or a smaller angle_deg."
        return f"does not arrive, {off:.2g} deg off at the end: {reason}", [fix]
    what = "arrive" if at_rest(course) else "follow"
    return f"does not {what}: {off:.2g} deg off at the end", ["Other gains or another controller may hold it."]


def _answer(study: Study, repeated: Repeated, reason: str, advice: Sequence[str], wrist: str) -> Answer:
    from wristctl.simulation.planes import why_two

    chosen, places = study.simulate, repeated.first.trajectory.tension.shape[1]
    reason_for_two = why_two(study.wrist, asked_for_by(study))
    why = f"{reason_for_two}; " if " out of " in reason_for_two else ""
    scenario = (
        f"{motion_words(chosen.reference, chosen.direction)} on {wrist or wrist_words(study.wrist)} in two planes "
        f"({why}{places} tendons, {loop_words(chosen.loop, study.wrist)})"
    )
    values = {name: figure_of(repeated, name) for name, *_ in _FIGURES}
    figures = [
        f"RMSE {degrees(values['rmse_ulnar'])} deg toward ulnar",
        f"{degrees(values['rmse_flexion'])} deg toward flexion",
        f"{degrees(values['rmse'])} deg over both", f"at most {two(values['peak_tension'])} N in a tendon",
    ]  # fmt: skip
    sentence = outcome(study, scenario, repeated, "" if repeated.first.failed else joined(figures), reason)
    more = "All metrics: `--all`; the path in the plane of bends and the wrist in 3D: report.html of the run."
    return Answer(sentence, figures_table(repeated, _FIGURES), advice, more)
