"""Which controller with which gains to run on one's own wrist: presets scaled to it, tuned and tested on drawn rigs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import FROM_IDENTIFIED, Inputs
from wristctl.commands.inputs_of_loops import check_searched, why_two_planes
from wristctl.commands.kept_studies import gains_content, keep_study, row_of
from wristctl.commands.loop_warnings import warn_if_coarse, warn_if_it_buckles, warn_of_one_plane
from wristctl.commands.procedure import Procedure
from wristctl.commands.recommend.answer import (
    RECOMMENDED,
    Limit,
    Recommended,
    files_table,
    sine_deg,
)
from wristctl.commands.recommend.expected import (
    FAMILY,
    SCALED,
    TOLERATED,
    TUNED,
    Candidate,
    asked_for,
    expected,
    spread,
)
from wristctl.commands.recommend.study_file import next_command, own_rig, sections_of, takers_of, trial_of
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.config.families import Family, TuningWorlds
from wristctl.config.loop import Reference
from wristctl.config.recommend import in_any_direction
from wristctl.config.study import Study
from wristctl.config.tune import Objective, TuneSettings
from wristctl.errors import UserError, under

if TYPE_CHECKING:
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.control.law import Controller
    from wristctl.simulation.cases import Measured
    from wristctl.tuning.search import Search

# Weight of swings in a search [decades]: gains that swing on any rig of a search are not wanted.
_SWINGING = 3.0
# What is drawn of what a hand carries.
_CARRIED = "plant.payload", "plant.hand_mass"
# What the limits of motion and payload are told by.
_SWINGS = ("rmse", "oscillation", "sustained")
# Rigs on which the limits of motion and payload are looked for.
_RIGS_AT_LIMITS = 12
# Time of a rollout at short steps over that of a search's; seconds of limits and figures, and of rehearsals.
_CLOSELY, _DRAWN, _REHEARSED = 2.0, 6.0, 40.0
# Relative difference of two gains that is none: a search begins at the preset, to its last bit but one.
_ALIKE = 1e-9


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controllers, and that the tendons reach what is asked for. Raises UserError."""
    from wristctl.commands.recommend.own_rig import on_the_rig
    from wristctl.commands.recommend.reach import LEAST_DEG, asked_of_rigs, family_of_rigs, reach_deg
    from wristctl.commands.recommend.rehearsals import check_homing
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import Size, check_size
    from wristctl.simulation.planes import planes_of

    study = on_the_rig(identified(study, "recommend", inputs))
    settings = study.recommend
    with under("recommend"):
        check_searched(settings.controllers)
    reach = reach_deg(study)
    if reach < LEAST_DEG:
        reason = f"the tendons hold the wrist to {reach:g} deg only: no controller can help"
        fix = "a larger tension_limit or tendon_radius, a softer wrist, or a lighter hand"
        known = _reach_identified(study, reach)
        if known is not None and known >= LEAST_DEG:
            fix += f"; or wristctl identify: with springs and tendons known they hold {known:g} deg"
        raise UserError(reason, "wrist", fix)
    family, asked = family_of_rigs(study, reach), asked_of_rigs(study)
    check_homing(study, planes_of(study.wrist, asked))
    searched = settings.candidates * settings.iterations * settings.draws + settings.validation * settings.candidates
    rollouts = sum(controller(name).learning for name in settings.controllers)
    count = rollouts * len(family.references) * (searched + 2 * settings.tests)
    check_size(Size([settings.loop], settings.horizon, count), planes_of(study.wrist, asked))
    bending = " in two planes" * bool(why_two_planes(study.wrist, asked))
    return (
        f"{', '.join(settings.controllers)} tuned on {settings.draws} simulated rigs and tested on {settings.tests} "
        f"others, motions of up to {reach:g} deg{bending}: about {count} rollouts of {settings.horizon:g} s"
    )


