"""A motion in two planes as the wrist in space: data of the page's view, and a figure that stands still.

Axes as everywhere: x along the straight wrist, y toward ulnar, z toward flexion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import cycle
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.plotting.animation import HINGED, columns_of
from wristctl.plotting.style import (
    BLACK,
    GREEN,
    GREY,
    LIGHT,
    SILVER,
    TENDON_COLOURS,
    figure,
    legend_below,
    title,
    undress,
)
from wristctl.plotting.wrist_drawing import RIM
from wristctl.records.run import Run
from wristctl.simulation.trajectory import Trajectory
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.tendon_layout import TendonLayout

# Pictures a second, between which the page interpolates, and how many at most.
FRAMES, MOST = 50.0, 600
# Units of whole numbers on the page: of an angle [rad], of a place [m], of a pull [N].
ANGLE, PLACE, PULL = 1e-4, 1e-5, 0.1
# Direction from which the wrist is looked at: turned about its axis, and from above [rad].
AZIMUTH, ELEVATION = math.radians(-35.0), math.radians(22.0)
# The unit circle across the straight wrist.
_RING = np.stack([np.zeros(49), *(wave(np.linspace(0.0, 2.0 * np.pi, 49)) for wave in (np.cos, np.sin))], axis=1)


class Cable(NamedTuple):
    """A tendon's place in the cross-section [m], and the number of discs that it runs through, the clamped one too."""

    y: float
    z: float
    discs: int


def cables(wrist: WristParameters) -> list[Cable]:
    """Places of all tendons of a wrist, in the order of its pulls."""
    layout = TendonLayout.of(wrist)
    return [
        Cable(float(y), float(z), place.ends_at or wrist.discs)
        for (y, z), place in zip(layout.cross_section, layout.places, strict=True)
    ]


def rim(wrist: WristParameters) -> float:
    """Radius of the drawn discs [m], which hold every tendon."""
    return RIM * max(math.hypot(cable.y, cable.z) for cable in cables(wrist))


def spatial_view(run: Run) -> dict[str, Any] | None:
    """Wrist, tendons and motion of a run in two planes, as the page plays them; None of any other run, or plant.

    Of trials on a rig it is the first one.

    Numbers are whole: a picture has the bends of all segments and both wanted ones [0.1 mrad], each tendon's pull
    [0.1 N], and the tip where it is and where it is wanted [0.01 mm]. Pictures end where the wrist left its range.
    """
    table_of = {"simulate": "data/bends.csv", "hw-run": "data/trials.csv"}.get(run.kind)
    if table_of is None or not run.has(table_of):
        return None
    loop = run.config.hw_run.loop if run.kind == "hw-run" else run.config.simulate.loop
    if loop.plant.model not in HINGED:
        return None
    wrist, planes = plant_of(run.config.wrist, loop.plant), ("ulnar", "flexion")
    places = cables(wrist)
    groups = {
        "bends": ([f"bend_{k + 1}_{plane}" for k in range(loop.plant_segments) for plane in planes], ANGLE),
        "wanted": ([f"bend_ref_{plane}" for plane in planes], ANGLE),
        "pulls": ([f"acting_{number}" for number in range(1, len(places) + 1)], PULL),
        "tip": ([f"tip_{axis}" for axis in "xyz"], PLACE),
        "tip_desired": ([f"tip_desired_{axis}" for axis in "xyz"], PLACE),
    }
    columns = ["time", *(name for names, _ in groups.values() for name in names)]
    known = columns_of(run, "bends") if run.kind == "simulate" else _performed(run, columns)
    if known is None:
        return None
    table = np.stack([known[name] for name in columns], axis=1)
    sound = np.isfinite(table).all(axis=1)
    table = table[: len(table) if sound.all() else int(np.argmin(sound))]
    if len(table) < 2:
        return None
    time, end = table[:, 0], float(table[-1, 0] - table[0, 0])
    instants = np.linspace(time[0], time[-1], 1 + min(MOST, math.ceil(end * FRAMES)))
    shown = np.stack([np.interp(instants, time, column) for column in table.T[1:]], axis=1)
    parts = np.split(shown, np.cumsum([len(names) for names, _ in groups.values()])[:-1], axis=1)
    return {
        "wrist": {"length": wrist.length, "discs": wrist.discs, "rim": rim(wrist), "hand": wrist.hand_offset},
        "tendons": [
            {**cable._asdict(), "number": number, "colour": TENDON_COLOURS[k % len(TENDON_COLOURS)]}
            for k, (cable, number) in enumerate(zip(places, _numbers(run, len(places)), strict=True))
        ],
        "units": {"angle": ANGLE, "place": PLACE, "pull": PULL},
        "gravity": [*wrist.gravity, wrist.gravity_flexion],
        "from": {"azimuth": AZIMUTH, "elevation": ELEVATION},
        "hinged": HINGED[loop.plant.model],
        "duration": end,
        "left": not sound.all(),
    } | {
        name: np.rint(part / unit).astype(np.int64).tolist()
        for part, (name, (_, unit)) in zip(parts, groups.items(), strict=True)
    }


