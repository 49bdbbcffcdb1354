"""`wristctl hw calibrate`, and what is printed for a rig: board and markers, and its parts at true scale."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.app import lazy_app
from wristctl.cli.commands import CALIBRATIONS
from wristctl.cli.options import config_option, set_option, with_debug
from wristctl.errors import Argument, writing
from wristctl.records.files import replacing
from wristctl.study_files.load import load_study

app = lazy_app(CALIBRATIONS, "Calibrate camera and wrist.")
board_pdf_app = typer.Typer(add_completion=False)


@board_pdf_app.command("board-pdf")
@with_debug
def board_pdf(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Where to write it.")] = Path("wrist-board.pdf"),
    paper: Annotated[Literal["a4", "letter"], typer.Option("--paper", help="What the printer holds.")] = "a4",
    config: Annotated[list[Path] | None, config_option("Study file with the sizes.")] = None,
    override: Annotated[list[str] | None, set_option("Override one: board.square=0.02 [m].")] = None,
) -> None:
    """Write the calibration board and the two markers as a PDF, to print at true scale.

    Page 1 is the board, page 2 the markers; each has a 100 mm ruler to check the print.
    """
    from wristctl.commands.calibrate.print_sheet import write_sheets

    study = load_study(config or (), override or (), "calibrate-camera")
    with replacing(file, Argument("file", metavar="FILE", positional=True)) as temporary:
        write_sheets(temporary, paper, study.calibrate_camera.board, study.track.markers)
    typer.echo("print at 100 % (no 'fit to page'), then measure the rulers: 100 mm", err=True)
    print(file)


def drawings(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Where to write them.")] = Path("wrist-drawings"),
    tendon_mm: Annotated[float, typer.Option("--tendon-mm", min=0.1, max=3.0, help="Diameter of the tendon.")] = 0.7,
    shaft_mm: Annotated[
        float, typer.Option("--shaft-mm", min=1.0, help="Diameter of the motors' shaft: 5 of most NEMA 17.")
    ] = 6.35,
    paper: Annotated[Literal["a4", "letter"], typer.Option("--paper", help="What the printer holds.")] = "a4",
    config: Annotated[list[Path] | None, config_option("Study file of the rig.")] = None,
    override: Annotated[list[str] | None, set_option("Override one: actuator.pulley_radius=0.01 [m].")] = None,
) -> None:
    """Write spool, tendon clamp, wrist disc, marker flag and markers as SVG at true scale; the spool as STL too.

    Of a rig in two planes the second camera's markers too.

    All of them follow from the settings of hw-run and the wrist. Each page has a ruler to check the print.
    """
    from wristctl.commands.adoption import with_planes
    from wristctl.commands.calibrate.part_drawings import part_pages
    from wristctl.commands.calibrate.print_sheet import marker_page
    from wristctl.records.formats import write_figure_for_paper
    from wristctl.trial.spool_part import SpoolPart, write_stl

    study = with_planes(load_study(config or (), override or (), "hw-run"))
    settings = study.hw_run
    spool = SpoolPart.of(settings, tendon_mm, shaft_mm)
    pages = {**part_pages(settings, study.wrist, spool, paper), "markers": marker_page(paper, settings.markers)}
    if settings.planes == 2:
        pages["markers_2"] = marker_page(paper, settings.markers_2)
    place = Argument("folder", metavar="FOLDER", positional=True)
    with writing(folder, place):
        folder.mkdir(parents=True, exist_ok=True)
    for name, page in pages.items():
        write_figure_for_paper(folder / f"{name}.svg", page, by=place)
        print(folder / f"{name}.svg")
    with replacing(folder / "spool.stl", place) as temporary:
        write_stl(temporary, spool.mesh(), f"wristctl spool, pulley radius {spool.pulley_radius:g} mm")
    print(folder / "spool.stl")
    typer.echo("print at 100 % (no 'fit to page'), then measure the rulers", err=True)
