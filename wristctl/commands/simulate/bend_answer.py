"""The answer of a simulated loop in two planes: its scenario, errors by plane and as one norm, and how it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees, joined, two
from wristctl.commands.simulate.answer import controller_words, loop_words, motion_words, wrist_words

if TYPE_CHECKING:
    from wristctl.config.study import Study
    from wristctl.simulation.bend_loops import RepeatedBends

# Figures of the table: metric, heading, and whether it is an angle.
_FIGURES = (
    ("rmse_ulnar", "RMSE toward ulnar [deg]", True),
    ("rmse_flexion", "RMSE toward flexion [deg]", True),
    ("rmse", "RMSE over both planes [deg]", True),
    ("largest_error", "largest error [deg]", True),
    ("steady_state", "error at the end [deg]", True),
    ("oscillation", "half the swing at the end [deg]", True),
    ("tip_rmse", "RMS distance of the tip [mm]", False),
    ("peak_tension", "largest tension [N]", False),
    ("saturation", "share of time out of reach", False),
)


def answer(study: Study, repeated: RepeatedBends, reason: str = "", advice: Sequence[str] = ()) -> Answer:
    """The answer of a loop in two planes that was simulated once or several times; parameters as of one plane."""
    chosen, count = study.simulate, len(repeated.failed)
    places = len(repeated.layout.places)
    scenario = (
        f"{motion_words(chosen.reference, chosen.direction)} on {wrist_words(study.wrist)} in two planes "
        f"({places} tendons, {loop_words(chosen.loop, study.wrist)})"
    )
    faults = [*bend_faults(repeated), *([reason] if reason else [])]
    subject = controller_words(chosen.controller, chosen.gains)
    figures = "" if repeated.first.failed else joined(_told(repeated))
    there = f". There: {figures}" if figures else ""
    does = f"{joined(faults)}{there}" if faults else f"follows with {figures}"
    median = f" Figures are medians of {count} repetitions." * (count > 1)
    more = "All metrics: `--all`; the path in the plane of bends: report.html of the run."
    return Answer(f"{scenario}: {subject} {does}.{median}", _table(repeated), advice, more)


def bend_faults(repeated: RepeatedBends) -> list[str]:
    """Why the loop is no good, as what the controller does."""
    if repeated.failure:
        return [f"fails: the wrist {repeated.failure}"]
    faults = []
    if repeated.swing > 0.0:
        faults.append(f"swings by {degrees(repeated.swing)} deg to either side and does not rest")
    if repeated.chatter > 0.0:
        faults.append(f"chatters: tensions go from limit to limit and back {repeated.chatter:.0f} times a second")
    if repeated.beyond > 0.0:
        bears = repeated.wrist.tension_limit
        faults.append(f"is not physical: {repeated.beyond:.3g} N in a tendon that bears {bears:g} N")
    if repeated.drift > 0.0:
        by = f" by {degrees(repeated.drift)} deg" if math.isfinite(repeated.drift) else ""
        faults.append(f"is not settled numerically: the result changes{by} with the integration step")
    return faults


def _told(repeated: RepeatedBends) -> list[str]:
    values = {name: _median(repeated, name) for name, *_ in _FIGURES}
    return [
        f"RMSE {degrees(values['rmse_ulnar'])} deg toward ulnar",
        f"{degrees(values['rmse_flexion'])} deg toward flexion",
        f"{degrees(values['rmse'])} deg over both",
        f"at most {two(values['peak_tension'])} N in a tendon",
    ]


def _median(repeated: RepeatedBends, name: str) -> float:
    from wristctl.comparison.repetition_spread import spread

    return spread(repeated.metrics[name]).median


def _table(repeated: RepeatedBends) -> Table:
    """The main figures; of several repetitions the median with its 95 % interval; `-` where there is none."""
    from wristctl.comparison.repetition_spread import spread

    rows: list[tuple[str, ...]] = []
    several = len(repeated.failed) > 1
    for name, heading, angle in _FIGURES:
        estimate = spread(repeated.metrics[name])
        shown = [
            "-" if not math.isfinite(value) else degrees(value) if angle else two(value, 3)
            for value in (estimate.median, estimate.low, estimate.high)
        ]
        rows.append((heading, shown[0], f"{shown[1]} to {shown[2]}") if several else (heading, shown[0]))
    heads = ("figure", "median", f"95 % interval, {len(repeated.failed)} repetitions")
    return Table("", heads if several else ("figure", "value"), rows)