def _numbers(run: Run, count: int) -> Sequence[int]:
    """Numbers of the tendons in the run's tables."""
    if run.kind == "simulate":
        return range(1, count + 1)
    from wristctl.trial.rig_belief import layout_of_rig, numbers_of

    return numbers_of(layout_of_rig(run.config.hw_run, run.config.wrist))


def _performed(run: Run, columns: list[str]) -> dict[str, Array] | None:
    """Columns of the first trial of a rig in two planes that went to its end: as it truly was, where that is known."""
    if run.config.hw_run.planes == 1:
        return None
    from wristctl.trial.trial_results import first_course

    course = first_course(run)
    if course is None:
        return None
    of_course = course.columns()
    segments = sum(name.startswith("bend_") and name[5].isdigit() for name in columns)
    known = course.segment_theta.shape[1]
    if known < segments:  # of a real wrist one arc is all that is seen
        of_course |= {name: of_course[f"bend_1_{name[7:]}"] * known / segments for name in columns[1 : 1 + segments]}
    return of_course


def seen(points: Array) -> Array:
    """Points (..., 3) as they are seen from `AZIMUTH` and `ELEVATION`: to the right, up, and away (..., 3)."""
    x, y, z = np.moveaxis(points, -1, 0)
    behind = z * math.cos(AZIMUTH) - y * math.sin(AZIMUTH)
    right, up = y * math.cos(AZIMUTH) + z * math.sin(AZIMUTH), x * math.cos(ELEVATION) + behind * math.sin(ELEVATION)
    return np.stack([right, up, behind * math.cos(ELEVATION) - x * math.sin(ELEVATION)], axis=-1)


def motion_in_space(course: Trajectory, wrist: WristParameters, heading: str = "", plant: str = "pcc") -> Figure:
    """Left the wrist in space where it is bent most, right the path of its tip as seen from above it [mm].

    `wrist` is the wrist as it is.
    """
    picture, ((left, right),) = figure(1, 2, height=3.8)
    largest = int(np.nanargmax(np.hypot(*course.bend.T)))
    _draw_floor(left, 2.0 * rim(wrist))
    _draw_body(left, course.segment_theta[largest], wrist, plant)
    for path, style in ((course.tip_desired, _WANTED), (course.tip, _REACHED)):
        _line(left, path, zorder=4.0, **style)
        right.plot(1e3 * path[:, 1], 1e3 * path[:, 2], **style)
    _line(left, course.tip[largest, None], zorder=5.0, **_HERE)
    right.plot(1e3 * course.tip[largest, 1], 1e3 * course.tip[largest, 2], **_HERE)
    _draw_gravity(left, wrist)
    undress(left)
    left.set(xticks=[], yticks=[], aspect="equal")
    right.set_aspect("equal", adjustable="datalim")  # a box as flat as a straight path would have no height
    right.set(xlabel="tip toward ulnar [mm]", ylabel="tip toward flexion [mm]")
    title(left, heading)
    title(right, f"bent most at {course.time[largest]:.2f} s")
    legend_below(picture)
    return picture


