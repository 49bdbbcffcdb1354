"""`wristctl export-model`: the wrist of a run for another program."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.command import asked_to_trust
from wristctl.cli.options import RESULTS, Debug, Out, Ref, TrustCode
from wristctl.cli.output import say
from wristctl.plugins.trust import asking

app = typer.Typer(add_completion=False)

_EPILOG = "Examples:\n\nwristctl export-model latest:identify --to mujoco\n\nwristctl export-model RUN --to matlab"


@app.command("export-model", epilog=_EPILOG)
def export_model(
    ref: Ref,
    to: Annotated[Literal["mujoco", "matlab"], typer.Option("--to", help="The program that is to read it.")],
    segments: Annotated[int, typer.Option("--segments", min=1, max=8, help="Segments that bend by themselves.")] = 4,
    direction: Annotated[
        Literal["ulnar", "radial", "flexion", "extension"],
        typer.Option("--direction", help="Whose bending plane: stiffness and gravity differ."),
    ] = "ulnar",
    file: Annotated[
        Path | None, typer.Option("--file", help="Where to write it; by default wrist.xml or wrist_chain.m here.")
    ] = None,
    trust_code: TrustCode = False,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Write the wrist of a run, identified or as its controller knew it, as a chain of rigid links.

    For MuJoCo a model with tendons, whose two actuators take tensions; for MATLAB (or Octave) a function with the
    equations of motion. How far they are from the wrist here: documentation: The wrist in other programs.
    """
    from wristctl.commands.export.model import export_wrist
    from wristctl.records import require

    with asking(partial(asked_to_trust, trust_code)):
        say(export_wrist(require(ref, None, out), to, file, segments, direction))
