"""What is recommended, as a study file: the wrist, the controller with its gains, and the rig that it is made for."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from wristctl.commands.recommend.answer import Candidate
from wristctl.config.compare import CompareSettings
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import Reference
from wristctl.config.study import Study

# What of a loop is the rig's.
_RIG = ("actuator", "sensor", "control_period")


def study_file(study: Study, rows: Sequence[Candidate], names: Sequence[str], reach_deg: float) -> str:
    """Text of the file for `simulate`, `compare` and, where `hw-run` can have such a rig, for `hw-run`.

    Parameters
    ----------
    study
        the study whose wrist and `recommend.loop` it is recommended for
    rows
        what `simulate` and `hw-run` take, and then what `compare` takes beside it
    names
        the controllers' names, or the references of their code beside the file
    reach_deg
        angle that the tendons hold [deg]; no motion asks for more
    """
    import yaml

    written = [_row(one, name) for one, name in zip(rows, names, strict=True)]
    content: dict[str, Any] = {
        "wrist": study.wrist.model_dump(mode="json"),
        "simulate": written[0] | {"loop": _rig(study)} | _within(study.simulate.reference, reach_deg),
        "compare": {"controllers": written, "loops": {"rig": _rig(study)}} | _moves(reach_deg),
        "hw-run": {"controllers": written[:1]},
    }
    if hw_run_fits(study):
        content["hw-run"] |= _rig(study) | _within(study.hw_run.reference, reach_deg)
    head = f"# {rows[0].label}, as `wristctl recommend` found it for this wrist on this rig: wristctl hw-run THIS"
    plain = json.loads(json.dumps(content))  # nothing twice, for which YAML would write an alias
    text = yaml.safe_dump(plain, sort_keys=False, width=100)
    return f"{head}\n{text}"


def hw_run_fits(study: Study) -> bool:
    """Whether `hw-run` can have the rig: motors, tendons, a camera, and ticks that its board can follow."""
    try:
        HwRunSettings.model_validate(study.hw_run.model_dump(by_alias=True) | _rig(study))
    except ValidationError:
        return False
    return True


def next_command(study: Study, typed: Sequence[str], file: str) -> str:
    """The trial of what is recommended, or its simulation, on the files that were typed.

    Settings of the recommendation are none of it, nor those of the wrist, which the file has; what else was set is.
    """
    words, own = list(typed), ("recommend.", "wrist.")
    places = [k for k, word in enumerate(words) if word.startswith(own) and words[k - 1] == "--set"]
    kept = [word for k, word in enumerate(words) if k not in places and k + 1 not in places]
    return shlex.join(["wristctl", "hw-run" if hw_run_fits(study) else "simulate", *kept, file])


def _rig(study: Study) -> dict[str, Any]:
    return study.recommend.loop.model_dump(mode="json", include=set(_RIG))


def _row(candidate: Candidate, name: str) -> dict[str, Any]:
    return {"controller": name, "gains": {gain: float(f"{value:.6g}") for gain, value in candidate.gains.items()}}


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
    return {"references": [move.model_dump(mode="json", exclude_defaults=True) for move in scaled]}
