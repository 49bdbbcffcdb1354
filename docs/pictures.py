"""Make the README's pictures and docs/results.md anew: `python docs/pictures.py`."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure
from shots import shot

from wristctl.commands.analyse.hysteresis_figures import loops as loops_by_speed
from wristctl.commands.ranking_tables import places_of
from wristctl.comparison.combinations import ComparedRow, compare
from wristctl.comparison.controller_ranking import class_rankings
from wristctl.comparison.paper import T2
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.plotting.loop_figures import over_time
from wristctl.plotting.ranking_figures import answer_figure
from wristctl.plotting.wrist_drawing import directions
from wristctl.records.formats import write_figure
from wristctl.simulation.hysteresis import loops
from wristctl.simulation.strokes import strokes
from wristctl.study_files.load import load_study
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Tracker
from wristctl.vision.recordings import annotate
from wristctl.vision.scene import Scene

HERE = Path(__file__).parent
ROWS = "[" + ", ".join(
    f"{{controller: {name}, gains: {gains}}}"
    for name, gains in (
        ("smc", "printed"), ("smc", "exchanged"), ("smc", "initial"), ("pid", "printed"),
        ("feedforward", "default"), ("computed-torque", "default"),
    )
) + "]"  # fmt: skip

LOOPS = "{exact: {}, sampled: {}, four-segments: {}}"
REFERENCES = "[{kind: step}, {duration: 1.0}, {duration: 2.0}]"

MARK = "*"
"""Behind a number that no integration step settles."""


def table(results: list[ComparedRow]) -> str:
    """RMSE of every row on every loop, beside the paper's."""
    loops = list(dict.fromkeys(r.loop for r in results))
    references = list(dict.fromkeys(r.reference for r in results))
    labels = list(dict.fromkeys(r.label for r in results))
    of = {(r.label, r.loop, r.reference): r for r in results}
    heads = [f"{loop}, {reference}" for loop in loops for reference in references]
    lines = ["| RMSE [rad] | paper (T2) | " + " | ".join(heads) + " |", "|---" * (len(heads) + 2) + "|"]
    for label in labels:
        controller = label.split("/")[0]
        cells = [of[label, loop, reference] for loop in loops for reference in references]
        shown = ["diverged" if c.simulation.failed else f"{c.simulation.metrics['rmse']:.2g}" for c in cells]
        shown = [f"{value}{MARK * (c.repeated.drift > 0.0)}" for value, c in zip(shown, cells, strict=True)]
        printed = f"{T2[controller].rmse:g}" if controller in T2 else ""
        lines.append(f"| {label} | {printed} | " + " | ".join(shown) + " |")
    return "\n".join(lines)


def page(results: list[ComparedRow]) -> str:
    """docs/results.md: the table, and what it says of the paper's gains."""
    return f"""\
# The paper's gains on three loops

{textwrap.fill(said(results), 120)}

The angle is given directly (no network). Loops: `exact` is the model as its own plant, torque held for a microsecond,
no limits; `sampled` the same at 1 kHz with 60 N tendons; `four-segments` a four-segment plant under the one-segment
model. An RMSE with {MARK} changes with the integration step, however short: [convergence](convergence.md).

{table(results)}

Made by `python docs/pictures.py`.
"""


def said(results: list[ComparedRow]) -> str:
    """Where the paper's sliding mode gains arrive, how near they come to its RMSE, and how fast tensions slam."""
    own = [each for each in results if each.label == "smc/exchanged"]
    moves = [each.simulation.metrics["rmse"] for each in own if each.loop == "exact" and not each.jumps]
    slams = {each.loop: f"{each.repeated.chatter:.0f}" for each in sorted(own, key=lambda row: row.repeated.chatter)}
    fast = [f"{rate} times a second on {loop}" for loop, rate in slams.items() if rate != "0"]
    return (
        f"SMC with the printed gains brings the wrist to 30 deg {arrivals(results, 'smc/printed')}; with P1 and P2 "
        f"exchanged (a hypothesis) {arrivals(results, 'smc/exchanged')}. Its RMSE of smooth moves on exact is "
        f"{min(moves) / T2['smc'].rmse:.2g} to {max(moves) / T2['smc'].rmse:.2g} times the paper's. "
        + (f"Its tensions go from limit to limit and back up to {', '.join(fast)}. " if fast else "")
        + "Up to which tension limit it arrives, and with which measurement of the rate: [the paper at its "
        "best](best_case.md)."
    )


