"""How far tendons hold the wrist on the simulated rigs, of which most are to hold what is asked of them."""

from __future__ import annotations

import math

from wristctl.commands.recommend.expected import FAMILY, TOLERATED
from wristctl.commands.recommend.own_rig import drawn_of_facts
from wristctl.commands.recommend.study_file import homes
from wristctl.config.families import Family
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.simulation.drawn_worlds import asked_of, believed_world_of
from wristctl.simulation.planes import Asked, planes_of
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.spatial.held_bends import held_all_around
from wristctl.wrist.statics import shortfall
from wristctl.wrist.tendon_layout import TendonLayout

# Angle [deg] that the tendons must hold for a motion to be worth a search.
LEAST_DEG = 5.0
# Most rigs on which it is looked for.
_RIGS = 100


def asked_of_rigs(study: Study) -> list[Asked]:
    """The simulated rigs with what they are asked for, before it is known whether that is in two planes."""
    return asked_of(_family(study, LEAST_DEG))


def _family(study: Study, largest_deg: float, planes: int = 1) -> Family:
    """As `RecommendSettings.family`; of a robot of one's own with what is drawn from its facts."""
    family = study.recommend.family(largest_deg, planes).model_copy(update={"homed": homes(study)})
    return family if study.recommend.rig is None else drawn_of_facts(study, family)


def family_of_rigs(study: Study, largest_deg: float) -> Family:
    """The simulated rigs, in two planes where anything takes them out of one. Raises UserError."""
    return _family(study, largest_deg, planes_of(study.wrist, asked_of_rigs(study)))


def reach_deg(study: Study) -> float:
    """Largest whole angle [deg] that the tendons hold on 19 of 20 simulated rigs, at most the wanted.

    To both sides of one plane, in two planes to any side, against each rig's own load.
    """
    settings, planes = study.recommend, planes_of(study.wrist, asked_of_rigs(study))
    wanted = min(settings.largest_deg, study.wrist.range_deg)
    family, count = _family(study, wanted, planes), min(settings.tests, _RIGS)
    rigs = [believed_world_of(family, FAMILY, "test", study.seed, number, study.wrist) for number in range(count)]
    held = sorted(_held_deg(study.wrist, rig, wanted, planes) for rig in rigs)
    return float(math.floor(held[int(TOLERATED * count)]))


def _held_deg(wrist: WristParameters, rig: Loop, wanted: float, planes: int) -> float:
    """Angle [deg], at most the wanted, that the tendons of one rig hold."""
    if not rig.limits:
        return wanted
    actual, load, held = _as_pulled(wrist, rig, wanted), rig.disturbances.load, wanted
    if planes == 2:
        return held_all_around(actual, TendonLayout.of(actual), abs(load), wanted)
    for toward in (-1.0, 1.0):
        bound = math.radians(toward * wanted)
        short = shortfall(actual, min(bound, 0.0), max(bound, 0.0), load)
        if short is not None:
            held = min(held, 0.0 if math.isnan(short.angle) else math.degrees(abs(short.angle)))
    return held


def _as_pulled(wrist: WristParameters, rig: Loop, wanted: float) -> WristParameters:
    """A rig's wrist with the tensions that reach it where motors wind as far as its controller lets them.

    A tendon that is softer than believed pulls as much less, and what rubs in its sheath and along a bend of the wanted
    angle [deg] takes its share (Euler and Eytelwein): of the pulling side, and of the other, which it adds to.
    """
    actual = plant_of(wrist, rig.plant)
    if not rig.actuator.winds:
        return actual
    motors = rig.plant.actuator.of(rig.actuator)
    firmer = motors.tendon_stiffness / rig.actuator.tendon_stiffness
    rubs = math.exp(motors.friction * (motors.sheath + math.radians(wanted)))
    limits = {"tension_limit": firmer / rubs * actual.tension_limit, "pretension": firmer * rubs * actual.pretension}
    return actual.model_copy(update=limits)
