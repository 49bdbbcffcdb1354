"""`wristctl init`: the experiments in a folder of your own."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from wristctl.cli.options import Debug
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.config.shipped import EXPERIMENTS, shipped
from wristctl.config.system_errors import writing
from wristctl.config.wording import Argument

app = typer.Typer(add_completion=False)

_NEXT = """
wristctl gen-data experiments/quick.yaml
wristctl train experiments/quick.yaml --data latest:gen-data
wristctl tune experiments/quick.yaml --network latest:train
wristctl compare experiments/quick.yaml --network latest:train --tuned latest:tune
wristctl audit experiments/claims.yaml
"""


@app.command("init")
def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write to; made where there is none.")],
    debug: Debug = False,
) -> None:
    """Lay out the study files and laws that come with wristctl in a folder, for you to change."""
    to = folder / EXPERIMENTS
    if os.path.lexists(to):
        raise UserError("there are experiments already, and they may be changed", str(to), "another folder")
    with writing(to, Argument("folder", metavar="DIR", positional=True)):
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=f".{EXPERIMENTS}-") as scratch:
            whole = Path(scratch) / EXPERIMENTS
            for file in _files():
                (whole / file).parent.mkdir(parents=True, exist_ok=True)
                (whole / file).write_bytes((shipped() / file).read_bytes())
            whole.rename(to)
    say(f"{to} is written, for you to change. The paper's study in small, a few minutes:")
    for line in (f"cd {shlex.quote(str(folder))}", *_NEXT.split("\n")[1:-1]):
        say(f"  {line}")


def _files() -> list[Path]:
    """From the folder of experiments."""
    return sorted(each.relative_to(shipped()) for suffix in ("yaml", "py") for each in shipped().rglob(f"*.{suffix}"))
