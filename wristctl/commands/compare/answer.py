"""The answer of a comparison in words, and its tables: which controller to use where, and what of the paper holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wristctl.commands.answer import Answer, rest
from wristctl.commands.compare.csv_data import metrics_of
from wristctl.commands.printed_table import Table, capital, joined
from wristctl.commands.ranking_answer import (
    PRINTED,
    advice,
    certainty,
    condition,
    decided,
    error,
    gains_words,
    is_by_loop,
    led,
    names_of,
    not_to_use,
    open_loop,
    paired,
    recommended,
    winner,
)
from wristctl.commands.ranking_tables import controllers_table, keep_error
from wristctl.commands.results import Findings
from wristctl.comparison.combinations import CLASS_MEANINGS, ComparedRow
from wristctl.comparison.controller_ranking import Ranking, labels_of
from wristctl.comparison.paper import T2, verdict
from wristctl.comparison.repetition_spread import spread
from wristctl.comparison.step_cost import StepTime
from wristctl.comparison.tie_groups import share
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.trajectory import rests


def answer_of(
    rankings: Sequence[Ranking],
    run: str = "",
    gains: Mapping[str, Mapping[str, float]] | None = None,
    bending: str = "",
    asked: Collection[str] = (),
    own_wrist: bool = False,
) -> Answer | None:
    """The answer of a comparison for one screen; None where nothing was compared.

    `run` is its path, empty for a result in memory; `gains` are those of every row by its label, in SI units; `bending`
    says in which planes all loops bend, where these are two; the table has the labels that were `asked` for, however
    many others there are; `own_wrist` is whether the study has another wrist than the default one.
    """
    if not rankings:
        return None
    short = given_names(labels_of(rankings))
    if any(short[label] != label for label in short):
        rankings = [replace(one, labels=[short[label] for label in one.labels]) for one in rankings]
        gains = {short.get(label, label): values for label, values in (gains or {}).items()}
        asked = [short.get(label, label) for label in asked]
    names = names_of(rankings)
    table = controllers_table(rankings, names, asked)
    intervals = any("[" in str(cell) for row in table.rows for cell in row)
    more = rest("Every rank and figure", run)
    notes = [
        bending,
        not_to_use(rankings, names),
        f"{conditions(rankings)} {presets_of_names(rankings, gains or {})}".strip(),
        best_on_yours(rankings),
        gains_of_best(rankings, gains or {}),
        papers(rankings),
        papers_order(rankings),
        " ".join(filter(None, [certainty(rankings), paired(rankings) * intervals, decided(rankings)])),
        gains_meant(rankings),
        "Your own wrist: `wristctl init DIR` begins a folder for it (documentation: Your own wrist)." * (not own_wrist),
    ]
    return Answer(advice(rankings), table, more=more).fitted(notes)


def given_names(labels: Sequence[str]) -> dict[str, str]:
    """Names by label: controller/given of the one row of a controller whose gains are given by value."""
    given = [label for label in labels if "=" in label.partition("/")[2]]
    often = Counter(label.partition("/")[0] for label in given)
    own = {label: f"{label.partition('/')[0]}/given" for label in given if often[label.partition("/")[0]] == 1}
    return {label: own.get(label, label) for label in labels}


def best_on_yours(rankings: Sequence[Ranking]) -> str:
    """Probability that a controller is the best on an identified robot in a motion: its share of the draws of both.

    Empty where the worlds are no draws of an identification's posterior.
    """
    posteriors = [one for one in rankings if isinstance(one, WorldRanking) and one.family.together]
    sentences = []
    for ranking in posteriors:
        best = ranking.scores == ranking.scores.min(axis=0)
        shares = [share(best[row] & np.isfinite(ranking.scores[row])) for row in range(len(ranking.labels))]
        row = max(range(len(shares)), key=lambda number: shares[number].times)
        steps = " of steps" if ranking.jumps else ""
        sentences.append(
            f"{ranking.labels[row]} is best{steps} on your robot with probability {shares[row].value:.2f} (95 % "
            f"{shares[row].low:.2f} to {shares[row].high:.2f}) in a motion drawn at random: it has the least error in "
            f"{shares[row].times} of {shares[row].n} worlds, each a motion and a wrist that your trials leave possible."
        )
    return " ".join(sentences)


def presets_of_names(rankings: Sequence[Ranking], gains: Mapping[str, Mapping[str, float]]) -> str:
    """Which preset a controller has under which condition that was typed by its name alone; empty where none was.

    They are named where other rows have gains of their own.
    """
    rig = {condition(one): one.traits.rig for one in rankings}
    usual = [preset for preset, wanted in (("hardware", True), ("default", False)) if wanted in rig.values()]
    alone = list(filter(is_by_loop, labels_of(rankings)))
    presets = [row.split("/", 1) for row, values in gains.items() if values and "/" in row]
    own = {label: [preset for name, preset in presets if name == label] for label in alone}
    others = [f"{label} {preset}" for label, found in own.items() for preset in found if preset not in usual]
    others += [f"{label} default in all" for label, found in own.items() if found == ["default"] and len(usual) > 1]
    if not any(own.values()):
        return ""
    words = f"preset {usual[0]}"
    if len(usual) > 1:
        words = f"preset hardware in {joined([name for name, is_rig in rig.items() if is_rig])}, default elsewhere"
    odd = f" ({'; '.join(others)})" if others else ""
    if all(is_by_loop(label) or open_loop(label) for label in labels_of(rankings)):
        return f"A name alone has its {words}{odd}: none is tuned for this."
    return (
        f"A name alone ({joined([label for label in alone if own[label]])}) has its {words}{odd}: not tuned for this."
    )


def gains_of_best(rankings: Sequence[Ranking], gains: Mapping[str, Mapping[str, float]]) -> str:
    """Gains of the controllers that are recommended, with units; empty where they have none or are not known."""
    everyone = labels_of(rankings)
    listed = [
        f"{row} has {gains_words(row.split('/')[0], gains[row])}"
        for label in recommended(rankings)
        for row in gains
        if gains[row] and (row == label or (row.split("/")[0] == label and row not in everyone))
    ]
    return f"Gains: {'; '.join(listed)}." if listed else ""


def conditions(rankings: Sequence[Ranking]) -> str:
    """What the names of the conditions mean; empty for families of worlds, which a study describes."""
    meanings = dict[str, str]()
    for one in rankings:
        if one.unit != "world":
            name, words = one.name.removesuffix(", steps"), condition(one).removesuffix(" (steps)")
            rig = "angles come from pictures" if one.traits.camera else "of some loops"
            if one.traits.tendons:
                rig = "spools follow the reference, so even low gains track it"
            meanings[words] = rig if name == "camera and tendons" else CLASS_MEANINGS[name]
    return f"{capital('; '.join(f'{name}: {meaning}' for name, meaning in meanings.items()))}." if meanings else ""


# For what presets were made; those of the paper are told apart.
_GAINS = {
    "default": "for exact angles and torques",
    "hardware": "for motors and a camera",
    "tuned": "by search",
    "given": "by value in the study",
}


def gains_meant(rankings: Sequence[Ranking]) -> str:
    """What the presets that take part are made for."""
    present = {label.rpartition("/")[2] for ranking in rankings for label in ranking.labels if not open_loop(label)}
    meanings = [f"{name} {meaning}" for name, meaning in _GAINS.items() if name in present]
    return f"Presets: {', '.join(meanings)}." if meanings else ""


def papers(rankings: Sequence[Ranking]) -> str:
    """What becomes of the paper's printed gains, and of P1 and P2 exchanged, condition by condition."""
    labels = labels_of(rankings)
    sentences = [
        f"{label}{explained} {_outcomes(rankings, label)}"
        for gains, explained in ((PRINTED, ""), ("exchanged", " (P1, P2)"))
        for label in labels
        if label.endswith(f"/{gains}")
    ]
    return f"The paper's gains: {'; '.join(sentences)}." if sentences else ""


