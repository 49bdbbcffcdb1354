"""`wristctl hw calibrate board-pdf`: the board and the markers, to print."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.options import Debug
from wristctl.config.wording import Argument
from wristctl.records.files import replacing

app = typer.Typer(add_completion=False)


@app.command("board-pdf")
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
    from wristctl.config.load import load_study
    from wristctl.report.print_sheet import write_sheets

    study = load_study(config or (), override or (), "calibrate-camera")
    with replacing(file, Argument("file", metavar="FILE", positional=True)) as temporary:
        write_sheets(temporary, paper, study.calibrate_camera.board, study.track.markers)
    typer.echo("print at 100 % (no 'fit to page'), then measure the rulers: 100 mm", err=True)
    print(file)
