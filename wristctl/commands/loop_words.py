"""A loop in words, for people who know control and nothing of this project: wrist, motion, plant, rig, controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.wrist import WristParameters

_ACTUATORS = {"ideal": "", "lagged": "motors with a lag", "tendon": "stepper motors and elastic tendons"}


def controller_words(name: str, gains: str | Mapping[str, float]) -> str:
    """A controller with its gains: smc with its printed gains, pid with Kp = 10, Ki = 2."""
    from wristctl.control.table import controller

    law = controller(name)
    if not law.gains:
        return law.name
    if isinstance(gains, str):
        return f"{law.name} with {'tuned' if gains == 'tuned' else f'its {gains}'} gains"
    return f"{law.name} with {', '.join(f'{gain} = {value:.3g}' for gain, value in gains.items())}"


def motion_words(reference: Reference, direction: DirectionName = "ulnar") -> str:
    """A wanted motion: 30 deg ulnar in 1 s (minimum jerk)."""
    from wristctl.config.choices import REFERENCES
    from wristctl.simulation.reference import reference_name

    if REFERENCES[reference.kind].plane:
        return reference_name(reference)
    if reference.tip is None and reference.kind == "minimum-jerk":
        return f"{reference.end_deg:g} deg {direction} in {reference.duration:g} s (minimum jerk)"
    if reference.tip is None and reference.kind == "step":
        return f"a step of {reference.end_deg:g} deg {direction}"
    return f"{reference_name(reference)}, {direction}"


def wrist_words(wrist: WristParameters) -> str:
    """The paper's wrist, or another one by its length and stiffness."""
    if wrist == WristParameters():
        return "the paper's wrist"
    return f"a wrist of {1e3 * wrist.length:g} mm and {wrist.stiffness:g} N m/rad"


def loop_words(loop: Loop, wrist: WristParameters) -> str:
    """Segments, motors, camera, what the controller does not know, and how often it acts."""
    from wristctl.simulation.worlds import World, mismatches

    count, sensor = loop.plant_segments, loop.sensor
    parts = [f"{count} {'hinge' if loop.plant.model == 'hinges' else 'segment'}{'s' * (count > 1)}"]
    parts += [_ACTUATORS[loop.actuator.level]] * (loop.actuator.level != "ideal")
    parts += [f"a camera of {sensor.frame_rate:g} Hz"] * (sensor.level == "camera")
    parts += ["tensions without a limit"] * (not loop.limits)
    parts += _disturbances(loop)
    if unknown := [mismatch.key.rpartition(".")[2].replace("_", " ") for mismatch in mismatches(World(loop, wrist))]:
        parts.append(f"a plant unlike the controller's model in {listed(unknown)}")
    return ", ".join([*parts, f"controller every {1e3 * loop.control_period:g} ms"])


def _disturbances(loop: Loop) -> list[str]:
    disturbances = loop.disturbances
    parts = []
    if disturbances.push.force:
        parts.append(f"a push of {disturbances.push.force:g} N at {disturbances.push.start:g} s")
    if disturbances.load:
        parts.append(f"a constant load of {disturbances.load:g} N")
    if disturbances.drift.scale != 1.0:
        parts.append(f"a stiffness that drifts to {disturbances.drift.scale:g} times")
    return parts


def listed(parts: Sequence[str], last: str = "and") -> str:
    """Parts of a sentence as a list: a, b and c."""
    *earlier, end = parts
    return f"{', '.join(earlier)} {last} {end}" if earlier else end