def recommend(session: Session) -> Recommended:
    """Scale presets to the wrist, tune each controller shortly, test all on rigs that no search has seen."""
    from wristctl.commands.recommend.own_rig import on_the_rig, said_of_facts
    from wristctl.commands.recommend.reach import asked_of_rigs, family_of_rigs, reach_deg
    from wristctl.commands.recommend.rehearsals import check_homing
    from wristctl.control.table import controller
    from wristctl.simulation.drawn_worlds import streams_of
    from wristctl.tuning.scaled_presets import scaled_to

    known, findings = identified(session.study, "recommend", session.inputs), session.findings
    study = on_the_rig(known)
    settings, reach = study.recommend, reach_deg(study)
    asked = asked_of_rigs(study)
    family, bending = family_of_rigs(study, reach), why_two_planes(study.wrist, asked)
    planes = 2 if bending else 1
    warn_if_it_buckles(findings, study.wrist, [settings.loop], planes)
    warn_if_coarse([settings.loop])
    warn_of_one_plane(study.wrist, asked)
    facts = "" if settings.rig is None else said_of_facts(study)
    check_homing(study, planes)
    for split in ("tune", "validation", "test"):
        findings.note_streams(streams_of(family, FAMILY, split))
    scaled = [scaled_to(study.wrist, controller(name)) for name in settings.controllers]
    searches = _searches(session, study, family, scaled)
    candidates = _candidates(scaled, searches)
    ranking = _tested(session, study, family, candidates)
    tables = [files_table([candidates[row] for row in ranking.standing.order], takers_of(study))]
    result = Recommended(
        session.study, findings, tables, reach, candidates, ranking, searches, [], [], "", facts=facts, bending=bending,
        reach_identified=_reach_identified(study, reach),
    )  # fmt: skip
    result = _rehearsed(session, study, result, planes)
    if result.best is None:
        return _recorded(known, result)
    with session.progress("how fast and how heavy"):
        motions = [
            _limit(study, result.best, rate, _sines(family, reach, rate, planes)) for rate in settings.frequencies
        ]
        payloads = [_limit(study, result.best, mass, _laden(family, mass)) for mass in settings.payloads]
    if result.rehearsals:
        result = replace(result, on_the_trial=expected(study, result.best, family, reach, planes))
    file = str(findings.run.path / RECOMMENDED) if findings.run else RECOMMENDED
    command = next_command(study, session.typed, file)
    return _recorded(known, replace(result, motions=motions, payloads=payloads, next_command=command))


def _reach_identified(study: Study, reach: float) -> float | None:
    """Angle [deg] that the tendons would hold, were they and the springs known; None where nobody asks for more."""
    from wristctl.commands.recommend.reach import reach_deg

    settings = study.recommend
    if settings.rig is not None or reach >= math.floor(min(settings.largest_deg, study.wrist.range_deg)):
        return None
    return reach_deg(study.model_copy(update={"recommend": settings.measured()}))


def _afterwards(study: Study) -> float:
    """Seconds that rehearsals, limits and figures take."""
    return _DRAWN + _REHEARSED * bool(study.recommend.rehearsed and own_rig(study) is None)


def _searches(session: Session, study: Study, family: Family, scaled: Sequence[Controller]) -> dict[str, Search]:
    from wristctl.tuning.search import judges_of, search

    settings = study.recommend
    tuning = study.model_copy(
        update={
            "families": {FAMILY: family},
            "tune": TuneSettings(
                controllers=settings.controllers, optimiser="differential-evolution",
                candidates=settings.candidates, iterations=settings.iterations, finalists=settings.candidates,
                objective=Objective(swinging=_SWINGING),
                worlds=TuningWorlds(family=FAMILY, draws=settings.draws, validation=settings.validation),
            ),
        }
    )  # fmt: skip
    judges, searches = judges_of(tuning), dict[str, "Search"]()
    searching, choosing = settings.iterations * settings.draws, _CLOSELY * settings.validation
    total, ended = (searching + choosing) * sum(law.learning for law in scaled), 0.0
    then = 2.0 * _CLOSELY * settings.tests / (settings.candidates * (searching + choosing))
    with session.progress("tuning", 100, "%", then, _afterwards(study)) as advance:
        for law in scaled:

            def searched(result: Search, before: float = ended, learning: int = law.learning) -> None:
                advance(round(100.0 * (before + learning * settings.draws * len(result.tried.values)) / total))

            def chosen(percent: int, before: float = ended, learning: int = law.learning) -> None:
                advance(round(100.0 * (before + learning * (searching + choosing * percent / 100.0)) / total))

            told = nullcontext(chosen)
            searches[law.name] = search(tuning, law, session.findings.stream, judges, searched, choosing=told)
            ended += law.learning * (searching + choosing)
    return searches


