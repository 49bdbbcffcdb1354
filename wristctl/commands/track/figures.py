"""Figures of a tracked recording: the angle over time, and some of its frames."""

from collections.abc import Sequence
from itertools import zip_longest

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREY,
    INDIGO,
    OLIVE,
    ORANGE,
    PURPLE,
    ROSE,
    SKY,
    VERMILLION,
    WINE,
    figure,
    legend,
    undress,
)
from wristctl.vision.marker import Sighting, SightingVerdict

# Pixels across a frame in a figure.
_WIDE = 480
_REFUSAL_COLOURS = VERMILLION, ORANGE, INDIGO, PURPLE, SKY, GREY, WINE, BLACK, OLIVE, ROSE
_COLOURS = dict(zip(list(SightingVerdict)[1:], _REFUSAL_COLOURS, strict=True))


def angle(sightings: Sequence[Sighting], bends: Array | None = None) -> Figure:
    """Bending angle [deg], or the bends of both planes [rad], over time [s]; below the frames without, by why."""
    refused = [verdict for verdict in _COLOURS if any(sighting.verdict is verdict for sighting in sightings)]
    below_it = 0.2 * len(refused)
    fig, axes = figure(2, 1, height=3.6 + below_it, sharex=True, height_ratios=(3.2, 0.2 + below_it))
    above, below = axes[:, 0]
    time = np.array([sighting.time for sighting in sightings])
    style = {"linewidth": 1.0, "marker": ".", "markersize": 2.5}
    if bends is None:
        theta = np.degrees([sighting.theta for sighting in sightings])
        above.plot(time, theta, color=BLUE, **style)
        above.set_ylabel("bending angle [deg]")
    else:
        planes = np.array([sighting.plane for sighting in sightings])
        for plane, (name, colour) in enumerate((("ulnar", BLUE), ("flexion", ORANGE))):
            own = planes == plane
            above.plot(time[own], np.degrees(bends[own]), color=colour, label=f"toward {name}", **style)
        above.set_ylabel("bend [deg]")
        legend(above)
    for row, verdict in enumerate(refused):
        times = [sighting.time for sighting in sightings if sighting.verdict is verdict]
        below.plot(times, np.full(len(times), row), linestyle="", marker="|", markersize=7.0, color=_COLOURS[verdict])
    below.set_yticks(range(len(refused)), [str(refusal) for refusal in refused])
    below.set(xlabel="time [s]", ylim=(len(refused) - 0.4, -0.6))
    below.grid(False, axis="y")
    if not refused:
        below.set_yticks([])
        below.text(0.0, 0.5, "every frame was used", transform=below.transAxes, va="center", fontsize=9.0, color=GREY)
    return fig


def frames(pictures: Sequence[NDArray[np.uint8]]) -> Figure:
    """Annotated pictures (height, width, 3, blue first), three in a row."""
    cols = min(3, len(pictures))
    rows = -(-len(pictures) // cols)
    tall = pictures[0].shape[0] / pictures[0].shape[1]
    fig, _ = figure(rows, cols, width=9.0, height=rows * 9.0 / cols * tall)
    for place, picture in zip_longest(fig.axes, pictures):
        undress(place)
        place.set(xticks=[], yticks=[])
        if picture is not None:
            smaller = _WIDE / picture.shape[1]
            shown = cv2.resize(picture, None, fx=smaller, fy=smaller, interpolation=cv2.INTER_AREA)
            place.imshow(shown[..., ::-1])
    return fig
