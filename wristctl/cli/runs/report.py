"""`wristctl runs report`."""

from __future__ import annotations

import hashlib
import logging
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out, Quiet, TrustCode
from wristctl.cli.progress import listening, progress
from wristctl.cli.runs.run_options import RESULTS, Refs
from wristctl.cli.say import say
from wristctl.cli.trust_code import asked_to_trust
from wristctl.config.errors import UserError
from wristctl.config.trust import asking
from wristctl.config.wording import TO
from wristctl.records import Run, open_run
from wristctl.records.files import write_text
from wristctl.records.index import DRAWN
from wristctl.studies.counting import no_event

_log = logging.getLogger(__name__)


def draw_later(run: Run, quiet: bool) -> Path:
    """Draw what a run left for later, into a folder beside it."""
    from wristctl.records.formats import write_figure
    from wristctl.studies.redraw import redrawn

    folder = run.path.parent / f"{DRAWN}{run.id}"
    with listening(quiet, False) as console:
        found = redrawn(run, partial(progress, console, quiet=quiet)).figures
        left = [name for name in found if not (run.path / "figures" / f"{name}.svg").exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with progress(console, no_event, "drawing", len(left), "figures", quiet) as done:
            for count, name in enumerate(left, start=1):
                write_figure(folder / name, found[name])
                done(count)
    return folder


def report(
    refs: Refs,
    out: Out = RESULTS,
    to: Annotated[Path | None, typer.Option("--to", help="The file to write; by default beside the runs.")] = None,
    all_figures: Annotated[
        bool, typer.Option("--all-figures", help="Draw those too that the run left for later, into a folder beside it.")
    ] = False,
    trust_code: TrustCode = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Write a page about one run, or about several beside each other: one HTML file that needs no network.

    Where the folder of the runs cannot be written to, the page goes to the working directory.
    """
    from wristctl.report.comparison_page import several_page
    from wristctl.report.page import page

    runs = [open_run(ref, out) for ref in refs]
    name = hashlib.sha256(" ".join(run.id for run in runs).encode()).hexdigest()[:6]
    file = to or runs[0].path.parent / f"report-{runs[0].id if len(runs) == 1 else name}.html"
    with asking(partial(asked_to_trust, trust_code)):
        drawn = draw_later(runs[0], quiet) if all_figures and len(runs) == 1 else None
        text = page(runs[0], runs[0].manifest, drawn) if len(runs) == 1 else several_page(runs)
    try:
        write_text(file, text, TO)
    except UserError as error:
        if to:
            raise
        _log.warning("%s (%s): the page is written here", error.what, error.where)
        file = Path(file.name)
        write_text(file, text)
    say(file)
