"""`wristctl runs trend`: what drifts from run to run of one rig."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from wristctl.cli.json_output import print_json
from wristctl.cli.options import RESULTS, Json, Out, run_ids
from wristctl.cli.output import say, write_picture
from wristctl.commands.printed_table import Table, number
from wristctl.errors import UserError
from wristctl.records import require
from wristctl.records.find import entries

if TYPE_CHECKING:
    from wristctl.identification.rig_trend import Reading, Trend
    from wristctl.records import Run

# Exit code where something drifts, and runs whose values are printed.
DRIFT, _SHOWN = 3, 8


def trend(
    refs: Annotated[
        list[str] | None,
        typer.Argument(metavar="[RUN...]", help="Runs of one rig; all hw-run runs where none is named.",
                       autocompletion=run_ids),
    ] = None,
    per: Annotated[Literal["run", "day"], typer.Option("--per", help="What slopes are per: wear or creep.")] = "run",
    figure: Annotated[Path | None, typer.Option("--figure", help="The picture to write.")] = None,
    out: Out = RESULTS,
    as_json: Json = False,
) -> None:  # fmt: skip
    """Say what of a rig drifts over its runs (exit code 3 if something does).

    Reads what hw-run, calibrate-wrist and identify runs have measured, in order of time: stiffness, spool steps per
    radian, slack and friction at homing, the marker's zero. Control errors hide such drifts.
    """
    from wristctl.identification.rig_trend import check_one_rig, trends_of

    names = refs or [entry.id for entry in entries(out) if entry.kind == "hw-run" and entry.state == "ok"]
    if not names:
        raise UserError("no hw-run run that ended ok", str(out), "run trials first: wristctl hw-run")
    runs = list({run.id: run for run in (require(name, None, out) for name in names)}.values())
    check_one_rig(runs)
    readings = sorted(map(_read, runs), key=lambda reading: reading.time)
    trends = trends_of(readings, per == "day")
    drifting = [line for line in trends if line.drifts]
    if as_json:
        print_json(_plain(readings, trends, per))
    else:
        for line in _answer(trends, len(readings), per):
            say(line)
        print(f"\n{_slopes(trends, per).text()}\n\n{_values(readings, trends).text()}")
        if len(readings) > _SHOWN:
            say(f"The last {_SHOWN} of {len(readings)} runs; all of them: --json")
    if figure is not None:
        from wristctl.plotting.trend_figure import trends_over_runs

        axis = "run, in order of time" if per == "run" else "time [days]"
        write_picture(figure, lambda: trends_over_runs(trends, axis))
        if not as_json:
            say(f"Every quantity with its line: {figure}")
    if drifting:
        raise typer.Exit(DRIFT)


def _read(run: Run) -> Reading:
    from wristctl.identification.rig_trend import reading_of

    with run.reading():
        return reading_of(run)


def _answer(trends: Sequence[Trend], runs: int, per: str) -> list[str]:
    from wristctl.identification.rig_trend import quantity_of

    drifting = sorted((line for line in trends if line.drifts), key=lambda line: -abs(line.share))
    if not drifting:
        return [f"Nothing drifts: {len(trends)} quantities of {runs} runs stay within their scatter."]
    lines = [f"{len(drifting)} of {len(trends)} quantities drift over {runs} runs, beyond their scatter:"]
    for line in drifting:
        way = "rises" if line.slope > 0.0 else "falls"
        ends = sorted((abs(line.low), abs(line.high)))
        interval = f"[{number(ends[0])}, {number(ends[1])}]"
        size = f"{number(abs(line.slope))} {interval} {line.unit}"
        lines.append(f"- {line.name} {way} by {size} per {per}, {100.0 * abs(line.share):.1f} % in all")
        lines.append(f"  likely: {quantity_of(line.name).causes}")
    return lines


def _slopes(trends: Sequence[Trend], per: str) -> Table:
    rows = [
        (line.name, line.unit, len(line.values), line.slope, line.low, line.high, "drifts" if line.drifts else "-")
        for line in trends
    ]
    columns = ("quantity", "unit", "runs", f"slope per {per}", "low (95 %)", "high (95 %)", "beyond its scatter")
    return Table("Slopes", columns, rows)


def _values(readings: Sequence[Reading], trends: Sequence[Trend]) -> Table:
    shown = list(readings)[-_SHOWN:]
    rows = [(line.name, line.unit, *(reading.values.get(line.name) for reading in shown)) for line in trends]
    return Table("Values, oldest run first", ("quantity", "unit", *(reading.run[:16] for reading in shown)), rows)


def _plain(readings: Sequence[Reading], trends: Sequence[Trend], per: str) -> dict[str, Any]:
    quantities = [
        {
            "name": line.name, "unit": line.unit, "slope": line.slope, "interval": [line.low, line.high],
            "change": line.change, "drifts": line.drifts,
        }
        for line in trends
    ]  # fmt: skip
    runs = [{"run": reading.run, "time": reading.time, "values": dict(reading.values)} for reading in readings]
    return {"schema": "wristctl.trend/1", "per": per, "quantities": quantities, "runs": runs}
