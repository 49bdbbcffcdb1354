"""`wristctl hw calibrate`: what must be known before a trial, and the board to print for it."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.app import lazy_group
from wristctl.cli.commands import CALIBRATIONS
from wristctl.cli.options import Debug
from wristctl.errors import Argument
from wristctl.records.files import replacing

app = typer.Typer(
    cls=lazy_group(CALIBRATIONS), help="Calibrate camera and wrist.", no_args_is_help=True, add_completion=False
)


@app.callback()
def _calibrate() -> None:
    """Calibrate camera and wrist."""


board_pdf_app = typer.Typer(add_completion=False)


@board_pdf_app.command("board-pdf")
def board_pdf(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Where to write it.")] = Path("wrist-board.pdf"),
    paper: Annotated[Literal["a4", "letter"], typer.Option("--paper", help="What the printer holds.")] = "a4",
    config: Annotated[
        list[Path] | None, typer.Option("--config", "-c", metavar="FILE", help="Study file with the sizes.")
    ] = None,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override one: board.square=0.02 [m].")
    ] = None,
    debug: Debug = False,
) -> None:
    """Write the calibration board and the two markers as a PDF, to print at true scale.

    Page 1 is the board, page 2 the markers; each has a 100 mm ruler to check the print.
    """
    from wristctl.commands.calibrate.print_sheet import write_sheets
    from wristctl.study_files.load import load_study

    study = load_study(config or (), override or (), "calibrate-camera")
    with replacing(file, Argument("file", metavar="FILE", positional=True)) as temporary:
        write_sheets(temporary, paper, study.calibrate_camera.board, study.track.markers)
    typer.echo("print at 100 % (no 'fit to page'), then measure the rulers: 100 mm", err=True)
    print(file)
