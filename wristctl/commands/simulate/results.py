"""What a simulated loop is as a result: its answer, its fault, its marks, and its tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer, rest
from wristctl.commands.course_table import course_of_trajectory
from wristctl.commands.inputs_of_loops import asked_of_simulation
from wristctl.commands.printed_table import Table, degrees, joined, two
from wristctl.commands.results import Findings, StudyResult
from wristctl.config.choices import REFERENCES
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.directions import toward_words

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.comparison.repetition_spread import Spread
    from wristctl.simulation.repetitions import Repeated
    from wristctl.simulation.trajectory import Trajectory


# Names of the table of a trajectory, by planes.
_TABLES = {1: "trajectory", 2: "bends"}


@dataclass(frozen=True, repr=False, eq=False)
class Simulated(StudyResult):
    """One closed loop, as often as the study says."""

    kind = "simulate"

    repeated: Repeated
    """Metrics of every repetition."""
    short_of: str = ""
    """Reason why the loop does not arrive at its reference; empty where it does."""
    advice: Sequence[str] = ()
    """What may help where it does not: sentences, and a command after `$ `."""
    simulated: Study | None = None
    """Study with the identified wrist, motors and sensor in it; None: `study`."""
    wrist: str = ""
    """The wrist in words, where it was identified."""

    @property
    def trajectory(self) -> Trajectory:
        """Trajectory of the first repetition."""
        return self.repeated.first.trajectory

    @property
    def answer(self) -> Answer:
        """The scenario and how it ends; why a loop does not arrive, and what may help."""
        return answer(self.simulated or self.study, self.repeated, self.place, self.short_of, self.advice, self.wrist)

    @property
    def course(self) -> pd.DataFrame:
        """The motion: time, bend, reference, torque, tension, tip; SI units."""
        return course_of_trajectory(self.trajectory)

    def courses(self) -> Mapping[str, Mapping[str, Any]]:
        """The columns of the trajectory, by the name of its table."""
        return {_TABLES[self.trajectory.planes]: self.trajectory.columns()}

    def frame(self) -> pd.DataFrame:
        """Every column of the trajectory; SI units."""
        return self.trajectory.frame()

    @property
    def failed(self) -> bool:
        """Whether the wrist left its range in any repetition."""
        return bool(self.repeated.failed.any())

    @property
    def fault(self) -> UserError | None:
        """Error of a wrist that left its range; None where it stayed within."""
        if not self.failed:
            return None
        fix = "look at the figures; try other gains or a slower motion"
        return UserError(f"the wrist {self.repeated.failure}", self.place, fix, exit_code=3)

    @property
    def marks(self) -> list[str]:
        """Verdicts on the loop: failed, does not arrive, limit cycle, chatters, not physical, not converged."""
        return self.repeated.marks


def trajectory_table(findings: Findings, course: Trajectory) -> None:
    """Keep a trajectory in the run, with unit and meaning of each column."""
    from wristctl.simulation.trajectory import meanings

    columns = course.columns()
    told = meanings(list(columns))
    units, meaning = ({name: column[i] for name, column in told.items()} for i in range(2))
    findings.table(f"data/{_TABLES[course.planes]}.csv", columns, units=units, meaning=meaning)


def metrics_table(findings: Findings, title: str, repeated: Repeated) -> Table:
    """Every metric, kept in the run: its value, or of several repetitions the median with its 95 % interval."""
    import numpy as np

    from wristctl.comparison.repetition_spread import spread
    from wristctl.simulation.metrics import metrics_in

    metrics, several = metrics_in(repeated.first.trajectory.planes), len(repeated.failed) > 1
    rows = list[tuple[object, ...]]()
    for name, metric in metrics.items():
        found = spread(repeated.metrics[name])
        value = found.median if several else float(repeated.metrics[name][0])
        meaning = metric.formula + "; median" * several
        findings.metric(name, value, metric.unit, "lower", found.n, found.interval, meaning)
        rows.append((name, value, *found[1:3] * several, metric.unit, metric.formula))
    if not several:
        return Table(title, ("metric", "value", "unit", "meaning"), rows)
    every = {"repetition": np.arange(len(repeated.failed)), "failed": repeated.failed, **repeated.metrics}
    findings.table("data/repetitions.csv", every, {name: metric.unit for name, metric in metrics.items()})
    heads = ("metric", "median", "95 % low", "95 % high", "unit", "meaning")
    return Table(f"{title}, {len(repeated.failed)} repetitions", heads, rows)


# Actuators in words, by level.
_ACTUATORS = {
    "ideal": "", "lagged": "motors with a lag", "tendon": "stepper motors and elastic tendons",
    "servo": "motors that follow targets, and elastic tendons",
}  # fmt: skip
# Figures of the table, in one plane and in two.
_FIGURES = {
    1: ("rmse", "settling", "steady_state", "overshoot", "peak_tension", "swing"),
    2: (
        "rmse_ulnar", "rmse_flexion", "rmse", "largest_error", "steady_state", "swing", "tip_rmse_mm", "peak_tension",
        "saturation",
    ),
}  # fmt: skip
# Their words where these are other than their names.
_WORDS = {
    "rmse": "RMSE", "rmse_ulnar": "RMSE toward ulnar", "rmse_flexion": "RMSE toward flexion",
    "steady_state": "error at the end", "peak_tension": "largest tension",
    "swing": "swing at the end, peak to peak", "tip_rmse_mm": "RMS distance of the tip to that of one arc",
    "saturation": "share of time out of reach",
}  # fmt: skip
# Why the tip is off where the error is small.
_UNEVEN = (
    "One arc's tip is that of a wrist that bends evenly, as wanted. Several segments bend unevenly, above all under "
    "their weight, so that the tip is off it however small the error."
)
# Overshoot [%] from which it is told.
_OVERSHOOT = 0.5


def answer(
    study: Study, repeated: Repeated, run: str = "", reason: str = "", advice: Sequence[str] = (), wrist: str = ""
) -> Answer:
    """The answer of a loop that was simulated once or several times, of a study with the loop as it was simulated.

    `run` is the path of the run, empty for a result in memory; `reason` says why it does not arrive, `advice` in
    paragraphs and commands what to do about it, and `wrist` which one it is, where it is not told by its parameters.
    """
    from wristctl.comparison.repetition_spread import FEWEST
    from wristctl.simulation.planes import why_two

    few = f"; 95 % intervals take {FEWEST}"
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
    median = f" Figures are medians of {count} repetitions{'' if count >= FEWEST else few}." * (count > 1)
    sentence = f"{motion} on {place}: {controller_words(chosen.controller, chosen.gains)} {does}.{median}"
    table = _table(repeated) if two or count > 1 else None
    notes = [_UNEVEN] * (two and chosen.loop.plant_segments > 1 and not repeated.first.failed)
    return Answer(sentence, table, [*notes, *advice], rest("All metrics, the motion and its figures", run))


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
    if (share := repeated.first.trajectory.outside) > 0.0:
        faults.append(f"is led by guesses: {100.0 * share:.3g} % of its tips lie outside what the network learned")
    if repeated.drift > 0.0:
        by = f" by {degrees(repeated.drift)} deg" if math.isfinite(repeated.drift) else ""
        faults.append(f"is not settled numerically: the result changes{by} with the integration step")
    return faults


def _told(repeated: Repeated) -> list[str]:
    """The main figures in words, medians of several repetitions."""
    from wristctl.simulation.oscillation import at_rest

    course = repeated.first.trajectory
    values = {name: _estimate(repeated, name).median for name in _FIGURES[course.planes]}
    least = f"at most {two(values['peak_tension'])} N in a tendon"
    if course.planes == 2:
        each = (("rmse_ulnar", "toward ulnar"), ("rmse_flexion", "toward flexion"), ("rmse", "over both"))
        errors = [f"{degrees(values[name])} deg {where}" for name, where in each]
        return [f"RMSE {errors[0]}", *errors[1:], *_beside_wanted(repeated), least]
    parts = [f"RMSE {degrees(values['rmse'])} deg", *_beside_wanted(repeated)]
    if math.isfinite(values["settling"]):
        parts.append(f"settled after {two(values['settling'])} s")
    parts.append(f"{degrees(values['steady_state'])} deg off at the end")
    if values["overshoot"] > _OVERSHOOT:
        parts.append(f"an overshoot of {two(values['overshoot'])} %")
    if at_rest(course) and not repeated.swing:
        parts.append("no swing at rest")
    return [*parts, least]


def _beside_wanted(repeated: Repeated) -> list[str]:
    """The error to the wanted angle, where a network stands before the reference and asks for another."""
    import numpy as np

    course = repeated.first.trajectory
    if np.array_equal(course.theta_desired, course.theta_ref):
        return []
    return [f"{degrees(_estimate(repeated, 'rmse_desired').median)} deg to the angle wanted of the network"]


def _estimate(repeated: Repeated, name: str) -> Spread:
    """A metric of a loop with its interval, of several repetitions the median; a swing is twice its amplitude."""
    import numpy as np

    from wristctl.comparison.repetition_spread import spread

    metric, times = ("oscillation", 2.0) if name == "swing" else (name, 1.0)
    return spread(times * np.asarray(repeated.metrics.get(metric, [math.nan])))


def _table(repeated: Repeated) -> Table:
    """Figures of a loop, of several repetitions medians, of enough with 95 % intervals; nan where there is none."""
    from wristctl.comparison.repetition_spread import FEWEST
    from wristctl.simulation.metrics import metrics_in

    planes, times = repeated.first.trajectory.planes, len(repeated.failed)
    metrics, rows = metrics_in(planes), []
    for name in _FIGURES[planes]:
        found, unit = _estimate(repeated, name), metrics["oscillation" if name == "swing" else name].unit
        values = (found.median, found.low, found.high) if times >= FEWEST else (found.median,)
        rows.append((_WORDS.get(name, name.replace("_", " ")), *values, unit))
    median = f"median of {times}" if times > 1 else "value"
    heads = (median, "95 % low", "95 % high") if times >= FEWEST else (median,)
    return Table("", ("figure", *heads, "unit"), rows)


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
