"""What a study of all laws leaves: the answer first, then rankings, terms and prices, as tables and figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table
from wristctl.commands.session import Session
from wristctl.commands.study.answer import answer
from wristctl.commands.study.units import BASE, Studied, StudyPlace, families_of
from wristctl.config.study import Study

if TYPE_CHECKING:
    import numpy as np

    from wristctl.comparison.paired_worlds import OrderShift, TermValue
    from wristctl.comparison.step_cost import StepTime
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.tuning.search import Search
    from wristctl.work.fan_out import Poisoned

Pieces = Mapping[StudyPlace, Sequence[Mapping[str, "np.ndarray"]]]


def written(session: Session, judged: Pieces, searches: dict[StudyPlace, Search], poisoned: list[Poisoned]) -> Studied:
    """Rank what was judged, and write all of it down."""
    from wristctl.comparison.paired_worlds import term_values

    study = session.study
    with session.progress("ranking"):
        rankings = _rankings(study, judged)
        terms = [value for found in rankings.values() for value in term_values(found, study.study.terms)]
        shifts = _shifts(study, judged)
    said = answer(rankings, terms, shifts, study.study.varied or families_of(study)[0])
    _note_streams(session)
    _tables(session, rankings, terms, shifts, searches)
    times = _step_times(session, searches)
    with session.progress("drawing"):
        _draw(session, rankings, terms)
    shown = [Table("Which law for which rig", *_best(rankings))]
    shown += [_ranking_table(found, times) for found in rankings.values()]
    if poisoned:
        rows = [(each.unit.name, each.why) for each in poisoned]
        shown.append(Table("Given up, and left out", ("unit of work", "why"), rows))
    return Studied(study, session.findings, shown, said, rankings, searches, terms, shifts, poisoned)


def _rankings(study: Study, judged: Pieces) -> dict[str, WorldRanking]:
    """By their names: a family's, and `family, steps` of those of its motions where it has others."""
    from wristctl.comparison.world_ranking import kinds_of, ranking, row_of
    from wristctl.tuning.objective import YARDSTICK

    found = {}
    for family in families_of(study):
        own = {place: each for place, each in judged.items() if (place.variant, place.family) == (BASE, family)}
        laws = [place.law for place in own]
        if YARDSTICK not in laws:
            continue
        family_of = study.families[family]
        for steps, motions in kinds_of(family_of).items():
            rows = [row_of(place.label, pieces, study.wrist.tension_range, motions) for place, pieces in own.items()]
            one = ranking(family, family_of, rows, laws.index(YARDSTICK), study.study.tolerated, steps)
            found[one.name] = one
    return found


def _shifts(study: Study, judged: Pieces) -> list[OrderShift]:
    """On the smooth motions of each variant's family, where it has any."""
    from wristctl.comparison.paired_worlds import order_shift
    from wristctl.comparison.world_ranking import kinds_of, row_of

    found, width = [], study.wrist.tension_range
    for variant, way in study.study.variants.items():
        after = {place: each for place, each in judged.items() if place.variant == variant}
        before = {place: judged.get(place._replace(variant=way.beside or BASE)) for place in after}
        pairs = [(place, known, after[place]) for place, known in before.items() if known is not None]
        rows = [
            [
                row_of(place.label, pieces, width, next(iter(kinds_of(study.families[place.family]).values())), 1)
                for place, pieces in side
            ]
            for side in ([(p, b) for p, b, _ in pairs], [(p, a) for p, _, a in pairs])
        ]
        if pairs:
            name = f"{variant} beside {way.beside}" if way.beside else variant
            found.append(order_shift(name, *rows))
    return found


def _note_streams(session: Session) -> None:
    from wristctl.simulation.drawn_worlds import streams_of

    study, findings = session.study, session.findings
    for name in families_of(study):
        for split in ("tune", "validation", "test"):
            findings.note_streams(streams_of(study.families[name], name, split))
    findings.note_streams(f"search {law}" for law in study.study.laws)