def _outcomes(rankings: Sequence[Ranking], label: str) -> str:
    """Conditions in which a row works, with its error and place, and what is wrong with it in the others."""
    works, bad = list[str](), dict[str, None]()
    for ranking in rankings:
        if label not in ranking.labels:
            continue
        row = ranking.labels.index(label)
        if row in ranking.standing.unusable:
            fault = ranking.fault(row)
            bad[fault.kind if fault else "fails"] = None
        else:
            group, groups = ranking.standing.group(row), ranking.standing.groups
            better = sum(map(len, groups[: group - 1])) if group else 0
            tied = ", tied" * (group is not None and len(groups[group - 1]) > 1)
            place = f" (place {better + 1}/{sum(map(len, groups))}{tied})" if group else ""
            works.append(f"{error(ranking, row)} deg in {condition(ranking)}{place}")
    verbs = joined(list(bad), "or")
    if not works:
        return f"{verbs} in every condition" if len(rankings) > 1 else verbs
    return f"{joined(works)}{f', elsewhere {verbs}' if bad else ''}"


def papers_order(rankings: Sequence[Ranking]) -> str:
    """Whether the order of the paper's five controllers by RMSE is that of their best rows here."""
    printed = sorted(T2, key=lambda name: T2[name].rmse)
    holds, complete = [], 0
    for ranking in rankings:
        ordered = [ranking.labels[row].split("/")[0] for row in ranking.standing.order]
        theirs = list(dict.fromkeys(name for name in ordered if name in T2))
        complete += len(theirs) == len(T2)
        if theirs == printed:
            holds.append(condition(ranking))
    if not complete:
        return ""
    where = f"holds in {joined(holds)} alone" if holds else f"holds in none of {complete}"
    if complete == 1:
        where = "holds" if holds else "does not hold"
    return f"The paper's ranking {' < '.join(printed)} {where}."


