"""`wristctl hw watch`: the trials that go on now, drawn into a picture again and again.

It reads the log of a run of hw-run from a process of its own, so that drawing never delays the control loop.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS
from wristctl.config.errors import UserError
from wristctl.records import Run, open_run

Seconds = Annotated[float, typer.Option("--last", help="Seconds to show.", min=0.5)]
Every = Annotated[float, typer.Option("--every", help="Seconds between two pictures.", min=0.1)]


def watch(
    ref: Annotated[str, typer.Argument(metavar="[RUN]", help="A run of hw-run; by default the newest.")] = "",
    file: Annotated[Path, typer.Option("--file", help="The picture (PNG) to write anew each time.")] = Path("live.png"),
    last: Seconds = 10.0,
    every: Every = 0.5,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Draw angle, reference and tensions of the trials that go on, until their run ends."""
    from wristctl.records.files import replacing
    from wristctl.report.live_figure import newest_rows, recent

    run = open_run(ref, out) if ref else _newest(out)
    if run.kind != "hw-run":
        raise UserError("only runs of hw-run go on in time", str(run.path), "name a run of hw-run")
    period, log = run.config.hw_run.control_period, run.path / "data" / "log.csv"
    going_on, drawn = True, False
    while going_on:
        going_on = run.state == "running"
        if log.is_file() and log.stat().st_size:  # empty until the first tick
            drawn = True
            with replacing(file) as temporary:
                recent(newest_rows(log, last, period)).savefig(temporary, format="png", dpi=100)
        if going_on:
            time.sleep(every)
    if not drawn:
        raise UserError("the run ended before its first trial", str(run.path), f"wristctl runs show {run.id}")
    print(file)


def _newest(results: Path) -> Run:
    from wristctl.records.index import indexed

    found = [each.id for each in indexed(results, renew=False) if each.kind == "hw-run"]
    if not found:
        raise UserError("there is no run of hw-run", str(results), "start one, or say --out DIR")
    return Run(results / found[-1])
