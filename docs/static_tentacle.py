"""A soft tentacle at rest held against its recordings: `python docs/static_tentacle.py FOLDER` writes real-robots.md.

FOLDER is paper_results/secVa_system_identification/data of github.com/tud-phi/soromox @4f03054 (MIT); none of it is
part of this package. Runs that one motor pulls are fitted, those that both pull are predicted. Errors are means over
the four markers and the runs, as its authors have them. The fit takes a minute or two.

The rod hangs along +x. Its bending stiffness times its curvature is the moment of the tendons, which end at its tip,
and of the weight beyond; its axial stiffness times its strain is their force (small strains, a cross-section that stays
as it is). Tendons run along it, off its axis, and come nearer to it toward the tip.
"""

from __future__ import annotations

import csv
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from wristctl.arrays import Array
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.baselines import gaussian_process, mean_of_runs

# Pieces of the rod, share of the change of curvature that a step of the search for rest takes, its most steps, and the
# change of curvature [1/m] at which it ends.
_PIECES, _SHARE, _STEPS, _REST = 24, 0.3, 400, 1e-5
# Least length of a piece over that without load.
_LEAST = 0.3
GRAVITY = 9.81


@dataclass(frozen=True)
class Tentacle:
    """Published geometry: length, radii at the base and at the tip [m], offset of tendons [m] and its taper."""

    length: float
    radii: tuple[float, float]
    offset: float
    taper: float
    angles: tuple[float, ...]
    """Directions of the tendons from the first [rad]."""
    turn: float
    """Direction of the first tendon from y at which its search begins [rad]."""
    markers: tuple[float, ...]
    """Where along the rod markers are about [m]; places and distances from the axis are fitted."""

    @property
    def begin(self) -> Array:
        """Where the search begins: modulus [MPa], density [1e3 kg/m^3], direction of the first tendon, tilt toward y
        and z [rad], then of each marker its place along the rod and its distances from the axis [m]."""
        own = [value for place in self.markers for value in (place, 0.0, 0.0)]
        return np.array([0.3, 1.2, self.turn, 0.0, 0.0, *own])

    def expected(self, values: Array, pulls: Array) -> Array:
        """Places of markers (N, markers, 3) [m] under pulls (N, tendons) [N]. Values as `begin` has them."""
        modulus, density, turn, tilt_y, tilt_z = values[:5] * [1e6, 1e3, 1.0, 1.0, 1.0]
        step = self.length / _PIECES
        along = step * (np.arange(_PIECES) + 0.5)
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * along / self.length
        area = math.pi * radius**2
        weight = density * area * step * GRAVITY
        stiffness = modulus * 0.25 * math.pi * radius**4
        arm = np.maximum(self.offset - self.taper * along, 0.0)
        directions = np.array(self.angles) + turn
        toward = np.stack([pulls @ np.cos(directions), pulls @ np.sin(directions)], axis=1)
        own = np.stack([-toward[:, 1:] * arm, toward[:, :1] * arm], axis=2)
        base = _turned(np.tile(np.eye(3), (len(pulls), 1, 1)), np.tile([0.0, -tilt_z, tilt_y], (len(pulls), 1)))
        curvature, strain = own / stiffness[:, None], np.zeros((len(pulls), _PIECES))
        for _ in range(_STEPS):
            frames, places = self._shape(base, curvature, strain, step)
            beyond = np.cumsum(weight[::-1])[::-1]
            moments = np.cumsum((weight[:, None] * places)[:, ::-1], axis=1)[:, ::-1]
            lever = moments - beyond[:, None] * places  # from each piece to what is beyond it, times its weight
            down = np.array([1.0, 0.0, 0.0])
            local = np.einsum("npji,npj->npi", frames, np.cross(lever, down))
            wanted = (own + local[..., 1:]) / stiffness[:, None]
            force = -pulls.sum(axis=1)[:, None] + beyond * frames[:, :, 0, 0]
            strain = np.maximum(force / (modulus * area), _LEAST - 1.0)
            change = wanted - curvature
            curvature = curvature + _SHARE * change
            if float(np.abs(change).max()) < _REST:
                break
        return self._markers(values[5:].reshape(-1, 3), base, curvature, strain, step)

    def _shape(self, base: Array, curvature: Array, strain: Array, step: float) -> tuple[Array, Array]:
        """Frames (N, P, 3, 3), whose columns are axes, and middles (N, P, 3) of all pieces."""
        frames, places = np.empty((*curvature.shape[:2], 3, 3)), np.empty((*curvature.shape[:2], 3))
        frame, end = base, np.zeros((len(base), 3))
        for k in range(_PIECES):
            turn = np.concatenate([np.zeros((len(base), 1)), 0.5 * step * curvature[:, k]], axis=1)
            frame = _turned(frame, turn)
            length = step * (1.0 + strain[:, k])
            frames[:, k], places[:, k] = frame, end + 0.5 * length[:, None] * frame[:, :, 0]
            end = end + length[:, None] * frame[:, :, 0]
            frame = _turned(frame, turn)
        return frames, places

    def _markers(self, own: Array, base: Array, curvature: Array, strain: Array, step: float) -> Array:
        frames, places = self._shape(base, curvature, strain, step)
        found = []
        for place, beside, across in own:
            at = np.clip(place / step - 0.5, 0.0, _PIECES - 1.0)
            k, rest = min(int(at), _PIECES - 2), at - min(int(at), _PIECES - 2)
            middle = (1.0 - rest) * places[:, k] + rest * places[:, k + 1]
            frame = frames[:, k] if rest < 0.5 else frames[:, k + 1]
            found.append(middle + beside * frame[:, :, 1] + across * frame[:, :, 2])
        return np.stack(found, axis=1)

    def fitted(self, pulls: Array, measured: Array) -> Array:
        """Values with the least squares of errors of markers (N, markers, 3) [m]."""

        def errors(values: Array) -> Array:
            return np.asarray((self.expected(values, pulls) - measured).ravel())

        scale = np.array([0.1, 0.3, 0.5, 0.1, 0.1, *np.tile([0.02, 0.02, 0.02], len(self.markers))])
        low, high = self.begin - 8.0 * scale, self.begin + 8.0 * scale
        low[:2] = 0.05, 0.3
        found = least_squares(
            errors, self.begin, bounds=(low, high), x_scale=scale, diff_step=np.full(len(low), 1e-3), max_nfev=25
        )
        return np.asarray(found.x)


def _turned(frames: Array, turns: Array) -> Array:
    """Frames (N, 3, 3) turned by rotation vectors (N, 3) in their own axes (Rodrigues)."""
    angle = np.linalg.norm(turns, axis=1)
    axis = turns / np.maximum(angle, 1e-12)[:, None]
    cross = np.zeros((len(turns), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = axis[:, 2], -axis[:, 1], axis[:, 0]
    sine, rest = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    return np.asarray(frames @ (np.eye(3) + sine * cross + rest * cross @ cross))


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