def _candidates(scaled: Sequence[Controller], searches: Mapping[str, Search]) -> list[Candidate]:
    """What is tested: of each controller its scaled preset and its tuned gains where these are others; feedforward."""
    from wristctl.tuning.objective import YARDSTICK

    candidates = []
    for law, found in zip(scaled, searches.values(), strict=True):
        last = list(law.presets.values())[-1:]
        preset = dict(zip(law.gains, law.values(last[0]), strict=True)) if last else {}
        candidates += [Candidate(law.name, SCALED, preset)] * bool(preset)
        same = bool(preset) and all(math.isclose(found.gains[name], preset[name], rel_tol=_ALIKE) for name in preset)
        candidates += [Candidate(law.name, TUNED, dict(found.gains))] * (not same)
    return [*candidates, Candidate(YARDSTICK, "", {})]


def _tested(session: Session, study: Study, family: Family, candidates: Sequence[Candidate]) -> WorldRanking:
    import numpy as np

    from wristctl.comparison.world_ranking import RANKED, measured_row, ranking
    from wristctl.control.table import controller
    from wristctl.simulation.cases import measure
    from wristctl.simulation.drawn_worlds import drawn_cases

    tests = study.recommend.tests
    cases = drawn_cases(family, FAMILY, "test", study.seed, tests, study.wrist)
    measured: list[Measured] = []
    with session.progress("testing", len(candidates), "candidates", after=_afterwards(study)) as advance:
        for number, candidate in enumerate(candidates, start=1):
            law = controller(candidate.controller)
            gains = np.array([list(law.values(candidate.gains))])
            measured.append(measure(law, gains, cases, study.wrist, RANKED))
            advance(number)
    labels = [candidate.label for candidate in candidates]
    rows = [measured_row(label, own, measured[-1], tests) for label, own in zip(labels, measured, strict=True)]
    return ranking(FAMILY, family, rows, tolerated=TOLERATED)


def _rehearsed(session: Session, study: Study, result: Recommended, planes: int) -> Recommended:
    """The result with its best candidates rehearsed on the emulated rig, some at a time, until one is sound there."""
    from wristctl.commands.recommend.rehearsals import rehearsed

    at_once = study.recommend.rehearsed
    if not at_once or own_rig(study) is not None or trial_of(study) != "hw-run" or result.best_row is None:
        return result
    while result.untried:
        rows = result.untried[:at_once]
        finalists = [row_of(one.controller, one.gains) for one in map(result.candidates.__getitem__, rows)]
        runs = rehearsed(session, study, finalists, result.reach_deg, planes)
        result = replace(result, rehearsals={**result.rehearsals, **dict(zip(rows, runs, strict=True))})
        if result.best_row is not None:
            break
    return result


def _sines(family: Family, reach: float, frequency: float, planes: int) -> Family:
    """The rigs asked for a sine to both sides, in two planes an ellipse, for at least two of its periods."""
    horizon = float(max(family.horizon, math.ceil(2.0 / frequency)))
    if planes == 1:
        sine = Reference(kind="two-sided-sine", frequency=frequency, angle_deg=sine_deg(reach))
        return asked_for(family, [sine], horizon)
    ellipse = {"kind": "ellipse", "turn": 1.0 / frequency, "angle_deg": sine_deg(reach)}
    asked = asked_for(family, [Reference.model_validate(ellipse)], horizon)
    return asked.model_copy(update={"draw": in_any_direction(asked.draw, asked.references)})


