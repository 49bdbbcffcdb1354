"""What an open log tells without a force: ratios to the wrist's stiffness, which make a wrist once that is known.

The model is `arc_robot`'s single arc: a tendon of stiffness k at radius r weighs k r^2 / K, damping D counts as D / K,
where K is what the wrist shows in its pose, its springs and its weight together. A winch whose length arrives
`gain` times is a circle of tendons `gain` times smaller, of tendons gain^2 as stiff.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wristctl.config.study import Study
from wristctl.config.wrist import TendonPlace
from wristctl.errors import Setting, UserError
from wristctl.identification.measured_trials import MOST_DELAYED
from wristctl.identification.unknowns import identified_yaml, tendons_of_values
from wristctl.wrist.statics import straight_stiffness
from wristctl.wrist.tendon_layout import TendonLayout

if TYPE_CHECKING:
    from wristctl.identification.arc_fit import ArcFit
    from wristctl.identification.driven_robot import DrivenRobot

SCHEMA = "wristctl.ratios/1"
# Unknowns of the arc that a wrist's settings have.
_USED = ("gain", "tendon", "turn", "damping", "delay", "friction", "sheath", "presliding", "force")
# Of these the names as settings are identified by.
_FRICTION = {"friction": "friction", "sheath": "sheath_friction", "presliding": "presliding"}


def ratios_of(fit: ArcFit, rate: float | None) -> dict[str, Any]:
    """For JSON: each value that the data tell, the tendons' directions [rad] and radius [m], readings a second."""
    told = {name: one.value for name, one in fit.told.items() if name in _USED and one.known}
    robot = fit.robot
    return {
        "schema": SCHEMA,
        "values": told,
        "angles": [float(angle) for angle in robot.angles],
        "radius": robot.radius,
        "rate": rate,
    }


def ratios_of_driven(fit: ArcFit, robot: DrivenRobot, rate: float) -> dict[str, Any]:
    """As `ratios_of` of a log of tensions or currents: directions [rad] where all are told, the number of tendons.

    Of currents without a torque constant it has `drive` too.
    """
    told = {name: one.value for name, one in fit.told.items() if one.known}
    values = {name: told[name] for name in _USED if name in told and name != "force"}
    if robot.drive == "tension" and "stiffness" in told:
        values["force"] = told["stiffness"]
    names = [f"direction_{number}" for number in robot.numbers]
    directions = list(robot.angles) if robot.planar else [told[name] for name in names if name in told]
    whole = len(directions) == robot.tendons
    drive = {"drive": robot.drive} if robot.drive == "current" else {}
    return drive | {
        "schema": SCHEMA,
        "values": values,
        "angles": [float(angle) for angle in directions] if whole else [],
        "tendons": robot.tendons,
        "radius": robot.radius,
        "rate": rate,
    }


class LogWrist(NamedTuple):
    """A wrist by a log and by what was given beside it."""

    yaml: str
    """As `identified.yaml`."""
    told: dict[str, float | None]
    """Settings that the log tells, by their paths, with their values; None of what is no number."""
    given: list[str]
    assumed: list[str]
    """Those that stay as the study has them by default."""

    def said(self, run: str, kept: Sequence[str] = (), taken: Sequence[str] = ()) -> str:
        """Which settings are whose, in a sentence.

        `kept` are given though the log tells them, `loop.sensor.frame_rate`, ..., and `taken` are from the log's run.
        """
        own = {".".join(key.split(".")[-2:]) for key in kept}
        told = {name: value for name, value in self.told.items() if name not in own}
        values = [f"{name} = {value:.4g}" if value is not None else name for name, value in told.items()]
        parts = [f"the log of {run} tells {', '.join(values) or 'nothing of it'}"]
        given = [name for name in self.given if name not in taken] + [name for name in self.told if name in own]
        if given:
            parts.append(f"the study {', '.join(given)}")
        if taken:
            parts.append(f"the settings of that run {', '.join(taken)}")
        if self.assumed:
            parts.append(f"assumed as by default: {', '.join(self.assumed)}")
        return f"Of this wrist {'; '.join(parts)}."


