"""Drawings of a rig's parts at true scale: spool, tendon clamp, wrist disc, marker flags."""

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from wristctl.commands.calibrate.print_sheet import draw_ruler, mm_page, write_lines
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plotting.style import BLACK, BLUE, GREY, LIGHT, VERMILLION
from wristctl.trial.spool_part import FLANGE, HUB, PLAY, SpoolPart
from wristctl.vision.detector import print_of
from wristctl.wrist.tendon_layout import TendonLayout

Paper = Literal["a4", "letter"]

# Millimetres: length of the bar that checks a print, and holes for M3.
BAR, _M3 = 50.0, 3.2
_THIN: dict[str, Any] = {"color": BLUE, "linewidth": 0.35}
_EDGE: dict[str, Any] = {"edgecolor": BLACK, "linewidth": 0.6}
# Clamp: friction of plastic on a tendon (assumed), pulls that it is to hold over the largest, M3's K in T = K F d.
_FRICTION, _RESERVE, _NUT_FACTOR = 0.1, 2.0, 0.2


def part_pages(settings: RigSettings, wrist: WristParameters, spool: SpoolPart, paper: Paper) -> Mapping[str, Figure]:
    """A page for each part, by name. Raises UserError where a part does not fit the paper."""
    return {
        "spool": _spool_page(spool, paper),
        "clamp": _clamp_page(settings, wrist, spool.tendon, paper),
        "disc": _disc_page(wrist, spool.tendon, paper),
        "flag": _flag_page(settings, paper),
    }


def _spool_page(spool: SpoolPart, paper: Paper) -> Figure:
    size = max(spool.flange, spool.length)
    enlarged = next((scale for scale in (4, 3, 2, 1) if scale * size <= _ROOM), None)
    if enlarged is None:
        raise UserError(f"a spool of {spool.flange:.0f} mm does not fit the page", "actuator.pulley_radius")
    page, axes = _begun(paper, f"Spool, 4 pieces: {spool.pulley_radius:g} mm from the axis to the tendon's middle")
    _section(axes, spool, 60.0, 32.0 + 0.5 * spool.flange, 1.0)
    for name, diameter in (("front-flange", spool.flange), ("front-bore", spool.bore)):
        axes.add_patch(Circle((35.0, 32.0 + 0.5 * spool.flange), 0.5 * diameter, fill=False, gid=name, **_EDGE))
    _label(axes, 35.0, 29.0, "1 : 1")
    left, middle = 62.0, 32.0 + spool.flange + 24.0 + 0.5 * enlarged * spool.flange
    _section(axes, spool, left, middle, float(enlarged))
    _label(axes, left + 0.5 * enlarged * spool.length, middle - 0.5 * enlarged * spool.flange - 19.0, f"{enlarged} : 1")
    _dimension_spool(axes, spool, left, middle, float(enlarged))
    below = middle + 0.5 * enlarged * spool.flange + 24.0
    screw = 0.5 * HUB
    notes = (
        f"Tendon of {spool.tendon:g} mm in one layer: {spool.turns:.1f} turns at most, two of which always stay on.",
        f"Bore for a shaft of {spool.bore - PLAY:g} mm: measure yours. The groove's floor is half a tendon below r.",
        f"To drill: M3 for a set screw into the hub, {screw:g} mm from its end; {spool.tendon + 0.5:g} mm",
        "through a flange at the groove's floor, for the tendon's end. Round the edges that it touches.",
    )
    return _ended(page, axes, below, notes)


def _section(axes: Axes, spool: SpoolPart, left: float, middle: float, scale: float) -> None:
    """Section along the axis, which lies across the page at `middle`."""
    for side in (1.0, -1.0):
        corners = np.stack([left + scale * spool.profile[:, 1], middle - side * scale * spool.profile[:, 0]], axis=1)
        name = f"section-{scale:g}-{'upper' if side > 0 else 'lower'}"
        axes.add_patch(Polygon(corners, facecolor=LIGHT, gid=name, **_EDGE))
    ends = left - 4.0, left + scale * spool.length + 4.0
    axes.plot(ends, (middle, middle), color=GREY, linewidth=0.35, linestyle=(0, (12, 3, 2, 3)))
    turn = scale * spool.tendon
    first = left + scale * (HUB + FLANGE) + 0.5 * turn
    for number in range(math.ceil(spool.turns)):
        for side in (1.0, -1.0):
            place = first + 1.2 * number * turn, middle - side * scale * spool.pulley_radius
            axes.add_patch(Circle(place, 0.5 * turn, fill=False, edgecolor=VERMILLION, linewidth=0.35))


