"""Figures of a run that has ended, drawn anew: its study is performed once more, in memory."""

from __future__ import annotations

import math
from typing import Any

from wristctl.config.errors import UserError
from wristctl.records import Run
from wristctl.studies.inputs import Inputs
from wristctl.studies.perform import Prepared, perform, prepare
from wristctl.studies.procedures import procedure_of
from wristctl.studies.session import ShowProgress
from wristctl.studies.study_result import StudyResult
from wristctl.studies.unattended import Unattended

AGAIN = ("gen-data", "train", "tune", "compare", "simulate", "analyse", "hysteresis", "identify", "audit")
"""Kinds of runs that come out the same again."""
_ALIKE = 1e-6
"""Relative difference of metrics up to which a repetition shows what the run found."""


def redrawn(run: Run, show: ShowProgress) -> StudyResult:
    """What a run found, with all its figures, each drawn when it is asked for.

    UserError for a kind of run that cannot be had again, for one that did not end well, and where the repetition does
    not find what the run did: a figure of it would show something else.
    """
    if run.kind not in AGAIN:
        raise UserError(
            f"{run.kind} runs cannot be drawn again: they are no calculation",
            str(run.path),
            "take the PNG and SVG of the run's figures/",
        )
    if run.state != "ok":
        raise UserError(f"the run is {run.state}, not ok", str(run.path), "name one that ended ok")
    prepared = _prepared(run)
    found: StudyResult = perform(prepared, None, show, Unattended())
    again = {name: each["value"] for name, each in found.findings.metrics.items()}
    searched = run.kind == "compare" and run.config.compare.tuning is not None
    known = {name: each["value"] for name, each in run.metrics.items() if name in again or not searched}
    other = [name for name, value in known.items() if name not in again or not _alike(value, again[name])]
    if other:
        raise UserError(
            f"again it finds something else: {other[0]}{f' and {len(other) - 1} more' * (len(other) > 1)}",
            str(run.path),
            f"wristctl runs replay {run.id} says why",
            exit_code=3,
        )
    return found


def _prepared(run: Run) -> Prepared[Any]:
    """The run's study with its inputs; gains that a comparison searched for itself are those that it found."""
    procedure, study, out = procedure_of(run), run.config, run.path.parent
    prepared = prepare(procedure, study, out)
    if run.kind == "compare" and study.compare.tuning is not None:
        settled = study.compare.model_copy(update={"tuning": None})
        inputs = Inputs({**prepared.inputs, "tuned": run})
        return Prepared(procedure, study.model_copy(update={"compare": settled}), inputs)
    return prepared


def _alike(value: float | None, again: float | None) -> bool:
    known = [each for each in (value, again) if each is not None and math.isfinite(each)]
    return not known or (len(known) == 2 and math.isclose(*known, rel_tol=_ALIKE, abs_tol=1e-12))
