"""Files of a study of all laws: the answer first, then rankings, terms and costs, as tables and figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from wristctl.commands.printed_table import Table
from wristctl.commands.ranking_tables import answer_tables, draw_intervals, draw_rankings, every_row, keep_error
from wristctl.commands.session import Session
from wristctl.commands.step_times import timed_steps
from wristctl.commands.study.published import PUBLISHED, published, published_gains
from wristctl.commands.study.units import BASE, Studied, StudyPlace, budget_of, families_of, places_in
from wristctl.comparison.tuned_ranking import (
    OrderShift,
    TermValue,
    TunedRanking,
    order_shift,
    published_tuning,
    term_values,
    tuned_ranking,
)
from wristctl.comparison.world_ranking import kinds_of, ranked_units, ranking_frame, row_of
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.control.table import controller, write_gains
from wristctl.simulation.drawn_worlds import streams_of
from wristctl.tuning.objective import YARDSTICK
from wristctl.tuning.search import Search, search_stream
from wristctl.work.fan_out import Poisoned

Piece = Mapping[str, "np.ndarray"]
Pieces = Mapping[StudyPlace, Sequence[Piece]]


def written(session: Session, judged: Pieces, searches: dict[StudyPlace, Search], poisoned: list[Poisoned]) -> Studied:
    """Rank the judged rows by their metrics in ranges of worlds, and write rankings, tables and figures.

    `poisoned` are units that failed on every worker.
    """
    study = session.study
    with session.progress("ranking"):
        rankings = _rankings(study, judged)
        terms = [value for ranking in rankings.values() for value in term_values(ranking, study.study.terms)]
        shifts = _shifts(study, judged)
    _note_streams(session)
    _tables(session, rankings, terms, shifts, searches)
    times = timed_steps(session, _laws(searches))
    with session.drawing():
        _draw(session, rankings, terms)
    shown = answer_tables(list(rankings.values()))
    shown += [every_row(ranking, times) for ranking in rankings.values()]
    if poisoned:
        rows = [(lost.unit.name, lost.why) for lost in poisoned]
        shown.append(Table("Given up, and left out", ("unit of work", "why"), rows))
    return Studied(study, session.findings, shown, rankings, searches, terms, shifts, poisoned)


def _tunings(study: Study, judged: Pieces, variant: str, family: str) -> dict[str, list[Sequence[Piece]]]:
    """What was judged of each row, by label: its tunings in order. A row of which one was given up is left out."""
    places = [place for place in judged if (place.variant, place.family) == (variant, family)]
    wanted = {f"{law}/tuned": budget_of(study.study).tunings for law in study.study.laws}
    counts = Counter(place.label for place in places)
    complete = [place for place in places if counts[place.label] == wanted.get(place.label, 1)]
    rows: dict[str, list[Sequence[Piece]]] = {}
    for place in sorted(complete, key=lambda place: place.tuning):
        rows.setdefault(place.label, []).append(judged[place])
    return {label: rows[label] for label in dict.fromkeys(place.label for place in complete)}


def _rankings(study: Study, judged: Pieces) -> dict[str, TunedRanking]:
    """Rankings by name: that of the family, and `family, steps` for its steps where it has other motions.

    The gains that are published are the same in both.
    """
    rankings = dict[str, "TunedRanking"]()
    for family in families_of(study):
        of_family = _tunings(study, judged, BASE, family)
        if f"{YARDSTICK}/default" not in of_family:
            continue
        family_of, published, places = study.families[family], list[int](), places_in(study, family)
        for steps, motions in kinds_of(family_of).items():
            (open_loop,), width = of_family[f"{YARDSTICK}/default"], study.wrist.tension_range
            rows = [
                [row_of(label, pieces, width, motions, None, open_loop, places) for pieces in tunings]
                for label, tunings in of_family.items()
            ]
            published = published or [published_tuning(of_row) for of_row in rows]
            one = tuned_ranking(family, family_of, rows, published, study.study.tolerated, steps)
            rankings[one.name] = one
    return rankings


def _shifts(study: Study, judged: Pieces) -> list[OrderShift]:
    """Shift of the order by each variant, on the smooth motions of its family where it has any."""
    shifts, width = [], study.wrist.tension_range
    varied = study.study.varied or families_of(study)[0]
    places = places_in(study, varied)
    motions = next(iter(kinds_of(study.families[varied]).values()))
    for variant, way in study.study.variants.items():
        before, after = (_tunings(study, judged, name, varied) for name in (way.beside or BASE, variant))
        labels = [label for label in after if label in before]
        rows = [
            [[row_of(label, pieces, width, motions, 1, None, places) for pieces in side[label]] for label in labels]
            for side in (before, after)
        ]
        if labels:
            name = f"{variant} beside {way.beside}" if way.beside else variant
            shifts.append(order_shift(name, *rows))
    return shifts


def _note_streams(session: Session) -> None:
    study, findings = session.study, session.findings
    for name in families_of(study):
        for split in ("tune", "validation", "test"):
            findings.note_streams(streams_of(study.families[name], name, split))
    tunings = range(budget_of(study.study).tunings)
    findings.note_streams(search_stream(f"search {law}", tuning) for law in study.study.laws for tuning in tunings)


def _tables(
    session: Session,
    rankings: Mapping[str, TunedRanking],
    terms: Sequence[TermValue],
    shifts: Sequence[OrderShift],
    searches: Mapping[StudyPlace, Search],
) -> None:
    """Tables and numbers for programs."""
    import pandas as pd

    findings = session.findings
    for name, ranking in rankings.items():
        slug = _slug(name)
        findings.table(f"data/ranking-{slug}.csv", ranking_frame(ranking), units=ranked_units())
        worlds = {"world": range(ranking.count)} | {row.label: row.rmse for row in ranking.rows}
        meaning = {row.label: "geometric mean of the RMSE over motions and noises; inf: failed" for row in ranking.rows}
        findings.table(f"data/worlds-{slug}.csv", pd.DataFrame(worlds), dict.fromkeys(meaning, "rad"), meaning)
        for index, row in enumerate(ranking.rows):
            keep_error(findings, f"rmse_{slug}_{row.label}", ranking, index)
        if len(tunings := ranking.tunings_frame()):
            findings.table(f"data/tunings-{slug}.csv", tunings, dict.fromkeys(map(str, tunings.columns), "1"))
    if firsts := [frame for ranking in rankings.values() if len(frame := ranking.firsts_frame())]:
        whole = pd.concat(firsts, ignore_index=True)
        findings.table("data/firsts.csv", whole, dict.fromkeys(map(str, whole.columns), "1"))
    for family in families_of(session.study):
        if family in rankings and (file := findings.file(f"data/gains-{family}.json")):
            write_gains(file, published_gains(rankings[family], searches))
    of_families = {name: published(rankings[name], searches) for name in families_of(session.study) if name in rankings}
    findings.plain(PUBLISHED, of_families)
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


def _laws(searches: Mapping[StudyPlace, Search]) -> dict[str, tuple[Controller, tuple[float, ...]]]:
    """Every controller with gains of one of its searches: for the time of a step they make no difference."""
    laws: dict[str, tuple[Controller, tuple[float, ...]]] = {YARDSTICK: (controller(YARDSTICK), ())}
    for place, search in searches.items():
        law = controller(place.law)
        laws.setdefault(place.law, (law, law.values(search.gains)))
    return laws


def _draw(session: Session, rankings: Mapping[str, TunedRanking], terms: Sequence[TermValue]) -> None:
    from wristctl.commands.study.figures import laws_by_rig, pareto, terms_by_rig, world_map

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
        draw_intervals(findings, ranking, f"-{slug}")
        caption = f"RMSE against variation of tension and work on {name}; hollow rows must not be used"
        findings.figure(f"pareto-{slug}", pareto, ranking, caption=caption)
        caption = f"RMSE over the least one in each world of {name}; a cross fails, a dot swings"
        findings.figure(f"worlds-{slug}", world_map, ranking, caption=caption)


def _slug(name: str) -> str:
    """Name of a file made from a ranking's name."""
    return name.replace(", ", "-")
