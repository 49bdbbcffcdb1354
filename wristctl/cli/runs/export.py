"""`wristctl runs export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run


def export(
    ref: Ref,
    to: Annotated[Literal["mcap", "mat"], typer.Option("--to", help="The format.")],
    file: Annotated[
        Path | None, typer.Option("--file", help="Where to write it; by default the run's id, in this folder.")
    ] = None,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Write a run's tables, arrays and videos for other programs, with their units.

    mat: one file for MATLAB and Octave. mcap: a log of what went on in time, videos too, for Foxglove, PlotJuggler or
    Rerun. A table for pandas is the CSV file of the run, or `wristctl.open_run(RUN).data(NAME)` in Python.
    """
    from wristctl.studies.run_export import export_run

    say(export_run(open_run(ref, out), to, file))
