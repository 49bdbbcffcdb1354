"""Warnings about a closed loop: buckling, coarse steps, presets out of their conditions, motions out of reach."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import ends_of_family, judged_loops
from wristctl.commands.printed_table import joined
from wristctl.commands.results import Findings
from wristctl.commands.study.published import what_changed
from wristctl.config.choices import CONTROLLERS
from wristctl.config.compare import CompareSettings
from wristctl.config.controller_row import BY_LOOP, Row
from wristctl.config.former_names import preset_today
from wristctl.config.loop import DirectionName, Loop, Reference, longest_step, sample_period
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.config.tune import TuneSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.comparison.controller_ranking import Ranking
    from wristctl.control.law import Conditions
    from wristctl.control.shipped_gains import ShippedGains
    from wristctl.simulation.planes import Asked


log = logging.getLogger(__name__)


def warn_if_outside(share: float) -> None:
    """Warn where this share of the wanted tips lies outside what the network learned."""
    if share > 0.0:
        log.warning("%.3g %% of the wanted tips lie outside what the network learned: guesses", 100.0 * share)


def warn_if_it_buckles(findings: Findings, wrist: WristParameters, loops: Iterable[Loop], planes: int) -> None:
    """Warn where the straight wrist of a loop has no stable equilibrium, and note it in the manifest."""
    from wristctl.simulation.worlds import plant_of
    from wristctl.wrist.spatial.spatial_statics import least_stiffness_at_pretension
    from wristctl.wrist.statics import least_stiffness

    of_wrist = least_stiffness if planes == 1 else least_stiffness_at_pretension
    least = min(of_wrist(plant_of(wrist, loop.plant), loop.plant_segments) for loop in loops)
    findings.numerics(least_stiffness=least, buckles=least <= 0.0)
    if least <= 0.0:
        log.warning("the straight wrist buckles: its least stiffness is %.3g N m/rad; only feedback can hold it", least)


def warn_of_first_repetitions(rows: Iterable[Row]) -> None:
    """Warn of controllers that learn over repetitions of a motion where each of their trials is a first one."""
    from wristctl.control.table import controller

    for name in dict.fromkeys(row.controller for row in rows):
        if controller(name).learning > 1:
            log.warning("%s learns over repetitions, and each trial is a first one: it has learned nothing there", name)


def outside_conditions(rows: Iterable[Row | SimulateSettings], loops: Iterable[Loop]) -> list[str]:
    """Presets that are not made for a loop with motors, tendons and a camera, in words."""
    from wristctl.control.shipped_gains import is_shipped, shipped_gains
    from wristctl.control.table import controller, preset_for

    real = [rig for rig in loops if rig.actuator.level == "tendon" and rig.sensor.level == "camera"]
    warnings = []
    presets = {(row.controller, row.gains) for row in rows if isinstance(row.gains, str) and row.gains != "tuned"}
    for name, preset in sorted(presets):
        law = controller(name)
        preset = preset_for(law, exact=False) if preset == BY_LOOP else preset
        if is_shipped(preset):
            warnings += _of_shipped(name, shipped_gains(law.name, preset), preset, real)
            continue
        stated = law.conditions.get(preset_today(preset, law.presets))
        if real and stated is None:
            instead = f"; made for them: {', '.join(law.conditions)}" if law.conditions else ""
            made = "untried with" if is_untried(name) else "not made for"
            warnings.append(f"{name}/{preset} is {made} elastic tendons behind a camera: it may swing{instead}")
        for loop in real:
            if stated and (mismatch := _outside(stated, loop)):
                warnings.append(f"{name}/{preset} was made for {mismatch}: it may swing (documentation: Limit cycles)")
    return warnings


def is_untried(name: str) -> bool:
    """Whether a controller is from elsewhere and states no conditions of any preset: nobody knows where it swings."""
    from wristctl.control.table import controller

    return CONTROLLERS.origin(name) is not None and not controller(name).conditions


def warn_of_lost(rows: Iterable[Row], loops: Iterable[Loop], rankings: Iterable[Ranking]) -> None:
    """Warn of each preset that is not made for its loop, and was lost with motors or a camera in these rankings.

    One that held there needs no warning, and of an untried one the rankings themselves say that it was lost.
    """
    lost = {
        label
        for ranking in rankings
        if ranking.traits.rig
        for row, label in enumerate(ranking.labels)
        if ranking.standing.lost[row].times or row in ranking.standing.unusable
    }
    told = [row for row in rows if row.label in lost and not is_untried(row.controller)]
    for warning in outside_conditions(told, loops):
        log.warning("%s", warning)


def warn_outside_conditions(rows: Iterable[Row | SimulateSettings], loops: Iterable[Loop]) -> None:
    """Warn of each preset that is not made for its loop, and of shipped gains of an earlier family or drive."""
    rows = list(rows)
    for warning in outside_conditions(rows, loops):
        log.warning("%s", warning)
    warn_of_earlier_families(rows)


def warn_of_earlier_families(rows: Iterable[Row | SimulateSettings]) -> None:
    """Warn of shipped gains whose family or simulated drive has changed since they were found, once of each family."""
    from wristctl.control.shipped_gains import PREFIX, is_shipped, shipped_gains
    from wristctl.control.table import controller

    warnings = dict[str, str]()
    for row in rows:
        if isinstance(row.gains, str) and is_shipped(row.gains):
            found = shipped_gains(controller(row.controller).name, row.gains)
            warnings[row.gains] = what_changed(row.gains.removeprefix(PREFIX), found.family_sha256, found.drive)
    for gains, changed in warnings.items():
        if changed:
            log.warning("%s: %s", gains, changed)


def _of_shipped(name: str, shipped: ShippedGains, label: str, loops: Iterable[Loop]) -> list[str]:
    """What speaks against shipped gains on loops with motors, tendons and a camera, in words."""
    warnings = []
    for loop in loops:
        if shipped.conditions is None:
            warnings.append(f"{name}/{label} is of a family without elastic tendons behind a camera: it may swing")
        elif mismatch := _outside(shipped.conditions, loop):
            warnings.append(f"{name}/{label} was found for {mismatch}: it may swing")
        if not shipped.reliable:
            lost = f"{shipped.lost} of {shipped.worlds} worlds"
            warnings.append(f"{name}/{label} fails, swings or chatters in {lost} of {shipped.run}")
    return list(dict.fromkeys(warnings))


def _outside(stated: Conditions, loop: Loop) -> str:
    (fast, slow), (soft, stiff) = stated
    mismatches = []
    if not fast <= loop.control_period <= slow:
        mismatches.append(f"periods of {1e3 * fast:g} to {1e3 * slow:g} ms, not {1e3 * loop.control_period:g}")
    believed = loop.actuator.tendon_stiffness
    if not soft <= believed <= stiff:
        mismatches.append(f"tendons of {soft / 1e3:g} to {stiff / 1e3:g} kN/m, not {believed / 1e3:g}")
    return " and ".join(mismatches)


def warn_if_coarse(loops: Iterable[Loop]) -> None:
    """Warn where configured substeps are longer than elastic tendons allow."""
    for loop in loops:
        step = loop.control_period / loop.steps
        if loop.actuator.winds and step > longest_step(loop.actuator) * (1.0 + 1e-9):
            message = "integration steps of %.3g ms are too long for elastic tendons: substeps: null, or at least %d"
            log.warning(message, 1e3 * step, loop.fewest_steps)


def warn_of_one_plane(wrist: WristParameters, asked: Iterable[Asked]) -> None:
    """Warn where loops that are to bend in one plane have what bends the wrist out of it."""
    from wristctl.simulation.planes import left_out

    if what := left_out(wrist, asked):
        log.warning("%s, which `planes: 1` leaves out", what)


class AskedMotion(NamedTuple):
    """A motion that a loop is asked for."""

    name: str
    """Name of the loop; empty where there is one alone."""
    loop: Loop
    reference: Reference
    direction: DirectionName
    horizon: float


class OutOfReach(NamedTuple):
    """A shortfall of one or more loops and motions."""

    where: str
    what: str
    fix: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}; {self.fix}"


def asked_by(study: Study, settings: SimulateSettings | TuneSettings | CompareSettings) -> list[AskedMotion]:
    """The motions of a section; of a family those at both ends of what they are drawn from, on its own loop.

    A family and the scenarios of `tune` have one plane, in which all angles count.
    """
    from wristctl.simulation.reference import toward

    if isinstance(settings, SimulateSettings):
        asked = toward(settings.reference, settings.direction)
        return [AskedMotion("", settings.loop, asked, settings.direction, settings.horizon)]
    if name := settings.worlds.family:
        family = study.families[name]
        return [
            AskedMotion(name, family.loop, reference, "ulnar", family.horizon) for reference in ends_of_family(family)
        ]
    if isinstance(settings, TuneSettings):
        scenarios = settings.scenarios
        return [AskedMotion(s.loop, settings.loops[s.loop], s.reference, "ulnar", settings.horizon) for s in scenarios]
    motions = [
        AskedMotion(name, loop, toward(reference, direction), direction, settings.horizon)
        for name, loop in settings.loops.items()
        for reference in settings.references
        for direction in settings.directions
    ]
    return motions + (asked_by(study, settings.tuning) if settings.tuning else [])


def out_of_reach(wrist: WristParameters, asked: Iterable[AskedMotion]) -> list[OutOfReach]:
    """Motions that the tendons cannot hold, by the statics of one segment; equal shortfalls are one entry."""
    from wristctl.simulation.reference import reference_name

    shortfalls: dict[tuple[str, str], dict[str, dict[str, None]]] = {}
    for request in asked:
        if (told := _not_held(wrist, request)) is not None:
            motion = reference_name(request.reference) + f", {request.direction}" * (request.direction != "ulnar")
            shortfalls.setdefault(told, {}).setdefault(motion, {})[request.name] = None
    unreachable = []
    for (reason, fix), motions in shortfalls.items():
        for loops in dict.fromkeys(map(tuple, motions.values())):
            names = ", ".join(motion for motion, on_loops in motions.items() if tuple(on_loops) == loops)
            unreachable.append(OutOfReach(names + (f" on {', '.join(loops)}" if any(loops) else ""), reason, fix))
    return unreachable


def warn_out_of_reach(findings: Findings, wrist: WristParameters, asked: Iterable[AskedMotion]) -> list[OutOfReach]:
    """Warn of each motion out of reach, and note it in the manifest."""
    unreachable = out_of_reach(wrist, asked)
    for shortfall in unreachable:
        log.warning("%s", shortfall)
    if unreachable:
        findings.numerics(out_of_reach=[str(motion) for motion in unreachable])
    return unreachable


def warn_of_loops(
    findings: Findings,
    study: Study,
    settings: SimulateSettings | TuneSettings | CompareSettings,
    asked: Sequence[Asked],
) -> list[OutOfReach]:
    """Warn of loops of a section that buckle or are integrated coarsely, of what is left out of one plane, and of
    motions out of reach; these are returned."""
    from wristctl.simulation.planes import planes_of

    loops = [settings.loop] if isinstance(settings, SimulateSettings) else list(judged_loops(study, settings).values())
    warn_if_it_buckles(findings, study.wrist, loops, planes_of(study.wrist, asked))
    warn_if_coarse(loops)
    warn_of_one_plane(study.wrist, asked)
    return warn_out_of_reach(findings, study.wrist, asked_by(study, settings))


def refuse_out_of_reach(study: Study, inputs: Inputs) -> None:
    """UserError where gains are to be searched on motions that no gains can hold; a sweep's points are warned of."""
    settings = study.tune
    unreachable = (
        [] if study.sweep else out_of_reach(identified(study, "tune", inputs).wrist, asked_by(study, settings))
    )
    if unreachable:
        first, family = unreachable[0], settings.worlds.family
        where = f"families.{family}.references" if family else "tune.scenarios"
        more = f" (and {len(unreachable) - 1} more)" if len(unreachable) > 1 else ""
        reason = f"no gains can help: {first.where}: {first.what}{more}"
        raise UserError(reason, where, f"{first.fix}; or go on with --force")


