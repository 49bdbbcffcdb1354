"""Figure of a run's residuals over time, each with its limit."""

import math

from matplotlib.figure import Figure

from wristctl.plotting.style import BLUE, GREY, VERMILLION, grid, title, with_unit
from wristctl.trial.residuals import residual
from wristctl.trial.run_limits import Logged, StopTick

_COLUMNS = 3


def residuals_over_time(logged: Logged, stop: StopTick | None, last: float | None = None) -> Figure:
    """Every residual [its unit] over the run's clock [s], with +- its limit; the tick that stopped the run marked.

    With `last` only so many seconds before the stop, or the end, are drawn.
    """
    values = logged.values if stop is None else logged.values.iloc[: stop.row + 1]
    if last is not None:
        values = values[values["clock"] >= float(values["clock"].iloc[-1]) - last]
    clock = values["clock"].to_numpy(float)
    picture, panels = grid(len(logged.limits), _COLUMNS, 1.8, sharex=True)
    for panel, limit in zip(panels, logged.limits, strict=True):
        unit = residual(limit.name, logged.settings.rig is not None).shown
        panel.plot(clock, values[limit.name].to_numpy(float) / unit.size, color=BLUE, linewidth=0.8)
        for level, style in ((limit.limit, "-"), (limit.odd, ":")):
            if math.isfinite(level):
                for side in (1.0, -1.0) if (values[limit.name] < 0.0).any() else (1.0,):
                    panel.axhline(side * level / unit.size, color=VERMILLION, linewidth=0.8, linestyle=style)
        if stop is not None:
            panel.axvline(stop.clock, color=GREY, linewidth=0.8)
        title(panel, with_unit(limit.name, unit.unit) + ("  stopped here" if stop and stop.limit == limit else ""))
    for panel in panels[-_COLUMNS:]:
        panel.set_xlabel("clock [s]")
        panel.tick_params(labelbottom=True)
    return picture
