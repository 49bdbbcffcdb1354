"""Which controller for which rig, as a page: `python docs/study.py RUN... --judged RUN...` writes docs/study.md.

Each RUN is of `wristctl study experiments/fair_study.yaml --budget full --set 'study.families=[NAME]'`, which tunes at
equal budget and judges every tuning, or of `wristctl compare experiments/shipped.yaml --set worlds.family=NAME`: the
gains of the tuning in the middle (docs/gains.md) in the same worlds, which no search has seen. The others, after
`--judged`, are of experiments/shipped_judged.yaml: these gains in other worlds, with motions that are in no family.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import shutil
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
from choices import about
from other_motions import asked_again, confirmed, unsettled
from published_gains import SHIPPED, source_of
from ranking_rows import Rankings, Row, deg, first_group, group, interval, short, three

from wristctl.commands.printed_table import joined
from wristctl.commands.study.published import what_changed
from wristctl.commands.study.units import families_of as families_studied
from wristctl.comparison.bootstrap import paired_ratio, penalised
from wristctl.comparison.world_ranking import kinds_of
from wristctl.config.families import Family
from wristctl.control.shipped_gains import PREFIX
from wristctl.control.table import controller
from wristctl.records import Run
from wristctl.study_files.load import load_study

HERE = Path(__file__).parent
# Times the lowest RMSE up to which a controller that is not told from it is about the same; upper over lower end of a
# ratio's interval that tells nothing; share of the worlds that a controller loses whose RMSE tells nothing.
ALIKE, WIDE, USELESS = 1.1, 1.5, 0.5
# Share of the worlds that a controller may lose.
LOST = 0.01
_EXACT, _RIG = "with exact angles and torques", "on rigs with motors, tendons and a camera"
STUDY = HERE.parent / "experiments" / "fair_study.yaml"
"""What tuned the gains, and names pairs of controllers that tell what a term buys."""
PICTURE = "camera"
PAPER = ("smc/tuned", "smc/printed", "smc/exchanged", "pid/tuned", "pid/printed")

_SIMULATED = """**All of it is simulated: nothing here was measured on a real rig.** [How the model meets recordings of
real robots](real-robots.md)."""
_ABOUT = """Each row of the table is a family of {worlds} simulated worlds, each another wrist on another rig, none of
them seen in tuning. Each controller was tuned {tunings} times, each time with {evaluations} sets of gains on {draws}
other worlds. Beside an RMSE stand those of the best and the worst of its tunings, as the study found them{former}. The
RMSE is the geometric mean over worlds{over_all}, by a bootstrap, and of the mean, not of single wrists. Controllers are
distinguished by their paired differences in the same worlds: one may be worse though its RMSE lies in the other's
interval{by_overlap}. Not distinguished does not mean equal: an RMSE more than a tenth above the lowest stands beside
the name. Where a line above is of several rigs, it names what is not distinguished from the lowest on the most of them,
and of these the one of the least errors.

