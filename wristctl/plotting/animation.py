"""Data of the page's animation: the wrist's segment angles over time, as logged."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any

from wristctl.records.run import Run

if TYPE_CHECKING:
    import numpy as np

# Pictures a second; the page interpolates between them.
FRAMES = 25.0
# Angles are whole numbers of 0.1 mrad: an eighth of a pixel at the tip.
_PLACES = 1e4


def animation(run: Run) -> dict[str, Any] | None:
    """Wrist, time step and one course per closed loop of the run, grouped by what it had to follow; None without any.

    A course holds its group, its name, its colour, whether its parts are hinged or arcs, and per picture the angle of
    each [0.1 mrad] and the wanted angle; pictures end where it diverged. Loops of another plant are left out. Gravity
    is that along the straight wrist, and 0 where it has another part, which planes see differently.
    """
    if run.has("data/trajectories.npz"):
        courses, time = _compared(run)
    elif run.has("data/trajectory.csv"):
        courses, time = _single(run)
    elif run.kind == "hw-run" and run.config.hw_run.planes == 1 and run.has("data/trials.csv"):
        courses, time = _trials(run)
    else:
        return None
    if not courses:
        return None
    step, wrist = max(1, round(1.0 / FRAMES / float(time[1] - time[0]))), run.config.wrist
    return {
        "wrist": {
            "length": wrist.length,
            "discs": wrist.discs,
            "offset": wrist.tendon_offset,
            "radius": wrist.tendon_radius,
            "hand": wrist.hand_offset,
            "gravity": 0.0 if any((wrist.gravity[1], wrist.gravity_flexion)) else wrist.gravity[0],
        },
        "step": float(time[step] - time[0]),
        "duration": float(time[-1] - time[0]),
        "courses": [_course(*course, step) for course in courses],
    }


# Whether the parts of a plant are rigid links with a hinge, or arcs; what is neither is not drawn.
HINGED = {"pcc": False, "hinges": True}

Named = tuple[str, str, str, bool, Any, Any]
"""Group, name, controller, whether it is hinged, angles and wanted ones."""


def _compared(run: Run) -> tuple[list[Named], np.ndarray]:
    table, series = run.data("comparison"), run.array("trajectories")
    if "theta" not in series:  # in two planes
        return [], series["time"][0]
    bent = series.get("segment_theta", series["theta"][..., None])
    many = table["inverse"].nunique() > 1
    plants = {name: loop.plant.model for name, loop in run.config.compare.loops.items()}
    courses: list[Named] = []
    for row, angles, wanted in zip(table.to_dict("records"), bent, series["theta_desired"], strict=True):
        if (plant := plants.get(row["loop"])) in HINGED:
            group = f"{row['loop']}, {row['reference']}" + f", {row['inverse']} inverse" * many
            name, law = f"{row['controller']}/{row['gains']}", str(row["controller"])
            courses.append((group, name, law, HINGED[plant], angles, wanted))
    return courses, series["time"][0]


def columns_of(run: Run, table: str) -> dict[str, np.ndarray]:
    """Columns of numbers of a run's table by name, (rows,) each, sooner than pandas is loaded."""
    import numpy as np

    with run.file(f"data/{table}.csv").open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    numbers = np.array([[float(cell or "nan") for cell in row] for row in rows])
    return dict(zip(names, numbers.T, strict=True))


def _single(run: Run) -> tuple[list[Named], np.ndarray]:
    import numpy as np

    table = columns_of(run, "trajectory")
    angle_columns = [name for name in table if name.removeprefix("theta_").isdigit()] or ["theta"]
    settings = getattr(run.config, run.kind.replace("-", "_"))
    if settings.loop.plant.model not in HINGED:
        return [], table["time"]
    gains = settings.gains if isinstance(settings.gains, str) else "own gains"
    name = ("", f"{settings.controller}/{gains}", settings.controller, HINGED[settings.loop.plant.model])
    bent = np.stack([table[column] for column in angle_columns], axis=1)
    return [(*name, bent, table["theta_desired"])], table["time"]


def _trials(run: Run) -> tuple[list[Named], np.ndarray]:
    """Complete trials on the control grid: the true segment angles where logged, else the estimate as one segment."""
    import numpy as np

    trials, log = run.data("trials"), run.data("log")
    plant = run.config.hw_run.bench.plant.model
    truth = run.data("truth") if plant in HINGED and run.has("data/truth.csv") else None
    time = np.arange(0.0, run.config.hw_run.horizon, run.config.hw_run.control_period)
    courses = []
    for row in trials[trials["outcome"] == "ok"].to_dict("records"):
        course = log[log["trial"] == row["trial"]]
        angles = course if truth is None else truth[truth["trial"] == row["trial"]]
        angle_columns = [name for name in angles.columns if name.removeprefix("theta_").isdigit()] or ["theta"]
        bent = np.stack([np.interp(time, angles["time"], angles[name]) for name in angle_columns], axis=-1)
        wanted = np.interp(time, course["time"], course["theta_desired"])
        group = row["direction"] + (f", pushed with {row['push']:g} N" if row["push"] else "")
        name = f"{row['controller']}/{row['gains']}"
        again = f", repetition {row['repetition']}" if row["repetition"] else ""
        hinged = truth is not None and HINGED[plant]
        courses.append((group, name + again, row["controller"], hinged, bent, wanted))
    return courses, time


def _course(
    group: str, name: str, controller: str, hinged: bool, bent: np.ndarray, wanted: np.ndarray, step: int
) -> dict[str, Any]:  # fmt: skip
    import numpy as np

    from wristctl.plotting.style import colour

    shown = bent[::step, ~np.isnan(bent[0])]
    drawable = np.isfinite(shown).all(axis=1) & (np.abs(shown.sum(axis=1)) < np.pi)
    shown = shown[: len(shown) if drawable.all() else int(np.argmin(drawable))]
    return {
        "group": group,
        "name": name,
        "colour": colour(controller),
        "hinged": hinged,
        "diverged": not drawable.all(),
        "theta": np.round(_PLACES * shown).astype(int).tolist(),
        "wanted": np.round(_PLACES * wanted[::step]).astype(int).tolist(),
    }
