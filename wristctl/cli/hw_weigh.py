"""`wristctl hw weigh`: what load cells read, their zero, and their scale by a known weight."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wristctl.cli.hw_by_hand import Dry
from wristctl.cli.operator import idle, typed_line
from wristctl.cli.options import BAUD, Baud, Port, study_files
from wristctl.commands.printed_table import Table
from wristctl.errors import UserError
from wristctl.study_files.load import load_study

if TYPE_CHECKING:
    from wristctl.config.hw_run import LoadCells
    from wristctl.trial.weighing import Weighing


def weigh(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILE]", help="Study files with what is known of cells.", autocompletion=study_files),
    ] = None,
    mass: Annotated[
        float | None, typer.Option("--kg", min=0.1, help="Weight that is hung on one tendon's cell after the other.")
    ] = None,
    axis: Annotated[int | None, typer.Option("--axis", min=0, max=3, help="Weigh with this axis's cell alone.")] = None,
    port: Port = None, baud: Baud = BAUD, dry_run: Dry = False,
) -> None:  # fmt: skip
    """Read the tendons' load cells, take what they show as no pull, and with --kg find their scale; nothing moves.

    On stdout comes a study file for hw-run and calibrate-wrist.
    """
    from wristctl.board.driver import Board
    from wristctl.board.transport import open_transport
    from wristctl.config.hw_run import LoadCells
    from wristctl.trial import weighing
    from wristctl.wrist.directions import ACTIVE

    cells = load_study(files or (), (), "hw-run").hw_run.load_cells or LoadCells()
    if dry_run:
        weighed = "" if mass is None else f", then {mass:g} kg on each in turn, or on that of --axis"
        print(f"the load cells are read without a pull{weighed}; nothing moves")
        return
    with Board(open_transport(port, baud)) as board:
        _ask("All tendons slack, nothing hangs on a cell; then press Enter: ")
        empty = weighing.weigh(board)
        cells = weighing.tared(cells, empty)
        silent = weighing.silent_axes(empty)
        _tell(cells, empty)
        if len(silent) == 4:
            problem = "no load cell answers"
            fix = "see DOUT, PD_SCK and supply of the amplifiers (documentation: Load cells)"
            raise UserError(problem, fix=fix, exit_code=4)
        for one in [] if mass is None else range(4) if axis is None else [axis]:
            if axis is None and one in silent:
                continue
            _ask(f"Hang {mass:g} kg on the cell of axis {one} (tendon {ACTIVE[one]}) alone; then press Enter: ")
            loaded = weighing.weigh(board)
            assert mass is not None
            cells = weighing.scaled(cells, one, mass, empty, loaded)
            _tell(cells, loaded)
    print(_study(cells), end="")


def _ask(question: str) -> None:
    typer.echo(question, nl=False, err=True)
    typed_line(idle)
    typer.echo("", err=True)


def _tell(cells: LoadCells, weighing: Weighing) -> None:
    from wristctl.trial.weighing import newtons
    from wristctl.wrist.directions import ACTIVE

    pulls = newtons(cells, weighing.counts)
    rows = [
        (axis, ACTIVE[axis], "silent", "", "") if pull != pull
        else (axis, ACTIVE[axis], f"{counts:.1f}", f"{scatter:.1f}", f"{pull:.2f}")
        for axis, (counts, scatter, pull) in enumerate(zip(*weighing, pulls, strict=True))
    ]  # fmt: skip
    typer.echo(Table("", ("axis", "tendon", "counts", "scatter", "pull [N]"), rows).text(), err=True)


def _study(cells: LoadCells) -> str:
    lines = [f"    {name}: {_flow(value) if isinstance(value, Sequence) else value}" for name, value in cells]
    return "".join("\n".join([f"{section}:", "  load_cells:", *lines, ""]) for section in ("hw-run", "calibrate-wrist"))


def _flow(values: Sequence[float]) -> str:
    return f"[{', '.join(map(repr, values))}]"