def head_with_the_best(findings: Findings, rankings: Sequence[Ranking]) -> None:
    """Let the run's page be headed by the error of the best row under each condition, that of the answer first."""
    headed: dict[str, str] = {}
    for ranking in rankings:
        if (best := winner(ranking, rankings)) is not None:
            name = f"best_{_slug(ranking)}"
            meaning = f"RMSE of {ranking.labels[best]}, the best there, over {ranking.cases}"
            keep_error(findings, name, ranking, best, meaning)
            headed[ranking.name] = name
    findings.headline(*(headed[ranking.name] for ranking in led(rankings) if ranking.name in headed))


def by_controller(
    rankings: Sequence[Ranking], rows: Sequence[ComparedRow]
) -> tuple[dict[str, list[Any]], dict[str, dict[str, Any]]]:
    """Columns with a value for each controller, RMSE [rad] under each condition first, and what is known of columns."""
    labels, about = labels_of(rankings), dict[str, dict[str, Any]]()
    fates: dict[str, list[str]] = {label: [] for label in labels}
    errors: dict[str, dict[str, float]] = {}
    for ranking in led(rankings):
        name = f"rmse_{_slug(ranking)}"
        lost = set(ranking.standing.unusable) & set(np.nonzero(~np.isfinite(ranking.scores).all(axis=1))[0].tolist())
        errors[name] = {
            label: np.nan if row in lost else ranking.means[row].value for row, label in enumerate(ranking.labels)
        }
        about[name] = {"unit": "rad", "heading": f"RMSE, {condition(ranking)}", "chief": True}
        for row in ranking.standing.unusable:
            if (fault := ranking.fault(row)) is not None:
                place = f" in {condition(ranking)}" * (len(rankings) > 1)
                fates[ranking.labels[row]].append(f"{fault.kind}{place}")
    for result in rows:
        name = f"rmse_{result.loop}_{result.inverse}_{result.reference}".replace(" ", "-")
        errors.setdefault(name, {})[result.label] = spread(result.repeated.metrics["rmse"]).median
        about[name] = {"unit": "rad"}
    columns: dict[str, list[Any]] = {"controller": list(given_names(labels).values())}
    columns |= {"fate": [", ".join(fates[label]) for label in labels]} if any(fates.values()) else {}
    columns |= {name: [of_rows.get(label, np.nan) for label in labels] for name, of_rows in errors.items()}
    return columns, about


