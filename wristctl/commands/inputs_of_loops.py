"""Inputs of closed loops: network and gains of earlier runs, and a wrist that does not buckle."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from wristctl.commands.inputs import Inputs
from wristctl.config.compare import CompareSettings
from wristctl.config.controller_row import BY_LOOP, Row
from wristctl.config.families import Family
from wristctl.config.loop import Loop, Reference
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.config.tune import TuneSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import Argument, Call, UserError, meant, under
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.control.table import Gains
    from wristctl.learning.network import Network
    from wristctl.simulation.planes import Asked
    from wristctl.wrist.kinematics import Inverse

log = logging.getLogger(__name__)


def check_row(row: Row | SimulateSettings, tuned: Gains | None, run: Run | None = None) -> None:
    """UserError, naming the key, for an unknown controller, preset or gain, or gains that are not among the tuned.

    `run` is where those are from.
    """
    from wristctl.control.table import controller, gains_of

    law = controller(row.controller)
    if row.gains == BY_LOOP:
        return
    if row.gains == "tuned" and law.name not in (tuned or {}):
        looked = f" in {run.id}, which tuned {', '.join(tuned or ()) or 'nothing'}" if run else ""
        fix = (Argument("tuned"), f", a tune run that tuned {law.name}: `", Call("runs ls"), "` shows the runs")
        raise UserError(f"no tuned gains of {law.name}{looked}", "gains", fix)
    gains_of(law, row.gains, tuned)


def check_searched(names: Iterable[str]) -> None:
    """UserError, naming its place, for a controller that is unknown or has no gains to search."""
    from wristctl.control.table import controller
    from wristctl.tuning.search import check_tunable

    for number, name in enumerate(names):
        try:
            check_tunable(controller(name))
        except UserError as error:
            raise error.at(f"controllers.{number}") from error


def with_what_there_is(study: Study, inputs: Inputs) -> tuple[Study, list[str]]:
    """A comparison without the rows that want a tune run, and the inverse that wants a network, where none is given.

    And what is left out that somebody asked for, in words. Gains `tuned:worlds` are those shipped of the family that is
    compared on. Where nothing would be left, and where a run is given that lacks some gains, the study stays as it is:
    what it lacks is an error.
    """
    from wristctl.control.shipped_gains import OF_WORLDS, PREFIX

    settings, left_out = study.compare, list[str]()
    if family := settings.worlds.family:
        of_family = {"gains": f"{PREFIX}{family}"}
        rows = tuple(row.model_copy(update=of_family) if row.gains == OF_WORLDS else row for row in settings.rows)
        settings = settings.model_copy(update={"rows": rows})
    searched = settings.tuning.controllers if settings.tuning is not None else ()
    if "tuned" not in inputs:
        rows = tuple(row for row in settings.rows if row.gains != "tuned" or row.controller in searched)
        if rows and len(rows) < len(settings.rows):
            missing = [row.label for row in settings.rows if row not in rows]
            left_out.append(f"{', '.join(missing)} (no tune run is given)")
            settings = settings.model_copy(update={"rows": rows})
    inverses = tuple(inverse for inverse in settings.inverses if inverse != "network")
    if "network" not in inputs and inverses and inverses != settings.inverses and not settings.worlds.family:
        if "inverses" in settings.model_fields_set:  # else nobody asked for a network
            left_out.append("references through a network (no train run is given)")
        settings = settings.model_copy(update={"inverses": inverses})
    return study if settings is study.compare else study.model_copy(update={"compare": settings}), left_out


def check_reach(references: Iterable[Reference], wrist: WristParameters, where: str, planes: int = 1) -> None:
    """UserError for the first reference that asks for more than the wrist's range, or whose course fails."""
    import numpy as np

    from wristctl.simulation.planes import motion_in
    from wristctl.simulation.reference import by_angles

    for number, reference in enumerate(references):
        try:
            asked = motion_in(planes, by_angles(reference), None, wrist, 1.0, 0.1)
            asked.angles.into(np.empty((3 * planes, 10)))
        except UserError as error:
            if not error.where.startswith("reference"):  # in a file
                raise
            raise error.at(where.format(number) + error.where.removeprefix("reference")) from error


