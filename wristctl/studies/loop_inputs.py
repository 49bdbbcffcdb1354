"""What closed loops begin with: network, gains and parameters of earlier runs, and a wrist that does not buckle."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from wristctl.config.control import Row, SimulateSettings, TuneSettings
from wristctl.config.errors import UserError
from wristctl.config.loop import LONGEST_STEP, Loop, Reference, steps_within
from wristctl.config.study import Study
from wristctl.config.wording import Argument
from wristctl.config.wrist import WristParameters
from wristctl.records import Run
from wristctl.studies.findings import Findings
from wristctl.studies.inputs import Inputs

if TYPE_CHECKING:
    from wristctl.control.law import Conditions
    from wristctl.learning.network import Network
    from wristctl.studies.identify import Identified
    from wristctl.studies.train import Trained
    from wristctl.studies.tune import Tuned
    from wristctl.tuning.gains_file import Gains
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

NETWORK = "models/network.safetensors"


def check_row(row: Row | SimulateSettings, tuned: Gains | None) -> None:
    """UserError, naming the key, for an unknown controller, preset or gain, or gains that are not among the tuned."""
    from wristctl.control.table import controller, gains_of

    law = controller(row.controller)
    if row.gains == "tuned" and law.name not in (tuned or {}):
        fix = (Argument("tuned"), f", a tune run that tuned {law.name}")
        raise UserError(f"no tuned gains of {law.name}", "gains", fix)
    gains_of(law, row.gains, tuned)


def check_inverses(inverses: Iterable[str], network: Inverse | None) -> None:
    """UserError where a reference goes through a network and none is given."""
    if network is None and "network" in inverses:
        what = "the reference goes through a network, and none is given"
        raise UserError(what, "reference.inverse", Argument("network"))


def inverses_of(references: Iterable[Reference]) -> set[str]:
    """How the tip targets of these references become angles."""
    return {reference.inverse for reference in references}


def tuned_gains(inputs: Inputs) -> Gains | None:
    """The gains of the tuning among the inputs, by controller and name; None without one."""
    return inputs.read("tuned", _gains)


def tuned_on(inputs: Inputs) -> TuneSettings | None:
    """What the gains of the tuning among the inputs were tuned on; None without one."""
    return inputs.read("tuned", _tune_settings)


def network_for(inputs: Inputs, wrist: WristParameters, loops: Iterable[Loop]) -> Inverse | None:
    """The network of the training among the inputs at the wrist's pose and hand, None without one.

    UserError where it learned a wrist of another number of segments than the loops simulate.
    """
    network = inputs.read("network", _network)
    if network is None:
        return None
    others = sorted({loop.plant_segments for loop in loops} - {network.segments})
    if network.segments > 1 and others:
        run = inputs.runs().get("network")
        raise UserError(
            f"the network learned a wrist of {network.segments} segments, the loop has {others[0]}",
            str(run.file(NETWORK)) if run else "network",
            f"plant_segments: {network.segments} in every loop, or train on data with segments: {others[0]}",
        )
    pose = math.atan2(wrist.gravity[1], -wrist.gravity[0])
    at = network.at({"pose": pose, "hand_mass": wrist.hand_mass}) if network.others else network
    if at.domain.is_empty:
        log.warning("the study's pose or hand mass lies outside what the network learned: every angle is a guess")
    return at.along


def identified(study: Study, command: str, inputs: Inputs) -> Study:
    """The study with the parameters of the identification among the inputs, as it is without one."""
    from wristctl.identification.identified import with_identified

    text = inputs.read("from_identified", _identified_yaml)
    return study if text is None else with_identified(study, command, text)


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
            instead = f"; {', '.join(law.conditions)} is" if law.conditions else ""
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
        if loop.actuator.level == "tendon" and step > LONGEST_STEP * (1.0 + 1e-9):
            fewest = steps_within(loop.control_period)
            told = "integration steps of %.3g ms are too long for elastic tendons: substeps: null, or at least %d"
            log.warning(told, 1e3 * step, fewest)


def _gains(given: Run | Tuned) -> Gains:
    from wristctl.tuning.gains_file import read_gains

    return read_gains(given.file("data/gains.json")) if isinstance(given, Run) else given.gains


def _tune_settings(given: Run | Tuned) -> TuneSettings:
    return given.config.tune if isinstance(given, Run) else given.study.tune


def _network(given: Run | Trained) -> Network:
    from wristctl.learning.network_file import load_network

    return load_network(given.file(NETWORK)) if isinstance(given, Run) else given.network


def _identified_yaml(given: Run | Identified) -> str:
    if isinstance(given, Run):
        return given.file("data/identified.yaml").read_text(encoding="utf-8")
    return given.yaml
