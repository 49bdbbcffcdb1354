"""What is recommended, as a study file: the wrist, the controller with its gains, and the rig that it is made for."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from wristctl.commands.recommend.answer import Candidate
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study

# What of a loop is the rig's.
_RIG = ("actuator", "sensor", "control_period")


def study_file(study: Study, best: Candidate, controller: str, reach_deg: float) -> str:
    """Text of the file for `simulate` and, where `hw-run` can have such a rig, for `hw-run`.

    Parameters
    ----------
    study
        the study whose wrist and `recommend.loop` it is recommended for
    best
        what is recommended
    controller
        its name, or the reference of its code beside the file
    reach_deg
        angle that the tendons hold [deg]; the motion of `hw-run` asks for no more
    """
    import yaml

    row = {"controller": controller, "gains": {name: float(f"{value:.6g}") for name, value in best.gains.items()}}
    content: dict[str, Any] = {
        "wrist": study.wrist.model_dump(mode="json", exclude_defaults=True),
        "simulate": row | {"loop": _rig(study)},
        "hw-run": {"controllers": [deepcopy(row)]},  # a study file has no aliases
    }
    if hw_run_fits(study):
        content["hw-run"] |= _rig(study) | _reference(study, reach_deg)
    head = f"# {best.label}, as `wristctl recommend` found it for this wrist on this rig: wristctl hw-run THIS"
    written = yaml.safe_dump({key: value for key, value in content.items() if value}, sort_keys=False, width=100)
    return f"{head}\n{written}"


def hw_run_fits(study: Study) -> bool:
    """Whether `hw-run` can have the rig: motors, tendons, a camera, and ticks that its board can follow."""
    try:
        HwRunSettings.model_validate(study.hw_run.model_dump(by_alias=True) | _rig(study))
    except ValidationError:
        return False
    return True


def next_command(study: Study, typed: Sequence[str], file: str) -> str:
    """The trial of what is recommended, or its simulation, on the files that were typed.

    Settings of the recommendation are none of it; what else was set is.
    """
    words = list(typed)
    places = [k for k, word in enumerate(words) if word.startswith("recommend.") and words[k - 1] == "--set"]
    kept = [word for k, word in enumerate(words) if k not in places and k + 1 not in places]
    return shlex.join(["wristctl", "hw-run" if hw_run_fits(study) else "simulate", *kept, file])


def _rig(study: Study) -> dict[str, Any]:
    return study.recommend.loop.model_dump(mode="json", include=set(_RIG))


def _reference(study: Study, reach_deg: float) -> dict[str, Any]:
    wanted = study.hw_run.reference.end_deg
    return {"reference": {"angle_deg": reach_deg}} if wanted > reach_deg else {}
