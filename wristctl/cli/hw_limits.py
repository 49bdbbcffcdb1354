"""`wristctl hw limits --from RUN`: how near a run came to each limit, and limits that its rig would bear."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from wristctl.cli.json_output import print_json
from wristctl.cli.output import write_picture
from wristctl.commands.printed_table import Table
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.records import Run
    from wristctl.trial.run_limits import Logged, Nearness, StopTick

_WIDTH = 100


def tell_limits(names: Sequence[str], out: Path, figure: Path | None, as_json: bool) -> None:
    """Print what runs show of their limits, by their files alone; the picture is of the last one."""
    from wristctl.records import open_run
    from wristctl.trial.run_limits import nearness, stop_of

    runs = [_logged(open_run(name, out)) for name in names]
    for name, run in zip(names, runs, strict=True):
        if run.limits != runs[0].limits:
            problem = f"its limits are not those of {names[0]}"
            raise UserError(problem, name, "runs with the same safety and control_period")
    stops = [stop_of(run) for run in runs]
    lines = nearness(runs, stops)
    if as_json:
        print_json(_plain(names, stops, lines))
    else:
        _tell(names, runs, stops, lines)
    if figure is not None:
        from wristctl.plotting.residual_figure import residuals_over_time

        write_picture(figure, lambda: residuals_over_time(runs[-1], stops[-1]))
        if not as_json:
            print(f"\nEvery residual with its limit: {figure}")


def _tell(
    names: Sequence[str], runs: Sequence[Logged], stops: Sequence[StopTick | None], lines: Sequence[Nearness]
) -> None:
    for name, stop in zip(names, stops, strict=True):
        if stop is not None:
            print(_stopped(name, stop, runs[0].settings.rig is not None))
    if not any(stops):
        print(_went_through(runs, lines[0]))
    print("\n" + _table(lines).within(_WIDTH).text())
    _tell_proposals(lines, all(stop is not None for stop in stops))


def _logged(run: Run) -> Logged:
    from wristctl.trial.residuals import FILE, load
    from wristctl.trial.run_limits import Logged

    if not run.has("data/residuals.csv") or not run.has(FILE):
        raise UserError("a run without residuals and limits", str(run.path), "an hw-run run")
    with run.reading():
        values, limits = run.data("residuals"), load(run.file(FILE))
    return Logged(values, limits, run.config.hw_run, run.config.wrist)


def _stopped(name: str, stop: StopTick, own: bool) -> str:
    from wristctl.trial.residuals import stopped_by

    where = f"in trial {stop.trial}" if stop.trial >= 0 else "between trials"
    return f"{name} was stopped {where}, {stop.clock:.3f} s on its clock: {stopped_by(stop.limit, stop.value, own)}."


def _went_through(runs: Sequence[Logged], nearest: Nearness) -> str:
    trials = sum(int((run.values["trial"].unique() >= 0).sum()) for run in runs)
    return (
        f"No limit stopped {trials} trial{'s' * (trials != 1)}; {nearest.limit.name} came nearest, by {_of(nearest)}."
    )


def _of(line: Nearness) -> str:
    from wristctl.trial.run_limits import shown

    name = line.limit.name
    return f"{shown(name, line.largest)} of {shown(name, line.limit.limit)}"


def _table(lines: Sequence[Nearness]) -> Table:
    from wristctl.trial.run_limits import shown

    rows = []
    for line in lines:
        name, trial = line.limit.name, "between" if line.trial < 0 else str(line.trial)
        sizes = (shown(name, line.largest), shown(name, line.limit.limit))
        rows.append((name, *sizes, round(100.0 * line.share), trial, round(line.clock, 2), line.setting or "-"))
    columns = ("residual", "largest", "limit", "of limit [%]", "trial", "clock [s]", "proposed")
    return Table("", columns, rows)


def _tell_proposals(lines: Sequence[Nearness], stopped: bool) -> None:
    from wristctl.trial.run_limits import LEAST, MARGIN

    settings = [line.setting for line in lines if line.setting]
    if stopped:
        typer.echo("\nA run that was stopped proposes no limits; those that went through do.")
    elif settings:
        typer.echo(
            f"\nProposed: {MARGIN:g} times the largest, and {LEAST:g} of the present limit at least. Take many "
            "trials: one run\nshows a part of what a sound rig does, and a fault below its limit goes unseen."
        )


def _plain(names: Sequence[str], stops: Sequence[StopTick | None], lines: Sequence[Nearness]) -> dict[str, Any]:
    stopped = [
        None if stop is None else {"trial": stop.trial, "clock": stop.clock, "row": stop.row, "by": stop.limit.name}
        for stop in stops
    ]
    residuals = [
        {
            "name": line.limit.name, "unit": line.limit.unit, "largest": line.largest, "limit": line.limit.limit,
            "run": names[line.run], "trial": line.trial, "clock": line.clock, "proposed": line.proposed,
            "setting": line.setting or None,
        }
        for line in lines
        if math.isfinite(line.limit.limit)
    ]  # fmt: skip
    return {"schema": "wristctl.nearness/1", "runs": list(names), "stopped": stopped, "residuals": residuals}