def wrist_by_ratios(ratios: Mapping[str, Any], study: Study, run: str) -> LogWrist:
    """The wrist of a log's ratios, its stiffness by the log's tensions or by the study where that says it.

    Raises UserError where neither does.
    """
    values, wrist = dict(ratios["values"]), study.wrist
    stiffness = values.get("force")
    if stiffness is None and "stiffness" not in wrist.model_fields_set:
        currents = "the log with identify.torque_constant and identify.spool_radius, or " * ("drive" in ratios)
        or_log = f" with its N m/rad; or identify {currents}a log with tension_1 [N], ... of all tendons"
        problem = "its log tells ratios to the wrist's stiffness, and nobody has said that"
        raise UserError(problem, run, (Setting("wrist.stiffness=VALUE"), or_log))
    weight = float(straight_stiffness(wrist.model_copy(update={"pretension": 0.0}), 1)[0, 0]) - wrist.stiffness
    shown = wrist.stiffness + weight if stiffness is None else float(stiffness)
    if shown <= 0.0:
        fix = "more wrist.stiffness, or how it stands: wrist.gravity, wrist.hand_mass"
        raise UserError("a wrist of this stiffness buckles under its weight, and the log's did not", run, fix)
    _check_tendons(ratios, study, run)
    angles, radius, gain = ratios["angles"], float(ratios["radius"]), float(values.get("gain", 1.0))
    found = {"stiffness": shown - weight}
    if "gain" in values:
        found["tendon_radius"] = wrist.tendon_radius / gain
    if "damping" in values:
        found["damping"] = shown * float(values["damping"])
    if "tendon" in values:
        of_one = float(values["tendon"]) / _tendons_of_one(len(angles), study)
        found["tendon_stiffness"] = of_one * shown * (gain / radius) ** 2
    found |= {name: float(values[ratio]) for ratio, name in _FRICTION.items() if ratio in values}
    camera = dict[str, float]()
    if ratios["rate"] is not None and "delay" in values:
        camera = {"frame_rate": float(ratios["rate"])}
        camera["delay_frames"] = float(np.clip(values["delay"] * camera["frame_rate"], 0.0, MOST_DELAYED))
    places = _places(angles, float(values.get("turn", 0.0)), radius / gain, study)
    by_log = [name for name in ("stiffness", "tendon_radius", "damping") if name in found]
    told: dict[str, float | None] = {f"wrist.{name}": found[name] for name in by_log[0 if "force" in values else 1 :]}
    told |= {f"actuator.{name}": value for name, value in tendons_of_values(found).items()}
    told |= {f"sensor.{name}": value for name, value in camera.items()}
    if places:
        told["wrist.tendons"] = None
    given = sorted(f"wrist.{name}" for name in wrist.model_fields_set if f"wrist.{name}" not in told)
    weighs = ("wrist.stiffness", "wrist.damping", "wrist.length", "wrist.hand_mass", "wrist.hand_offset",
              "wrist.gravity", "actuator.tendon_stiffness", "actuator.friction", "sensor.delay_frames")  # fmt: skip
    assumed = [name for name in weighs if name not in (*told, *given)]
    return LogWrist(identified_yaml(found, camera, places), told, given, assumed)


def _check_tendons(ratios: Mapping[str, Any], study: Study, run: str) -> None:
    """UserError where the log does not tell the tendons' directions, and the study has other tendons."""
    own = sum(place.radius > 0.0 for place in TendonLayout.of(study.wrist).places)
    count = ratios.get("tendons", len(ratios["angles"]))
    if not ratios["angles"] and count != own:
        problem = f"its log does not tell the directions of its {count} tendons, and the study's wrist has {own}"
        named = {3: "three", 4: "four", 5: "five", 6: "six"}.get(count, "[...]")
        raise UserError(problem, run, (Setting(f"wrist.tendons={named}"), ", or their places"))


def _tendons_of_one(count: int, study: Study) -> int:
    """How many tendons of the wrist one of the log stands for: of two antagonists each is a side of a square's."""
    return 2 if count == 2 and TendonLayout.of(study.wrist).planes != 1 else 1


def _places(angles: list[float], turn: float, radius: float, study: Study) -> list[TendonPlace]:
    """Places of tendons that are not those of the study's wrist."""
    own = TendonLayout.of(study.wrist)
    if len(angles) == 2:
        return []
    at = sorted(round(math.degrees(angle + turn) % 360.0, 3) for angle in angles)
    if len(set(at)) < len(at) or at == sorted(round(math.degrees(place.angle) % 360.0, 3) for place in own.places):
        return []
    return [TendonPlace(angle_deg=math.degrees(angle + turn), radius=radius) for angle in angles]
