"""`wristctl validate`: the model held against recordings of real robots that their authors published."""

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug
from wristctl.cli.output import say
from wristctl.errors import UserError

app = typer.Typer(add_completion=False)

_EPILOG = "Examples:\n\nwristctl validate --list\n\nwristctl validate uc3m-soft-neck --data Data-and-Results"


@app.command("validate", epilog=_EPILOG)
def validate(
    robot: Annotated[str | None, typer.Argument(help="Name of a data set, as --list has it.")] = None,
    data: Annotated[Path | None, typer.Option("--data", help="Folder in which its files are.")] = None,
    listed: Annotated[bool, typer.Option("--list", help="Say where each set is, and its licence.")] = False,
    debug: Debug = False,
) -> None:
    """Fit the model to a part of a real robot's recordings, and predict the rest.

    Nobody's recordings are part of this package: clone them from where --list says. With --data alone their
    SHA-256 are checked; uc3m-soft-neck is fitted too.
    """
    from wristctl.commands.validation import checked_set, data_sets_table, soft_neck_answer

    if listed:
        for line in data_sets_table().text(100).split("\n"):
            say(line)
        return
    if robot is None or data is None:
        raise UserError("a data set and its folder are needed", "validate", "wristctl validate --list")
    say(checked_set(robot, data))
    if robot == "uc3m-soft-neck":
        for line in ["", *soft_neck_answer(data).lines()]:
            say(line)
