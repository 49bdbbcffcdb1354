"""The tables of docs/two-planes.md: which controllers hold circumduction and the dart-thrower's motion, and where.

Run `python docs/bends.py` from the repository; it takes some minutes.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import wristctl
from wristctl.config.loop import Loop, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.bend_course import BendCourse
from wristctl.simulation.bend_loops import bends_of
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.spatial_batch import sample_step
from wristctl.simulation.two_planes import rollout_bends
from wristctl.simulation.worlds import Draws, World

PAGE = Path(__file__).with_name("two-planes.md")
STUDY = Path(__file__).parents[1] / "experiments" / "two_planes.yaml"
BEGIN, END = "<!-- made by docs/bends.py -->", "<!-- end -->"
LAWS = ("ct-dob", "pid-dob", "smc-dob", "pid-ff", "mrac")
SEEDS = 20
# Worse axis' RMSE [deg] up to which a controller holds a motion.
HOLDS = 0.5
CIRCUMDUCTION = {"kind": "circumduction", "angle_deg": 25.0, "turn": 4.0}
DART = {"kind": "dart-thrower", "angle_deg": 30.0, "turn": 1.5}
MOTIONS = [
    *(("circumduction of 25 deg", CIRCUMDUCTION | {"turn": turn}) for turn in (8.0, 4.0, 2.0)),
    *(("dart-thrower of 30 deg", DART | {"turn": turn}) for turn in (3.0, 1.5, 0.75)),
]
Changes = Mapping[str, Any]
LEVEL = {"gravity": (0.0, 0.0), "gravity_flexion": 9.81}
PUSH = {"force": 2.0, "start": 3.0, "duration": 1.0}
OBLIQUE = {"flexion_ratio": 2.0, "stiffness_axis_deg": 30.0}
# Conditions: name, changes of the wrist that the controller knows, of the plant, and of the loop.
CONDITIONS: Sequence[tuple[str, Changes, Changes, Changes]] = (
    ("upright", {}, {}, {}),
    ("forearm level, palm down", LEVEL, {}, {}),
    ("a push of 2 N toward flexion at 3 s", {}, {}, {"disturbances": {"push": PUSH, "toward_deg": 90.0}}),
    ("a push of 2 N toward 130 deg at 3 s", {}, {}, {"disturbances": {"push": PUSH, "toward_deg": 130.0}}),
    ("tendon 4 lost at 4 s", {}, {"actuator": {"broken_at": 4.0, "broken_tendon": 4}}, {}),
)
# The same of springs twice as stiff across 30 deg as along it.
COUPLING: Sequence[tuple[str, Changes, Changes, Changes]] = (
    ("springs alike all around", {}, {}, {}),
    ("oblique, known and compensated", OBLIQUE, {}, {}),
    ("oblique, known by plane, coupling ignored", OBLIQUE, {}, {"coupling": "ignored"}),
    ("oblique, not known", {}, OBLIQUE, {}),
)
EXACT = {"sensor": {"level": "ideal"}, "actuator": {"level": "ideal"}, "plant": {}, "control_period": 1e-3}


def loop_of(study: Study, plant: Changes, changes: Changes) -> Loop:
    """The study's loop with other leaves."""
    loop = study.simulate.loop.model_dump(by_alias=True) | dict(changes)
    loop["plant"] = loop["plant"] | dict(plant)
    return Loop.model_validate(loop)


def courses(
    study: Study, law: str, gains: str, motion: Changes, wrist: WristParameters, loop: Loop, seeds: int = SEEDS
) -> list[BendCourse]:
    """One motion by one controller under every seed."""
    chosen, reference = controller(law), Reference.model_validate(motion)
    bends = bends_of(reference, "ulnar", wrist, study.simulate.horizon, sample_step(loop.control_period))
    draws, scenario = Draws(study.seed), scenario_of(reference, "ulnar")
    streams = [draws.camera(scenario, seed) for seed in range(seeds)]
    rows = np.tile(gains_of(chosen, gains), (seeds, 1))
    return rollout_bends(chosen, rows, bends, [World(loop, wrist)] * seeds, None, None, streams)


def cell(results: Sequence[BendCourse]) -> str:
    """The worse axis' RMSE [deg]: median and largest of all seeds; bold where all are held, else how many fail."""
    failed = sum(course.failed for course in results)
    if failed:
        return f"fails in {failed} of {len(results)}"
    metrics = [course.metrics() for course in results]
    worse = np.rad2deg([max(each["rmse_ulnar"], each["rmse_flexion"]) for each in metrics])
    middle, most = float(np.median(worse)), float(worse.max())
    text = f"{middle:.2g}" if len(results) == 1 else f"{middle:.2g} ({most:.2g})"
    return f"**{text}**" if most <= HOLDS else text


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def tables() -> str:
    """All of them, with what they show."""
    study = wristctl.load_study(STUDY)
    wrist = study.wrist
    real = loop_of(study, {}, {})
    speeds = [
        (
            f"{name} in {motion['turn']:g} s",
            *(cell(courses(study, law, "hardware", motion, wrist, real)) for law in LAWS),
        )
        for name, motion in MOTIONS
    ]
    places = []
    for motion_name, motion in (("circumduction", CIRCUMDUCTION), ("dart-thrower", DART)):
        for name, known, plant, changes in CONDITIONS:
            loop, own = loop_of(study, plant, changes), wrist.model_copy(update=dict(known))
            cells = [cell(courses(study, law, "hardware", motion, own, loop)) for law in LAWS]
            places.append((f"{motion_name}: {name}", *cells))
    coupled = []
    for name, known, plant, changes in COUPLING:
        own = wrist.model_copy(update=dict(known))
        exact = loop_of(study, {}, EXACT | dict(changes))
        exact = exact.model_copy(update={"plant": exact.plant.model_validate(dict(plant))})
        behind = loop_of(study, plant, changes)
        cells = [
            cell(courses(study, law, gains, CIRCUMDUCTION, own, loop, seeds))
            for law, gains, loop, seeds in (
                ("computed-torque", "default", exact, 1),
                ("ct-dob", "default", exact, 1),
                ("ct-dob", "hardware", behind, SEEDS),
                ("pid-ff", "hardware", behind, SEEDS),
            )
        ]
        coupled.append((name, *cells))
    return "\n\n".join(
        [
            f"RMSE of the worse axis [deg] over 8 s: the median of {SEEDS} seeds and in brackets the largest; bold "
            f"where all are within {HOLDS:g} deg. Motors, tendons with friction, a camera of 60 Hz, springs weaker "
            "by a fifth than the controller believes (`experiments/two_planes.yaml`), gains `hardware`.",
            table(["motion", *LAWS], speeds),
            "The same in other places; circumduction in 4 s, the dart-thrower in 1.5 s.",
            table(["motion and condition", *LAWS], places),
            "Springs twice as stiff across 30 deg as along it, on circumduction of 25 deg in 4 s. The first two "
            "columns have ideal motors and sensors; the others are as above.",
            table(["springs", "computed-torque, ideal", "ct-dob, ideal", "ct-dob, camera", "pid-ff, camera"], coupled),
        ]
    )


def main() -> None:
    """Write the tables into the page."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{tables()}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
