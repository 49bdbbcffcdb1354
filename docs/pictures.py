"""Make the README's pictures and docs/results.md anew: `python docs/pictures.py`."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.class_standing import class_standings
from wristctl.comparison.combinations import ComparedRow, compare
from wristctl.comparison.paper import T2
from wristctl.config.load import load_study
from wristctl.config.vision import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.records.formats import write_figure
from wristctl.report.answer_figure import answer_figure
from wristctl.report.hysteresis_figures import loops as loops_by_speed
from wristctl.report.loop_figures import errors
from wristctl.report.wrist_drawing import directions
from wristctl.simulation.hysteresis import loops
from wristctl.simulation.strokes import strokes
from wristctl.vision.annotate import annotate
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Tracker
from wristctl.vision.scene import Scene

HERE = Path(__file__).parent
ROWS = "[" + ", ".join(
    f"{{controller: {name}, gains: {gains}}}"
    for name, gains in (
        ("smc", "printed"), ("smc", "exchanged"), ("smc", "initial"), ("pid", "printed"),
        ("feedforward", "default"), ("computed-torque", "default"),
    )
) + "]"  # fmt: skip


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
        printed = f"{T2[controller].rmse:g}" if controller in T2 else ""
        lines.append(f"| {label} | {printed} | " + " | ".join(shown) + " |")
    return "\n".join(lines)


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
    study = load_study([HERE.parent / "experiments" / "hysteresis.yaml"], ["ranges_deg=[[0, 30]]"], "hysteresis")
    own = strokes(study.wrist, study.hysteresis)
    keep("hysteresis", loops_by_speed(own, loops(own)))


def answer() -> None:
    """What `make run` answers: every law in each class of conditions, but for the rows that are tuned first."""
    study = load_study([HERE.parent / "experiments" / "quick.yaml"], [])
    rows = tuple(row for row in study.compare.rows if row.gains != "tuned")
    chosen = study.compare.model_copy(update={"rows": rows})
    results = compare(study.model_copy(update={"compare": chosen}))
    keep("answer", answer_figure(class_standings(results, chosen, study.wrist)))


def main() -> None:
    camera()
    hysteresis()
    answer()
    study = load_study([], [f"rows={ROWS}", "inverses=[none]"], "compare")
    results = compare(study)
    shown = ("smc/exchanged", "smc/initial", "pid/printed", "computed-torque/default")
    for loop in ("exact", "default"):
        courses = [
            r.simulation.trajectory
            for r in results
            if r.loop == loop and r.label in shown and r.reference.startswith("minimum jerk 1")
        ]
        figure = errors(courses, f"loop {loop}: 30 deg in 1 s, error of the bending angle", log=True)
        keep(f"errors-{loop}", figure)
    keep("directions", directions(study.wrist))
    (HERE / "results.md").write_text(
        "# The paper's gains on three loops\n\nMade by `python docs/pictures.py`; the angle is given directly (no "
        "network). Loops: `exact` is the model as its own plant, torque held for a microsecond, no limits; `sampled` "
        "the same at 1 kHz with 60 N tendons; `default` a four-segment plant under the one-segment model.\n\n"
        + table(results)
        + "\n\nThe printed SMC gains do not move the wrist. With P1 and P2 exchanged (a hypothesis) the paper's RMSE "
        "lies between those of the two moves on the exact loop; sampled at 1 kHz the same gains slam the tendons at "
        "every tick. Whether they bring a four-segment wrist to 30 deg turns on the tension limit and on how the rate "
        "is measured: [the paper at its best](best_case.md).\n"
    )


if __name__ == "__main__":
    main()
