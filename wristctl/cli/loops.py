"""What closed loops begin with: the network and gains of earlier runs, and a wrist that does not buckle."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.cli.command import Session
from wristctl.config.control import Row, SimulateSettings
from wristctl.config.errors import UserError
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)

Gains = Mapping[str, Mapping[str, float]]


def check_row(row: Row | SimulateSettings, tuned: Gains | None) -> None:
    """UserError, naming the key, for an unknown controller, preset or gain, or gains that are not among the tuned."""
    from wristctl.control.table import controller, gains_of

    gains_of(controller(row.controller), row.gains, tuned)


def network_of(session: Session) -> Inverse | None:
    """The network of the session's train run at the study's pose and hand, None without one.

    UserError where it learned a wrist of another number of segments than the loops simulate.
    """
    from wristctl.learning.network_file import load_network

    run = session.inputs.get("network")
    if run is None:
        return None
    file = run.file("models/network.safetensors")
    network, wrist, settings = load_network(file), session.study.wrist, session.settings
    loops = settings.loops.values() if hasattr(settings, "loops") else [settings.loop]
    others = sorted({loop.plant_segments for loop in loops} - {network.segments})
    if network.segments > 1 and others:
        raise UserError(
            f"the network learned a wrist of {network.segments} segments, the loop has {others[0]}",
            str(file),
            f"plant_segments: {network.segments} in every loop, or train on data with segments: {others[0]}",
        )
    pose = math.atan2(wrist.gravity[1], -wrist.gravity[0])
    at = network.at({"pose": pose, "hand_mass": wrist.hand_mass}) if network.others else network
    if at.domain.is_empty:
        log.warning("the study's pose or hand mass lies outside what the network learned: every angle is a guess")
    return at.along


def identified(session: Session, command: str) -> Session:
    """The command's session with the parameters of its identify run in its study, as it is without one."""
    from wristctl.identification.identified import with_identified

    run = session.inputs.get("from_identified")
    if run is None:
        return session
    text = run.file("data/identified.yaml").read_text(encoding="utf-8")
    study = with_identified(session.study, command, text)
    return replace(session, study=study, settings=getattr(study, command.replace("-", "_")))


def tuned_of(inputs: Mapping[str, Run]) -> Gains | None:
    """The gains of the tune run among a command's inputs, None without one."""
    from wristctl.tuning.gains_file import read_gains

    run = inputs.get("tuned")
    return read_gains(run.file("data/gains.json")) if run else None


def tuned_study(inputs: Mapping[str, Run]) -> Study | None:
    """The study of the tune run among a command's inputs, None without one."""
    from wristctl.config.load import load_study

    run = inputs.get("tuned")
    return load_study([run.file("config.yaml")]) if run else None


def warn_if_outside(share: float) -> None:
    """Warn where this share of the wanted tips lies outside what the network learned."""
    if share > 0.0:
        log.warning("%.3g %% of the wanted tips lie outside what the network learned: guesses", 100.0 * share)


def warn_if_it_buckles(session: Session, loops: Iterable[Loop]) -> None:
    """Warn where the straight wrist of a loop has no stable equilibrium, and note it in the manifest."""
    from wristctl.simulation.worlds import plant_of
    from wristctl.wrist.statics import least_stiffness

    wrist = session.study.wrist
    least = min(least_stiffness(plant_of(wrist, loop.plant), loop.plant_segments) for loop in loops)
    session.run.numerics(least_stiffness=least, buckles=least <= 0.0)
    if least <= 0.0:
        log.warning("the straight wrist buckles: its least stiffness is %.3g N m/rad; only feedback can hold it", least)
