"""The answer of one simulated loop: its scenario, how it ends, and of several repetitions a table of main figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.loop_words import controller_words, listed, loop_words, motion_words, wrist_words
from wristctl.commands.printed_table import Table, degrees, two

if TYPE_CHECKING:
    from wristctl.config.study import Study
    from wristctl.simulation.repetitions import Repeated

# Figures of the table of repetitions: metric, heading, and whether it is an angle.
_FIGURES = (
    ("rmse", "RMSE [deg]", True),
    ("settling", "settling [s]", False),
    ("steady_state", "error at the end [deg]", True),
    ("overshoot", "overshoot [%]", False),
    ("peak_tension", "largest tension [N]", False),
    ("oscillation", "half the swing at the end [deg]", True),
)
# Overshoot [%] from which it is told.
_OVERSHOOT = 0.5


def answer(study: Study, repeated: Repeated, reason: str = "", advice: Sequence[str] = ()) -> Answer:
    """The answer of a loop that was simulated once or several times.

    Parameters
    ----------
    study
        Study with the loop.
    repeated
        Its repetitions.
    reason
        Reason why it does not arrive; empty where it does.
    advice
        Paragraphs and commands on what to do about a loop that is no good.
    """
    chosen, count = study.simulate, len(repeated.failed)
    scenario = (
        f"{motion_words(chosen.reference, chosen.direction)} on {wrist_words(study.wrist)} "
        f"({loop_words(chosen.loop, study.wrist)})"
    )
    verdicts = [*_faults(repeated), *([reason] if reason else [])]
    figures = "" if repeated.first.failed else listed(_told(repeated))
    subject = controller_words(chosen.controller, chosen.gains)
    there = f". There: {figures}" if figures else ""
    does = f"{listed(verdicts)}{there}" if verdicts else f"follows with {figures}"
    median = f" Figures are medians of {count} repetitions." * (count > 1)
    sentence = f"{scenario}: {subject} {does}.{median}"
    more = "All metrics: `--all`; the motion and its figures: report.html of the run."
    return Answer(sentence, _table(repeated) if count > 1 else None, advice, more)


def _rests(repeated: Repeated) -> bool:
    from wristctl.simulation.oscillation import at_rest

    return at_rest(repeated.first.trajectory)


def _faults(repeated: Repeated) -> list[str]:
    """Why the loop is no good, as what the controller does; where it does not arrive, that has a reason of its own."""
    from wristctl.simulation.oscillation import oscillation_frequency

    if repeated.failure:
        return [f"fails: the wrist {repeated.failure}"]
    faults = []
    if repeated.swing > 0.0:
        frequency = oscillation_frequency(repeated.first.trajectory)
        faults.append(
            f"swings by {degrees(repeated.swing)} deg to either side at {two(frequency)} Hz and does not rest"
        )
    if repeated.chatter > 0.0:
        faults.append(f"chatters: tensions go from limit to limit and back {repeated.chatter:.0f} times a second")
    if repeated.beyond > 0.0:
        faults.append(f"is not physical: {repeated.beyond:.3g} N in a tendon that bears {repeated.bears:g} N")
    if repeated.drift > 0.0:
        by = f" by {degrees(repeated.drift)} deg" if math.isfinite(repeated.drift) else ""
        faults.append(f"is not settled numerically: the result changes{by} with the integration step")
    return faults


def _told(repeated: Repeated) -> list[str]:
    """The main figures in words, medians of several repetitions."""
    values = {name: _median(repeated, name) for name, *_ in _FIGURES}
    parts = [f"RMSE {degrees(values['rmse'])} deg"]
    if math.isfinite(values["settling"]):
        parts.append(f"settled after {two(values['settling'])} s")
    parts.append(f"{degrees(values['steady_state'])} deg off at the end")
    if values["overshoot"] > _OVERSHOOT:
        parts.append(f"an overshoot of {two(values['overshoot'])} %")
    if _rests(repeated) and not repeated.swing:
        parts.append("no swing at rest")
    return [*parts, f"at most {two(values['peak_tension'])} N in a tendon"]


def _median(repeated: Repeated, name: str) -> float:
    from wristctl.comparison.repetition_spread import spread

    return spread(repeated.metrics[name]).median if name in repeated.metrics else math.nan


def _table(repeated: Repeated) -> Table:
    """Median and 95 % interval of the main figures; `-` where there is none."""
    from wristctl.comparison.repetition_spread import spread

    rows = []
    for name, heading, angle in _FIGURES:
        if name not in repeated.metrics:
            continue
        estimate = spread(repeated.metrics[name])
        shown = [
            "-" if not math.isfinite(value) else degrees(value) if angle else two(value, 3)
            for value in (estimate.median, estimate.low, estimate.high)
        ]
        rows.append((heading, shown[0], f"{shown[1]} to {shown[2]}"))
    return Table("", ("figure", "median", f"95 % interval, {len(repeated.failed)} repetitions"), rows)
