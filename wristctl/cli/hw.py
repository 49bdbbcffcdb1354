"""`wristctl hw`: the motor board, and what to calibrate."""

from __future__ import annotations

import typer

from wristctl.cli.hw_by_hand import clear, home, jog, limits, slacken
from wristctl.cli.hw_calibrate import app as calibrations
from wristctl.cli.hw_check import check
from wristctl.cli.hw_emulate import emulate
from wristctl.cli.hw_flash import flash
from wristctl.cli.hw_ports import ports
from wristctl.cli.hw_stop import stop
from wristctl.cli.hw_watch import watch

app = typer.Typer(
    help="The motor board: find, check, flash, emulate, stop; move by hand; calibrate; watch trials.",
    no_args_is_help=True,
    add_completion=False,
)

app.add_typer(calibrations, name="calibrate")
for command in (watch, ports, check, flash, emulate, stop, jog, home, limits, slacken, clear):
    app.command(command.__name__)(command)
