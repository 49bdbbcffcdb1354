"""Controllers x loops x references x inverses: every combination rolled out under the same conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from wristctl.config.compare import CompareSettings
from wristctl.config.controller_row import label_of
from wristctl.config.loop import DirectionName, Loop, Reference, sample_period
from wristctl.config.study import Study
from wristctl.config.tune import TuneSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.table import TunedGains, controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import repeat, scenario_of
from wristctl.simulation.disturbances import DISTURBANCES
from wristctl.simulation.motion import Motion
from wristctl.simulation.planes import Asked, motion_in, planes_of
from wristctl.simulation.reference import jumps, reference_name
from wristctl.simulation.repetitions import Repeated, Simulation
from wristctl.simulation.worlds import Draws, World, is_random, loop_facing, mismatches
from wristctl.wrist.kinematics import Inverse


@dataclass(frozen=True)
class ComparedRow:
    """One controller with one set of gains on one loop, reference and inverse."""

    loop: str
    reference: str
    inverse: str
    controller: str
    gains: str
    repeated: Repeated
    jumps: bool = False
    """Whether its reference is made of steps."""

    @property
    def simulation(self) -> Simulation:
        """The first repetition."""
        return self.repeated.first

    @property
    def label(self) -> str:
        """controller/gains; of gains by loop the controller alone"""
        return label_of(self.controller, self.gains)


def refuse_tuned_scenarios(compared: CompareSettings, tuned: TuneSettings) -> None:
    """UserError if a controller was tuned on a scenario on which it would be judged.

    Worlds of a family are another matter: those that are searched on and judged on are draws of different names.
    """
    if compared.worlds.family or tuned.worlds.family:
        return
    for scenario in tuned.scenarios:
        for name, loop in compared.loops.items():
            same_loop = loop == tuned.loops[scenario.loop]
            for reference in compared.references:
                if same_loop and reference_name(reference) == reference_name(scenario.reference):
                    raise UserError(
                        f"the gains were tuned on a scenario that they would be tested on: "
                        f"{reference_name(reference)} on loop {name}",
                        where="compare.references",
                        fix="tune on other references, or compare on others",
                    )


@dataclass(frozen=True)
class Condition:
    """A block of the comparison: a loop in one direction's plane, and the courses that every row follows there."""

    name: str
    loop: Loop
    wrist: WristParameters
    courses: Sequence[ReferenceCourse]


@dataclass(frozen=True)
class ReferenceCourse:
    """A reference in a direction through one inverse: its name, its scenario's, the motion, and whether it jumps."""

    reference: str
    inverse: str
    scenario: str
    motion: Motion
    jumps: bool


def planned(study: Study, network: Inverse | None = None) -> list[Condition]:
    """Conditions of the study's `compare` section: every row follows every course of every condition.

    In two planes they are of the wrist itself, in one as each direction's plane sees it.
    """
    chosen, planes = study.compare, planes_of(study.wrist, asked_by(study.compare))
    conditions = []
    for name, loop in chosen.loops.items():
        for direction in chosen.directions:
            wrist, own = (study.wrist, loop) if planes == 2 else loop_facing(study.wrist, loop, direction)
            period, courses = sample_period(loop.control_period), []
            for reference, inverse in product(chosen.references, chosen.inverses):
                inverted = reference.model_copy(update={"inverse": inverse})
                motion = motion_in(planes, inverted, direction, wrist, chosen.horizon, period, network)
                names = course_name(reference, direction, chosen), inverse, scenario_of(reference, direction)
                courses.append(ReferenceCourse(*names, motion, jumps(reference)))
            conditions.append(Condition(name, own, wrist, courses))
    return conditions


def asked_by(chosen: CompareSettings) -> list[Asked]:
    """The motions that loops of a `compare` section are asked for."""
    pairs = product(chosen.loops.values(), chosen.references, chosen.directions)
    return [Asked(loop, reference, direction) for loop, reference, direction in pairs]


def count_rollouts(chosen: CompareSettings) -> int:
    """Number of rollouts in a `compare` section, every repetition that a controller learns from among them."""
    courses = len(chosen.directions) * len(chosen.references) * len(chosen.inverses)
    times = [(loop, chosen.repetitions if is_random(loop) else 1) for loop in chosen.loops.values()]
    laws = [controller(row.controller) for row in chosen.rows]
    return courses * sum(
        count * law.learning for loop, count in times for law in laws if law.keeps_up(loop.control_period)
    )


def within(progress: Callable[[float], None] | None, begin: float, end: float) -> Callable[[float], None]:
    """Progress of a part that takes a task from one share of it to another."""
    return lambda share: None if progress is None else progress(begin + share * (end - begin))