def arrivals(results: list[ComparedRow], label: str) -> str:
    """On which loops a row arrives with all its references, and on which with how many of them."""
    loops: dict[str, list[bool]] = {}
    for each in results:
        if each.label == label:
            loops.setdefault(each.loop, []).append(each.repeated.arrives)
    there = [
        loop if all(ends) else f"{loop} ({sum(ends)} of {len(ends)} references)"
        for loop, ends in loops.items()
        if any(ends)
    ]
    return f"on {', '.join(there)}" if there else "on no loop"


def camera() -> None:
    """What the rendered camera sees of the wrist bent by 30 deg, with the tracker's markers and angle drawn in."""
    scene = Scene(SceneSettings(), WristParameters())
    image = scene.render(np.full((1, 4), math.radians(30.0) / 4), np.random.default_rng(0))
    seen = Tracker(Markers(), scene.view, Gates()).see(Frame(image, 0.0, 0))
    cv2.imwrite(str(HERE / "images" / "camera.jpg"), annotate(image, seen), [cv2.IMWRITE_JPEG_QUALITY, 88])


def keep(name: str, figure: Figure) -> None:
    """The figure as images/NAME.png."""
    write_figure(HERE / "images" / name, figure)
    (HERE / "images" / f"{name}.svg").unlink()


def hysteresis() -> None:
    """Outer loops by sheath and speed, with the roots of the statics."""
    study = load_study(
        [HERE.parent / "experiments" / "hysteresis.yaml"], ["hysteresis.ranges_deg=[[0, 30]]"], "analyse"
    )
    own = strokes(study.wrist, study.hysteresis)
    keep("hysteresis", loops_by_speed(own, loops(own)))


def answer() -> None:
    """What `make run` answers: every controller in each class of conditions, but for the rows that are tuned first."""
    study = load_study([HERE.parent / "experiments" / "quick.yaml"], [])
    rows = tuple(row for row in study.compare.rows if row.gains != "tuned")
    chosen = study.compare.model_copy(update={"rows": rows})
    results = compare(study.model_copy(update={"compare": chosen}))
    rankings = class_rankings(results, chosen, study.wrist)
    keep("answer", answer_figure(rankings, places_of(rankings)))


def report() -> None:
    """The head of a report in Chromium: emulated trials in two planes."""
    with tempfile.TemporaryDirectory() as folder:
        trial = [sys.executable, "-m", "wristctl", "hw-run", "--reference", "circumduction"]
        subprocess.run([*trial, "--set", "reference.angle_deg=25"], check=True, cwd=folder)
        (page,) = Path(folder).glob("results/*-hw-run-*/report.html")
        shot(page, HERE / "images" / "report.png", 1000, 1400)


def main() -> None:
    camera()
    report()
    hysteresis()
    answer()
    settings = [f"controllers={ROWS}", f"loops={LOOPS}", f"references={REFERENCES}", "inverses=[none]"]
    study = load_study([], settings, "compare")
    results = compare(study)
    shown = ("smc/exchanged", "smc/initial", "pid/printed", "computed-torque/default")
    for loop in ("exact", "four-segments"):
        courses = [
            r.simulation.trajectory
            for r in results
            if r.loop == loop and r.label in shown and r.reference.startswith("minimum jerk 1")
        ]
        figure = over_time(courses, "size", heading=f"loop {loop}: 30 deg in 1 s, error of the bending angle")
        keep(f"errors-{loop}", figure)
    keep("directions", directions(study.wrist))
    (HERE / "results.md").write_text(page(results))


if __name__ == "__main__":
    main()
