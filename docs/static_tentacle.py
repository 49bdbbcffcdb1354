"""A soft tentacle at rest held against its recordings: `python docs/static_tentacle.py FOLDER` writes real-robots.md.

FOLDER is paper_results/secVa_system_identification/data of github.com/tud-phi/soromox @4f03054 (MIT); none of it is
part of this package. Runs that one motor pulls are fitted, those that both pull are predicted. Errors are means over
the four markers and the runs, as its authors have them. The fit takes a minute or two.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.baselines import gaussian_process, mean_of_runs
from wristctl.identification.static_tentacle import Tentacle

PAGE = Path(__file__).parent / "real-robots.md"
BEGIN, END = "<!-- table by docs/static_tentacle.py -->\n", "<!-- end of the tentacle -->"
WINCH = 0.0325
"""Radius of the winches [m]."""
_FIRST, _MORE = (0.1, 0.15, 0.2, 0.25), (0.05, 0.12, 0.18)
LEVELS = (
    *((level, 0.0) for level in _FIRST), *((0.0, level) for level in _FIRST),
    *((level, 0.0) for level in _MORE), *((0.0, level) for level in _MORE),
    (0.1, 0.1), (0.2, 0.2), (0.1, 0.2), (0.15, 0.2), (0.2, 0.1), (0.2, 0.15), (0.1, 0.05), (0.05, 0.1),
)  # fmt: skip
"""Torque of both motors [N m] in each run, in the order of the authors' arrays."""
ROD = Tentacle(0.36, (0.0154, 0.0048), 0.0114, 0.0295, (0.0, -math.tau / 3.0), 1.1, (0.13, 0.22, 0.28, 0.35))
AUTHORS = {
    "their GVS rod, fitted modulus, ratio and density": r"$\tau_{ext} = 0$",
    "the same with a residual network": r"$\tau_{ext} = \tau_{ext,NN}$",
}
"""Rows of the table, and how the authors' file of errors calls them."""


def measured(folder: Path) -> Array:
    """Markers (22, 4, 3) [m]: down the rod, then its authors' x and y."""
    places = np.load(folder / "measured_pts.npy", allow_pickle=False)
    turned: Array = np.stack([-places[..., 2], places[..., 0], places[..., 1]], axis=-1)
    return turned


def authors_errors(folder: Path, condition: str) -> Array:
    """The authors' own errors (22, 4) [m]."""
    with (folder / "violin_data.csv").open(encoding="utf-8") as stream:
        rows = [row for row in csv.reader(stream) if row[1] == condition]
    return np.array([[float(row[2]) for row in rows if row[0] == f"M{k}"] for k in (1, 2, 3, 4)]).T


def errors_of_all(folder: Path) -> dict[str, tuple[Array, int]]:
    """Errors (22, 4) [m] of each way to predict the markers, and its free numbers."""
    pulls, markers = np.array(LEVELS) / WINCH, measured(folder)
    both, count = np.asarray((pulls > 0.0).all(axis=1)), len(markers)
    found = {name: (authors_errors(folder, condition), 3) for name, condition in AUTHORS.items()}
    nothing = np.zeros(count, bool)
    runs = ArcRecording(
        "all", "all", np.arange(float(count)), pulls, markers.reshape(count, -1), np.full(count, math.nan), ~both,
        nothing, both, np.arange(count),
    )  # fmt: skip
    for name, predict in (("mean of the other runs", mean_of_runs), ("Gaussian process", gaussian_process)):
        wrong = predict([runs])[0].reshape(markers.shape) - markers
        found[name] = np.linalg.norm(wrong, axis=2), 0
    values = ROD.fitted(pulls[~both], markers[~both])
    found["our rod: weight, tendons, taper"] = (
        np.linalg.norm(ROD.expected(values, pulls) - markers, axis=2), len(values)
    )  # fmt: skip
    return found


def table(found: dict[str, tuple[Array, int]]) -> str:
    """A row for each way, errors in millimetres; intervals by drawing the runs that are predicted."""
    both = (np.array(LEVELS) > 0.0).all(axis=1)
    drawn = np.random.default_rng(0).integers(int(both.sum()), size=(4000, int(both.sum())))
    lines = ["| error of the markers [mm] | all 22 runs | 8 runs that both motors pull, 95 % |", "|---|---|---|",
             "| their GVS rod, initial values | 36.8 | - |"]  # fmt: skip
    for name, (wrong, _) in found.items():
        runs = 1e3 * wrong[both].mean(axis=1)
        low, high = np.quantile(runs[drawn].mean(axis=1), [0.025, 0.975])
        lines.append(f"| {name} | {1e3 * wrong.mean():.1f} | {runs.mean():.1f} [{low:.1f}, {high:.1f}] |")
    return "\n".join(lines) + "\n"


def main(folder: str) -> None:
    """Fit the rod, and write the table between the page's marks."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    shown = table(errors_of_all(Path(folder)))
    PAGE.write_text(f"{before}{BEGIN}{shown}{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
