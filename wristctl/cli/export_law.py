"""`wristctl export-law`: a tuned controller for a firmware of one's own."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.command import asked_to_trust
from wristctl.cli.options import RESULTS, Debug, Out, TrustCode, controllers_and_studies
from wristctl.cli.output import say
from wristctl.plugins.trust import asking

app = typer.Typer(add_completion=False)

_EPILOG = (
    "Examples:\n\nwristctl export-law pid-ff mywrist.yaml\n\n"
    "wristctl export-law ct-dob/hardware mywrist.yaml --set loop.actuator.level=tendon --set loop.sensor.level=camera "
    "--set loop.control_period=0.01\n\n"
    "wristctl export-law latest:recommend\n\nwristctl export-law latest:tune pid-ff --folder firmware/law"
)


@app.command("export-law", epilog=_EPILOG)
def export_law(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="CONTROLLER|FILE|RUN...",
            help="NAME, NAME/PRESET or file.py:NAME with study files; or a run, and a controller of it.",
            autocompletion=controllers_and_studies,
        ),
    ],
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override one setting of `simulate`.")
    ] = None,
    folder: Annotated[Path | None, typer.Option("--folder", help="Where to write; by default NAME_law.")] = None,
    trust_code: TrustCode = False,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Write a tuned controller in C99 and NumPy, for a firmware of your own.

    The law, the allocation of its torque to tendons within their limits, what the motors are sent, and behind a camera
    the observer, with the gains and the wrist as constants, test vectors of a simulated loop, a test that compares
    them, and a README with the order of calls and the units. The loop is that of `simulate` in the study, or the run's.
    """
    from wristctl.commands.export.law import export_law as write

    with asking(partial(asked_to_trust, trust_code)):
        for path in write(words, override or (), folder, out):
            say(path)
