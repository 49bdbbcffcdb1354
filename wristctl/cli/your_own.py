"""`wristctl new`, `init`, `schema`, `check-controller` and `check-rig`: files of your own, begun and checked."""

from __future__ import annotations

import json
import keyword
import os
import re
import shlex
from collections.abc import Sequence
from functools import partial
from importlib.resources import files
from os.path import lexists
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wristctl.cli.command import trusting
from wristctl.cli.json_output import print_json
from wristctl.cli.options import Json, TrustCode, config_option, controllers, with_debug
from wristctl.cli.output import say
from wristctl.config.choices import CONTROLLERS, OPTIMISERS, REFERENCES, RIGS
from wristctl.errors import TO, Argument, UserError, writing
from wristctl.plugins.places import placed
from wristctl.records.files import write_text
from wristctl.records.manifest import README
from wristctl.study_files.json_schema import NAMED, SCHEMA_FILE, study_schema
from wristctl.study_files.load import load_study
from wristctl.study_files.shipped import EXPERIMENTS, shipped

if TYPE_CHECKING:
    from wristctl.commands.law_certificate import LawCheck
    from wristctl.commands.rig_certificate import RigCheck

new_app = typer.Typer(add_completion=False)

_TABLES = {"controller": CONTROLLERS, "reference": REFERENCES, "optimiser": OPTIMISERS, "rig": RIGS}
_AFTER_NEW = {
    "controller": "wristctl check-controller {0}\nwristctl compare pid-ff adrc {0}",
    "reference": "wristctl simulate --set reference.kind={0}",
    "optimiser": "wristctl tune --set optimiser={0}",
    "rig": "wristctl check-rig {0}\nwristctl hw-run pid-ff --rig {0}",
}


@new_app.command("new")
@with_debug
def new(
    kind: Annotated[
        Literal["controller", "reference", "optimiser", "rig"], typer.Argument(metavar="KIND", help=", ".join(_TABLES))
    ],
    name: Annotated[str, typer.Argument(metavar="NAME", help="What it shall be called: letters, digits, dashes.")],
    to: Annotated[Path, typer.Option("--to", help="Folder to write to.")] = Path(),
) -> None:
    """Write a controller, reference, optimiser or rig that runs as it stands, for you to change."""
    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise UserError(f"{name!r} is no name for a {kind}", "NAME", "small letters, digits and dashes: my-controller")
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

# The file of a wrist of one's own, and the commands that follow it.
_WRIST = "mywrist.yaml"
_AFTER_INIT = (
    f"wristctl simulate {_WRIST}",
    f"wristctl compare ct-dob pid-ff mrac {_WRIST}",
    f"wristctl tune ct-dob {_WRIST} --iterations 20",
)


@init_app.command("init")
@with_debug
def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to write to; made where there is none.")],
) -> None:
    """Begin a folder for a wrist of your own: mywrist.yaml with its values, and studies and laws to change."""
    to = folder / EXPERIMENTS
    for place in (to, folder / _WRIST, folder / README, folder / SCHEMA_FILE):
        if os.path.lexists(place):
            raise UserError("this is there already, and it may be changed", str(place), "another folder")
    with writing(to, Argument("folder", metavar="DIR", positional=True)):
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=f".{EXPERIMENTS}-") as scratch:
            copies = Path(scratch) / EXPERIMENTS
            # studies, code, logs, and models of robots that code names
            found = (file for suffix in ("yaml", "py", "csv", "xml") for file in shipped().rglob(f"*.{suffix}"))
            for file in sorted(one.relative_to(shipped()) for one in found):
                (copies / file).parent.mkdir(parents=True, exist_ok=True)
                (copies / file).write_bytes((shipped() / file).read_bytes())
            templates = files("wristctl.cli") / "templates"
            for name in (_WRIST, README):
                text = (templates / f"{name}.txt").read_text(encoding="utf-8")
                text = text.replace("@commands@", "\n".join(_AFTER_INIT)).replace("@schema@", NAMED)
                (Path(scratch) / name).write_text(text, encoding="utf-8")
            (Path(scratch) / SCHEMA_FILE).write_text(json.dumps(study_schema(), indent=1) + "\n", encoding="utf-8")
            copies.rename(to)
            for name in (_WRIST, README, SCHEMA_FILE):
                (Path(scratch) / name).rename(folder / name)
    say(f"{folder / _WRIST} is written: put the values of your wrist in. Then:")
    for line in (f"cd {shlex.quote(str(folder))}", *_AFTER_INIT):
        say(f"  {line}")


