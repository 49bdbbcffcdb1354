"""`wristctl new`: a file of your own to begin from."""

from __future__ import annotations

import keyword
import re
from importlib.resources import files
from os.path import lexists
from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.options import Debug
from wristctl.cli.say import say
from wristctl.config.choices import CONTROLLERS, OPTIMISERS, REFERENCES
from wristctl.config.errors import UserError
from wristctl.config.wording import TO
from wristctl.records.files import write_text

app = typer.Typer(add_completion=False)

_TABLES = {"controller": CONTROLLERS, "reference": REFERENCES, "optimiser": OPTIMISERS}
_NEXT = {
    "controller": "wristctl check-law {0}\nwristctl simulate --controller {0} --gains default",
    "reference": "wristctl simulate --set reference.kind={0}",
    "optimiser": "wristctl tune --set optimiser={0}",
}


@app.command("new")
def new(
    kind: Annotated[
        Literal["controller", "reference", "optimiser"], typer.Argument(metavar="KIND", help=", ".join(_TABLES))
    ],
    name: Annotated[str, typer.Argument(metavar="NAME", help="What it shall be called: letters, digits, dashes.")],
    to: Annotated[Path, typer.Option("--to", help="Folder to write to.")] = Path(),
    debug: Debug = False,
) -> None:
    """Write a controller, reference or optimiser that runs as it stands, for you to change."""
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise UserError(f"{name!r} is no name for a {kind}", "NAME", "small letters, digits and dashes: my-law")
    if keyword.iskeyword(name):
        raise UserError(f"{name!r} is a word of Python's own", "NAME", f"another name: my-{name}")
    if name in _TABLES[kind]:
        raise UserError(f"there is a {kind} '{name}' already", "NAME", f"another name: my-{name}")
    word = name.replace("-", "_")
    file = to / f"{word}.py"
    title = name.replace("-", " ").capitalize()
    own = "".join(part.capitalize() for part in name.split("-")) if kind == "optimiser" else word.upper()
    text = (files("wristctl.cli") / "templates" / f"{kind}.py.txt").read_text(encoding="utf-8")
    for mark, value in (("@name@", name), ("@OBJECT@", own), ("@Title@", title)):
        text = text.replace(mark, value)
    if lexists(file):
        raise UserError("there is such a file already", str(file), "another name, or another folder with --to")
    write_text(file, text, TO)
    say(f"{file} is written, and runs as it stands:")
    for line in _NEXT[kind].format(f"{file}:{own}").splitlines():
        say(f"  {line}")
