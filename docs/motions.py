"""Which controllers follow daily living: `python docs/motions.py` writes the table of docs/motions.md and its picture.

Each controller follows each task with motors, tendons and a camera (loop of experiments/scenarios/camera.yaml), and of
each task's range the share is counted in which it never was off by more than 2 deg.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import wristctl
from wristctl.config.choices import REFERENCES
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.records.formats import write_figure
from wristctl.simulation.reference import motion

HERE = Path(__file__).parent
FAMILY = HERE.parent / "experiments" / "scenarios" / "camera.yaml"
TASKS = (
    "personal-care", "eating", "stirring", "jar", "phone", "mean-flexion", "mean-deviation", "most-flexion",
    "all-deviation",
)  # fmt: skip
"""Those within the wrist's range of +-50 deg: combing and every task in flexion are not."""
LAWS = ("ct-dob/hardware", "pid-ff/hardware", "smc-tracking/camera", "smc/hardware", "feedforward/default")
BEGIN, END = "<!-- table by docs/motions.py -->\n", "<!-- end -->"
HORIZON = 8.0


def untracked(law: str, task: str) -> float:
    """Share of a task's range that is lost."""
    controller, gains = law.split("/")
    family = wristctl.load_study(FAMILY).families["camera"]
    plane = REFERENCES[f"adl:{task}"].plane
    study = wristctl.load_study(
        None,
        f"simulate.controller={controller}",
        f"simulate.gains={gains}",
        f"simulate.direction={plane}",
        f"simulate.horizon={HORIZON}",
        f"simulate.reference.kind=adl:{task}",
    )
    own = study.simulate.model_copy(update={"loop": family.loop})
    return float(wristctl.simulate(study.model_copy(update={"simulate": own})).metrics["range_untracked"])


def width(task: str) -> float:
    """Range of a task [deg]."""
    followed = motion(Reference(kind=f"adl:{task}"), WristParameters(), HORIZON, 1e-3)
    return float(np.rad2deg(np.ptp(followed.theta_ref)))


def table() -> str:
    """The share tracked of every task by every controller, and of all of them, weighted by their ranges."""
    widths = np.array([width(task) for task in TASKS])
    heads = ["task", "range [deg]", *LAWS]
    tracked = 100.0 * (1.0 - np.array([[untracked(law, task) for law in LAWS] for task in TASKS]))
    rows = [
        [f"adl:{task}", f"{wide:.1f}", *(f"{share:.0f} %" for share in own)]
        for task, wide, own in zip(TASKS, widths, tracked, strict=True)
    ]
    whole = ["all of it", f"{widths.sum():.1f}", *(f"{share:.1f} %" for share in widths @ tracked / widths.sum())]
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows, whole))


def picture() -> Figure:
    """The curves of the tasks, one panel a plane."""
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    for axes, plane, ends in zip(
        figure.subplots(1, 2), ("flexion", "ulnar"), (("extension", "flexion"), ("radial", "ulnar")), strict=True
    ):
        named = [task for task in TASKS if REFERENCES[f"adl:{task}"].plane == plane]
        for task in named:
            followed = motion(Reference(kind=f"adl:{task}"), WristParameters(), 3.0, 1e-3)
            axes.plot(followed.time, np.rad2deg(followed.theta_ref), label=task)
        axes.set(xlabel="time [s]", ylabel=f"angle [deg], {ends[1]} +, {ends[0]} -", ylim=(-50.0, 55.0))
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=7, ncols=3, frameon=False)
        axes.grid(alpha=0.3)
    return figure


def main() -> None:
    """Write both."""
    page = HERE / "motions.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{table()}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")
    write_figure(HERE / "images" / "daily-living", picture())
    (HERE / "images" / "daily-living.svg").unlink()


if __name__ == "__main__":
    main()
