"""Drawings of the wrist bending in its plane: discs, springs, backbone, tendons and hand.

Drawn as the wrist stands in the experiment: x, along the base's tangent, goes up, and +y to the right; in mm.
"""

import math
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.wrist import WristParameters
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    VERMILLION,
    columns_within,
    figure,
    legend_below,
    title,
    undress,
)
from wristctl.simulation.trajectory import Trajectory
from wristctl.vision.scene_parts import coil, hand
from wristctl.wrist.directions import DIRECTIONS, TENDONS, Direction
from wristctl.wrist.kinematics import Planar, discs, offset_points

# Radius of the drawn discs over that of the circle of tendons.
RIM = 1.25


def draw_wrist(axes: Axes, q: Array, wrist: WristParameters, pulling: int = 0, edge_on: bool = False) -> None:
    """Draw the wrist as arcs of angles (q,); `pulling` is the sign of the side whose tendons pull."""
    backbone = PLANTS["pcc"].backbone
    frames = discs(backbone, q, wrist)
    c, centres, normals = wrist.tendon_offset, *frames
    for outline in hand(wrist.hand_offset, edge_on) if wrist.hand_offset > 0.0 else []:
        _fill(axes, centres[-1] + normals[-1] * outline, facecolor=LIGHT)
    for offset in (-c, 0.0, c):
        ends = offset_points(frames, offset)
        for start, end in pairwise(ends):
            _line(axes, coil(complex(start), complex(end), 0.15 * c), color=GREY, linewidth=0.5)
    line, _ = backbone(wrist, q, np.linspace(0.0, wrist.length, 60))
    _line(axes, line, color=BLUE, linewidth=1.2, linestyle="--")
    for sign in (1, -1):
        style = {"color": VERMILLION, "linewidth": 2.2} if sign == pulling else {"color": BLACK, "linewidth": 1.2}
        _line(axes, offset_points(frames, sign * c), **style)
    half, thick = RIM * wrist.tendon_radius, 0.02 * wrist.length
    plate: Planar = np.array([-thick - 1j * half, thick - 1j * half, thick + 1j * half, -thick + 1j * half])
    for centre, normal in zip(*frames, strict=True):
        _fill(axes, centre + normal * plate, facecolor=BLACK, zorder=3.0)
    _fill(axes, 2.0 * plate - 3.0 * thick, facecolor="w", edgecolor=GREY, hatch="////", linewidth=0.0)
    _frame(axes)


def directions(wrist: WristParameters) -> Figure:
    """The wrist bent by 30 deg in the four directions, with the tendons that pull; cross-sections below."""
    picture, axes = figure(2, 4, width=9.0, height=5.6, height_ratios=(2.2, 1.0), sharey="row")
    reach = 1e3 * (wrist.length + 2.0 * wrist.hand_offset)
    between = " " if columns_within(4, 1.2) == 4 else "\n"
    for direction, above, below in zip(DIRECTIONS.values(), *axes, strict=True):
        theta, (first, second) = math.radians(30.0 * direction.sign), direction.tendons
        draw_wrist(above, np.array([theta]), wrist, direction.sign, direction.plane == "flexion")
        title(above, f"{direction.name}, {math.degrees(theta):+.3g} deg\ntendons {first} and {second} pull")
        above.set_xlim(sorted((-0.22 * reach * direction.sign, 0.58 * reach * direction.sign)))
        above.set(ylim=(-0.1 * reach, 1.0 * reach), xlabel=f"y [mm],{between}+ {direction.plane}")
        _draw_cross_section(below, wrist, direction)
        below.set_xlabel(f"X [mm],{between}+ ulnar")
    axes[0, 0].set_ylabel("x [mm]")
    axes[1, 0].set_ylabel("Y [mm], + flexion")
    return picture


def stroboscope(trajectory: Trajectory, wrist: WristParameters, count: int = 7, plant: str = "pcc") -> Figure:
    """A move as the wrist at `count` instants, evenly spaced until it rests within 2 % of it, and its tip's path."""
    picture, ((axes,),) = figure(width=5.0, height=4.2)
    finite = np.isfinite(trajectory.theta)
    time, theta = trajectory.time[finite], trajectory.theta[finite]
    moving = np.flatnonzero(np.abs(theta - theta[-1]) > 0.02 * np.abs(theta).max())
    instants = np.linspace(0, moving[-1] if len(moving) else len(time) - 1, count).round().astype(int)
    colours = ScalarMappable(Normalize(0.0, float(time[instants[-1]])), mpl.colormaps["viridis_r"])
    rim, backbone = RIM * wrist.tendon_radius, PLANTS[plant].backbone
    for sample in instants:
        colour, bent = colours.to_rgba(time[sample]), trajectory.segment_theta[sample]
        line, _ = backbone(wrist, bent, np.linspace(0.0, wrist.length, 60))
        _line(axes, line, color=colour, linewidth=1.2)
        frames = discs(backbone, bent, wrist)
        for plate in zip(offset_points(frames, -rim), offset_points(frames, rim), strict=True):
            _line(axes, np.array(plate), color=colour, linewidth=2.5)
    tip, desired = (path[:, 0] + 1j * path[:, 1] for path in (trajectory.tip, trajectory.tip_desired))
    end: Any = {"markevery": [-1], "markersize": 5.0}
    _line(axes, tip, color=BLACK, linewidth=1.5, marker="o", label="tip", **end)
    _line(axes, desired, color=VERMILLION, linewidth=2.5, linestyle=":", marker="x", label="desired tip", **end)
    _frame(axes)
    axes.set(xlabel="y [mm]", ylabel="x [mm]")
    title(axes, trajectory.label)
    legend_below(picture)
    picture.colorbar(colours, ax=axes, label="time [s]", ticks=time[instants], format="%.2f")
    return picture


def _draw_cross_section(axes: Axes, wrist: WristParameters, direction: Direction) -> None:
    """Disc and tendons seen along the straight wrist, with the direction's arrow."""
    rim, c = 1e3 * RIM * wrist.tendon_radius, 1e3 * wrist.tendon_offset
    axes.add_patch(Circle((0.0, 0.0), rim, facecolor="w", edgecolor=BLACK))
    for number, (across, up) in TENDONS.items():
        pulls = number in direction.tendons
        colours = {"facecolor": VERMILLION if pulls else "w", "edgecolor": VERMILLION if pulls else GREY}
        axes.add_patch(Circle((c * across, c * up), 0.2 * rim, **colours))
        place: Any = {"ha": "center", "va": "center_baseline", "fontsize": 9.0}
        axes.text(c * across, c * up, str(number), color="w" if pulls else BLACK, **place)
    near, far = direction.sign * 1.1 * rim, direction.sign * 1.65 * rim
    ends = ((far, 0.0), (near, 0.0)) if direction.plane == "ulnar" else ((0.0, far), (0.0, near))
    axes.annotate("", *ends, arrowprops={"arrowstyle": "-|>", "color": VERMILLION, "linewidth": 1.5})
    axes.set(xlim=(-1.7 * rim, 1.7 * rim), ylim=(-1.7 * rim, 1.7 * rim))
    _frame(axes)


def _line(axes: Axes, points: Planar, **style: Any) -> None:
    axes.plot(1e3 * points.imag, 1e3 * points.real, **style)


def _fill(axes: Axes, outline: Planar, **style: Any) -> None:
    axes.add_patch(Polygon(1e3 * np.column_stack([outline.imag, outline.real]), **style))


def _frame(axes: Axes) -> None:
    """Equal scales and no frame, but ticks in mm."""
    undress(axes)
    axes.set_aspect("equal")
