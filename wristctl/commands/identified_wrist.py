"""An identified wrist as an input: what it has found, the study with it, and what stays of a study beside it."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from wristctl.board.messages import AXES
from wristctl.commands.adoption import bending_in, wound_in_both_planes
from wristctl.commands.inputs import IDENTIFIED, RATIOS, Inputs, check_wound
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import Phrase, Setting, UserError
from wristctl.plain_files import read_json
from wristctl.records import Run
from wristctl.study_files.strict_yaml import KeyPath

log = logging.getLogger(__name__)

# What of a wrist's geometry no log tells by itself.
_GEOMETRY = "length", "discs", "tendon_radius"
# What puts the identified motors and camera into a loop.
_RIG = "loop.actuator.level=tendon, loop.sensor.level=camera and loop.control_period=0.01 have them"


@dataclass
class Found:
    """What an identification has found, and whose run it is."""

    run: str
    yaml: str
    """Study file of the wrist; empty where a log told ratios alone."""
    ratios: Mapping[str, Any] | None = None
    said: bool = False
    """Whether a person has been told which settings are whose."""
    wrist: WristParameters | None = None
    """The settings by which a log was fitted; None of trials, whose runs have their own."""
    taken: Sequence[str] = ()
    """Settings that the study has from these."""


def found_in(earlier: Any) -> Found:
    """What a run or a result of `identify` has found. Raises UserError where that is no wrist."""
    if not isinstance(earlier, Run):
        found = Found("identify", getattr(earlier, "yaml", ""), getattr(earlier, "ratios", None))
    elif earlier.has(IDENTIFIED):
        found = Found(earlier.id, earlier.file(IDENTIFIED).read_text(encoding="utf-8"))
    else:
        found = Found(earlier.id, "", read_json(earlier.file(RATIOS)) if earlier.has(RATIOS) else None)
    study = earlier.config if isinstance(earlier, Run) else getattr(earlier, "study", None)
    if study is not None and study.identify.logs:
        found.wrist = study.wrist
    if not found.yaml and found.ratios is None:
        fix = "an identify run that did not refuse its logs or trials"
        raise UserError("no wrist was identified there", found.run, fix)
    return found


def with_found(study: Study, command: str, found: Found) -> Study:
    """The study with the wrist that was found. UserError where a log told ratios and nobody says the stiffness."""
    from wristctl.identification.unknowns import with_identified

    text, told = found.yaml, None
    if found.ratios is not None:
        from wristctl.identification.ratios import wrist_by_ratios

        ratios, kept = found.ratios, getattr(study, command.replace("-", "_")).kept
        if "wrist.stiffness" in kept:
            ratios = {**ratios, "values": {key: ratio for key, ratio in ratios["values"].items() if key != "force"}}
        wrist = wrist_by_ratios(ratios, study, found.run)
        if not found.said:
            log.info("%s", wrist.said(found.run, kept, found.taken))
            if command == "simulate" and study.simulate.loop.is_exact:
                log.info(
                    "Motors and camera are exact here: tendons, friction and delay of the log take no part; %s", _RIG
                )
        found.said = True
        text, told = wrist.yaml, {"wrist.stiffness", *wrist.told}
    known = with_identified(study, command, text)
    if command != "recommend":
        return known
    from wristctl.commands.recommend.own_rig import narrowed

    return narrowed(known, told)


def identified(study: Study, command: str, inputs: Inputs) -> Study:
    """The study with the parameters of the identification among the inputs, as it is without one.

    Raises UserError for a wrist with other tendons than the command bends.
    """
    found_by = inputs.read("from_identified", found_in)
    if found_by is None:
        return study
    found = with_found(study, command, found_by)
    if command == "hw-run":
        try:
            if study.hw_run.rig is not None:
                return _on_its_rig(study, found)
            check_wound(found.wrist, found.hw_run.planes, command)
            _check_same_tendons(study, found)
        except UserError as error:
            run = inputs.runs().get("from_identified")
            raise error.at(str(run.path) if run else "from_identified") from error
    return found


# Keys of an actuator that a log tells; the others are of motors, whose facts say them.
_OF_TENDONS = "tendon_stiffness", "friction", "sheath", "presliding"


def _on_its_rig(study: Study, found: Study) -> Study:
    """An identified wrist on a robot of one's own, whose motors and sensor are as its facts say: a log has the times at
    which its bends were true. UserError where it has other tendons.
    """
    _check_same_tendons(study, found)
    told = {key: getattr(found.hw_run.actuator, key) for key in _OF_TENDONS}
    motors = study.hw_run.actuator.model_copy(update=told)
    return found.model_copy(
        update={"hw_run": found.hw_run.model_copy(update={"actuator": motors, "sensor": study.hw_run.sensor})}
    )


def _check_same_tendons(study: Study, found: Study) -> None:
    """UserError where an identified wrist has another number of tendons than the rig winds."""
    from wristctl.trial.rig_belief import layout_of_rig

    layouts = [layout_of_rig(study.hw_run, wrist) for wrist in (study.wrist, found.wrist)]
    known, believed = (len(layout.places) if layout else AXES for layout in layouts)
    if known != believed:
        what = f"{believed} tendons were identified, and the rig has {known}"
        raise UserError(what, "from_identified", "identify a log of this rig: wristctl runs export latest:hw-run")


def wrist_identified(inputs: Inputs) -> str:
    """The wrist of the identification among the inputs, in words, by its run; empty without one."""
    if "from_identified" not in inputs:
        return ""
    run = inputs.runs().get("from_identified")
    return f"the wrist identified in {run.id}" if run else "the identified wrist"


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
    """The study of a board, real or emulated, that winds the tendons of a wrist that was found, if nobody gave others;
    in both planes where these bend in both, if nobody gave planes.
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
