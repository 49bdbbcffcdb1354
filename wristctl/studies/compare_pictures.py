"""What a comparison on loops draws: the answer at once, all else when somebody asks for it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from wristctl.config.study import Study
from wristctl.studies.findings import Findings

if TYPE_CHECKING:
    from wristctl.comparison.class_standing import ClassStanding
    from wristctl.comparison.combinations import ComparedRow


def draw(findings: Findings, study: Study, results: list[ComparedRow], standings: Sequence[ClassStanding]) -> None:
    """Each class by itself, then RMSE against variation of tension, over what grows, and of every row on every loop."""
    from wristctl.report.answer_figure import answer_figure
    from wristctl.report.class_figures import error_against_variation
    from wristctl.report.disturbance_figure import error_over_disturbance, series_of_sizes

    caption = "RMSE of every row in each class of conditions, with 95 % intervals; rows from best to worst over all"
    findings.figure("answer", answer_figure, standings, caption=caption)
    findings.overview.figure = "answer"
    for standing in standings:
        _of_class(findings, standing, results)
    later = partial(findings.figure, later=True)
    first = [each for each in results if each.inverse == _stands_for(results)[2]]
    caption = "RMSE against total variation of tension, medians over motions; the line is Pareto's front"
    later("rmse-against-tension-variation", error_against_variation, first, standings, caption=caption)
    for leaf, sizes in series_of_sizes(study.compare.loops).items():
        caption = f"RMSE over {leaf}, medians over motions"
        later(f"rmse-over-{_slug(leaf)}", error_over_disturbance, first, leaf, sizes, caption=caption)
    _of_every_row(findings, study, results)


def _of_class(findings: Findings, standing: ClassStanding, results: Sequence[ComparedRow]) -> None:
    """Errors and tensions over time of the best rows and of the paper's, on the motion that stands for the class."""
    from wristctl.report.class_figures import shown_rows, tension_rows
    from wristctl.report.loop_figures import errors
    from wristctl.report.repetition_figures import error_sizes

    later = partial(findings.figure, later=True)
    cell = _stands_for(standing.of(results))
    here = {each.label: each for each in results if (each.loop, each.reference, each.inverse) == cell}
    own = [here[row] for row in shown_rows(standing) if row in here]
    courses = [each.simulation.trajectory for each in own]
    slug, where = _slug(standing.name), f"{standing.name}: loop {cell[0]}, {cell[1]}"
    caption = f"|theta - reference| of the best rows and of the paper's laws, {where}"
    later(f"error-over-time-{slug}", errors, courses, where, log=True, caption=caption)
    later(
        f"tension-over-time-{slug}", tension_rows, courses, where, caption=f"Commanded tension of both sides, {where}"
    )
    repeated = [each.repeated for each in own if len(each.repeated.failed) > 1]
    if repeated:
        caption = f"|error| over repetitions: median and 95 % interval, {where}"
        later(f"error-of-repetitions-{slug}", error_sizes, repeated, where, caption=caption)


def _of_every_row(findings: Findings, study: Study, results: Sequence[ComparedRow]) -> None:
    from wristctl.comparison.paper_cells import paper_cells
    from wristctl.report.compare_figures import rmse_map, variation_dots

    later, cells, settings = partial(findings.figure, later=True), paper_cells(study), study.compare
    for loop in settings.loops:
        here = [each for each in results if each.loop == loop]
        beside = any(cell[0] == loop for cell in cells)
        caption = f"RMSE of every row on each reference, loop {loop}" + ", beside the paper's T2" * beside
        later(f"rmse-by-reference-{_slug(loop)}", rmse_map, here, f"loop {loop}", beside=beside, caption=caption)
        caption = f"Total variation of tension of every row, loop {loop}"
        later(f"tension-variation-{_slug(loop)}", variation_dots, here, f"loop {loop}", caption=caption)
    for reference in dict.fromkeys(each.reference for each in results) if len(settings.loops) > 1 else ():
        here = [each for each in results if each.reference == reference]
        caption = f"RMSE of every row on each loop, {reference}"
        later(f"rmse-by-loop-{_slug(reference)}", rmse_map, here, reference, "loop", beside=False, caption=caption)


def _stands_for(results: Sequence[ComparedRow]) -> tuple[str, str, str]:
    """The loop, reference and inverse of the first row that is no step and, if there are others, not of a network."""
    chosen = min(results, key=lambda each: (each.inverse == "network", each.jumps))
    return chosen.loop, chosen.reference, chosen.inverse


def _slug(name: str) -> str:
    """A name as a file's."""
    return re.sub(r"[^A-Za-z0-9.-]+", "-", name.replace(" -", " minus ").replace("+", "plus ")).strip("-")
