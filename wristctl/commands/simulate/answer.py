"""The answer of one simulated loop: its scenario, how it ends, and its main figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.inputs_of_loops import asked_of_simulation
from wristctl.commands.printed_table import Table, degrees, joined, two
from wristctl.config.wrist import WristParameters
from wristctl.wrist.directions import toward_words

if TYPE_CHECKING:
    from wristctl.config.loop import DirectionName, Loop, Reference
    from wristctl.config.study import Study
    from wristctl.simulation.repetitions import Repeated

# Actuators in words, by level.
_ACTUATORS = {"ideal": "", "lagged": "motors with a lag", "tendon": "stepper motors and elastic tendons"}
# Figures of the table, in one plane and in two: metric, heading, and for an angle how many times it is shown.
_FIGURES = (
    ("rmse", "RMSE [deg]", 1.0),
    ("settling", "settling [s]", None),
    ("steady_state", "error at the end [deg]", 1.0),
    ("overshoot", "overshoot [%]", None),
    ("peak_tension", "largest tension [N]", None),
    ("oscillation", "swing at the end, peak to peak [deg]", 2.0),
)
_OF_TWO = (
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
# Overshoot [%] from which it is told.
_OVERSHOOT = 0.5


def answer(study: Study, repeated: Repeated, reason: str = "", advice: Sequence[str] = (), wrist: str = "") -> Answer:
    """The answer of a loop that was simulated once or several times.

    Parameters
    ----------
    study
        Study with the loop as it was simulated.
    repeated
        Its repetitions.
    reason
        Reason why it does not arrive; empty where it does.
    advice
        Paragraphs and commands on what to do about a loop that is no good.
    wrist
        The wrist in words; empty: by its parameters.
    """
    from wristctl.simulation.planes import why_two

    chosen, count, course = study.simulate, len(repeated.failed), repeated.first.trajectory
    two, why = course.planes == 2, ""
    if two:
        reason_for_two = why_two(study.wrist, asked_of_simulation(study))
        why = f"{reason_for_two}; " * (" out of " in reason_for_two) + f"{course.tension.shape[1]} tendons, "
    motion = motion_words(chosen.reference, chosen.direction)
    place = f"{wrist or wrist_words(study.wrist)}{' in two planes' * two} ({why}{loop_words(chosen.loop, study.wrist)})"
    verdicts = [*_faults(repeated), *([reason] if reason else [])]
    figures = "" if repeated.first.failed else joined(_told(repeated))
    there = f". There: {figures}" if figures else ""
    does = f"{joined(verdicts)}{there}" if verdicts else f"follows with {figures}"
    median = f" Figures are medians of {count} repetitions." * (count > 1)
    sentence = f"{motion} on {place}: {controller_words(chosen.controller, chosen.gains)} {does}.{median}"
    table = figures_table(repeated, _OF_TWO if two else _FIGURES) if two or count > 1 else None
    return Answer(sentence, table, advice, "All metrics: `--all`; the motion and its figures: report.html of the run.")


def _rests(repeated: Repeated) -> bool:
    from wristctl.simulation.oscillation import at_rest

    return at_rest(repeated.first.trajectory)


def _faults(repeated: Repeated) -> list[str]:
    """Why the loop is no good, as what the controller does; where it does not arrive, that has a reason of its own."""
    if repeated.failure:
        return [f"fails: the wrist {repeated.failure}"]
    faults = []
    if repeated.swing > 0.0:
        at = f" at {two(repeated.frequency)} Hz" if math.isfinite(repeated.frequency) else ""
        faults.append(f"swings by {degrees(2.0 * repeated.swing)} deg peak to peak{at} and does not rest")
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
    course = repeated.first.trajectory
    values = {name: figure_of(repeated, name) for name, *_ in (_FIGURES if course.planes == 1 else _OF_TWO)}
    least = f"at most {two(values['peak_tension'])} N in a tendon"
    if course.planes == 2:
        each = (("rmse_ulnar", "toward ulnar"), ("rmse_flexion", "toward flexion"), ("rmse", "over both"))
        errors = [f"{degrees(values[name])} deg {where}" for name, where in each]
        return [f"RMSE {errors[0]}", *errors[1:], least]
    parts = [f"RMSE {degrees(values['rmse'])} deg"]
    if math.isfinite(values["settling"]):
        parts.append(f"settled after {two(values['settling'])} s")
    parts.append(f"{degrees(values['steady_state'])} deg off at the end")
    if values["overshoot"] > _OVERSHOOT:
        parts.append(f"an overshoot of {two(values['overshoot'])} %")
    if _rests(repeated) and not repeated.swing:
        parts.append("no swing at rest")
    return [*parts, least]


def figure_of(repeated: Repeated, name: str) -> float:
    """A metric of a loop, of several repetitions the median; nan where there is none."""
    from wristctl.comparison.repetition_spread import spread

    return spread(repeated.metrics[name]).median if name in repeated.metrics else math.nan


def figures_table(repeated: Repeated, figures: Sequence[tuple[str, str, float | None]]) -> Table:
    """Figures of a loop, of several repetitions medians with 95 % intervals; `-` where there is none.

    Each is a metric, its heading, and for an angle [rad] how many times it is shown, in degrees.
    """
    from wristctl.comparison.repetition_spread import spread

    rows: list[tuple[str, ...]] = []
    several = len(repeated.failed) > 1
    for name, heading, times in figures:
        if name not in repeated.metrics:
            continue
        estimate = spread(repeated.metrics[name])
        shown = [
            "-" if not math.isfinite(value) else two(value, 3) if times is None else degrees(times * value)
            for value in (estimate.median, estimate.low, estimate.high)
        ]
        rows.append((heading, shown[0], f"{shown[1]} to {shown[2]}") if several else (heading, shown[0]))
    heads = ("figure", "median", f"95 % interval, {len(repeated.failed)} repetitions")
    return Table("", heads if several else ("figure", "value"), rows)


def controller_words(name: str, gains: str | Mapping[str, float]) -> str:
    """A controller with its gains: smc with its printed gains, pid with Kp = 10, Ki = 2."""
    from wristctl.control.table import controller

    law = controller(name)
    after = f", after {law.learning} repetitions of the motion," if law.learning > 1 else ""
    if not law.gains:
        return f"{law.name}{after}"
    if isinstance(gains, str):
        return f"{law.name} with {'tuned' if gains == 'tuned' else f'its {gains}'} gains{after}"
    return f"{law.name} with {', '.join(f'{gain} = {value:.3g}' for gain, value in gains.items())}{after}"


def motion_words(reference: Reference, direction: DirectionName = "ulnar") -> str:
    """A wanted motion: 30 deg ulnar in 1 s (minimum jerk)."""
    from wristctl.config.choices import REFERENCES
    from wristctl.simulation.reference import reference_name

    if REFERENCES[reference.kind].plane or REFERENCES[reference.kind].planes == 2:
        return reference_name(reference)
    if reference.tip is None and reference.kind == "minimum-jerk":
        return f"{reference.end_deg:g} deg {direction} in {reference.duration:g} s (minimum jerk)"
    if reference.tip is None and reference.kind == "step":
        return f"a step of {reference.end_deg:g} deg {direction}"
    return f"{reference_name(reference)}, {direction}"


def wrist_words(wrist: WristParameters) -> str:
    """The paper's wrist, or another one by its length and stiffness."""
    if wrist == WristParameters():
        return "the paper's wrist"
    return f"a wrist of {1e3 * wrist.length:.3g} mm and {wrist.stiffness:.3g} N m/rad"