def _slug(ranking: Ranking) -> str:
    return ranking.name.replace(",", "").replace(" ", "_")


# Metrics that a motion which never rests does not have.
_OF_REST = ("settling", "overshoot")
# Metrics in the order of the printed table's columns; others that have a heading follow.
_FIRST = ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension", "saturation")

# Units of the columns of the table of standings.
STANDING_UNITS = dict.fromkeys(("rmse", "rmse_low", "rmse_high", "swing"), "rad") | {"peak": "N"}


def units() -> dict[str, str]:
    """Units of the columns of the comparison table, by name."""
    metric_units = {name: metric.unit or "1" for name, metric in METRICS.items()}
    ends = {f"{name}_{end}": unit for name, unit in metric_units.items() for end in ("low", "high")}
    return metric_units | ends | {"paper_rmse": "rad", "paper_settling": "s", "paper_steady_state": "rad"}


def loop_tables(loop: str, results: list[ComparedRow], cells: Container[tuple[str, str]]) -> list[Table]:
    """A table for each reference on one loop; of repetitions medians, with the interval of the RMSE's.

    The paper's numbers stand in those of the `cells` (loop, reference) alone; a motion that never rests has neither
    settling time nor overshoot.
    """
    shown = {name: METRICS[name].heading for name in dict.fromkeys((*_FIRST, *METRICS)) if METRICS[name].heading}
    times = max(len(result.repeated.failed) for result in results)
    ends = ("RMSE's 95 % low", "high") if times > 1 else ()
    tables = []
    for reference in dict.fromkeys(result.reference for result in results):
        on_reference, theirs = [row for row in results if row.reference == reference], (loop, reference) in cells
        columns = [name for name in shown if rests(on_reference[0].simulation.trajectory) or name not in _OF_REST]
        rows = [_row(result, columns, bool(ends), theirs) for result in on_reference]
        papers = ("paper's", "verdict") if theirs else ()
        heads = ("controller", "inverse", *(shown[name] for name in columns), *ends, *papers, "fate")
        medians = f", medians of {times} repetitions" if ends else ""
        tables.append(Table(f"Loop {loop}, {reference}{medians}", heads, rows))
    return tables


def _row(result: ComparedRow, shown: Iterable[str], repeated: bool, theirs: bool) -> tuple[str | float, ...]:
    metrics: dict[str, str | float] = dict(found := metrics_of(result))
    if found["settling"] != found["settling"]:
        metrics["settling"] = "failed" if result.repeated.failed.any() else "never"
    ends = spread(result.repeated.metrics["rmse"])[1:3] if repeated else ()
    papers: tuple[str, ...] = ("", "") if theirs else ()
    if theirs and result.controller in T2:
        printed = " / ".join(f"{value:g}" for value in T2[result.controller])
        papers = printed, verdict(result.controller, found["rmse"], found["settling"], found["steady_state"])
    values = (metrics[name] for name in shown)
    return (result.label, result.inverse, *values, *ends, *papers, result.repeated.fate)


def step_table(times: dict[str, StepTime]) -> Table:
    """Table of the time of a control step on this machine [us]."""
    rows = [(label, time.median, time.p99) for label, time in times.items()]
    return Table("Control step of one wrist on this machine", ("controller", "median [us]", "p99 [us]"), rows)
