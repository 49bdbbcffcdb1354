"""What stays of a study beside an identified wrist: the geometry by which its log was fitted, and what was given."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any

from wristctl.commands.adoption import bending_in, wound_in_both_planes
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import Found, found_in, with_found
from wristctl.config.study import Study
from wristctl.errors import Phrase, Setting
from wristctl.study_files.strict_yaml import KeyPath

log = logging.getLogger(__name__)

# What of a wrist's geometry no log tells by itself.
_GEOMETRY = "length", "discs", "tendon_radius"


def beside_identified(study: Study, section: str, inputs: Inputs, origins: Mapping[KeyPath, Phrase]) -> Study:
    """The study with the geometry by which the log of the identification among the inputs was fitted, which is said.

    Another that the study gives stays. Its `section`, by its key, names as kept what `origins` has of wrist, motors and
    sensors beside files: no log changes that. Places of tendons are none of it: they say which robot a log is of.
    Without an identification nothing is changed. Raises UserError where the input has found no wrist.
    """
    found = inputs.read("from_identified", found_in)
    if found is None:
        return study
    name = section.replace("-", "_")
    settings = getattr(study, name)
    typed = [tuple(map(str, path)) for path, where in origins.items() if isinstance(where, Setting)]
    kept = [*settings.kept, *_kept(typed, section)]
    if found.wrist is not None:
        own, given = {key: getattr(found.wrist, key) for key in _GEOMETRY}, study.wrist.model_fields_set
        taken = {key: value for key, value in own.items() if key not in given and value != getattr(study.wrist, key)}
        if taken:
            values = ", ".join(f"wrist.{key} = {value:.4g}" for key, value in taken.items())
            log.info("The log of %s was fitted with %s, which is taken here too.", found.run, values)
            study = study.model_copy(update={"wrist": study.wrist.model_copy(update=taken)})
        found.taken = [f"wrist.{key}" for key in taken]
        alike = {f"wrist.{key}" for key, value in own.items() if value == getattr(study.wrist, key)}
        kept = [key for key in kept if key not in alike]
    changed: dict[str, Any] = {"kept": tuple(dict.fromkeys(kept))}
    study = study.model_copy(update={name: settings.model_copy(update=changed)})
    return _wound(study, found) if section == "hw-run" and study.hw_run.rig is None else study


def _wound(study: Study, found: Found) -> Study:
    """The study of a board, real or emulated, that winds the tendons of the wrist that was found: if nobody gave others,
    and in both planes where these bend in both, if nobody gave planes.
    """
    wrist = with_found(study, "hw-run", found).wrist
    if not wound_in_both_planes(wrist):
        return study
    if "planes" not in study.hw_run.model_fields_set:
        study = bending_in(study, 2)
    if study.hw_run.planes == 2 and "tendons" not in study.wrist.model_fields_set:
        study = study.model_copy(update={"wrist": study.wrist.model_copy(update={"tendons": wrist.tendons})})
        log.info("The rig is taken to have the tendons that %s has found.", found.run)
    return study


def _kept(typed: Sequence[tuple[str, ...]], section: str) -> list[str]:
    """Keys that were given of what a log may tell: `wrist.damping`, `loop.sensor.frame_rate`."""
    wrist = [f"wrist.{path[1]}" for path in typed if path[0] == "wrist" and len(path) == 2 and path[1] != "tendons"]
    parts = [path[1:] for path in typed if path[0] == section and {*path[-2:-1]} & {"actuator", "sensor"}]
    return wrist + [".".join(path) for path in parts]