A world is lost where the controller [fails, swings or chatters](glossary.md); a failure counts as 90 deg in the RMSE.
Not to be used is what is shown, at 95 %, to lose more than 1 % of the worlds; it is in no other column, and up to {few}
of {worlds} do not show it. Feedforward alone comes near behind motors, whose spools follow the motion; with torques
alone it has the whole error of its model.
Gains are tuned where a name has no suffix; [what controllers are](choices.md#controllers). The same gains elsewhere:
`wristctl simulate --gains tuned:camera`. For a wrist of your own: [recommend](recommend.md)."""
_PAPER = """How many times the lowest RMSE on the rig; of what may not be used, the share of worlds that are lost.
The gains of [the paper](paper.md)'s sliding mode are P1, P2 and P3, those of its PID Kp, Ki and Kd: `printed` as the
paper prints them, `exchanged` with P1 and P2 swapped, our hypothesis of a misprint."""
_OVER = """, and in {of_studies} over tunings; elsewhere it is of the tuning in the middle, whose gains are
[shipped](gains.md). Intervals are of 95 %, over what the mean is over"""
_OVERLAP = """; where one tuning is tested, those whose tunings overlap the lowest's are not distinguished from it"""
_CONFIRMED = """What is named to be used is in the first group with [other motions](#other-motions) in other worlds too,
unless its line says that this is not settled."""
_JUDGED = """The same gains in other worlds, and with motions that are in no family: slower and quicker moves, other
strokes, other jumps (`experiments/shipped_judged.yaml`). How large errors are depends on the motion; what is asked here
is whether the order comes out again."""
_BOUGHT = """How many times less RMSE the second controller has, which has the term, than the first, or how many times
more. `none shown`: the 95 % interval holds 1; `unknown`: and its ends are more than {wide} times apart. With * the
second is among what not to use on that rig, for the worlds that it loses; `lost`: these are more than half."""


@dataclass(frozen=True)
class Judged:
    """What the page shows.

    What to use, rankings by family, best first, errors of tunings by rig and label, what the families are, values of
    terms, how it was tuned and tested, and the section on what other motions find again, empty without them.
    """

    answer: Sequence[str]
    rankings: Rankings
    tunings: Mapping[tuple[str, str], tuple[float, float]]
    about: Mapping[str, str]
    terms: Sequence[Row]
    settings: str
    compared: Sequence[str] = ()


def decision(rankings: Rankings, tunings: Mapping[tuple[str, str], tuple[float, float]]) -> list[str]:
    """A line for each rig: what to run, how its tunings did, what is as good, what comes next, and the gain.

    `tunings` has the best and the worst error of a controller's tunings by rig and label.
    """
    lines = [
        "| rig | lowest RMSE | RMSE [deg], 95 % | its tunings | not distinguished from it | first that is worse "
        "| feedforward's RMSE / the lowest | [do not use](#what-not-to-use) |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, rows in rankings.items():
        lost = sum(group(row) is None for row in rows)
        if not first_group(rows):
            lines.append(f"| {name} | none | - | - | - | - | - | {lost} of {len(rows)} |")
            continue
        best, *ties = first_group(rows)
        following = [row for row in rows if group(row) == 2]
        after = min(following, key=lambda row: float(row["rmse"])) if following else None
        same = ", ".join(short(row["row"]) + _beside(row, best) for row in ties)
        then = f"{short(after['row'])} {deg(after['rmse'])}" if after else "-"
        lines.append(
            f"| {name} | **{short(best['row'])}** | {interval(best)} "
            f"| {' to '.join(map(deg, tunings.get((name, best['row']), ()))) or '-'} | {same or '-'} | {then} "
            f"| {three(best['times_better'])} | {lost} of {len(rows)} |"
        )
    return lines


def _beside(row: Row, best: Row) -> str:
    """The RMSE of a row that is not told from the best though it is larger; nothing where it is about the same."""
    return f" ({interval(row)})" if row["rmse"] > ALIKE * best["rmse"] else ""


def recommended(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """Labels that are in most first groups of these rigs, that of the least errors first."""
    often = Counter(row["row"] for rows in rankings.values() for row in first_group(rows))
    most = max(often.values(), default=0)
    return sorted((label for label in often if often[label] == most), key=partial(_log_error, rankings.values()))


def use(rankings: Mapping[str, Sequence[Row]], where: str, otherwise: Mapping[str, str] = MappingProxyType({})) -> str:
    """What to use on rigs of a kind: how large its error is on each, and what is not distinguished from it.

    `otherwise` names what other motions recommend on the rigs where they share no controller with these.
    """
    if not recommended(rankings):
        return f"- **{where}**: none may be used."
    label, *others = recommended(rankings)
    firsts = {name: {row["row"]: row for row in first_group(rows)} for name, rows in rankings.items()}
    chosen = {name: rows[label] for name, rows in firsts.items() if label in rows}
    errors = []
    for name, row in chosen.items():
        lowest = first_group(rankings[name])[0]
        lower = "" if lowest["row"] == label else f" (there {short(lowest['row'])} has {deg(lowest['rmse'])})"
        errors.append(f"{interval(row)} deg in {name}{lower}")
    better = [row["times_better"] for row in chosen.values()]
    least = f"feedforward alone has {'at least ' * (len(better) > 1)}{three(min(better))} times as much"
    words = f"use {short(label)}: RMSE {joined(errors)}; {least}{', hardly more' * (min(better) < ALIKE)}."
    unsettled = [f"{other} in {name}" for name, other in otherwise.items() if name in rankings]
    if unsettled:
        words += f" That is not settled: [other motions](#other-motions) have {joined(unsettled)}."
    if len(rankings) == 1:
        ((row, rows),) = zip(chosen.values(), firsts.values(), strict=True)
        near = [other for other in others if rows[other]["rmse"] <= WIDE * row["rmse"]]
        far = [short(other) + _beside(rows[other], row) for other in others if other not in near]
        alike = [short(other) + _beside(rows[other], row) for other in near]
        words += f" Not distinguished from it: {joined(alike)}." if alike else ""
        words += f" Too uncertain to be told from it: {joined(far)}." if far else ""
    elif len(chosen) == len(rankings) and others:
        words += f" On each of these none is shown to be better than {joined([short(o) for o in others], 'or')} either."
    lost = [f"{100.0 * _lost(row):.2g} % of the worlds of {name}" for name, row in chosen.items() if _lost(row)]
    if lost:
        words += f" It fails, swings or chatters in {joined(lost)}."
    if any(_lost(row) > LOST for row in chosen.values()):
        words += f" More than {100.0 * LOST:.0f} % would forbid its use, which so few worlds do not show at 95 %."
    for name in (name for name in rankings if name not in chosen and first_group(rankings[name])):
        rows = {row["row"]: row for row in rankings[name]}
        lowest = first_group(rankings[name])[0]
        why = "it must not be used: there " if label in rows and group(rows[label]) is None else ""
        words += f" In {name} {why}use {short(lowest['row'])}: RMSE {interval(lowest)} deg."
    return "\n".join(textwrap.wrap(f"- **{where}**: {words}", 120, subsequent_indent="  "))


def _log_error(rankings: Iterable[Sequence[Row]], label: str) -> float:
    """Sum of the logarithms of a controller's errors in these rankings."""
    return sum(math.log(row["rmse"]) for rows in rankings for row in rows if row["row"] == label)


def _lost(row: Row) -> float:
    """Share of the worlds in which a controller fails, swings or chatters."""
    return float(row["failures"] + row["swings"])


def lead(families: Mapping[str, Family], rankings: Rankings, otherwise: Mapping[str, str]) -> list[str]:
    """What to use, a line for each kind of rig and of motion, and what the controllers are that it names.

    `otherwise` names what other motions recommend on the rigs where they share no controller with these.
    """
    lines, named = [], dict[str, None]()
    for rig, steps in itertools.product((True, False), (False, True)):
        alike = {name: rows for name, rows in rankings.items() if _kind(families, name) == (rig, steps)}
        where = f"{'Steps' if steps else 'Smooth motions'} {_RIG if rig else _EXACT}"
        lines += [use(alike, where, otherwise)] if alike else []
        used = [*recommended(alike)[:1], *(first_group(rows)[0]["row"] for rows in alike.values() if first_group(rows))]
        named |= {label.split("/")[0]: None for label in used}
    what = [f"| {name} | {about(controller(name).law.__module__)} |" for name in named]
    return [*lines, "", "| controller | what it is |", "| --- | --- |", *what]


def unusable(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """What must not be used on each rig, with the share of the worlds in which it fails or swings."""
    lines = []
    for name, rows in rankings.items():
        lost = {row["row"]: 100.0 * _lost(row) for row in rows if group(row) is None}
        worst = sorted(lost, key=lambda label: -lost[label])
        lines.append(f"- {name}: {', '.join(f'{short(label)} {lost[label]:.3g} %' for label in worst) or 'none'}")
    return lines


def of_the_paper(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """How many times the best's error the paper's controllers have on each rig; or what they lose."""
    lines = [f"| the paper's | {' | '.join(rankings)} |", "| --- |" + " --- |" * len(rankings)]
    for label in PAPER:
        cells = []
        for rows in rankings.values():
            row = next(row for row in rows if row["row"] == label)
            why = "fails" if row["failures"] > row["swings"] else "swings or chatters"
            lost = f"{100.0 * _lost(row):.3g} % lost ({why})"
            cells.append(f"{row['rmse'] / first_group(rows)[0]['rmse']:.3g}" if group(row) else lost)
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return lines


def bought(terms: Sequence[Row], rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """How many times less the RMSE is with each term, by rig, and which two controllers tell it."""
    lost = {(name, row["row"]): _lost(row) for name, rows in rankings.items() for row in rows if group(row) is None}
    lines = [f"| term | {' | '.join(rankings)} |", "| --- |" + " --- |" * len(rankings)]
    for term in dict.fromkeys(row["term"] for row in terms):
        values = {row["family"]: row for row in terms if row["term"] == term}
        pair = next(iter(values.values()))
        named = f"{term}: {short(pair['without'])} to {short(pair['with'])}"
        cells = []
        for name in rankings:
            share = lost.get((name, pair["with"]), 0.0)
            told = f"{_times(values[name])}{' *' if share else ''}" if name in values else "-"
            cells.append("lost" if share > USELESS else told)
        lines.append(f"| {named} | {' | '.join(cells)} |")
    return lines


def _times(row: Row) -> str:
    """A ratio with its interval in words: how many times less, or more; whether the interval holds 1, and is wide."""
    if not row["high"] < math.inf:
        return f"unknown: {three(row['times'])}"
    times, low, high = (row[name] for name in ("times", "low", "high"))
    word, more = "", ""
    if low <= 1.0 <= high:
        word = "unknown: " if high / low > WIDE else "none shown: "
    elif high < 1.0:
        times, low, high, more = 1.0 / times, 1.0 / high, 1.0 / low, " times more"
    return f"{word}{_finely(times)}{more} [{_finely(low)}, {_finely(high)}]"


def _finely(ratio: float) -> str:
    """Three digits of a ratio, and as many as tell it from 1."""
    digits = 3
    while digits < 6 and ratio != 1.0 and float(f"{ratio:.{digits}g}") == 1.0:
        digits += 1
    return f"{ratio:.{digits}g}" if digits > 3 else three(ratio)


def ranking(rows: Sequence[Row]) -> list[str]:
    """The table of a family of worlds, the best row first."""
    heads = (
        "group", "controller", "RMSE [deg], 95 %", "times below feedforward's, 95 %", "fails [%]", "swings [%]",
        "tension varies by [N/s]",
    )  # fmt: skip
    lines = []
    for row in rows:
        times = [three(row[f"times_better{end}"]) for end in ("", "_low", "_high")]
        ratio = f"{times[0]} [{times[1]}, {times[2]}]" if row["times_better_high"] < math.inf else times[0]
        lost = [f"{100.0 * row[fate]:.3g}" for fate in ("failures", "swings")]
        cells = (
            str(group(row) or "-"), short(row["row"]), interval(row), ratio, *lost,
            three(row["chattering"]),
        )  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *lines]


def page(judged: Judged, made: Sequence[str]) -> str:
    """The page: answer and tables; `made` tells the runs."""
    rankings = judged.rankings
    lines = [
        "# Which controller for which rig, tuned at equal budget", "", _SIMULATED, "",
        *judged.answer, "",
        *([_CONFIRMED, ""] if judged.compared else []),
        *decision(rankings, judged.tunings), "",
        *(f"- **{name}**: {about}" for name, about in judged.about.items()), "",
        judged.settings, "",
        f"![RMSE of each controller in each world of {PICTURE}](images/study-{PICTURE}.png)", "",
        "A dot is a world, a cross a controller that must not be used.", "",
        "## The paper's controllers", "",
        _PAPER, "",
        *of_the_paper(rankings), "",
        "## What a term buys", "",
        _BOUGHT.format(wide=WIDE), "",
        *bought(judged.terms, rankings), "",
        "## What not to use", "", "With the share of worlds that are lost:", "",
        *unusable(rankings), "",
        *judged.compared,
        *(part for name, rows in rankings.items() for part in (f"## {name}", "", *ranking(rows), "")),
        "## Runs", "", *made, "", "Made by `python docs/study.py RUN... --judged RUN...`.",
    ]  # fmt: skip
    text = "\n".join(lines) + "\n"
    for name in rankings:
        text = text.replace(name, name.replace(", steps", " (steps)"))
    return text


def named(families: Mapping[str, Family]) -> dict[str, str]:
    """What the rankings that families may have are of: the family's motions, and its jumps beside smooth ones."""
    smooth = {
        family: f"{content.about}{'; its smooth motions only' * (len(set(kinds_of(content))) > 1)}"
        for family, content in families.items()
    }
    steps = {family: f"{content.about}; its steps only" for family, content in families.items()}
    return {
        name: about
        for family in families
        for name, about in ((family, smooth[family]), (f"{family}, steps", steps[family]))
    }


def rankings_of(run: Run) -> dict[str, Sequence[Row]]:
    """The rankings of a run by family, best first; of gains tuned for its family, a row's label says `tuned` alone."""
    one = run.kind == "compare"
    files = {name: f"ranking-{name.replace(', ', '-')}" for name in named(families_of(run))}
    if one:
        (family,) = families_of(run)
        files = {name: file.replace(f"-{family}", "") for name, file in files.items()}
    present = {name: file for name, file in files.items() if (run.path / "data" / f"{file}.csv").exists()}
    rankings: dict[str, Sequence[Row]] = {name: run.data(file).to_dict("records") for name, file in present.items()}
    if not one:
        return rankings
    plain = {name: [{**row, "row": plainly(row["row"], family)} for row in rows] for name, rows in rankings.items()}
    return {name: by_tunings(rows, tunings_of([name])) for name, rows in plain.items()}


def by_tunings(rows: Sequence[Row], tunings: Mapping[tuple[str, str], tuple[float, float]]) -> list[Row]:
    """A ranking of one tuning each, with all in its first group whose tunings overlap those of its lowest."""
    ends = {label: best_and_worst for (_, label), best_and_worst in tunings.items()}
    best = first_group(rows)[:1]
    if not best or best[0]["row"] not in ends:
        return list(rows)
    low, high = ends[best[0]["row"]]
    alike = {label for label, (least, most) in ends.items() if least <= high and low <= most}
    return [{**row, "group": 1.0} if group(row) and row["row"] in alike else row for row in rows]


def tunings_of(families: Iterable[str]) -> dict[tuple[str, str], tuple[float, float]]:
    """The RMSE of the best and of the worst of a controller's tunings [rad], as its study found them on a family."""
    shipped = json.loads(SHIPPED.read_text(encoding="utf-8"))
    return {
        (family, f"{name}/tuned"): tuple(row["tunings"])
        for family in families
        if family in shipped
        for name, row in shipped[family]["controllers"].items()
    }


def has_changed(family: str) -> bool:
    """Whether a family or its drive is another than when its gains were found."""
    found = json.loads(SHIPPED.read_text(encoding="utf-8"))[family]
    return bool(what_changed(family, found["family_sha256"], found["drive"]))


def plainly(label: str, family: str) -> str:
    """A row's label, of gains tuned for this family without its name."""
    return label.removesuffix(f"{PREFIX}{family}") + "tuned" if label.endswith(f"{PREFIX}{family}") else label


def families_of(run: Run) -> dict[str, Family]:
    """The families that a study or a comparison is over, by name."""
    names = [run.config.compare.worlds.family] if run.kind == "compare" else families_studied(run.config)
    return {name: run.config.families[name] for name in names}


def terms_of(run: Run, terms: Mapping[str, tuple[str, str]]) -> Sequence[Row]:
    """How many times less the RMSE is with each term, in the same worlds, with its interval over these."""
    if run.kind == "study":
        return run.data("terms").to_dict("records")
    found = list[Row]()
    for name in rankings_of(run):
        scores = scores_of(run, name)
        for term, (without, with_term) in terms.items():
            if {without, with_term} <= set(scores):
                times = paired_ratio(scores[without], scores[with_term], run.config.seed)
                found.append(
                    {"term": term, "family": name, "without": without, "with": with_term}
                    | {"times": times.value, "low": times.low, "high": times.high}
                )
    return found


def scores_of(run: Run, name: str) -> pd.DataFrame:
    """RMSE [rad] of a comparison in each world, a column per row: the geometric mean over a ranking's motions."""
    ((family, content),) = families_of(run).items()
    every = run.data("worlds")
    wanted = kinds_of(content)[name.endswith(", steps") or set(kinds_of(content)) == {True}]
    chosen = every[every["motion"].isin(wanted)]
    errors = pd.DataFrame(
        {
            "row": chosen["row"].map(lambda label: plainly(str(label), family)),
            "world": chosen["world"],
            "rmse": np.log(penalised(np.where(chosen["failed"], np.inf, chosen["rmse"]))),
        }
    )
    return errors.groupby(["world", "row"])["rmse"].mean().unstack().map(math.exp)


def _kind(families: Mapping[str, Family], name: str) -> tuple[bool, bool]:
    """Whether a ranking is of rigs with a camera, and whether it is of steps."""
    family = families[name.removesuffix(", steps")]
    return family.loop.sensor.level == "camera", name.endswith(", steps") or set(kinds_of(family)) == {True}


def told(run: Run) -> str:
    """A run as the page tells it: the command that asks for it again, and its hash."""
    source = source_of(run)
    command = source["command"].replace(f"{HERE.parent}/", "")
    return f"- `{command}`, {source['run']},\n  hash `{source['result_sha256']}`."


def main() -> None:
    """Write the page and its picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--judged", nargs="*", type=Path, default=[])
    arguments = parser.parse_args()
    runs, others = ([Run(path) for path in paths] for paths in (arguments.runs, arguments.judged))
    rankings, judged = (
        {name: rows for run in which for name, rows in rankings_of(run).items()} for which in (runs, others)
    )
    families = {name: family for run in runs for name, family in families_of(run).items()}
    study = load_study([STUDY])
    budget = study.study.budgets["full"]
    (worlds,) = {run.config.compare.worlds.draws if run.kind == "compare" else budget.worlds for run in runs}
    studied = [name for run in runs if run.kind == "study" for name in families_of(run)]
    former = [name for name in families if has_changed(name)]
    how = _ABOUT.format(
        worlds=worlds,
        tunings=budget.tunings,
        evaluations=budget.candidates * budget.iterations,
        draws=budget.draws,
        former=f" ({joined(former)}: with the motions and the budget of that time)" if former else "",
        over_all=_OVER.format(of_studies=joined(studied)) if studied else "",
        by_overlap=_OVERLAP if len(studied) < len(families) else "",
        few=max(round(worlds * _lost(row)) for rows in rankings.values() for row in rows if group(row)),
    )
    about = {name: words for name, words in named(families).items() if name in rankings}
    terms = [line for run in runs for line in terms_of(run, study.study.terms)]
    compared = asked_again(rankings, judged, _JUDGED) if others else []
    answer = lead(families, confirmed(rankings, judged), unsettled(rankings, judged))
    for run in runs:
        if PICTURE in families_of(run):
            shutil.copyfile(run.path / "figures" / "ranking.png", HERE / "images" / f"study-{PICTURE}.png")
    made = [told(run) for run in (*runs, *others)]
    (HERE / "study.md").write_text(
        page(Judged(answer, rankings, tunings_of(families), about, terms, how, compared), made), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
