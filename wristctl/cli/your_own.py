"""`wristctl new`, `init` and `check-law`: files of your own to begin from, and a law of your own checked."""

import json
import keyword
import os
import re
import shlex
from functools import partial
from importlib.resources import files
from os.path import lexists
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal

import typer

from wristctl.cli.command import asked_to_trust
from wristctl.cli.options import Debug, Json, TrustCode, controllers
from wristctl.cli.output import say
from wristctl.config.choices import CONTROLLERS, OPTIMISERS, REFERENCES
from wristctl.errors import TO, Argument, UserError, writing
from wristctl.plugins.places import placed
from wristctl.plugins.trust import asking
from wristctl.records.files import write_text
from wristctl.study_files.load import load_study
from wristctl.study_files.shipped import EXPERIMENTS, shipped

new_app = typer.Typer(add_completion=False)

_TABLES = {"controller": CONTROLLERS, "reference": REFERENCES, "optimiser": OPTIMISERS}
_AFTER_NEW = {
    "controller": "wristctl check-law {0}\nwristctl simulate --controller {0}",
    "reference": "wristctl simulate --set reference.kind={0}",
    "optimiser": "wristctl tune --set optimiser={0}",
}


@new_app.command("new")
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
    object_name = "".join(part.capitalize() for part in name.split("-")) if kind == "optimiser" else word.upper()
    text = (files("wristctl.cli") / "templates" / f"{kind}.py.txt").read_text(encoding="utf-8")
    for mark, value in (("@name@", name), ("@OBJECT@", object_name), ("@Title@", title)):
        text = text.replace(mark, value)
    if lexists(file):
        raise UserError("there is such a file already", str(file), "another name, or another folder with --to")
    write_text(file, text, TO)
    say(f"{file} is written, and runs as it stands:")
    for line in _AFTER_NEW[kind].format(f"{file}:{object_name}").splitlines():
        say(f"  {line}")


init_app = typer.Typer(add_completion=False)

_AFTER_INIT = """
wristctl gen-data experiments/quick.yaml
wristctl train experiments/quick.yaml --data latest:gen-data
wristctl tune experiments/quick.yaml --network latest:train
wristctl compare experiments/quick.yaml --network latest:train --tuned latest:tune
wristctl audit experiments/claims.yaml
"""


@init_app.command("init")
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
            copies = Path(scratch) / EXPERIMENTS
            for file in _files():
                (copies / file).parent.mkdir(parents=True, exist_ok=True)
                (copies / file).write_bytes((shipped() / file).read_bytes())
            copies.rename(to)
    say(f"{to} is written, for you to change. The paper's study in small, a few minutes:")
    for line in (f"cd {shlex.quote(str(folder))}", *_AFTER_INIT.split("\n")[1:-1]):
        say(f"  {line}")


def _files() -> list[Path]:
    """From the folder of experiments."""
    return sorted(file.relative_to(shipped()) for suffix in ("yaml", "py") for file in shipped().rglob(f"*.{suffix}"))


check_law_app = typer.Typer(add_completion=False)
_VERDICTS = {True: "ok", False: "FAILS", None: ""}


@check_law_app.command("check-law")
def check_law(
    law: Annotated[
        str, typer.Argument(metavar="FILE:NAME", help="A law's file and name, or a name.", autocompletion=controllers)
    ],
    config: Annotated[
        list[Path] | None,
        typer.Option("--config", "-c", metavar="FILE", help="Study file with its `laws`."),
    ] = None,
    no_board: Annotated[bool, typer.Option("--no-board", help="Leave out the trial on the emulated board.")] = False,
    trust_code: TrustCode = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Check a law: it compiles, the same bits in every width, finite, nothing changed or allocated, bends the wrist
    back, and runs on the emulated board (exit code 3 where something fails)."""
    from wristctl.commands.law_certificate import LawCheck, certificate

    checks: list[LawCheck] = []
    with asking(partial(asked_to_trust, trust_code)):
        for check in certificate(placed(law, None), load_study(config or ()).laws, not no_board):
            checks.append(check)
            if not as_json:
                say(f"{_VERDICTS[check.passed]:<6}{check.asked + ':':<23} {check.found}")
    failed = [check.asked for check in checks if check.passed is False]
    if as_json:
        shown = {"schema": "wristctl.law/1", "law": law, "fit": not failed, "checks": [c._asdict() for c in checks]}
        print(json.dumps(shown, indent=2))
    if failed:
        raise UserError(f"{law} fails: {', '.join(failed)}", law, "mend it; docs/your-own-controller.md", exit_code=3)
    if not as_json:
        say(f"{law} is fit for simulate, tune and compare" + f"{', and for hw-run' * (not no_board)}")