def ends_of_family(family: Family) -> list[Reference]:
    """The motions of a family with all that is drawn of them at its lower end, then at its upper end."""
    ends = [dict.fromkeys(family.draw, share) for share in (0.0, 1.0 - 1e-12)]
    return [family.motion(number, shares) for shares in ends for number in range(len(family.references))]


def check_family_reach(study: Study, name: str) -> None:
    """As `check_reach` for the motions of a family, at both ends of what is drawn; an unknown family has none."""
    from wristctl.simulation.planes import planes_of

    motions = ends_of_family(study.families.get(name, Family()))
    half = len(motions) // 2
    planes = planes_of(study.wrist, asked_of_family(study, name))
    for part in (motions[:half], motions[half:]):
        check_reach(part, study.wrist, f"families.{name}.references.{{}}", planes)


def asked_of_family(study: Study, name: str) -> list[Asked]:
    """The loops of a family with what they are asked for; none of an unknown one."""
    from wristctl.simulation.drawn_worlds import asked_of

    return asked_of(study.families[name]) if name in study.families else []


def asked_of_search(study: Study) -> list[Asked]:
    """The loops of the study's `tune` section with what they are asked for."""
    from wristctl.tuning.search import asked_by

    family = study.tune.worlds.family
    return asked_of_family(study, family) if family else asked_by(study.tune)


def asked_of_comparison(study: Study) -> list[Asked]:
    """The loops of the study's `compare` section with what they are asked for."""
    from wristctl.comparison.combinations import asked_by

    family = study.compare.worlds.family
    return asked_of_family(study, family) if family else asked_by(study.compare)


def asked_of_simulation(study: Study) -> list[Asked]:
    """The loop of the study's `simulate` section with what it is asked for."""
    from wristctl.simulation.planes import Asked

    return [Asked(study.simulate.loop, study.simulate.reference, study.simulate.direction)]


def planes_of_simulation(study: Study) -> int:
    """Planes that the loop of the study's `simulate` section bends in. Raises UserError."""
    from wristctl.simulation.planes import planes_of

    with under("simulate"):
        return planes_of(study.wrist, asked_of_simulation(study))


# Time between two samples of a reference in two planes by which it is checked before a run [s].
_CHECKED = 0.01


def check_motion(study: Study, planes: int) -> None:
    """UserError for a motion of the study's `simulate` section that the wrist cannot be asked for in so many planes."""
    from wristctl.simulation.closed_loop import asked_of
    from wristctl.simulation.reference import by_angles

    chosen = study.simulate
    if planes == 1:
        check_reach([chosen.reference], study.wrist, "reference")
    else:
        by_bends = chosen.model_copy(update={"reference": by_angles(chosen.reference)})
        asked_of(study.model_copy(update={"simulate": by_bends}), min(_CHECKED, chosen.horizon / 4.0))


def why_two_planes(wrist: WristParameters, asked: Iterable[Asked], which: str = "") -> str:
    """In which planes all loops bend, and why, a sentence; empty where they stay in one. Raises UserError."""
    from wristctl.simulation.planes import why_two

    reason = why_two(wrist, asked)
    return f"All loops{which} bend in two planes: {reason}." if reason else ""


def check_inverses(inverses: Iterable[str], inputs: Inputs) -> None:
    """UserError where a reference goes through a network and none is among the inputs."""
    if "network" in inverses and "network" not in inputs:
        reason = "the reference goes through a network, and none is given"
        raise UserError(reason, "reference.inverse", Argument("network"))


def check_inverse(reference: Reference, inputs: Inputs) -> None:
    """`check_inverses` of the one reference of a command; a warning where it does not go through a network given."""
    check_inverses([reference.inverse], inputs)
    if "network" in inputs and reference.inverse != "network":
        log.warning("the reference does not go through the network that is given: that takes inverse: network")