def _dimension_spool(axes: Axes, spool: SpoolPart, left: float, middle: float, scale: float) -> None:
    right, groove = left + scale * spool.length, left + scale * (HUB + FLANGE)
    top = middle - 0.5 * scale * spool.flange
    _along(axes, left, left + scale * HUB, top - 6.0, HUB)
    _along(axes, groove, groove + scale * spool.width, top - 6.0, spool.width)
    _along(axes, left, right, top - 13.0, spool.length)
    for number, (name, diameter) in enumerate((("core", spool.core), ("flange", spool.flange))):
        _upright(axes, right + 8.0 + 12.0 * number, middle, 0.5 * scale * diameter, f"{name} \u00d8{diameter:.4g}")
    for number, (name, diameter) in enumerate((("bore", spool.bore), ("hub", spool.hub))):
        _upright(axes, left - 8.0 - 12.0 * number, middle, 0.5 * scale * diameter, f"{name} \u00d8{diameter:.4g}")
    end = middle + scale * spool.pulley_radius
    axes.plot((groove + 0.5 * scale * spool.width,) * 2, (middle, end), **_THIN)
    at, above = groove + 0.5 * scale * spool.width - 0.6, middle + 0.12 * scale * spool.bore
    radius = f"r {spool.pulley_radius:g}"
    axes.text(at, above, radius, rotation=90, ha="right", va="center", fontsize=7.0, color=BLUE)


def _clamp_page(settings: RigSettings, wrist: WristParameters, tendon: float, paper: Paper) -> Figure:
    pull = settings.within(wrist).safety.tension
    screw = _NUT_FACTOR * 3e-3 * 0.5 * _RESERVE * pull / (2.0 * _FRICTION)
    page, axes = _begun(paper, f"Tendon clamp, 4 pieces of two plates, 3 mm thick: for {pull:g} N")
    for number, (name, at) in enumerate((("plate with groove", 30.0), ("plate", 80.0))):
        axes.add_patch(Rectangle((at, 35.0), 24.0, 12.0, facecolor=LIGHT, gid=f"plate-{number}", **_EDGE))
        for hole in (5.0, 19.0):
            axes.add_patch(
                Circle((at + hole, 41.0), 0.5 * _M3, facecolor="white", gid=f"hole-{number}-{hole:g}", **_EDGE)
            )
        _label(axes, at + 12.0, 32.0, name)
    for side in (-0.5, 0.5):
        axes.plot((42.0 + side * tendon,) * 2, (35.0, 47.0), color=BLACK, linewidth=0.4)
    _along(axes, 35.0, 49.0, 53.0, 14.0)
    _along(axes, 30.0, 54.0, 59.0, 24.0)
    _upright(axes, 112.0, 41.0, 6.0, "12", 104.0)
    notes = (
        f"Groove {tendon:g} mm wide and {0.5 * tendon:g} mm deep, across one plate; holes {_M3:g} mm for M3 with nuts.",
        f"Two screws of {screw:.2f} N m each hold {_RESERVE:g} times {pull:g} N by friction of {_FRICTION:g}",
        f"(assumed; screws by T = 0.2 F d). Pull it with a spring scale to {pull:g} N before use, and knot the end.",
    )
    return _ended(page, axes, 70.0, notes)


def _disc_page(wrist: WristParameters, tendon: float, paper: Paper) -> Figure:
    places = 1e3 * TendonLayout.of(wrist).cross_section
    outer = float(np.hypot(*places.T).max()) + 4.0
    if 2.0 * outer > _ROOM:
        raise UserError(f"a disc of {2.0 * outer:.0f} mm does not fit the page", "wrist.tendon_radius")
    page, axes = _begun(paper, f"Wrist disc, {wrist.discs} pieces: holes for the tendons")
    x, y = 100.0, 42.0 + outer
    axes.add_patch(Circle((x, y), outer, facecolor=LIGHT, gid="disc", **_EDGE))
    for name, (across, along) in (("ulnar (+)", (1.0, 0.0)), ("flexion (+)", (0.0, -1.0))):
        ends = [x - outer * across, x + (outer + 4.0) * across], [y - outer * along, y + (outer + 4.0) * along]
        axes.plot(*ends, color=GREY, linewidth=0.35, linestyle=(0, (12, 3, 2, 3)))
        axes.text(x + (outer + 5.0) * across, y + (outer + 6.0) * along, name, fontsize=7.0, va="center",
                  ha="left" if across else "center")  # fmt: skip
    for number, (ulnar, flexion) in enumerate(places):
        hole = Circle((x + ulnar, y - flexion), 0.5 * tendon + 0.25, facecolor="white", gid=f"tendon-{number}", **_EDGE)
        axes.add_patch(hole)
        text = f"({ulnar:+.2f}, {flexion:+.2f})"
        axes.text(x + 0.72 * ulnar, y - 0.72 * flexion, text, fontsize=6.5, ha="center", va="center", color=BLUE)
    apart = 1e3 * wrist.length / (wrist.discs - 1)
    notes = (
        f"Holes of {tendon + 0.5:g} mm, rounded on both sides; their places [mm] are toward ulnar, toward flexion.",
        f"The outer edge is a proposal. Discs stand {apart:g} mm apart, {1e3 * wrist.length:g} mm from first to last.",
        f"Springs between them: the whole wrist bends by 1 rad at {wrist.stiffness:g} N m.",
    )
    return _ended(page, axes, y + outer + 12.0, notes)


