"""`wristctl runs figures`, `table`, `cite` and `export`."""

import logging
import re
import shlex
from collections.abc import Callable, Collection, Iterable, Sequence
from enum import StrEnum
from itertools import takewhile
from pathlib import Path
from typing import Annotated, Literal

import typer

from wristctl.cli.command import trusting
from wristctl.cli.options import RESULTS, Out, Quiet, Ref, TrustCode
from wristctl.cli.output import say
from wristctl.cli.progress import Bar, Terminal, listening, progress
from wristctl.config.choices import CONTROLLERS
from wristctl.errors import TO, Argument, UserError, meant, reason_of, writing
from wristctl.records import Run, open_run
from wristctl.records.index import DRAWN
from wristctl.records.manifest import CONFIG, read_overview

_log = logging.getLogger(__name__)


def draw_later(run: Run, quiet: bool) -> Path:
    """Draw what a run left for later, into a folder beside it."""
    from wristctl.commands.perform import redrawn
    from wristctl.records.formats import write_figure

    folder = run.path.parent / f"{DRAWN}{run.id}"
    with listening(quiet, False) as console:
        with Bar(console, quiet) as bar:
            drawn = redrawn(run, bar).figures
        left = [name for name in drawn if not (run.path / "figures" / f"{name}.svg").exists()]
        folder.mkdir(parents=True, exist_ok=True)
        _draw(left, lambda name: write_figure(folder / name, drawn[name]), console, quiet)
    return folder


def _draw(names: Sequence[str], write: Callable[[str], None], console: Terminal, quiet: bool) -> list[str]:
    """Draw figures one after another; those that cannot be drawn, of which each has a warning."""
    failed = []
    with progress(console, "drawing", quiet, len(names), "figures") as advance:
        for count, name in enumerate(names, start=1):
            try:
                write(name)
            except UserError:  # the disk
                raise
            except Exception as error:
                _log.warning("figure %s could not be drawn: %s", name, reason_of(error))
                failed.append(name)
            advance(count)
    return failed


class FigureFormat(StrEnum):
    """File format of a figure."""

    pdf, svg, png = "pdf", "svg", "png"


def figures(
    ref: Ref,
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME...]", help="Figures; all where none is.")] = None,
    format_: Annotated[FigureFormat, typer.Option("--format", help="pdf, svg or png.")] = FigureFormat.pdf,
    width: Annotated[
        str | None, typer.Option("--width", help="Of the page or column: 88mm, 18cm, 7in; by default each its own.")
    ] = None,
    to: Annotated[Path | None, typer.Option("--to", help="Folder; by default one beside the run.")] = None,
    trust_code: TrustCode = False,
    out: Out = RESULTS,
    quiet: Quiet = False,
) -> None:
    """Draw figures of a run anew, also those that it left for later, as wide as a column.

    The run stays as it was sealed: figures go into a folder beside it.
    """
    from wristctl.commands.perform import redrawn
    from wristctl.plotting.style import fit, for_paper
    from wristctl.records.formats import write_figure_for_paper

    run, inches = open_run(ref, out), _inches(width) if width else None
    folder = to or run.path.parent / f"{DRAWN}{run.id}"
    _check_names(names or (), read_overview(run.path).captions, run)
    with listening(quiet, False) as console, for_paper(inches), trusting(trust_code):
        with Bar(console, quiet) as bar:
            drawn = redrawn(run, bar).figures
        _check_names(names or (), drawn, run)
        chosen = list(names or drawn)
        with writing(folder, TO):
            folder.mkdir(parents=True, exist_ok=True)

        def write(name: str) -> None:
            fit(drawn[name])
            write_figure_for_paper(folder / f"{name}.{format_.value}", drawn[name])

        failed = _draw(chosen, write, console, quiet)
    say(folder)
    if failed:
        problem = f"{len(failed)} of {len(chosen)} figures could not be drawn: {', '.join(failed)}"
        raise UserError(problem, str(run.path), "the warnings say why", exit_code=1)


