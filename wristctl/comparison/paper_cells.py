"""Where a comparison can stand beside the paper's T2: on its wrist, on its move, with nothing that it does not have."""

from __future__ import annotations

from wristctl.comparison.combinations import course_name
from wristctl.comparison.condition_classes import class_of
from wristctl.config.loop import Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters

_PRINTED = ("discs", "springs", "tendons", "stiffness", "damping")
"""Of the wrist what the paper prints; what it does not (C10) may be anything."""
_MOVE_DEG = 30.0


def paper_cells(study: Study) -> frozenset[tuple[str, str]]:
    """Loops and references, by their names in a comparison, whose numbers may be those of T2: simulated, ulnar, 30 deg.

    A push, a payload, softer springs, motors or a camera are no part of it, nor is a motion that never rests.
    """
    chosen = study.compare
    if any(_differs(study.wrist, name) for name in _PRINTED):
        return frozenset()
    loops = [name for name, loop in chosen.loops.items() if class_of(loop, study.wrist) in ("ideal", "sampled")]
    moves = [each for each in chosen.references if _papers_move(each)]
    names = [course_name(each, "ulnar", chosen) for each in moves if "ulnar" in chosen.directions]
    return frozenset((loop, name) for loop in loops for name in names)


def _differs(wrist: WristParameters, name: str) -> bool:
    field = WristParameters.model_fields.get(name)
    return field is not None and getattr(wrist, name) != field.default


def _papers_move(reference: Reference) -> bool:
    single = reference.kind in ("step", "minimum-jerk") and reference.tip is None
    return single and abs(reference.end_deg - _MOVE_DEG) < 1e-9
