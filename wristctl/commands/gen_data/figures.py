"""Rest positions of the wrist's tip over the range of the tendons' tension, by statics and not by geometry."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plotting.bend_figure import draw_plane_of_bends
from wristctl.plotting.style import BLACK, BLUE, GREY, figure, legend, title
from wristctl.wrist.kinematics import arcs_backbone
from wristctl.wrist.spatial.held_bends import reach_of_bends
from wristctl.wrist.statics import equilibrium
from wristctl.wrist.tendon_layout import TendonLayout

SEGMENTS = 4
_TENSIONS, _DRAWN = 16, 5


def rest_poses(wrist: WristParameters, tension: Array) -> Array:
    """Segment angles (k, n) [rad] at rest where one side pulls with so much [N per tendon] (k,); nan where it buckles.

    Positive is the + side's tension, negative the - side's; the other side keeps its pretension.
    """
    poses = np.full((len(tension), SEGMENTS), np.nan)
    for index, pull in enumerate(tension.tolist()):
        with suppress(UserError):
            poses[index] = equilibrium(
                wrist, SEGMENTS, tuple(max(side_tension, wrist.pretension) for side_tension in (pull, -pull))
            )
    return poses


def workspace(wrist: WristParameters, planes: int = 1) -> Figure:
    """The wrist at rest under tensions up to its limit, its tip's path, and angle over tension; stiffer and softer.

    In two planes the bends that tendons within their limits hold, stiffer and softer.
    """
    if planes == 2:
        return _held_bends(wrist)
    up = np.linspace(wrist.pretension, wrist.tension_limit, _TENSIONS)
    tension = np.concatenate([-up[::-1], up])
    poses = rest_poses(wrist, tension)
    picture, ((shape, curve),) = figure(1, 2, width=8.5, height=3.8)
    colours = ScalarMappable(Normalize(-wrist.tension_limit, wrist.tension_limit), mpl.colormaps["viridis"])
    tips = []
    for number, pose in enumerate(poses):
        line, _ = arcs_backbone(wrist, pose, np.linspace(0.0, wrist.length, 60))
        tips.append(line[-1])
        if number % (_TENSIONS // _DRAWN) == 0 or number == len(poses) - 1:
            shape.plot(1e3 * line.imag, 1e3 * line.real, color=colours.to_rgba(tension[number]), linewidth=1.4)
    tip = 1e3 * np.array(tips)
    shape.plot(tip.imag, tip.real, color=BLACK, linewidth=2.0)
    shape.set(xlabel="y [mm]", ylabel="x [mm]", aspect="equal")
    reach = np.degrees(poses.sum(axis=1))
    finite, limit = reach[np.isfinite(reach)], f"within {wrist.tension_limit:g} N"
    ends = f"from {finite.min():.3g} to {finite.max():.3g} deg" if len(finite) else "nowhere: it buckles"
    title(shape, f"the tip rests {ends} {limit}")
    for stiffer, look in _stiffer(wrist):
        curve.plot(tension, np.degrees(rest_poses(stiffer, tension).sum(axis=1)), **look)
    curve.set(xlabel="tension of the pulling side's tendons [N]", ylabel="bending angle at rest [deg]")
    legend(curve, loc="best")
    return picture


def _stiffer(wrist: WristParameters) -> Iterator[tuple[WristParameters, dict[str, Any]]]:
    """The wrist with softer springs, as it is believed and with stiffer ones, and the line style of each."""
    for factor, style in ((0.7, "--"), (1.0, "-"), (1.3, ":")):
        label = "as believed" if factor == 1.0 else f"springs x{factor:g}"
        look = {"linestyle": style, "color": BLUE if factor == 1.0 else GREY, "label": label}
        yield wrist.model_copy(update={"stiffness": factor * wrist.stiffness}), look


def _held_bends(wrist: WristParameters) -> Figure:
    layout = TendonLayout.of(wrist)
    picture, ((axes,),) = figure(height=4.6)
    paths = [(reach_of_bends(stiffer, layout), look) for stiffer, look in _stiffer(wrist)]
    limit = f"{wrist.range_deg:g} deg held within {wrist.tension_limit:g} N"
    draw_plane_of_bends(axes, paths, f"bends of up to {limit}, and where each tendon pulls")
    for number, place in enumerate(layout.places, 1):
        if place.radius > 0.0:
            at = 1.08 * wrist.range_deg * np.array([np.cos(place.angle), np.sin(place.angle)])
            axes.text(*at, f"{number}", ha="center", va="center")
    legend(axes, loc="center")
    return picture
