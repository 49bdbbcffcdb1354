"""A trial while it goes on, from the end of its growing log."""

import io
from itertools import cycle
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wristctl.plotting.style import BLACK, BLUE, ORANGE, PURPLE, SKY, VERMILLION, WANTED, figure, legend_below, title

# Bytes of a row of the log, at most.
_ROW = 1000
_COLOURS = (ORANGE, VERMILLION, PURPLE, SKY)


def newest_rows(log: Path, seconds: float, period: float) -> pd.DataFrame:
    """The whole rows of the log's last seconds; a row that is being written is left out.

    `period` is that of the log's ticks [s]; only so much of the file's end is read as they may take.
    """
    with log.open("rb") as file:
        header = file.readline()
        begin, end = file.tell(), file.seek(0, io.SEEK_END)
        file.seek(max(begin, end - int(_ROW * seconds / period)))
        rows = file.read() if file.tell() == begin else file.read().partition(b"\n")[2]
    complete_rows = rows[: rows.rfind(b"\n") + 1]
    table = pd.read_csv(io.BytesIO(header + complete_rows))
    newest: pd.DataFrame = table[table["clock"] > table["clock"].max() - seconds]
    return newest


def recent(rows: pd.DataFrame) -> Figure:
    """Angle and reference [deg] and the tensions commanded [N] over the seconds up to the newest row."""
    picture, ((above,), (below,)) = figure(2, height=5.0, sharex=True)
    if len(rows):
        time = rows["clock"] - rows["clock"].iloc[-1]
        of_angle = [("theta", "", BLUE, "angle")]
        if "theta" not in rows:
            of_angle = [("bend", "_ulnar", BLUE, "toward ulnar"), ("bend", "_flexion", ORANGE, "toward flexion")]
        for name, plane, colour, label in of_angle:
            above.plot(time, np.degrees(rows[f"{name}_ref{plane}"]), **WANTED | {"label": "reference"})
            above.plot(time, np.degrees(rows[f"{name}{plane}"]), color=colour, label=label)
            captured, seen = time + rows[f"captured{plane}"] - rows["time"], np.degrees(rows[f"{name}_measured{plane}"])
            above.plot(captured, seen, ".", color=BLACK, markersize=2.0, label="marker")
        pulls = [name for name in rows.columns if name.startswith("tension_")]
        for name, colour in zip(pulls, cycle(_COLOURS), strict=False):
            below.plot(time, rows[name], color=colour, label=f"tendon {name.removeprefix('tension_')}")
        newest = rows.iloc[-1]
        title(above, f"trial {newest['trial'] + 1:.0f}, {newest['time']:.1f} s, board {newest['state']}")
        legend_below(picture, columns=4)
    above.set_ylabel("bending angle [deg]")
    below.set(xlabel="time before now [s]", ylabel="tension [N]")
    return picture