def check_tuned(rows: Iterable[Row | SimulateSettings], inputs: Inputs) -> None:
    """Warn of a tune run among the inputs whose gains no row takes."""
    if "tuned" in inputs and not any(row.gains == "tuned" for row in rows):
        log.warning("no controller takes the gains of the tune run that is given: that takes gains: tuned")


def inverses_of(references: Iterable[Reference]) -> set[str]:
    """Inverses that turn the tip targets of these references into angles."""
    return {reference.inverse for reference in references}


def tuned_gains(inputs: Inputs) -> Gains | None:
    """The gains of the tuning among the inputs, by controller and name; None without one."""
    return inputs.read("tuned", _gains)


def tuned_on(inputs: Inputs) -> TuneSettings | None:
    """Settings of the tuning among the inputs; None without one."""
    return inputs.read("tuned", _tune_settings)


def network_for(inputs: Inputs, wrist: WristParameters, loops: Iterable[Loop], planes: int = 1) -> Inverse | None:
    """The network of the training among the inputs at the wrist's pose and hand, None without one.

    UserError where it learned a wrist of another number of segments, or bends in other planes, than the loops simulate.
    """
    from wristctl.learning.dataset import attitude
    from wristctl.learning.network_file import NETWORK

    network = inputs.read("network", _network)
    if network is None:
        return None
    run = inputs.runs().get("network")
    where = str(run.file(NETWORK)) if run else "network"
    other_segments = sorted({loop.plant_segments for loop in loops} - {network.segments})
    if network.segments > 1 and other_segments:
        raise UserError(
            f"the network learned a wrist of {network.segments} segments, the loop has {other_segments[0]}",
            where,
            f"plant_segments: {network.segments} in every loop, or train on data with segments: {other_segments[0]}",
        )
    if network.planes != planes:
        learned, bends = ("one plane" if count == 1 else "two planes" for count in (network.planes, planes))
        fix = f"train on data of this wrist with gen-data.planes: {planes}"
        raise UserError(f"the network learned bends in {learned}, and the loop bends in {bends}", where, fix)
    pose, roll = attitude(wrist)
    at_pose = network.at({"pose": pose, "roll": roll, "hand_mass": wrist.hand_mass}) if network.others else network
    if at_pose.domain.is_empty:
        log.warning("the study's pose or hand mass lies outside what the network learned: every angle is a guess")
    return at_pose.along


def _gains(earlier: Any) -> Gains:
    from wristctl.control.table import read_gains

    return read_gains(earlier.file("data/gains.json")) if isinstance(earlier, Run) else earlier.gains


def _tune_settings(earlier: Any) -> TuneSettings:
    return earlier.config.tune if isinstance(earlier, Run) else earlier.study.tune


def _network(earlier: Any) -> Network:
    from wristctl.learning.network_file import NETWORK, load_network

    return load_network(earlier.file(NETWORK)) if isinstance(earlier, Run) else earlier.network


def family_of(families: Mapping[str, Family], name: str, where: str) -> Family:
    """The family of this name; UserError with the nearest one if there is none."""
    if name not in families:
        fix = meant(name, families) if families else "give one in `families`: experiments/scenarios has some"
        raise UserError(f"unknown family of worlds '{name}'", where, fix)
    return families[name]


def judged_loops(study: Study, settings: TuneSettings | CompareSettings) -> Mapping[str, Loop]:
    """The loops that gains are tuned or rows judged on, by name; of a family its loop before anything is drawn."""
    name = settings.worlds.family
    return {name: family_of(study.families, name, "worlds.family").loop} if name else settings.loops


def compared_inverses(study: Study) -> Iterable[str]:
    """Inverses that turn the tip targets of the compared references into angles."""
    name = study.compare.worlds.family
    return inverses_of(study.families[name].references) if name else study.compare.inverses
