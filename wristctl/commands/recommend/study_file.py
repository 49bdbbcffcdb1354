"""What is recommended, as a study file: the wrist, the controller with its gains, and the rig that it is made for."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from wristctl.commands.kept_studies import asked_for, hw_run_fits, rig_of
from wristctl.config.compare import CompareSettings
from wristctl.config.loop import Reference
from wristctl.config.recommend import RecommendSettings
from wristctl.config.study import Study
from wristctl.study_files.resolved import sections_read


def sections_of(study: Study, reach_deg: float, planes: int = 1) -> Mapping[str, Mapping[str, Any]]:
    """Settings of `simulate`, `compare` and, where it can have the rig, `hw_run`, on the rig of `recommend.loop`.

    No motion asks for more than the angle that the tendons hold [deg]. All bend in so many planes. A robot of one's own
    has `hw_run` alone: its motors and sensor are in its facts.
    """
    if (own := own_rig(study)) is not None:
        return {"hw_run": {"rig": own} | _within(study.hw_run.reference, reach_deg)}
    rig, bends = rig_of(study.recommend.loop), {"planes": 2} if planes == 2 else {}
    sections: dict[str, Mapping[str, Any]] = {
        "simulate": {"loop": rig | bends} | _within(study.simulate.reference, reach_deg),
        "compare": {"loops": {"rig": rig | bends}} | _moves(reach_deg),
    }
    if hw_run_fits(study, study.recommend.loop):
        within = _within(study.hw_run.reference, reach_deg)
        sections["hw_run"] = rig | bends | _homing(study) | within | _emulated(study, planes)
    return sections


def homes(study: Study) -> bool:
    """Whether trials of what is recommended wind by the tendons' stretch that homing measures: those of the board."""
    homing = study.hw_run.homing
    says_believed = "stretch" in homing.model_fields_set and homing.stretch == "believed"
    return own_rig(study) is None and trial_of(study) == "hw-run" and not says_believed


def _homing(study: Study) -> dict[str, Any]:
    """Homing as the study states it, and what its trials take up of it."""
    stated = study.hw_run.homing.model_dump(mode="json", exclude_unset=True)
    return {"homing": stated | {"stretch": "measured"}} if homes(study) else {}


# What of tendons and camera an emulated rig has of its own.
_OF_TENDONS, _OF_CAMERA = ("tendon_stiffness", "friction", "sheath", "presliding"), ("frame_rate", "delay_frames")


def _emulated(study: Study, planes: int) -> dict[str, Any]:
    """The emulated rig with tendons and camera as the study states, or has identified, those of the rig; else empty.

    Where it states others of the emulated rig itself, these stay.
    """
    loop, usual = study.recommend.loop, RecommendSettings.model_fields["loop"].default
    cameras = ("camera", "camera_2") if planes == 2 else ("camera",)
    parts: dict[str, tuple[Any, Any, tuple[str, ...]]] = {"actuator": (loop.actuator, usual.actuator, _OF_TENDONS)}
    parts |= dict.fromkeys(cameras, (loop.sensor, usual.sensor, _OF_CAMERA))
    bench: dict[str, dict[str, Any]] = {}
    for part, (believed, default, names) in parts.items():
        own = getattr(study.hw_run.bench, part)
        stated = {name: getattr(believed, name) for name in names if getattr(believed, name) != getattr(default, name)}
        stated = {name: value for name, value in stated.items() if name not in own.model_fields_set}
        if "frame_rate" in stated and "exposure" not in own.model_fields_set:
            stated["exposure"] = min(own.exposure, 0.5 / stated["frame_rate"])
        if stated:
            bench[part] = stated
    return {"bench": bench} if bench else {}


def own_rig(study: Study) -> str | None:
    """The robot of one's own that the study is of: `recommend` is told it, or the study's trials are on it."""
    return study.recommend.rig or study.hw_run.rig


def trial_of(study: Study) -> str:
    """The command that tries what is recommended: `hw-run` where it can have the rig."""
    return "hw-run" if own_rig(study) is not None or hw_run_fits(study, study.recommend.loop) else "simulate"


def takers_of(study: Study) -> str:
    """The commands that take a file of gains, in words."""
    if own_rig(study) is not None:
        return "hw-run"
    return "simulate, compare and hw-run" if trial_of(study) == "hw-run" else "simulate and compare"


def next_command(study: Study, typed: Sequence[str], file: str) -> str:
    """The trial of what is recommended, or its simulation, on the files that were typed.

    Of what was set it has what that command reads beside the wrist, which the file has.
    """
    command = trial_of(study)
    words, taken = list(typed), {"seed", *sections_read(command)}
    sections = [word.partition("=")[0].partition(".")[0].replace("-", "_") for word in words]
    places = [k for k, section in enumerate(sections) if words[k - 1] == "--set" and section not in taken]
    kept = [word for k, word in enumerate(words) if k not in places and k + 1 not in places]
    own = own_rig(study)
    return shlex.join(["wristctl", command, *(["--rig", own] if own is not None else []), *kept, file])


def _within(reference: Reference, reach_deg: float) -> dict[str, Any]:
    """The reference to an angle as far as the tendons hold it; empty where it asks for no more."""
    beyond = reference.tip is None and abs(reference.end_deg) > reach_deg
    return {"reference": {"angle_deg": math.copysign(reach_deg, reference.end_deg)}} if beyond else {}


def _moves(reach_deg: float) -> dict[str, Any]:
    """The usual moves of `compare`, smaller where the tendons do not hold the largest; empty where they do."""
    moves = CompareSettings().references
    largest = max(abs(move.end_deg) for move in moves)
    if largest <= reach_deg:
        return {}
    scaled = [move.model_copy(update={"angle_deg": move.end_deg * reach_deg / largest}) for move in moves]
    return {"references": [*map(asked_for, scaled)]}
