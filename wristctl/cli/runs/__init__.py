"""`wristctl runs`: what earlier commands have left."""

from __future__ import annotations

import typer

from wristctl.cli.runs import (
    diff,
    export,
    figures,
    gc,
    lineage,
    ls,
    pack,
    replay,
    report,
    rm,
    run_tables,
    show,
    sign,
    tag,
    verify,
)

app = typer.Typer(help="Find, compare, verify and repeat runs.", no_args_is_help=True, add_completion=False)

for module in (ls, show, lineage, diff, verify, sign, replay, report, figures, export, pack, tag, rm, gc):
    name = module.__name__.rpartition(".")[2]
    app.command(name)(getattr(module, name))
app.command("unpack")(pack.unpack)
app.command("table")(run_tables.table)