def _check_names(names: Iterable[str], available: Collection[str], run: Run) -> None:
    for name in names:
        if available and name not in available:
            raise UserError(f"no figure {name!r}", str(run.path), meant(name, available))


def _inches(text: str) -> float:
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(mm|cm|in)", text.strip())
    size = float(match[1]) / {"mm": 25.4, "cm": 2.54, "in": 1.0}[match[2]] if match else 0.0
    if not 1.5 <= size <= 40.0:
        problem = "no width of a figure" if match is None else "a figure is 4 to 100 cm wide"
        raise UserError(problem, Argument("width", text), "for example --width 88mm")
    return size


def table(
    ref: Ref,
    number: Annotated[
        list[int] | None, typer.Option("--table", "-n", help="Which of its tables, from 1; repeatable. All where none.")
    ] = None,
    latex: Annotated[
        bool, typer.Option("--latex", help="As LaTeX, a column wide: booktabs, siunitx, array, graphicx.")
    ] = False,
    out: Out = RESULTS,
) -> None:
    """Print the tables of a run, angles in degrees: all that the command printed or kept back."""
    from wristctl.cli.runs.latex import latex_table
    from wristctl.commands.printed_table import Table, capital
    from wristctl.plotting.page_tables import tables

    run = open_run(ref, out)
    run_tables = [Table(kept["title"], kept["columns"], kept["rows"]) for kept in tables(run)]
    if not run_tables:
        raise UserError(f"run {run.id} has no tables", str(run.path), "its data are in data/")
    for position in number or ():
        if not 1 <= position <= len(run_tables):
            raise UserError(f"no table {position}", str(run.path), f"1 to {len(run_tables)}")
    positions = number or range(1, len(run_tables) + 1)
    answer = read_overview(run.path).answer
    sentence = " ".join(takewhile(bool, answer))
    names_one = re.match(r"\S+\.py:", sentence) or re.split(r"[ /:,]", sentence)[0] in CONTROLLERS
    begins = sentence if names_one else capital(sentence)

    def caption(one: Table) -> str:
        """Of the answer's own table, which has no title or one of its lines for it, the answer's sentence too."""
        of_the_answer = begins if not one.title or one.title in " ".join(answer) else ""
        title = f"{one.title}." if one.title else ""
        said = " ".join(filter(None, (of_the_answer, title)))
        return f"{said} Run {run.id}." if said else f"{run.kind}: run {run.id}"

    chosen = {f"{run.kind}-{position}": run_tables[position - 1] for position in positions}
    texts = [latex_table(one, label, caption(one)) if latex else one.text() for label, one in chosen.items()]
    print("\n\n".join(texts))


def cite(ref: Ref, out: Out = RESULTS) -> None:
    """Print BibTeX of a run, by its id and the hash of its result, and of wristctl."""
    from wristctl.cli.runs.latex import bibtex

    print(bibtex(open_run(ref, out).manifest))


def export(
    ref: Ref,
    to: Annotated[Literal["csv", "mcap", "lerobot", "mat"], typer.Option("--to", help="The format.")] = "csv",
    file: Annotated[
        Path | None, typer.Option("--file", help="File or folder to write; by default the run's id, in this folder.")
    ] = None,
    out: Out = RESULTS,
) -> None:
    """Write a run's motions, tables, arrays and videos for other programs, with their units.

    csv: its motions as an open log. lerobot: the same as a LeRobotDataset (v3), a folder. mcap: messages of ROS 2 with
    all that went on in time, videos too, for Foxglove, PlotJuggler, Rerun or ros2 bag. `identify` reads these three.
    mat: one file for MATLAB and Octave. A table for pandas is the CSV file of the run, or
    `wristctl.open_run(RUN).data(NAME)` in Python.
    """
    from wristctl.commands.export.run_data import export_run

    run = open_run(ref, out)
    with run.reading():
        path = export_run(run, to, file)
        say(path)
    if run.kind == "hw-run" and to != "mat":
        command = ("wristctl", "identify", str(path), "--config", str(run.file(CONFIG)))
        with listening(False, False):
            _log.info("to identify it, with the wrist of this run: %s", shlex.join(command))
