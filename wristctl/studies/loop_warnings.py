"""What a person should know before a closed loop's numbers are believed."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING

from wristctl.config.control import Row, SimulateSettings
from wristctl.config.loop import Loop, longest_step
from wristctl.config.wrist import WristParameters
from wristctl.studies.findings import Findings

if TYPE_CHECKING:
    from wristctl.control.law import Conditions

log = logging.getLogger(__name__)


def warn_if_outside(share: float) -> None:
    """Warn where this share of the wanted tips lies outside what the network learned."""
    if share > 0.0:
        log.warning("%.3g %% of the wanted tips lie outside what the network learned: guesses", 100.0 * share)


def warn_if_it_buckles(findings: Findings, wrist: WristParameters, loops: Iterable[Loop]) -> None:
    """Warn where the straight wrist of a loop has no stable equilibrium, and note it in the manifest."""
    from wristctl.simulation.worlds import plant_of
    from wristctl.wrist.statics import least_stiffness

    least = min(least_stiffness(plant_of(wrist, loop.plant), loop.plant_segments) for loop in loops)
    findings.numerics(least_stiffness=least, buckles=least <= 0.0)
    if least <= 0.0:
        log.warning("the straight wrist buckles: its least stiffness is %.3g N m/rad; only feedback can hold it", least)


def outside_conditions(rows: Iterable[Row | SimulateSettings], loops: Iterable[Loop]) -> list[str]:
    """In words each preset that is not made for a loop with motors, tendons and a camera."""
    from wristctl.control.table import controller

    real, found = [each for each in loops if each.actuator.level == "tendon" and each.sensor.level == "camera"], []
    presets = {(row.controller, row.gains) for row in rows if isinstance(row.gains, str) and row.gains != "tuned"}
    for name, preset in sorted(presets):
        law = controller(name)
        stated = law.conditions.get(preset)
        if real and stated is None:
            instead = f"; made for them: {', '.join(law.conditions)}" if law.conditions else ""
            found.append(f"{name}/{preset} is not made for elastic tendons behind a camera: it may swing{instead}")
        for loop in real:
            if stated and (told := _outside(stated, loop)):
                found.append(f"{name}/{preset} was made for {told}: it may swing (docs/margins.md)")
    return found


def warn_outside_conditions(rows: Iterable[Row | SimulateSettings], loops: Iterable[Loop]) -> None:
    """Warn of each of them."""
    for each in outside_conditions(rows, loops):
        log.warning("%s", each)


def _outside(stated: Conditions, loop: Loop) -> str:
    (fast, slow), (soft, stiff) = stated
    told = []
    if not fast <= loop.control_period <= slow:
        told.append(f"periods of {1e3 * fast:g} to {1e3 * slow:g} ms, not {1e3 * loop.control_period:g}")
    believed = loop.actuator.tendon_stiffness
    if not soft <= believed <= stiff:
        told.append(f"tendons of {soft / 1e3:g} to {stiff / 1e3:g} kN/m, not {believed / 1e3:g}")
    return " and ".join(told)


def warn_if_coarse(loops: Iterable[Loop]) -> None:
    """Warn where configured substeps are longer than elastic tendons allow."""
    for loop in loops:
        step = loop.control_period / loop.steps
        if loop.actuator.level == "tendon" and step > longest_step(loop.actuator) * (1.0 + 1e-9):
            told = "integration steps of %.3g ms are too long for elastic tendons: substeps: null, or at least %d"
            log.warning(told, 1e3 * step, loop.fewest_steps)
