"""`wristctl runs`: what earlier commands have left."""

import typer

from wristctl.cli.options import with_debug
from wristctl.cli.runs.drawing import cite, export, figures, table
from wristctl.cli.runs.housekeeping import gc, pack, rm, unpack
from wristctl.cli.runs.listing import diff, lineage, ls, show, tag
from wristctl.cli.runs.pages import report, serve
from wristctl.cli.runs.trend import trend
from wristctl.cli.runs.verification import replay, sign, verify

app = typer.Typer(help="Find, compare, verify and repeat runs.", no_args_is_help=True, add_completion=False)

for verb in (
    ls, show, lineage, diff, trend, verify, sign, replay, report, serve, figures, table, cite, export, pack,
    unpack, tag, rm, gc,
):  # fmt: skip
    app.command(verb.__name__)(with_debug(verb))
