"""Figure of what runs of one rig have measured, with the line through each quantity."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from wristctl.identification.rig_trend import Trend
from wristctl.plotting.style import BLUE, GREY, VERMILLION, grid, title, with_unit

_COLUMNS = 2


def trends_over_runs(trends: Sequence[Trend], axis: str) -> Figure:
    """Values of every quantity over `axis`, which has its unit, with its line, red where it drifts."""
    picture, panels = grid(len(trends), _COLUMNS, 1.8)
    for panel, trend in zip(panels, trends, strict=True):
        line = trend.values.mean() + trend.slope * (trend.places - trend.places.mean())
        panel.plot(trend.places, trend.values, "o", color=BLUE, markersize=3.0)
        panel.plot(trend.places, line, color=VERMILLION if trend.drifts else GREY, linewidth=1.0)
        title(panel, with_unit(trend.name, trend.unit) + ("  drifts" if trend.drifts else ""))
        panel.set_xlabel(axis)
    return picture
