"""What hw-run's controllers do on the emulated rig: `python docs/trial_accuracy.py` writes docs/hardware/accuracy.md.

The default trial over ten seeds, then each controller that hw-run allows, with friction in sheaths of 1 and 3 rad, by
the emulated wrist's own angle and by the camera's, as on a real rig. `python docs/trial_accuracy.py default`, or
`sheath-1` or `sheath-3`, measures that part alone. Ends with 1 where the default trial is worse than its bounds.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from wristctl.control.table import CONTROLLERS

PAGE = Path(__file__).parent / "hardware" / "accuracy.md"
SEEDS, WORKERS = 10, 2
SHEATHS = {"default": 0.0, "sheath-1": 1.0, "sheath-3": 3.0}
"""Angle of the tendons' sheaths in each part of the page [rad]."""
DEFAULT = ("smc-tracking", "hardware")
BOUNDS = {
    "true RMSE [deg]": 0.068, "true swing, peak to peak [deg]": 0.1, "true settling [s]": 1.0,
    "true RMSE, pushed [deg]": 0.12,
}  # fmt: skip
"""Of the default trial's medians: springs 30 % weaker than believed, 30 deg in 1 s, pushed with 2 N."""


class Rig(NamedTuple):
    """One run: a controller, a sheath [rad], a seed."""

    law: tuple[str, str]
    sheath: float
    seed: int


def allowed() -> list[tuple[str, str]]:
    """Controllers with a preset for motors and a camera."""
    return [(name, "hardware") for name, law in CONTROLLERS.items() if "hardware" in law.presets]


def tried(rig: Rig) -> dict[str, float] | str:
    """Metrics of a run, or why it ended."""
    (name, gains), sheath, seed = rig
    given = {
        "directions": "[ulnar]", "rows": f"[{{controller: {name}, gains: {gains}}}]", "seed": str(seed),
        "bench.actuator.sheath": f"{sheath:g}",
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        settings = [part for key, value in given.items() for part in ("--set", f"{key}={value}")]
        command = [sys.executable, "-m", "wristctl", "hw-run", "--quiet", "--out", folder, *settings]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            said = done.stderr.strip().splitlines()[-1].removeprefix("error: ")
            return said.split(";")[0].split(" - fix")[0]
        trials = pd.read_csv(Path(done.stdout.split()[-1]) / "data" / "trials.csv")
    still, pushed = trials[trials["push"] == 0.0].iloc[0], trials[trials["push"] > 0.0].iloc[0]
    return {
        "true RMSE [deg]": np.degrees(still["true_rmse"]),
        "true steady state [deg]": np.degrees(still["true_steady_state"]),
        "true swing, peak to peak [deg]": np.degrees(2.0 * still["true_oscillation"]),
        "true settling [s]": still["true_settling"], "true RMSE, pushed [deg]": np.degrees(pushed["true_rmse"]),
        "RMSE by the camera [deg]": np.degrees(still["rmse"]),
    }  # fmt: skip


def row(title: str, found: Sequence[dict[str, float] | str]) -> str:
    """Medians of what came through, and how many did not."""
    good = pd.DataFrame([each for each in found if not isinstance(each, str)])
    stopped = [each for each in found if isinstance(each, str)]
    cells = [f"{good[name].median():.3f}" if len(good) and good[name].notna().any() else "-" for name in COLUMNS]
    ends = f"{len(stopped)} of {len(found)}: {stopped[0]}" if stopped else ""
    return f"| {title} | {' | '.join(cells)} | {ends} |"


COLUMNS = (
    "true RMSE [deg]",
    "true steady state [deg]",
    "true swing, peak to peak [deg]",
    "true settling [s]",
    "true RMSE, pushed [deg]",
    "RMSE by the camera [deg]",
)


def rigs_of(part: str) -> list[tuple[str, list[Rig]]]:
    """Runs of a part of the page, with the head of the row that they come to."""
    if part == "default":
        return [("/".join(DEFAULT), [Rig(DEFAULT, SHEATHS[part], seed) for seed in range(SEEDS)])]
    return [("/".join(law), [Rig(law, SHEATHS[part], 0)]) for law in allowed()]


def main() -> None:
    """Run the parts that are asked for, and write their tables into the page."""
    for part in sys.argv[1:] or SHEATHS:
        rows = rigs_of(part)
        with ThreadPoolExecutor(WORKERS) as pool:
            found = [list(pool.map(tried, rigs)) for _, rigs in rows]
        head = ["| | " + " | ".join(COLUMNS) + " | stopped |", "| --- |" + " --- |" * (len(COLUMNS) + 1)]
        table = "\n".join([*head, *(row(title, each) for (title, _), each in zip(rows, found, strict=True))])
        begin, end = f"<!-- {part}, by docs/trial_accuracy.py -->\n", f"<!-- end of {part} -->"
        before, _, rest = PAGE.read_text().partition(begin)
        PAGE.write_text(f"{before}{begin}\n{table}\n\n{end}{rest.partition(end)[2]}")
        if part == "default":
            good = pd.DataFrame([each for each in found[0] if not isinstance(each, str)], columns=list(BOUNDS))
            if over := [name for name, most in BOUNDS.items() if not good[name].median() <= most]:
                sys.exit(f"beyond its bound: {', '.join(over)}")


if __name__ == "__main__":
    main()