def compare(
    study: Study,
    network: Inverse | None = None,
    tuned: TunedGains | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[ComparedRow]:
    """Run every combination of the study's `compare` section.

    UserError for an unknown controller or gains, a missing network or tuned gains, before anything is run.
    """
    chosen, draws = study.compare, Draws(study.seed)
    gains = {
        name: [gains_of(controller(row.controller), row.gains, tuned, loop) for row in chosen.rows]
        for name, loop in chosen.loops.items()
    }
    names = list(dict.fromkeys(row.controller for row in chosen.rows))
    conditions = planned(study, network)
    learning = [controller(name).learning for name in names]
    before = [sum(learning[:number]) / sum(learning) for number in range(len(names) + 1)]
    results: list[ComparedRow] = []
    for part, condition in enumerate(conditions):
        courses, motions = condition.courses, [each.motion for each in condition.courses]
        scenarios = [each.scenario for each in courses]
        for number, name in enumerate(names):
            if not controller(name).keeps_up(condition.loop.control_period):
                continue
            rows = [i for i, row in enumerate(chosen.rows) if row.controller == name]
            batch = np.array([gains[condition.name][i] for i in rows for _ in courses]).reshape(
                len(rows) * len(courses), -1
            )
            which = np.tile(np.arange(len(courses)), len(rows))
            begin, end = ((part + share) / len(conditions) for share in before[number : number + 2])
            repetitions = repeat(
                controller(name), batch, motions, which, condition.loop, condition.wrist, scenarios, draws,
                chosen.repetitions, progress=within(progress, begin, end),
            )  # fmt: skip
            for index, repeated in enumerate(repetitions):
                row, course = chosen.rows[rows[index // len(courses)]], courses[which[index]]
                labelled = repeated.labelled(row.label)
                combination = (condition.name, course.reference, course.inverse, name, row.gains_name)
                results.append(ComparedRow(*combination, labelled, course.jumps))
    return _in_order(results, chosen)


def course_name(reference: Reference, direction: DirectionName, chosen: CompareSettings) -> str:
    """The reference's name, with the direction where there are several."""
    return reference_name(reference) + (f", {direction}" if len(chosen.directions) > 1 else "")


def _in_order(results: Sequence[ComparedRow], chosen: CompareSettings) -> list[ComparedRow]:
    """By loop, reference, direction, row of the study, inverse."""
    loops = list(chosen.loops)
    references = [course_name(r, direction, chosen) for r in chosen.references for direction in chosen.directions]
    rows = [(row.controller, row.gains_name) for row in chosen.rows]
    return sorted(
        results,
        key=lambda r: (
            loops.index(r.loop),
            references.index(r.reference),
            rows.index((r.controller, r.gains)),
            chosen.inverses.index(r.inverse),
        ),
    )


# Classes of loops with their meanings, from what a law is designed for to what it meets.
CLASS_MEANINGS = {
    "ideal": "the nominal model",
    "sampled": "with ticks, limits or more segments",
    "camera and tendons": "behind motors and tendons, or a camera",
    "pushed": "an unknown force",
    "off-nominal": "another wrist",
}
CLASSES = tuple(CLASS_MEANINGS)
# Control period [s] up to which a torque is held so briefly that a law need not know of it.
_CONTINUOUS = 1e-4


def class_of(loop: Loop, wrist: WristParameters) -> str:
    """The class of a loop: what is hardest about it.

    pushed: a force acts. camera and tendons: motors and tendons, or a camera, are simulated. off-nominal: the plant is
    not what its controller believes. ideal: it is, to the last segment, in nearly continuous time and without a limit
    of tension. sampled: the rest.
    """
    acting = [disturbance for disturbance in DISTURBANCES.values() if disturbance.acts(loop.disturbances)]
    if any(disturbance.force is not None for disturbance in acting):
        return "pushed"
    if loop.actuator.level == "tendon" or loop.sensor.level == "camera":
        return "camera and tendons"
    if acting or loop.actuator.level != "ideal" or loop.plant.model != "pcc" or mismatches(World(loop, wrist)):
        return "off-nominal"
    nearly = loop.plant_segments == 1 and not loop.limits and loop.control_period <= _CONTINUOUS
    return "ideal" if nearly else "sampled"


# Wrist parameters that the paper prints. Those that it does not print (C10) are free.
_PRINTED = ("discs", "tendons", "stiffness", "damping")
_MOVE_DEG = 30.0


def paper_cells(study: Study) -> frozenset[tuple[str, str]]:
    """Loops and references, by their names in a comparison, whose numbers may be those of T2: simulated, ulnar, 30 deg.

    A push, a payload, softer springs, motors or a camera are no part of it, nor is a motion that never rests.
    """
    chosen = study.compare
    fields = WristParameters.model_fields
    if any(getattr(study.wrist, name) != fields[name].default for name in _PRINTED) or "ulnar" not in chosen.directions:
        return frozenset()
    loops = [name for name, loop in chosen.loops.items() if class_of(loop, study.wrist) in ("ideal", "sampled")]
    single = [each for each in chosen.references if each.kind in ("step", "minimum-jerk") and each.tip is None]
    moves = [each for each in single if abs(each.end_deg - _MOVE_DEG) < 1e-9]
    return frozenset(product(loops, (course_name(reference, "ulnar", chosen) for reference in moves)))
