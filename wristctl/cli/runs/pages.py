"""`wristctl runs report` and `serve`."""

import hashlib
import logging
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.command import trusting
from wristctl.cli.options import RESULTS, Out, Quiet, TrustCode, run_ids
from wristctl.cli.output import say
from wristctl.cli.progress import listening, progress
from wristctl.cli.runs.drawing import draw_later
from wristctl.errors import TO, Argument, UserError
from wristctl.records import Run, open_run
from wristctl.records.files import write_text
from wristctl.records.find import entries

_log = logging.getLogger(__name__)


def report(
    refs: Annotated[
        list[str] | None,
        typer.Argument(metavar="[RUN...]", help="Runs: one, or several beside each other.", autocompletion=run_ids),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="A page of all runs instead: answers and pictures.")] = False,
    out: Out = RESULTS,
    to: Annotated[Path | None, typer.Option("--to", help="The file to write; by default beside the runs.")] = None,
    all_figures: Annotated[
        bool, typer.Option("--all-figures", help="Draw those too that the run left for later, into a folder beside it.")
    ] = False,
    trust_code: TrustCode = False,
    quiet: Quiet = False,
) -> None:
    """Write a page about one run, about several beside each other, or about all: one HTML file without a network.

    Where the folder of the runs cannot be written to, the page goes to the working directory.
    """
    if bool(refs) == all_:
        problem = "runs and --all" if refs else "no run is named"
        raise UserError(problem, "RUN", "name runs, for example latest:compare, or give --all alone")
    if all_:
        return _write(to, out / "index.html", _page_of_all(out, quiet))
    runs = [open_run(ref, out) for ref in refs or ()]
    with trusting(trust_code):
        text = _page_of(runs, all_figures, quiet)
    name = hashlib.sha256(" ".join(run.id for run in runs).encode()).hexdigest()[:6]
    _write(to, runs[0].path.parent / f"report-{runs[0].id if len(runs) == 1 else name}.html", text)


def _page_of(runs: list[Run], all_figures: bool, quiet: bool) -> str:
    from wristctl.plotting.page import page
    from wristctl.plotting.several_page import several_page

    if len(runs) > 1:
        return several_page(runs)
    return page(runs[0], runs[0].manifest, draw_later(runs[0], quiet) if all_figures else None)


def _page_of_all(out: Path, quiet: bool) -> str:
    from wristctl.plotting.index_page import index_page

    listed = entries(out)
    with listening(quiet, False) as console:  # noqa: SIM117 - it shows on the console
        with progress(console, "drawing", quiet, len(listed), "pictures") as advance:
            return index_page(out, listed, advance)


def _write(to: Path | None, beside: Path, text: str) -> None:
    """Write the page where it was asked for, or beside the runs, or else here; print where."""
    file = to or beside
    try:
        write_text(file, text, TO)
    except UserError as error:
        if to:
            raise
        _log.warning("%s (%s): the page is written here", error.what, error.where)
        file = Path(file.name)
        write_text(file, text)
    say(file)


def serve(
    out: Out = RESULTS,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="TCP port on this machine; 0: any.")] = 8010,
    browse: Annotated[bool, typer.Option("--open", help="Open it in the browser.")] = False,
) -> None:
    """Show the page of all runs in a browser on this machine, kept fresh while runs come; Ctrl-C ends it.

    Nobody else is served: it listens on the loopback interface alone, and reads files of runs only.
    """
    from wristctl.cli.runs.page_server import PageServer

    entries(out)  # what cannot be listed is said now
    try:
        server = PageServer(out, port)
    except OSError as error:
        fix = "end what listens there, or choose another: --port 0 takes any"
        raise UserError(f"cannot listen: {error.strerror}", Argument("port", str(port)), fix) from error
    with server:
        print(f"{server.url}  shows {out}; Ctrl-C ends it", flush=True)
        if browse:
            webbrowser.open(server.url)
        server.serve_forever()
