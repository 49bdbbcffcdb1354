"""Recorded motions that a study names: seen to before anything is computed or written."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from wristctl.config.errors import UserError
from wristctl.config.loop import Reference
from wristctl.config.resolved import sections_read
from wristctl.config.section import Section
from wristctl.config.study import Study


def check_motions(study: Study, command: str) -> None:
    """See that every recording of the sections that a command reads is one, and within the wrist's range.

    Raises UserError with file and line.
    """
    for section in sections_read(command):
        for reference in _recordings(getattr(study, section)):
            _check(reference, study.wrist.range_deg)


def _recordings(section: Any) -> Iterator[Reference]:
    if isinstance(section, Reference):
        if section.file:
            yield section
    elif isinstance(section, Section):
        for name in type(section).model_fields:
            yield from _recordings(getattr(section, name))
    elif isinstance(section, dict | tuple):
        for each in section.values() if isinstance(section, dict) else section:
            yield from _recordings(each)


def _check(reference: Reference, range_deg: float) -> None:
    import numpy as np

    from wristctl.simulation.recording import recording_of

    angle = np.rad2deg(reference.value("scale") * recording_of(reference).arc[0])
    most = float(np.abs(angle).max())
    if most > range_deg:
        what = f"the recording bends by {most:.4g} deg, beyond the wrist's range of +-{range_deg:g} deg"
        fix = "scale it, see to the unit in its header, or widen wrist.range_deg"
        raise UserError(what, str(reference.file), fix)