def _not_held(wrist: WristParameters, asked: AskedMotion) -> tuple[str, str] | None:
    """The bend that the tendons do not hold, and what helps, in words; tensions without limits hold every bend."""
    from wristctl.simulation.planes import Asked, motion_in, planes_of
    from wristctl.simulation.reference import by_angles, motion
    from wristctl.simulation.trajectory import size_of
    from wristctl.simulation.worlds import loop_facing, plant_of
    from wristctl.wrist.spatial.held_bends import share_held
    from wristctl.wrist.statics import shortfall
    from wristctl.wrist.tendon_layout import TendonLayout

    if not asked.loop.limits:
        return None
    reference, period = by_angles(asked.reference), sample_period(asked.loop.control_period)
    if planes_of(wrist, [Asked(asked.loop, asked.reference, asked.direction)]) == 2:
        bends = motion_in(2, reference, asked.direction, wrist, asked.horizon, period).bend_ref
        share = share_held(plant_of(wrist, asked.loop.plant), TendonLayout.of(wrist), bends)
        if share == 1.0:
            return None
        largest = math.degrees(float(size_of(bends).max()))
        held = "do not hold even the straight wrist"
        if share == share:
            most = _rounded(share * largest, math.floor) if share > 0.0 else 0.0
            held = f"hold at most {most:.3g} of the {largest:.3g} deg asked"
        fix = "a larger tension_limit or tendon_radius, or a smaller angle_deg would do"
        return f"tensions of {wrist.tension_limit:g} N {held}", fix
    facing, loop = loop_facing(wrist, asked.loop, asked.direction)
    theta = motion(reference, facing, asked.horizon, period).theta_ref
    if (most := math.degrees(float(abs(theta).max()))) > wrist.range_deg * (1.0 + 1e-12):
        problem = f"{reference.kind} asks for {most:.3g} deg, beyond the wrist's range of {wrist.range_deg:g} deg"
        raise UserError(problem, "reference", "other parameters of it, a smaller angle_deg, or widen wrist.range_deg")
    low, high = min(0.0, float(theta.min())), max(0.0, float(theta.max()))
    short = shortfall(plant_of(facing, loop.plant), low, high, loop.disturbances.load)
    if short is None:
        return None
    reason = (
        f"the tendons cannot hold {math.degrees(short.theta):.3g} deg, which asks for {abs(short.asked):.3g} N m where "
        f"{wrist.tension_limit:g} N give {abs(short.given):.3g}"
    )
    way = []
    if short.tension_limit > 0.0:
        way.append(f"a tension_limit of {_rounded(short.tension_limit, math.ceil):.3g} N")
    if abs(short.angle) > 0.0:  # nan where they do not hold it straight
        way.append(f"at most {_rounded(math.degrees(abs(short.angle)), math.floor):.3g} deg")
    way.append(f"a tendon_radius of {_rounded(short.tendon_radius, math.ceil):.3g} m")
    return reason, f"{joined(way, 'or')} would do"


def _rounded(value: float, way: Callable[[float], int]) -> float:
    """Round a value to three digits, up or down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return way(value / step) * step
