"""The model held against real robots: `python docs/real_robots.py NECK OPENCR [FOLDER]` writes docs/real-robots.md.

NECK and OPENCR are folders with the recordings of UC3M's soft neck and of OpenCR, as `wristctl validate --list` names
them; none is part of this package. Runs stay in the folder, and what is there already is not done again.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from wristctl.records import Run, list_runs

PAGE = Path(__file__).parent / "real-robots.md"
BEGIN, END = "<!-- tables by docs/real_robots.py -->\n", "<!-- end -->"
ROBOTS = {"uc3m-soft-neck": 0, "opencr-v4": 1, "opencr-v6": 1}
"""Robots, and which folder holds their recordings."""
TITLES = {"uc3m-soft-neck": "soft neck, bend", "opencr-v4": "OpenCR v4, tip", "opencr-v6": "OpenCR v6, tip"}
BASELINES = {"mean_of_the_other_runs": "mean of the other runs", "gaussian_process": "Gaussian process"}
TERMS = {"ratio_slack": "slack", "ratio_tendon_friction": "tendon friction", "ratio_inner_friction": "inner friction",
         "ratio_creep": "creep"}  # fmt: skip


def validated(results: Path, robot: str, data: str) -> Run:
    """The validation of a robot, done now where there is none."""
    runs = [run for run in list_runs(results) if run.state == "ok" and run.manifest.label == robot]
    if not runs:
        command = ["validate", robot, "--data", data, "--out", str(results), "--label", robot, "--quiet"]
        subprocess.run([sys.executable, "-m", "wristctl", *command], check=True, stdout=subprocess.DEVNULL)
        runs = [run for run in list_runs(results) if run.state == "ok" and run.manifest.label == robot]
    return runs[-1]


def with_interval(metric: dict[str, Any] | None, digits: int = 2) -> str:
    """A metric with its interval; a dash where there is none."""
    if metric is None:
        return "-"
    low, high = metric["interval"]
    return f"{metric['value']:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def tables(runs: dict[str, Run]) -> str:
    """Errors beside the authors', what each term is worth, and the closed-loop steps of the neck."""
    heads = ("robot", "its authors' own model", "ours, 95 %", "ours over theirs", *BASELINES.values(), "run")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for robot, run in runs.items():
        metrics = run.metrics
        unit = metrics["error"]["unit"]
        theirs = f"{metrics['authors']['value']:.2f} {unit}" if "authors" in metrics else "none to compare with"
        ours = f"{with_interval(metrics['error'])} {unit}"
        over = with_interval(metrics.get("ratio_to_authors"))
        beside = [f"{with_interval(metrics[name])} {unit}" for name in BASELINES]
        cells = [TITLES[robot], theirs, ours, over, *beside, f"`{run.result_hash[:12]}`"]
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", f"| error with it over without | {' | '.join(TERMS.values())} |", "|---" * (1 + len(TERMS)) + "|"]
    for robot, run in runs.items():
        cells = [with_interval(run.metrics.get(name), 3) for name in TERMS]
        lines.append(f"| {TITLES[robot]} | {' | '.join(cells)} |")
    return "\n".join([*lines, "", *steps_of(runs["uc3m-soft-neck"])]) + "\n"


def steps_of(run: Run) -> list[str]:
    """The neck's closed-loop steps: a row for each step of a file, a column for each load."""
    steps = {
        (name.split("_")[0], name.split("_")[1]): metric
        for name, metric in run.metrics.items()
        if name.startswith("step")
    }
    loads = list(dict.fromkeys(load for _, load in steps))
    lines = [f"| error of a closed-loop step [deg] | {' | '.join(load.replace('g', ' g') for load in loads)} |",
             "|---" * (1 + len(loads)) + "|"]  # fmt: skip
    for number in dict.fromkeys(number for number, _ in steps):
        errors = [f"{steps[number, load]['value']:.2f}" if (number, load) in steps else "-" for load in loads]
        lines.append(f"| {number.replace('step', 'step ')} | {' | '.join(errors)} |")
    return lines


def main(neck: str, opencr: str, folder: str = "results/real-robots") -> None:
    """Validate every robot, and write the tables between the page's marks."""
    runs = {robot: validated(Path(folder), robot, (neck, opencr)[place]) for robot, place in ROBOTS.items()}
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}{tables(runs)}{END}{rest.partition(END)[2]}", encoding="utf-8")
    figure = runs["uc3m-soft-neck"].path / "figures" / "motion.png"
    (PAGE.parent / "images" / "real-robots.png").write_bytes(figure.read_bytes())


if __name__ == "__main__":
    main(*sys.argv[1:])
