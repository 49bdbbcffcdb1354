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

_EPILOG = (
    "Examples:\n\nwristctl export-model latest:identify --to matlab\n\n"
    "wristctl export-model RUN --to mujoco --planes 2 --motors spools"
)


@app.command("export-model", epilog=_EPILOG)
def export_model(
    ref: Ref,
    to: Annotated[Literal["mujoco", "matlab", "urdf"], typer.Option("--to", help="The program that is to read it.")],
    segments: Annotated[int, typer.Option("--segments", min=1, max=8, help="Segments that bend by themselves.")] = 4,
    planes: Annotated[
        int | None,
        typer.Option("--planes", min=1, max=2, help="By default those of the run's loop."),
    ] = None,
    direction: Annotated[
        Literal["ulnar", "radial", "flexion", "extension"] | None,
        typer.Option("--direction", help="Whose plane, of a wrist in one."),
    ] = None,
    motors: Annotated[
        Literal["tensions", "spools"],
        typer.Option("--motors", help="What MuJoCo's actuators take."),
    ] = "tensions",
    file: Annotated[
        Path | None, typer.Option("--file", help="By default wrist.xml, wrist_chain.m or wrist.urdf.")
    ] = None,
    trust_code: TrustCode = False,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Write the wrist of a run, identified or as its controller knew it, as a chain of rigid links.

    For MuJoCo a model with tendons and actuators; for MATLAB (or Octave) a function with the equations of motion; as
    URDF links and joints alone, for viewers. How far they are from the wrist here: documentation: The wrist in other
    programs.
    """
    from wristctl.commands.export.model import Exported, export_wrist
    from wristctl.records import require

    with asking(partial(asked_to_trust, trust_code)):
        say(export_wrist(require(ref, None, out), to, file, Exported(segments, planes, direction, motors)))
