"""Figures of hysteresis: loops, the dead band, work a cycle, inner loops, and circles."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from wristctl.commands.analyse.hysteresis_tables import by_speed
from wristctl.plotting.bend_figure import draw_plane_of_bends
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    DOTTED,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    columns_within,
    figure,
    legend_below,
    logarithmic,
    title,
)
from wristctl.simulation.hysteresis import DeadBand, HysteresisLoop, with_preslidings, with_sheaths
from wristctl.simulation.hysteresis_circles import HysteresisCircle
from wristctl.simulation.strokes import FrictionCase, Strokes

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
_WORKS = {"friction_work": "-", "damped_work": ":", "raw_work": (0, (6, 2))}
# Panels beside each other, and the width of one [in] that has room for its title in one line.
_MOST, _PANEL = 3, 1.6


def case_text(case: FrictionCase) -> str:
    """A friction in short: coefficient, sheath, presliding."""
    if case.friction == 0.0:
        return "no friction"
    return f"mu {case.friction:g}, {case.sheath:g} rad, {1e6 * case.presliding:g} um"


def _some(cases: Sequence[FrictionCase]) -> list[FrictionCase]:
    """As many of them as have room beside each other, spread over all."""
    chosen = np.unique(np.linspace(0, len(cases) - 1, min(len(cases), _MOST)).round().astype(int))
    return [cases[index] for index in chosen]


def _narrow(cases: Sequence[FrictionCase]) -> bool:
    """Whether panels of these side by side have no room for their titles in one line."""
    return columns_within(len(cases), _PANEL) < len(cases)


def _heading(case: FrictionCase, narrow: bool) -> str:
    return case_text(case).replace(", ", ",\n") if narrow else case_text(case)


def loops(all_strokes: Strokes, driven: Sequence[HysteresisLoop]) -> Figure:
    """The outer loops with up to three sheaths: tension over angle, at the spool by speed and, of the slowest, at the
    wrist; and by how much the angle differs from that without friction, between the roots of the statics."""
    cases = _some(with_sheaths(all_strokes.settings))
    picture, axes = figure(2, len(cases), height=6.2, sharey="row")
    narrow, (place, alike, name) = _narrow(cases), _pulling(all_strokes)
    for (above, below), case in zip(axes.T, cases, strict=True):
        mine = by_speed(driven, case)
        for loop, colour in zip(mine[::-1], _COLOURS[: len(mine)][::-1], strict=False):
            angle, label = np.degrees(loop.bend), f"{loop.case.frequency:g} Hz"
            above.plot(angle, loop.course.spool[:, place] / alike, color=colour, linewidth=1.0, label=label)
            lag = np.degrees(loop.bend - loop.unhindered)
            below.plot(np.degrees(loop.unhindered), lag, color=colour, linewidth=1.0, label=label)
        slow = mine[0]
        at_wrist = slow.course.wrist[:, place] / alike
        above.plot(np.degrees(slow.bend), at_wrist, label="slowest, at the wrist", **DOTTED)
        angle = np.linspace(slow.case.low, slow.case.high, 61)
        for edge in all_strokes.exact([case] * len(angle), angle).T:
            below.plot(np.degrees(angle), np.degrees(edge - angle), label="roots of the statics", **_ROOTS)
        title(above, _heading(case, narrow))
        above.set_xlabel("angle [deg]")
        below.set_xlabel("without friction [deg]".replace(" ", "\n") if narrow else "without friction [deg]")
    axes[0, 0].set_ylabel(f"tension of {name} [N]")
    axes[1, 0].set_ylabel("angle less that [deg]")
    legend_below(picture, 3)
    return picture


def _pulling(all_strokes: Strokes) -> tuple[int, int, str]:
    """Index of the place whose tendons bend the wrist most, number of these, and the name of one."""
    place = int(np.argmax(all_strokes.arms))
    name = "a + tendon" if all_strokes.planes == 1 else f"tendon {place + 1}"
    return place, int(all_strokes.layout.multiplicity[place]), name


_ROOTS = {"color": BLACK, "linewidth": 1.2, "linestyle": (0, (4, 2))}


def dead_band(all_strokes: Strokes, bands: Sequence[DeadBand]) -> Figure:
    """Width of the dead band over the angle: roots of the statics, and where ramps came to rest."""
    picture, ((axes,),) = figure(height=3.6)
    low, high = np.radians(all_strokes.settings.ranges_deg[0])
    angle = np.linspace(low, high, 61)
    cases = list(dict.fromkeys((band.tendons.friction, band.tendons.sheath) for band in bands))
    for pair, colour in zip(cases, _COLOURS, strict=False):
        mine = [band for band in bands if (band.tendons.friction, band.tendons.sheath) == pair]
        edges = all_strokes.exact([mine[0].tendons] * len(angle), angle)
        name = f"mu {pair[0]:g}, {pair[1]:g} rad" if pair[0] else "no friction"
        axes.plot(np.degrees(angle), np.degrees(edges[:, 1] - edges[:, 0]), color=colour, label=f"{name}, statics")
        for slid, mark, label in ((True, "o", "came to rest"), (False, "x", "came to rest, but slid too little")):
            points = [(band.unhindered, band.width) for band in mine if band.slid == slid]
            if points:
                style = {"color": colour, "markersize": 5.0, "markerfacecolor": "white", "linestyle": ""}
                axes.plot(*np.degrees(points).T, mark, label=label, **style)
    held = "pulls" if all_strokes.winch else "spools"
    axes.set(xlabel="angle without friction [deg]", ylabel=f"dead band on held {held} [deg]")
    axes.set_ylim(bottom=0.0)
    legend_below(picture, 3)
    return picture


def work(all_strokes: Strokes, driven: Sequence[HysteresisLoop]) -> Figure:
    """Work of a cycle over how often it is gone through: what friction takes, what damping takes, and the raw loop."""
    picture, ((axes,),) = figure(height=3.8)
    for case, colour in zip(_some(with_sheaths(all_strokes.settings)), _COLOURS, strict=False):
        mine = by_speed(driven, case)
        speed = [loop.case.frequency for loop in mine]
        for name, dashes in _WORKS.items():
            values = 1e3 * np.array([getattr(loop, name) for loop in mine])
            label = case_text(case) if name == "friction_work" else None
            axes.plot(speed, values.clip(1e-9), ".", color=colour, linestyle=dashes, linewidth=1.2, label=label)
    for name, dashes in zip(("friction", "damping", "raw loop"), _WORKS.values(), strict=True):
        axes.plot([], [], color=GREY, linestyle=dashes, label=name)
    logarithmic(axes.xaxis)
    logarithmic(axes.yaxis)
    axes.set(xlabel="cycles per second [Hz]", ylabel="work a cycle [mJ]")
    legend_below(picture, 3)
    return picture


def minor_loops(all_strokes: Strokes, driven: Sequence[HysteresisLoop]) -> Figure:
    """The slowest loops of all ranges, of up to three preslidings (of sheaths where there is one): tension, angle."""
    slowest = min(loop.case.frequency for loop in driven)
    slow = [loop for loop in driven if loop.case.frequency == slowest]
    several = len(all_strokes.settings.preslidings) > 1 and all_strokes.settings.frictions[0] > 0.0
    cases = _some(with_preslidings(all_strokes.settings) if several else with_sheaths(all_strokes.settings))
    picture, axes = figure(1, len(cases), height=3.4, sharey=True)
    place, alike, name = _pulling(all_strokes)
    for panel, case in zip(axes[0], cases, strict=True):
        for loop, colour in zip((one for one in slow if one.case.tendons == case), _COLOURS, strict=False):
            label = f"{np.degrees(loop.case.low):g} to {np.degrees(loop.case.high):g} deg"
            tension = loop.course.spool[:, place] / alike
            panel.plot(np.degrees(loop.bend), tension, color=colour, linewidth=1.2, label=label)
        title(panel, _heading(case, _narrow(cases)))
        panel.set_xlabel("angle [deg]")
    axes[0, 0].set_ylabel(f"tension of {name}, {slowest:g} Hz [N]")
    legend_below(picture, 4)
    return picture


def circles(around: Sequence[HysteresisCircle]) -> Figure:
    """The slowest largest circle of up to three sheaths: both bends, and by how much they differ from those without
    friction, over the turn."""
    first = max(around, key=lambda each: (each.case.radius, -each.case.frequency)).case
    mine = [each for each in around if (each.case.radius, each.case.frequency) == (first.radius, first.frequency)]
    picture, ((left, right),) = figure(1, 2, height=3.8)
    paths = [(mine[0].unhindered, {"label": "without friction", **_ROOTS})]
    cases = _some([each.case.tendons for each in mine])
    for each, colour in zip((one for one in mine if one.case.tendons in cases), _COLOURS, strict=False):
        paths.append((each.course.bends, {"color": colour, "linewidth": 1.2, "label": case_text(each.case.tendons)}))
        for plane, dashes in ((0, "-"), (1, ":")):
            apart = np.degrees(each.course.bends[:, plane] - each.unhindered[:, plane])
            right.plot(each.case.frequency * each.time, apart, color=colour, linewidth=1.2, linestyle=dashes)
    for name, dashes in (("toward ulnar", "-"), ("toward flexion", ":")):
        right.plot([], [], color=GREY, linestyle=dashes, label=name)
    draw_plane_of_bends(left, paths)
    right.set(xlabel="turn", ylabel="bend less that without friction [deg]")
    legend_below(picture, 3)
    return picture
