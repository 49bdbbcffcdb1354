"""Figures of a comparison, and files and figures of a ranking over worlds, as a run keeps them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import Any

import pandas as pd

from wristctl.commands.ranking_answer import condition
from wristctl.commands.ranking_tables import draw_intervals, draw_rankings, keep_error
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.commands.step_times import after_rollouts
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import Ranking
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.config.study import Study
from wristctl.control.table import Gains
from wristctl.wrist.kinematics import Inverse


def draw(findings: Findings, study: Study, results: list[ComparedRow], rankings: Sequence[Ranking]) -> None:
    """Draw each condition, RMSE against tension variation and over a growing setting, and every row on every loop."""
    from wristctl.commands.compare.figures import (
        error_against_variation,
        error_over_disturbance,
        rmse_map,
        series_of_sizes,
        variation_dots,
    )
    from wristctl.comparison.combinations import paper_cells

    draw_rankings(findings, rankings, later=True)
    for ranking in rankings:
        _of_class(findings, ranking, results)
    later, cells = partial(findings.figure, later=True), paper_cells(study)
    first = [result for result in results if result.inverse == _stands_for(results)[2]]
    caption = "RMSE against total variation of tension, medians over motions; the line is Pareto's front"
    later("rmse-against-tension-variation", error_against_variation, first, rankings, caption=caption)
    for leaf, sizes in series_of_sizes(study.compare.loops).items():
        caption = f"RMSE over {leaf}, medians over motions"
        later(f"rmse-over-{_slug(leaf)}", error_over_disturbance, first, leaf, sizes, caption=caption)
    for loop in study.compare.loops:
        selected = [result for result in results if result.loop == loop]
        beside = any(cell[0] == loop for cell in cells)
        caption = f"RMSE of every row on each reference, loop {loop}" + ", beside the paper's T2" * beside
        later(f"rmse-by-reference-{_slug(loop)}", rmse_map, selected, f"loop {loop}", beside=beside, caption=caption)
        caption = f"Total variation of tension of every row, loop {loop}"
        later(f"tension-variation-{_slug(loop)}", variation_dots, selected, f"loop {loop}", caption=caption)
    for reference in dict.fromkeys(result.reference for result in results) if len(study.compare.loops) > 1 else ():
        selected = [result for result in results if result.reference == reference]
        caption = f"RMSE of every row on each loop, {reference}"
        later(f"rmse-by-loop-{_slug(reference)}", rmse_map, selected, reference, "loop", beside=False, caption=caption)


def _of_class(findings: Findings, ranking: Ranking, results: Sequence[ComparedRow]) -> None:
    """Errors and tensions over time of the best rows and of the paper's, on the motion that stands for the class."""
    from wristctl.commands.compare.figures import shown_rows, tension_rows
    from wristctl.plotting.bend_figure import bend_overlay
    from wristctl.plotting.loop_figures import over_time, spread_of_sizes

    later = partial(findings.figure, later=True)
    cell = _stands_for(ranking.of(results))
    by_label = {result.label: result for result in results if (result.loop, result.reference, result.inverse) == cell}
    shown = [by_label[row] for row in shown_rows(ranking) if row in by_label]
    courses = [result.simulation.trajectory for result in shown]
    slug, where = _slug(ranking.name), f"{condition(ranking)}: loop {cell[0]}, {cell[1]}"
    one_plane, caption = courses[0].planes == 1, f"Angle and error of the best controllers and of the paper's, {where}"
    options: dict[str, Any] = {"heading": where, "later": ranking.jumps, "caption": caption}
    if one_plane:
        findings.figure(f"overlay-{slug}", over_time, courses, "angle", "measurable size", **options)
    else:
        findings.figure(f"overlay-{slug}", bend_overlay, courses, **options)
    caption = f"|theta - reference| of the best rows and of the paper's laws, {where}"
    later(f"error-over-time-{slug}", over_time, courses, "size", heading=where, caption=caption)
    tendons = "both sides" if one_plane else "each tendon"
    later(f"tension-over-time-{slug}", tension_rows, courses, where, caption=f"Commanded tension of {tendons}, {where}")
    if repeated := [result.repeated for result in shown if len(result.repeated.failed) > 1]:
        caption, sizes = f"|error| over repetitions: median and 95 % interval, {where}", spread_of_sizes(repeated)
        later(f"error-of-repetitions-{slug}", over_time, courses[:1], sizes, heading=where, caption=caption)


def _stands_for(results: Sequence[ComparedRow]) -> tuple[str, str, str]:
    """The loop, reference and inverse of the first row that is no step and, if there are others, not of a network."""
    chosen = min(results, key=lambda result: (result.inverse == "network", result.jumps))
    return chosen.loop, chosen.reference, chosen.inverse


def _slug(name: str) -> str:
    """Name of a file made from a title."""
    return re.sub(r"[^A-Za-z0-9.-]+", "-", name.replace(" -", " minus ").replace("+", "plus ")).strip("-")


def ranked(session: Session, study: Study, network: Inverse | None, tuned: Gains) -> list[WorldRanking]:
    """Rank the rows on the worlds that the study names, and write down rankings and worlds."""

    from wristctl.comparison.world_ranking import rank, ranked_units, ranking_frame, worlds_frame
    from wristctl.simulation.drawn_worlds import streams_of

    findings, worlds = session.findings, study.compare.worlds
    with session.progress("ranking", 100, "%", after=after_rollouts(len(study.compare.rows))) as report:
        rankings = rank(study, tuned, network, lambda share: report(round(100 * share)))
    if worlds.sealed is None:
        findings.note_streams(streams_of(study.families[worlds.family], worlds.family, worlds.split))
    frames = pd.concat([worlds_frame(each) for each in rankings], ignore_index=True)
    findings.table("data/worlds.csv", frames, units=ranked_units())
    for each, end in zip(rankings, ("", "_steps"), strict=False):
        findings.table(f"data/ranking{end.replace('_', '-')}.csv", ranking_frame(each), units=ranked_units())
        for row, label in enumerate(each.labels):
            keep_error(findings, f"rmse_{label}{end}", each, row)
        with session.drawing():
            draw_intervals(findings, each, end)
    return rankings