def loop_words(loop: Loop, wrist: WristParameters) -> str:
    """Segments, motors, camera, what the controller does not know, and how often it acts."""
    from wristctl.simulation.worlds import World, mismatches

    count, sensor = loop.plant_segments, loop.sensor
    parts = [f"{count} {'hinge' if loop.plant.model == 'hinges' else 'segment'}{'s' * (count > 1)}"]
    parts += [_ACTUATORS[loop.actuator.level]] * (loop.actuator.level != "ideal")
    parts += [f"a camera of {sensor.frame_rate:g} Hz"] * (sensor.level == "camera")
    parts += ["tensions without a limit"] * (not loop.limits)
    parts += disturbance_words(loop)
    if unknown := [mismatch.key.rpartition(".")[2].replace("_", " ") for mismatch in mismatches(World(loop, wrist))]:
        parts.append(f"a plant unlike the controller's model in {joined(unknown)}")
    return ", ".join([*parts, f"controller every {1e3 * loop.control_period:g} ms"])


def disturbance_words(loop: Loop) -> list[str]:
    """What acts on a loop's wrist unknown to its controller, with the direction of what pushes in two planes."""
    disturbances = loop.disturbances
    parts = []
    if disturbances.push.force:
        parts.append(f"a push of {disturbances.push.force:g} N at {disturbances.push.start:g} s")
    if disturbances.load:
        parts.append(f"a constant load of {disturbances.load:g} N")
    if disturbances.grasp.mass:
        parts.append(f"an object of {abs(disturbances.grasp.mass):g} kg taken up at {disturbances.grasp.start:g} s")
    if parts and disturbances.toward_deg:
        parts[-1] += f", {toward_words(disturbances.toward_deg)}"
    if disturbances.drift.scale != 1.0:
        parts.append(f"a stiffness that drifts to {disturbances.drift.scale:g} times")
    return parts
