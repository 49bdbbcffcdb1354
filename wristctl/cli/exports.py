"""`wristctl export-model` and `export-law`: the wrist of a run, and a tuned controller, for other programs."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.command import trusting
from wristctl.cli.options import RESULTS, Out, Ref, TrustCode, controllers_and_studies, set_option, with_debug
from wristctl.cli.output import say

model_app, law_app = typer.Typer(add_completion=False), typer.Typer(add_completion=False)

_OF_MODEL = (
    "Examples:\n\nwristctl export-model latest:identify --to matlab\n\n"
    "wristctl export-model RUN --to mujoco --planes 2 --motors spools"
)


@model_app.command("export-model", epilog=_OF_MODEL)
@with_debug
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
) -> None:
    """Write the wrist of a run, identified or as its controller knew it, as a chain of rigid links.

    For MuJoCo a model with tendons and actuators; for MATLAB (or Octave) a function with the equations of motion; as
    URDF links and joints alone, for viewers. How far they are from the wrist here: documentation: The wrist in other
    programs.
    """
    from wristctl.commands.export.model import Exported, export_wrist
    from wristctl.records import require

    with trusting(trust_code):
        say(export_wrist(require(ref, None, out), to, file, Exported(segments, planes, direction, motors)))


_OF_LAW = (
    "Examples:\n\nwristctl export-law pid-ff mywrist.yaml\n\n"
    "wristctl export-law ct-dob/hardware mywrist.yaml --set loop.actuator.level=tendon --set loop.sensor.level=camera "
    "--set loop.control_period=0.01\n\n"
    "wristctl export-law latest:recommend\n\nwristctl export-law latest:tune pid-ff --folder firmware/law"
)


@law_app.command("export-law", epilog=_OF_LAW)
@with_debug
def export_law(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="CONTROLLER|FILE|RUN...",
            help="NAME, NAME/PRESET or file.py:NAME with study files; or a run, and a controller of it.",
            autocompletion=controllers_and_studies,
        ),
    ],
    override: Annotated[list[str] | None, set_option("Override one setting of `simulate`.")] = None,
    folder: Annotated[Path | None, typer.Option("--folder", help="Where to write; by default NAME_law.")] = None,
    trust_code: TrustCode = False,
    out: Out = RESULTS,
) -> None:
    """Write a tuned controller in C99 and NumPy, for a firmware of your own.

    The law, the allocation of its torque to tendons within their limits, what the motors are sent, and behind a camera
    the observer, with the gains and the wrist as constants, test vectors of a simulated loop, a test that compares
    them, and a README with the order of calls and the units. The loop is that of `simulate` in the study, or the run's.
    """
    from wristctl.commands.export.law import export_law as write

    with trusting(trust_code):
        for path in write(words, override or (), folder, out):
            say(path)