def _flag_page(settings: RigSettings, paper: Paper) -> Figure:
    cells = len(print_of(0))
    side = 1e3 * settings.markers.side
    flag, foot = side * cells / (cells - 2), 15.0
    if flag + foot > _ROOM:
        raise UserError(f"a flag of {flag:.0f} mm does not fit the page", "markers.side")
    page, axes = _begun(paper, "Marker flag, 2 pieces, 2 mm thick: flat, stiff, facing the camera")
    left, top = 60.0, 42.0
    axes.add_patch(Rectangle((left, top), flag, flag + foot, facecolor=LIGHT, gid="flag", **_EDGE))
    rim = 0.5 * (flag - side)
    axes.add_patch(Rectangle((left + rim, top + rim), side, side, facecolor="white", gid="marker", **_EDGE))
    _label(axes, left + 0.5 * flag, top + 0.5 * flag, "marker")
    for hole in (0.25, 0.75):
        place = left + hole * flag, top + flag + 0.5 * foot
        axes.add_patch(Circle(place, 0.5 * _M3, facecolor="white", gid=f"hole-{hole:g}", **_EDGE))
    _along(axes, left, left + flag, top - 6.0, flag)
    _along(axes, left + rim, left + rim + side, top - 12.0, side)
    _along(axes, left + 0.25 * flag, left + 0.75 * flag, top + flag + foot + 6.0, 0.5 * flag)
    _upright(axes, left + flag + 8.0, top + 0.5 * flag, 0.5 * flag, f"{flag:.4g}", left + flag)
    _upright(
        axes, left + flag + 22.0, top + 0.5 * (flag + foot), 0.5 * (flag + foot), f"{flag + foot:.4g}", left + flag
    )
    base = 1e3 * settings.markers.base_at
    notes = (
        "The foot is a proposal: screw it on so that both markers stand in one plane, parallel to the bending plane,",
        f"'hand' toward the hand. The base's marker has its middle {abs(base):g} mm "
        f"{'below' if base < 0.0 else 'above'} the first disc (markers.base_at).",
        "Print of the markers: markers.svg.",
    )
    return _ended(page, axes, top + flag + foot + 16.0, notes)


# Millimetres of a page's width that a view may take.
_ROOM = 100.0


def _begun(paper: Paper, heading: str) -> tuple[Figure, Axes]:
    page, axes = mm_page(paper)
    axes.text(15.0, 16.0, heading, fontsize=11.0, va="center", weight="bold")
    axes.text(15.0, 22.0, "Dimensions in mm.", fontsize=7.5, va="center", color=GREY)
    return page, axes


def _ended(page: Figure, axes: Axes, below: float, notes: tuple[str, ...]) -> Figure:
    write_lines(axes, 15.0, below, notes)
    draw_ruler(axes, 15.0, below + 4.0 * len(notes) + 4.0, BAR)
    text = f"Print at 100 %: this bar must measure {BAR:g} mm."
    axes.text(15.0 + BAR + 5.0, below + 4.0 * len(notes) + 6.0, text, fontsize=7.5, va="center")
    return page


def _label(axes: Axes, x: float, y: float, text: str) -> None:
    axes.text(x, y, text, fontsize=7.5, ha="center", va="center")


def _along(axes: Axes, start: float, end: float, y: float, value: float) -> None:
    """A dimension across the page."""
    axes.annotate("", (start, y), (end, y), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, **_LINE})
    axes.text(0.5 * (start + end), y - 1.6, f"{value:.4g}", fontsize=7.0, ha="center", va="center", color=BLUE)


def _upright(axes: Axes, x: float, middle: float, half: float, text: str, beside: float | None = None) -> None:
    """A dimension along the page, of twice `half` on paper, with lines to what it measures where `beside` is."""
    ends = middle - half, middle + half
    axes.annotate("", (x, ends[0]), (x, ends[1]), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, **_LINE})
    axes.text(x - 1.6, middle, text, fontsize=7.0, ha="center", va="center", color=BLUE, rotation=90)
    if beside is not None:
        for end in ends:
            axes.plot((beside, x), (end, end), **_THIN)


_LINE: dict[str, Any] = {"color": BLUE, "linewidth": 0.35, "mutation_scale": 5.0}
