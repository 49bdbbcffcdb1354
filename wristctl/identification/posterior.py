"""Draws of what trials leave open of a wrist's parameters, as a family of worlds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wristctl.identification.fit import Fit
from wristctl.identification.intervals import Knowledge
from wristctl.identification.unknowns import tendons_of_values

FAMILY = "posterior"
_OF_WRIST = ("stiffness", "flexion_ratio", "stiffness_axis_deg", "damping", "tendon_radius")
# Half the range of angles [deg] that every motion of the family is drawn from.
_ANGLE = 30


def posterior_draws(fit: Fit, knowledge: Knowledge, count: int, rng: np.random.Generator) -> list[dict[str, float]]:
    """Parameters drawn from the normal distribution of the fit's coordinates, with their correlations, within bounds.

    Parameters
    ----------
    fit : the fit, of whose coordinates the parameters follow
    knowledge : deviations, as wide as the intervals are, and correlations
    count : number of draws
    rng : random generator
    """
    free = len(fit.problem.free)
    deviation, correlation = knowledge.deviation[:free], knowledge.correlation[:free, :free]
    root = np.linalg.cholesky(correlation + 1e-9 * np.eye(free))
    low, high = (np.asarray(bound)[:free] for bound in fit.problem.bounds())
    draws = []
    for _ in range(count):
        x = fit.x.copy()
        x[:free] = np.clip(x[:free] + deviation * (root @ rng.normal(size=free)), low, high)
        draws.append(fit.problem.values(x))
    return draws


def posterior_yaml(
    draws: list[dict[str, float]], values: Mapping[str, float], camera: Mapping[str, float], period: float
) -> str:
    """The part of a study file with the family of these draws.

    Parameters
    ----------
    draws : parameters of each wrist
    values : parameters of the fit
    camera : its sensor
    period : time between two ticks of the trials [s], which is the loop's; of a longer one than a frame of the camera
        lasts, a frame's, since no simulated loop takes more than one
    """
    if "frame_rate" in camera:
        period = min(period, 1.0 / camera["frame_rate"])
    lines = [
        "families:", f"  {FAMILY}:", "    about: wrists that the identified trials leave possible", "    loop:",
        f"      control_period: {period!r}", "      actuator:", "        level: tendon",
        *(f"        {name}: {value!r}" for name, value in tendons_of_values(values).items()), "      sensor:",
        "        level: camera", *(f"        {name}: {value!r}" for name, value in camera.items()),
        f"    draw: {{reference.angle_deg: -{_ANGLE}..{_ANGLE}}}", "    horizon: 4.0", "    references:",
        "      - {kind: minimum-jerk, duration: 1.0}", "      - {kind: two-sided-sine, frequency: 0.5}",
        "      - {kind: ramp, duration: 0.5}", "      - {kind: limited-square, frequency: 0.3}", "    together:",
    ]  # fmt: skip
    for draw in draws:
        row = {f"plant.{name}": draw[name] for name in _OF_WRIST if name in draw}
        row |= {f"plant.actuator.{name}": value for name, value in tendons_of_values(draw).items()}
        if "delay_frames" in camera and "frame_rate" in camera:
            late = camera["delay_frames"] + camera["frame_rate"] * (draw["delay"] - values["delay"])
            row["plant.sensor.delay_frames"] = max(0.0, late)
        lines.append("      - {" + ", ".join(f"{key}: {float(value)!r}" for key, value in row.items()) + "}")
    return "\n".join(lines) + "\n"
