"""`wristctl list`: what can be chosen, a line each."""

from typing import Annotated

import typer

from wristctl.cli.options import Json, with_debug
from wristctl.cli.output import print_table, say
from wristctl.commands.choice_tables import TABLES
from wristctl.commands.printed_table import COLUMNS
from wristctl.errors import UserError, meant

app = typer.Typer(add_completion=False)


def _tables(incomplete: str) -> list[str]:
    return [name for name in TABLES if name.startswith(incomplete)]


@app.command("list", epilog="Examples:\nwristctl list controllers\nwristctl list presets")
@with_debug
def list_choices(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=", ".join(TABLES), autocompletion=_tables)],
    as_json: Json = False,
) -> None:
    """List what can be chosen, a line each: controllers, presets, references, conditions or metrics."""
    if what not in TABLES:
        raise UserError(f"there is no list of '{what}'", "WHAT", meant(what, TABLES))
    table = TABLES[what]()
    if as_json:
        return print_table(table, as_json)
    for line in table.folded(COLUMNS).text().split("\n"):
        say(line)