def _tables(
    session: Session,
    rankings: Mapping[str, WorldRanking],
    terms: Sequence[TermValue],
    shifts: Sequence[OrderShift],
    searches: Mapping[StudyPlace, Search],
) -> None:
    """Tables and numbers for programs."""
    import pandas as pd

    from wristctl.comparison.world_ranking import RANKED, ranking_frame
    from wristctl.control.table import write_gains
    from wristctl.simulation.metrics import METRICS

    findings = session.findings
    units = {name: METRICS[name].unit or "1" for name in RANKED}
    units |= dict.fromkeys(("rmse_low", "rmse_high", "worst_rmse"), "rad")
    for name, found in rankings.items():
        slug = _slug(name)
        findings.table(f"data/ranking-{slug}.csv", ranking_frame(found), units=units)
        worlds = {"world": range(found.worlds)} | {row.label: row.rmse for row in found.rows}
        meaning = {row.label: "geometric mean of the RMSE over motions and noises; inf: failed" for row in found.rows}
        findings.table(f"data/worlds-{slug}.csv", pd.DataFrame(worlds), dict.fromkeys(meaning, "rad"), meaning)
        for at, row in enumerate(found.rows):
            mean = found.means[at]
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            findings.metric(f"rmse_{slug}_{row.label}", mean.value, "rad", "lower", found.worlds, interval)
    for family in families_of(session.study):
        if file := findings.file(f"data/gains-{family}.json"):
            own = {
                place.law: each.gains
                for place, each in searches.items()
                if (place.variant, place.family) == (BASE, family)
            }
            write_gains(file, own)
    flat = [
        {"term": each.term, "family": each.family, "without": each.without, "with": each.given,
         "times": each.times.value, "low": each.times.low, "high": each.times.high,
         "lost_without": each.swings[0], "lost_with": each.swings[1]}
        for each in terms
    ]  # fmt: skip
    if flat:
        findings.table("data/terms.csv", pd.DataFrame(flat), dict.fromkeys(flat[0], "1"))
    if shifts:
        frame = pd.DataFrame([each._asdict() | {"best": " -> ".join(each.best)} for each in shifts])
        findings.table("data/sensitivity.csv", frame, dict.fromkeys(map(str, frame.columns), "1"))


def _step_times(session: Session, searches: Mapping[StudyPlace, Search]) -> dict[str, StepTime]:
    """What a control tick of each law costs here; gains make no difference to it."""
    from wristctl.comparison.step_cost import step_time
    from wristctl.control.table import controller
    from wristctl.tuning.objective import YARDSTICK

    times = {YARDSTICK: step_time(controller(YARDSTICK), (), session.study.wrist)}
    with session.progress("timing the control step"):
        for place, found in searches.items():
            if place.law not in times:
                law = controller(place.law)
                times[place.law] = step_time(law, law.values(found.gains), session.study.wrist)
    session.findings.plain("timing.json", {name: each._asdict() for name, each in times.items()})
    return times


def _draw(session: Session, rankings: Mapping[str, WorldRanking], terms: Sequence[TermValue]) -> None:
    from wristctl.commands.study.figures import laws_by_rig, pareto, terms_by_rig, world_map
    from wristctl.plotting.ranking_figures import ranking_intervals, world_profiles

    findings = session.findings
    if rankings:
        findings.figure("laws", laws_by_rig, rankings)
        findings.overview.figure = "laws"
    if terms:
        findings.figure("terms", terms_by_rig, terms)
    for name, found in rankings.items():
        findings.figure(f"ranking-{_slug(name)}", ranking_intervals, found)
        findings.figure(f"profiles-{_slug(name)}", world_profiles, found)
        findings.figure(f"pareto-{_slug(name)}", pareto, found)
        findings.figure(f"worlds-{_slug(name)}", world_map, found)


def _slug(name: str) -> str:
    """A ranking's name as a file's."""
    return name.replace(", ", "-")


def _best(rankings: Mapping[str, WorldRanking]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """The first group of each family."""
    heads = (
        "rig",
        "law",
        "RMSE [deg]",
        "95 % low",
        "high",
        "times less than feedforward",
        "95 %",
        "cannot be told [%]",
    )
    rows: list[tuple[object, ...]] = []
    for family, found in rankings.items():
        floor = 100.0 * (found.standing.floor - 1.0)
        for at in found.standing.groups[0] if found.standing.groups else []:
            mean, gain = found.means[at], found.gains[at]
            ends = tuple(math.degrees(each) for each in (mean.value, mean.low, mean.high))
            rows.append((family, found.rows[at].label, *ends, gain.value, f"{gain.low:.3g} to {gain.high:.3g}", floor))
    return heads, rows


def _ranking_table(found: WorldRanking, times: Mapping[str, StepTime]) -> Table:
    import numpy as np

    from wristctl.commands.study.figures import medians, undominated

    energy, chattering = medians(found, "energy"), medians(found, "chattering")
    rmse = np.array([each.value for each in found.means])
    front = undominated(np.column_stack([rmse, chattering, energy]))
    rows = []
    for at in found.standing.order:
        mean, gain, group = found.means[at], found.gains[at], found.standing.group(at)
        failures, swings = found.standing.failures[at], found.standing.swings[at]
        lost = [f"{100 * each.value:.3g} % (< {100 * each.high:.2g})" for each in (failures, swings)]
        tick = times.get(found.rows[at].label.split("/")[0])
        ends = tuple(math.degrees(each) for each in (mean.value, mean.low, mean.high))
        rows.append((
            "-" if group is None else str(group), found.rows[at].label, *ends,
            gain.value, f"{gain.low:.3g} to {gain.high:.3g}", *lost, chattering[at], energy[at],
            tick.median if tick else None, "yes" if front[at] and group else "",
        ))  # fmt: skip
    heads = (
        "group", "row", "RMSE [deg]", "95 % low", "high", "times less", "95 %", "fails", "swings", "tension [N/s]",
        "work [J]", "tick [us]", "undominated",
    )  # fmt: skip
    title = f"{found.name}: {found.worlds} held-out worlds, {found.motions} motions each"
    return Table(title, heads, rows)
