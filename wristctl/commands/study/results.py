"""Files of a study of all laws: the answer first, then rankings, terms and costs, as tables and figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.printed_table import Table
from wristctl.commands.ranking_drawing import draw_rankings
from wristctl.commands.ranking_tables import answer_tables, every_row
from wristctl.commands.session import Session
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
    """Rank the judged rows, and write rankings, tables and figures.

    Parameters
    ----------
    session
        Session of the study.
    judged
        Metrics of each judged row, in ranges of worlds.
    searches
        Search behind each row with tuned gains.
    poisoned
        Units that failed on every worker.
    """
    from wristctl.comparison.paired_worlds import term_values

    study = session.study
    with session.progress("ranking"):
        rankings = _rankings(study, judged)
        terms = [value for ranking in rankings.values() for value in term_values(ranking, study.study.terms)]
        shifts = _shifts(study, judged)
    _note_streams(session)
    _tables(session, rankings, terms, shifts, searches)
    times = _step_times(session, searches)
    with session.progress("drawing"):
        _draw(session, rankings, terms)
    shown = answer_tables(list(rankings.values()))
    shown += [every_row(ranking, times) for ranking in rankings.values()]
    if poisoned:
        rows = [(lost.unit.name, lost.why) for lost in poisoned]
        shown.append(Table("Given up, and left out", ("unit of work", "why"), rows))
    return Studied(study, session.findings, shown, rankings, searches, terms, shifts, poisoned)


def _rankings(study: Study, judged: Pieces) -> dict[str, WorldRanking]:
    """Rankings by name: that of the family, and `family, steps` for its steps where it has other motions."""
    from wristctl.comparison.world_ranking import kinds_of, ranking, row_of
    from wristctl.tuning.objective import YARDSTICK

    rankings = {}
    for family in families_of(study):
        of_family = {
            place: pieces for place, pieces in judged.items() if (place.variant, place.family) == (BASE, family)
        }
        laws = [place.law for place in of_family]
        if YARDSTICK not in laws:
            continue
        family_of = study.families[family]
        for steps, motions in kinds_of(family_of).items():
            rows = [
                row_of(place.label, pieces, study.wrist.tension_range, motions) for place, pieces in of_family.items()
            ]
            one = ranking(family, family_of, rows, study.study.tolerated, steps)
            rankings[one.name] = one
    return rankings


def _shifts(study: Study, judged: Pieces) -> list[OrderShift]:
    """Shift of the order by each variant, on the smooth motions of its family where it has any."""
    from wristctl.comparison.paired_worlds import order_shift
    from wristctl.comparison.world_ranking import kinds_of, row_of

    shifts, width = [], study.wrist.tension_range
    for variant, way in study.study.variants.items():
        after = {place: pieces for place, pieces in judged.items() if place.variant == variant}
        before = {place: judged.get(place._replace(variant=way.beside or BASE)) for place in after}
        pairs = [(place, earlier, after[place]) for place, earlier in before.items() if earlier is not None]
        rows = [
            [
                row_of(place.label, pieces, width, next(iter(kinds_of(study.families[place.family]).values())), 1)
                for place, pieces in side
            ]
            for side in ([(p, b) for p, b, _ in pairs], [(p, a) for p, _, a in pairs])
        ]
        if pairs:
            name = f"{variant} beside {way.beside}" if way.beside else variant
            shifts.append(order_shift(name, *rows))
    return shifts


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
    for name, ranking in rankings.items():
        slug = _slug(name)
        findings.table(f"data/ranking-{slug}.csv", ranking_frame(ranking), units=units)
        worlds = {"world": range(ranking.count)} | {row.label: row.rmse for row in ranking.rows}
        meaning = {row.label: "geometric mean of the RMSE over motions and noises; inf: failed" for row in ranking.rows}
        findings.table(f"data/worlds-{slug}.csv", pd.DataFrame(worlds), dict.fromkeys(meaning, "rad"), meaning)
        for index, row in enumerate(ranking.rows):
            mean = ranking.means[index]
            interval = (mean.low, mean.high) if math.isfinite(mean.high) else None
            findings.metric(f"rmse_{slug}_{row.label}", mean.value, "rad", "lower", ranking.count, interval)
    for family in families_of(session.study):
        if file := findings.file(f"data/gains-{family}.json"):
            gains = {
                place.law: search.gains
                for place, search in searches.items()
                if (place.variant, place.family) == (BASE, family)
            }
            write_gains(file, gains)
    flat = [
        {"term": value.term, "family": value.family, "without": value.without, "with": value.given,
         "times": value.times.value, "low": value.times.low, "high": value.times.high,
         "lost_without": value.swings[0], "lost_with": value.swings[1]}
        for value in terms
    ]  # fmt: skip
    if flat:
        findings.table("data/terms.csv", pd.DataFrame(flat), dict.fromkeys(flat[0], "1"))
    if shifts:
        frame = pd.DataFrame([shift._asdict() | {"best": " -> ".join(shift.best)} for shift in shifts])
        findings.table("data/sensitivity.csv", frame, dict.fromkeys(map(str, frame.columns), "1"))


def _step_times(session: Session, searches: Mapping[StudyPlace, Search]) -> dict[str, StepTime]:
    """Time of a control tick of each law on this machine; gains make no difference to it."""
    from wristctl.comparison.step_cost import step_time
    from wristctl.control.table import controller
    from wristctl.tuning.objective import YARDSTICK

    times = {YARDSTICK: step_time(controller(YARDSTICK), (), session.study.wrist)}
    with session.progress("timing the control step"):
        for place, search in searches.items():
            if place.law not in times:
                law = controller(place.law)
                times[place.law] = step_time(law, law.values(search.gains), session.study.wrist)
    session.findings.plain("timing.json", {name: time._asdict() for name, time in times.items()})
    return times


def _draw(session: Session, rankings: Mapping[str, WorldRanking], terms: Sequence[TermValue]) -> None:
    from wristctl.commands.study.figures import laws_by_rig, pareto, terms_by_rig, world_map
    from wristctl.plotting.ranking_figures import ranking_intervals

    findings = session.findings
    draw_rankings(findings, list(rankings.values()))
    if rankings:
        findings.figure(
            "laws", laws_by_rig, rankings, caption="How many times less RMSE than feedforward, on every rig"
        )
        findings.overview.figure = "laws"
    if terms:
        findings.figure("terms", terms_by_rig, terms, caption="How many times less RMSE a term of a controller gives")
    for name, ranking in rankings.items():
        slug = _slug(name)
        caption = f"RMSE of every controller on {name}, with 95 % intervals over worlds"
        findings.figure(f"ranking-{slug}", ranking_intervals, ranking, caption=caption)
        caption = f"RMSE against variation of tension and work on {name}; hollow rows must not be used"
        findings.figure(f"pareto-{slug}", pareto, ranking, caption=caption)
        caption = f"RMSE over the least one in each world of {name}; a cross fails, a dot swings"
        findings.figure(f"worlds-{slug}", world_map, ranking, caption=caption)


def _slug(name: str) -> str:
    """Name of a file made from a ranking's name."""
    return name.replace(", ", "-")