def _laden(family: Family, mass: float) -> Family:
    """The rigs whose hand carries this mass [kg] and nothing else that nobody told of."""
    draw = {key: source for key, source in family.draw.items() if key not in _CARRIED}
    plant = family.loop.plant.model_copy(update={"payload": mass})
    return family.model_copy(update={"draw": draw, "loop": family.loop.model_copy(update={"plant": plant})})


def _limit(study: Study, best: Candidate, value: float, family: Family) -> Limit:
    """How the recommended gains do on a family of which one thing has this value."""
    import numpy as np

    from wristctl.control.table import controller
    from wristctl.simulation.cases import measure
    from wristctl.simulation.drawn_worlds import drawn_cases
    from wristctl.tuning.objective import YARDSTICK

    cases = drawn_cases(family, FAMILY, "test", study.seed, _RIGS_AT_LIMITS, study.wrist)
    own, open_loop = (
        measure(law, np.array([law.values(gains)]), cases, study.wrist, _SWINGS)
        for law, gains in ((controller(best.controller), best.gains), (controller(YARDSTICK), {}))
    )
    lost = (own.failed | own.swings_beside(open_loop)).reshape(_RIGS_AT_LIMITS, -1).any(axis=1)
    error = float(np.nanmedian(own.metrics["rmse"]))
    return Limit(value, _RIGS_AT_LIMITS, int(lost.sum()), error, own.largest_swing(open_loop))


def _recorded(study: Study, result: Recommended) -> Recommended:
    """The result, its figures, tables and study file written; `study` has the wrist that was identified."""
    from wristctl.commands.recommend.figures import errors, limits
    from wristctl.comparison.world_ranking import worlds_frame

    findings, ranked, best = result.findings, result.ranking, result.best
    findings.table("data/ranking.csv", result.frame())
    findings.table("data/rigs.csv", worlds_frame(ranked))
    findings.metric("reach_deg", result.reach_deg, "deg", "higher", meaning="angle held on 19 of 20 simulated rigs")
    caption = "Error of each controller over the simulated rigs: median, 95 of 100 rigs, and each rig"
    findings.figure("errors", errors, result, caption=caption)
    findings.overview.figure = "errors"
    _write_files(study, findings, result)
    if best is None or result.best_row is None:
        return result
    low, median, high = spread(ranked.rows[result.best_row].rmse)
    meaning = f"RMSE of {best.label} on a simulated rig"
    findings.metric("rmse", median, "rad", "lower", ranked.count, meaning=f"{meaning}: median")
    findings.metric("rmse_low", low, "rad", "lower", ranked.count, meaning=f"{meaning}: 25 of 1000 stay below")
    findings.metric("rmse_high", high, "rad", "lower", ranked.count, meaning=f"{meaning}: 975 of 1000 stay below")
    findings.headline("rmse", "rmse_low", "rmse_high", "reach_deg")
    findings.figure("limits", limits, result, caption="Error and lost rigs over frequency and over payload")
    return result


def _write_files(study: Study, findings: Findings, result: Recommended) -> None:
    """A study file for every row, and one with what is recommended that compares all."""
    sections = sections_of(study, result.reach_deg, 2 if result.bending else 1)
    ordered = [result.candidates[row] for row in result.ranking.standing.order]
    files = {one.file: [one] for one in ordered}
    if (best := result.best) is not None:
        files[RECOMMENDED] = [best, *(one for one in ordered if one != best)]
    for file, rows in files.items():
        run = f"wristctl {trial_of(study)} THIS"
        found = f"{rows[0].label}, as `wristctl recommend` found it for this wrist on this rig: {run}"
        content = gains_content(study, [row_of(one.controller, one.gains, 6) for one in rows], **sections)
        if own_rig(study) is not None:
            content = {name: part for name, part in content.items() if name not in ("simulate", "compare")}
        keep_study(findings, file, found, content)


def _in_one_plane(study: Study) -> bool:
    from wristctl.commands.recommend.reach import asked_of_rigs

    return study.recommend.rig is None and not why_two_planes(study.wrist, asked_of_rigs(study))


RECOMMEND = Procedure(
    "recommend",
    plan,
    recommend,
    (FROM_IDENTIFIED,),
    in_one_plane=_in_one_plane,
)
