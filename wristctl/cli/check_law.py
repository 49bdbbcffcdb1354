"""`wristctl check-law`: is a law of your own fit for all that a law is used for?"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.completion import controllers
from wristctl.cli.options import Debug, Json, TrustCode
from wristctl.cli.say import say
from wristctl.cli.trust_code import asked_to_trust
from wristctl.config.errors import UserError
from wristctl.config.foreign import placed
from wristctl.config.load import load_study
from wristctl.config.trust import asking

app = typer.Typer(add_completion=False)
_VERDICTS = {True: "ok", False: "FAILS", None: ""}


@app.command("check-law")
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
    from wristctl.studies.law_certificate import LawCheck, certificate

    checks: list[LawCheck] = []
    with asking(partial(asked_to_trust, trust_code)):
        for each in certificate(placed(law, None), load_study(config or ()).laws, not no_board):
            checks.append(each)
            if not as_json:
                say(f"{_VERDICTS[each.passed]:<6}{each.asked + ':':<23} {each.found}")
    failed = [each.asked for each in checks if each.passed is False]
    if as_json:
        shown = {"schema": "wristctl.law/1", "law": law, "fit": not failed, "checks": [c._asdict() for c in checks]}
        print(json.dumps(shown, indent=2))
    if failed:
        raise UserError(f"{law} fails: {', '.join(failed)}", law, "mend it; docs/your-own-controller.md", exit_code=3)
    if not as_json:
        say(f"{law} is fit for simulate, tune and compare" + f"{', and for hw-run' * (not no_board)}")