_WANTED: dict[str, Any] = {"color": SILVER, "linewidth": 4.0, "label": "tip wanted"}
_REACHED: dict[str, Any] = {"color": GREEN, "linewidth": 1.2, "label": "tip reached"}
_HERE: dict[str, Any] = {"color": GREEN, "marker": "o", "markersize": 5.0, "linestyle": "none"}


def _line(axes: Axes, points: Array, **style: Any) -> None:
    axes.plot(*(1e3 * seen(points)[:, :2].T), **style)


def _draw_gravity(axes: Axes, wrist: WristParameters) -> None:
    """Where gravity pulls, in a corner."""
    pull = np.array([*wrist.gravity, wrist.gravity_flexion])
    if not pull.any():
        return
    right, up, _ = 28.0 * seen(pull / np.linalg.norm(pull))
    arrow = {"arrowstyle": "->", "color": GREY}
    from_, to = (30.0 - 0.5 * right, 244.0 - 0.5 * up), (30.0 + 0.5 * right, 244.0 + 0.5 * up)
    corner: Any = "figure points"
    axes.annotate("", to, from_, xycoords=corner, textcoords=corner, arrowprops=arrow)
    axes.annotate("gravity", (30.0, 214.0), xycoords=corner, ha="center", fontsize=9.0, color=GREY)


def _draw_floor(axes: Axes, radius: float) -> None:
    """The plane across the straight wrist at its base, with its directions."""
    _line(axes, radius * _RING, color=LIGHT, linewidth=0.8, zorder=1.0)
    for positive, negative, axis in (("ulnar", "radial", 1), ("flexion", "extension", 2)):
        end = radius * np.eye(3)[axis]
        _line(axes, np.stack([-end, end]), color=LIGHT, linewidth=0.8, zorder=1.0)
        for name, place in ((positive, 1.3 * end), (negative, -1.3 * end)):
            right, up, _ = 1e3 * seen(place)
            axes.annotate(name, (right, up), ha="center", va="center", fontsize=9.0, color=GREY)


def _draw_body(axes: Axes, q: Array, wrist: WristParameters, plant: str) -> None:
    """Discs, backbone and tendons at coordinates q (2n,): each disc over what is behind its plane."""
    frames_at = partial(PLANTS_IN_SPACE[plant].frames, wrist, q)
    centres, frames = frames_at(np.linspace(0.0, 1.0, wrist.discs))
    order = 2.0
    for k in _from_afar(seen(frames[:, :, 0])[:, 2] < 0.0):
        order += 0.01
        if k % 2 == 0:  # disc k / 2
            outline = 1e3 * seen(centres[k // 2] + rim(wrist) * _RING @ frames[k // 2].T)[:, :2]
            axes.add_patch(Polygon(outline, facecolor="#F2F2F2", edgecolor=BLACK, linewidth=1.0, zorder=order))
            continue
        ends = slice(k // 2, k // 2 + 2)
        shares = np.linspace(k // 2, k // 2 + 1, 9) / (wrist.discs - 1)
        lines = [(frames_at(shares)[0], {"color": BLACK, "linewidth": 2.0})]
        for cable, colour in zip(cables(wrist), cycle(TENDON_COLOURS), strict=False):
            if k // 2 + 1 < cable.discs:
                at = centres[ends] + frames[ends] @ np.array([0.0, cable.y, cable.z])
                lines.append((at, {"color": colour, "linewidth": 1.5}))
        for line, style in sorted(lines, key=lambda each: -float(seen(each[0])[:, 2].mean())):
            order += 0.001
            _line(axes, line, zorder=order, **style)


def _from_afar(above: NDArray[np.bool_]) -> list[int]:
    """Discs (2k) and what is between them (2k + 1), the farthest first, by which discs are seen from above."""
    parts: list[int] = []
    for k in range(len(above) - 1, -1, -1):
        below = [2 * k - 1] if k else []
        parts = [*below, 2 * k, *parts] if above[k] else [*parts, 2 * k, *below]
    return parts