check_controller_app = typer.Typer(add_completion=False)
_VERDICTS = {True: "ok", False: "FAILS", None: ""}


@check_controller_app.command("check-controller")
@with_debug
def check_controller(
    law: Annotated[
        str,
        typer.Argument(
            metavar="FILE:NAME", help="A controller's file and name, or a name.", autocompletion=controllers
        ),
    ],
    config: Annotated[list[Path] | None, config_option("Study file with its `controller-settings`.")] = None,
    no_board: Annotated[bool, typer.Option("--no-board", help="Leave out the trial on the emulated board.")] = False,
    trust_code: TrustCode = False,
    as_json: Json = False,
) -> None:
    """Check a controller: it compiles, the same bits in every width, finite, nothing changed or allocated, bends the
    wrist back, and runs on the emulated board (exit code 3 where something fails)."""
    from wristctl.commands.law_certificate import certificate

    checks: list[LawCheck] = []
    with trusting(trust_code):
        for check in certificate(placed(law, None), load_study(config or ()).controller_settings, not no_board):
            if not checks and not as_json:  # it is there, and a controller
                say("compiling the controller and trying it: half a minute the first time")
            checks.append(check)
            if not as_json:
                say(f"{_VERDICTS[check.passed]:<6}{check.asked + ':':<23} {check.found}")
    error = _failure(law, checks, "mend it (documentation: Your own controller)")
    if as_json:
        shown = {"schema": "wristctl.law/1", "law": law, "fit": not error, "checks": [c._asdict() for c in checks]}
        return print_json(shown, error)
    if error:
        raise error
    say(f"{law} is fit for simulate, tune and compare" + f"{', and for hw-run' * (not no_board)}")


def _failure(name: str, checks: Sequence[LawCheck | RigCheck], fix: str) -> UserError | None:
    """The error that names the checks that failed; None where none did."""
    failed = [check.asked for check in checks if check.passed is False]
    return UserError(f"{name} fails: {', '.join(failed)}", name, fix, exit_code=3) if failed else None


check_rig_app = typer.Typer(add_completion=False)


@check_rig_app.command("check-rig")
@with_debug
def check_rig(
    rig: Annotated[str, typer.Argument(metavar="FILE:NAME", help="A rig's file and name.")],
    config: Annotated[list[Path] | None, config_option("Study file with its `wrist`.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nobody before a rig on the wall clock moves.")] = False,
    trust_code: TrustCode = False,
    as_json: Json = False,
) -> None:
    """Check a robot of your own against its facts: clock, looks, refusals, sense and scale of each tendon, delay,
    stops, and a trial of 5 deg (exit code 3 where something fails)."""
    from wristctl.cli.operator import TerminalOperator
    from wristctl.cli.progress import listening
    from wristctl.commands.rig_certificate import Certificate
    from wristctl.trial.rig_stand import BEFORE_MOTION

    checks: list[RigCheck] = []
    with trusting(trust_code), listening(as_json, False) as console:
        operator = TerminalOperator(console, as_json, frozenset({"yes"} if yes else ()))
        study = load_study(config or ())
        certificate = Certificate(placed(rig, None), study, partial(operator.confirm, BEFORE_MOTION))
        for check in certificate.checks():
            checks.append(check)
            if not as_json:
                say(f"{_VERDICTS[check.passed]:<6}{check.asked + ':':<10} {check.found}")
    fix = next((check.fix for check in checks if check.fix), "mend it (documentation: Your own rig)")
    error = _failure(rig, checks, fix)
    if as_json:
        found = [check._asdict() for check in checks]
        shown = {"schema": "wristctl.rig/1", "rig": rig, "fit": not error, "checks": found}
        return print_json(shown | {"allowed": certificate.allowed}, error)
    if error:
        raise error
    for line in ("", *certificate.allowed):
        say(line)


schema_app = typer.Typer(add_completion=False)


@schema_app.command("schema")
@with_debug
def schema() -> None:
    """Print the JSON schema of study files, by which editors complete keys and check values.

    Lay it beside a study file that begins with `# yaml-language-server: $schema=study.schema.json`; `wristctl init`
    does both.
    """
    print_json(study_schema())
