"""How a procedure is carried out where Python calls it: in memory, or as a run directory too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run
from wristctl.studies.counting import Watch, watched
from wristctl.studies.perform import perform, prepare, recording
from wristctl.studies.procedure import Found, Procedure
from wristctl.studies.unattended import Unattended

Ref = str | Path | Run
Folder = str | Path
RESULTS = "results"
"""Where runs are looked for when no folder is given."""


@contextmanager
def in_python() -> Iterator[None]:
    """Let errors speak of arguments and functions."""
    try:
        yield
    except UserError as error:
        error.in_python = True
        raise


def check_executor(named: str) -> None:
    """UserError for what names no executor."""
    from wristctl.work.executors import Workers

    Workers.of(named)


def carry_out(
    procedure: Procedure[Found], study: Study, given: Mapping[str, Any], out: Folder | None, label: str,
    progress: Watch | None, executor: str = "serial",
) -> Found:  # fmt: skip
    """Plan and perform a procedure with inputs by their roles; with a folder `out` it leaves a sealed run there."""
    folder, show = Path(RESULTS if out is None else out), watched(progress)
    prepared = prepare(procedure, study, folder, given)
    prepared.plan()
    check_executor(executor)
    if out is None:
        return perform(prepared, None, show, Unattended(), executor)
    with recording(prepared, folder, label, [f"wristctl.{procedure.kind.replace('-', '_')}()"]) as run:
        return perform(prepared, run, show, Unattended(), executor)
