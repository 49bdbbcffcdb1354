"""Study files that a run keeps for the next command: gains that were found, and what they were found on."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from wristctl.board.messages import AXES
from wristctl.commands.results import Findings
from wristctl.config.choices import CONTROLLERS, REFERENCES, RIGS
from wristctl.config.foreign import PLAIN
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import Loop, Reference
from wristctl.config.study import Study
from wristctl.errors import UserError

# Folder of a run with a file for each controller.
FOLDER = "data/controllers"
# What of a loop is the rig's.
RIG = ("actuator", "sensor", "control_period")


def file_of(label: str) -> str:
    """Name in the run of the file for a controller, or a controller with words in brackets."""
    return f"{FOLDER}/{re.sub(r'[^A-Za-z0-9_]+', '-', label).strip('-')}.yaml"


def row_of(controller: str, gains: Mapping[str, float], digits: int | None = None) -> dict[str, Any]:
    """A controller with its gains, to so many digits or whole, as a study file has it."""
    values = {name: float(value if digits is None else f"{value:.{digits}g}") for name, value in gains.items()}
    return {"controller": controller, "gains": values}


def rig_of(loop: Loop) -> dict[str, Any]:
    """Motors, tendons, camera and timing of a loop."""
    return loop.model_dump(mode="json", include=set(RIG))


def hw_run_fits(study: Study, loop: Loop) -> bool:
    """Whether `hw-run` can have the loop's rig: motors, tendons that its board winds, a camera, and ticks that it can
    follow."""
    from wristctl.wrist.tendon_layout import off_both_sides, wound_by

    try:
        if off_both_sides(study.wrist) is not None:
            wound_by(study.wrist, AXES)
        HwRunSettings.model_validate(study.hw_run.model_dump(by_alias=True) | rig_of(loop))
    except (UserError, ValidationError):
        return False
    return True


def asked_for(reference: Reference) -> dict[str, Any]:
    """A reference as a study file has it."""
    return reference.model_dump(mode="json", exclude_defaults=True)


def keep_study(findings: Findings, file: str, title: str, content: Mapping[str, Any]) -> None:
    """Write a study file into the run, if there is one: code and files by the run's copies, which count from there."""
    if findings.run is None:
        return
    up, home, code = "../" * file.count("/"), f"{findings.run.path.absolute()}/", findings.run.code
    tables = {"controller": CONTROLLERS, "controllers": CONTROLLERS, "kind": REFERENCES, "rig": RIGS}

    def here(key: str, value: Any) -> Any:
        if isinstance(value, dict):
            return {name: here(name, entry) for name, entry in value.items()}
        if isinstance(value, list):
            return [here(key, entry) for entry in value]
        if not isinstance(value, str):
            return value
        origin = tables[key].origin(value) if key in tables else None
        reference = origin.reference if origin else value
        if reference in code:
            return up + code[reference]
        return up + value.removeprefix(home) if value.startswith(home) else value

    findings.text(file, study_text(title, here("", content)))


def gains_content(study: Study, rows: Sequence[Mapping[str, Any]], **sections: Mapping[str, Any]) -> dict[str, Any]:
    """Content of the file: the whole wrist, so that no file before it shows through, and three sections.

    Controllers from elsewhere have their settings too.
    """
    names = {str(row["controller"]).removesuffix(PLAIN) for row in rows}
    own = {name: dict(values) for name, values in study.controller_settings.items() if name in names}
    return {
        "wrist": study.wrist.model_dump(mode="json"),
        **({"controller-settings": own} if own else {}),
        "simulate": {**rows[0], **sections.get("simulate", {})},
        "compare": {"controllers": [*rows], **sections.get("compare", {})},
        "hw-run": {"controllers": [rows[0]], **sections.get("hw_run", {})},
    }


def study_text(title: str, content: Mapping[str, Any]) -> str:
    """Text of a study file."""
    import yaml

    plain = json.loads(json.dumps(content))  # nothing twice, for which YAML would write an alias
    return f"# {title}\n{yaml.safe_dump(plain, sort_keys=False, width=100)}"
