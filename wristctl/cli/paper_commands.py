"""`wristctl paper`: what is about the paper alone."""

import typer

from wristctl.cli.app import lazy_group
from wristctl.cli.commands import PAPER

app = typer.Typer(
    cls=lazy_group(PAPER), help="Check the paper's claims one by one.", no_args_is_help=True, add_completion=False
)


@app.callback()
def _paper() -> None:
    """Check the paper's claims one by one."""
