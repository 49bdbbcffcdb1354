"""`wristctl runs figures`."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out, Quiet, TrustCode
from wristctl.cli.progress import listening, progress
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.cli.trust_code import asked_to_trust
from wristctl.config.errors import UserError, meant
from wristctl.config.system_errors import writing
from wristctl.config.trust import asking
from wristctl.config.wording import TO, Argument
from wristctl.records import Run, open_run
from wristctl.records.index import DRAWN
from wristctl.records.overview import read_overview
from wristctl.studies.counting import no_event


class FigureFormat(StrEnum):
    """What a figure is written as."""

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
    debug: Debug = False,
) -> None:
    """Draw figures of a run anew, also those that it left for later, as wide as a column.

    The run stays as it was sealed: figures go into a folder beside it.
    """
    from wristctl.records.formats import write_figure_for_paper
    from wristctl.report.style import fit, for_paper
    from wristctl.studies.redraw import redrawn

    run, inches = open_run(ref, out), _inches(width) if width else None
    folder = to or run.path.parent / f"{DRAWN}{run.id}"
    _check_names(names or (), read_overview(run.path).captions, run)
    trust = asking(partial(asked_to_trust, trust_code))
    with listening(quiet, False) as console, for_paper(inches), trust:
        found = redrawn(run, partial(progress, console, quiet=quiet)).figures
        _check_names(names or (), found, run)
        chosen = list(names or found)
        with writing(folder, TO):
            folder.mkdir(parents=True, exist_ok=True)
        with progress(console, no_event, "drawing", len(chosen), "figures", quiet) as done:
            for count, name in enumerate(chosen, start=1):
                made = found[name]
                fit(made)
                write_figure_for_paper(folder / f"{name}.{format_.value}", made)
                done(count)
    say(folder)


def _check_names(names: Iterable[str], known: Collection[str], run: Run) -> None:
    for name in names:
        if known and name not in known:
            raise UserError(f"no figure {name!r}", str(run.path), meant(name, known))


def _inches(text: str) -> float:
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?(mm|cm|in)", text.strip())
    size = float(found[1]) / {"mm": 25.4, "cm": 2.54, "in": 1.0}[found[2]] if found else 0.0
    if not 1.5 <= size <= 40.0:
        what = "no width of a figure" if found is None else "a figure is 4 to 100 cm wide"
        raise UserError(what, Argument("width", text), "for example --width 88mm")
    return size
