"""`wristctl runs report`."""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Refs
from wristctl.cli.say import say
from wristctl.config.errors import UserError
from wristctl.records import open_run
from wristctl.records.files import write_text

_log = logging.getLogger(__name__)


def report(
    refs: Refs,
    out: Out = RESULTS,
    to: Annotated[Path | None, typer.Option("--to", help="The file to write; by default beside the runs.")] = None,
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
    text = page(runs[0], runs[0].manifest) if len(runs) == 1 else several_page(runs)
    try:
        write_text(file, text)
    except UserError as error:
        if to:
            raise UserError(error.what, error.where, "name another file with --to") from error
        _log.warning("%s (%s): the page is written here", error.what, error.where)
        file = Path(file.name)
        write_text(file, text)
    say(file)
