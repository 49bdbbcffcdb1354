"""What was identified as a study file, and put into another study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wristctl.config.loop import Loop
from wristctl.config.strict_yaml import parse_yaml
from wristctl.config.study import Study
from wristctl.identification.unknowns import tendons_of_values

_WRIST = ("stiffness", "flexion_ratio", "damping", "tendon_radius")


def identified_yaml(values: Mapping[str, float], camera: Mapping[str, float]) -> str:
    """A study file: the wrist, and the actuator and sensor of `simulate`, with these parameters."""
    lines = ["wrist:", *(f"  {name}: {values[name]!r}" for name in _WRIST), "simulate:", "  loop:"]
    lines += [
        "    actuator:",
        "      level: tendon",
        *(f"      {name}: {each!r}" for name, each in tendons_of_values(values).items()),
    ]
    lines += ["    sensor:", "      level: camera", *(f"      {name}: {value!r}" for name, value in camera.items())]
    return "\n".join(lines) + "\n"


def with_identified(study: Study, command: str, text: str) -> Study:
    """The study with the values of an identified.yaml in its wrist and in every actuator and sensor of the command.

    Their levels stay as they are.
    """
    found = parse_yaml(text, "identified.yaml").data
    loop = found["simulate"]["loop"]
    parts = {name: {k: v for k, v in loop[name].items() if k != "level"} for name in ("actuator", "sensor")}
    name = command.replace("-", "_")
    settings = getattr(study, name)
    changed: dict[str, Any] = {}
    for leaf in type(settings).model_fields:
        value = getattr(settings, leaf)
        if isinstance(value, Loop):
            changed[leaf] = _known(value, parts)
        elif leaf == "loops":
            changed[leaf] = {key: _known(each, parts) for key, each in value.items()}
        elif leaf in parts:
            changed[leaf] = value.model_copy(update=parts[leaf])
    wrist = study.wrist.model_copy(update=found["wrist"])
    return study.model_copy(update={"wrist": wrist, name: settings.model_copy(update=changed)})


def _known(loop: Loop, parts: Mapping[str, Mapping[str, Any]]) -> Loop:
    return loop.model_copy(update={name: getattr(loop, name).model_copy(update=each) for name, each in parts.items()})
