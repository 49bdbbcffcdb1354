"""The answer of a study of controllers, as a page: `python docs/study.py RUN [SECOND]` writes docs/study.md.

RUN is a sealed run of `wristctl study experiments/fair_study.yaml --budget full --executor processes`, SECOND another
with `--set seed=2`: other worlds, searches and noise. With it the page says what of its answer comes out again.
"""

from __future__ import annotations

import itertools
import json
import math
import re
import shutil
import sys
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from choices import about
from ranking_rows import Rankings, Row, deg, first_group, group, interval, short, three
from second_study import again, asked_twice, unsettled

from wristctl.commands.printed_table import joined
from wristctl.commands.study.units import families_of
from wristctl.comparison.repeated_tunings import HALVES
from wristctl.comparison.world_ranking import kinds_of
from wristctl.config.families import Family
from wristctl.control.table import controller
from wristctl.records import Run
from wristctl.records.manifest import asked_again

HERE = Path(__file__).parent
# Times the lowest RMSE up to which a controller that is not told from it is about the same; upper over lower end of a
# ratio's interval that tells nothing; share of the worlds that a controller loses whose RMSE tells nothing.
ALIKE, WIDE, USELESS = 1.1, 1.5, 0.5
# Share of the worlds that a controller may lose.
LOST = 0.01
_EXACT, _RIG = "with exact angles and torques", "on rigs with motors, tendons and a camera"
FIGURES = {"laws": "RMSE of every controller on every rig", "terms": "What each term of a controller buys"}
PAPER = ("smc/tuned", "smc/printed", "smc/exchanged", "pid/tuned", "pid/printed")

_SIMULATED = """**All of it is simulated: nothing here was measured on a real rig.** [How the model meets recordings of
real robots](real-robots.md)."""
_ABOUT = """Each row of the table is a family of {worlds} simulated worlds, each another wrist on another rig, none of
them seen in tuning. Each controller was tuned {tunings} times, each time with {evaluations} sets of gains on {draws}
other worlds; the RMSE is the geometric mean over worlds and tunings. Intervals are of 95 %, by a bootstrap over tunings
and worlds, and of the mean, not of single wrists. Controllers are distinguished by their paired differences in the same
worlds: one may be worse though its RMSE lies in the other's interval, and one of a larger RMSE may not be distinguished
where its tunings differ much. That does not mean equal: an RMSE more than a tenth above the lowest stands beside the
name. Halves of the worlds are drawn at random, {halves} times, with the same tunings: what is lowest in all of them may
owe it to its tunings. Where a line above is of several rigs, it names what is not distinguished from the lowest on the
most of them, and of these the one of the least errors.

A world is lost where the controller [fails, swings or chatters](glossary.md); a failure counts as 90 deg in the RMSE.
Not to be used is what is shown, at 95 %, to lose more than 1 % of the worlds; it is in no other column, and up to {few}
of {worlds} do not show it. Feedforward alone comes near behind motors, whose spools follow the motion; with torques
alone it has the whole error of its model.
Gains are tuned where a name has no suffix; [what controllers are](choices.md#controllers). The gains of the tuning
whose error is the median: `wristctl simulate --gains tuned:camera`, [of all families](gains.md). For a wrist of your
own: [recommend](recommend.md)."""
_PAPER = """How many times the lowest RMSE on the rig; of what may not be used, the share of worlds that are lost.
The gains of [the paper](paper.md)'s sliding mode are P1, P2 and P3, those of its PID Kp, Ki and Kd: `printed` as the
paper prints them, `exchanged` with P1 and P2 swapped, our hypothesis of a misprint."""
_BOUGHT = """How many times less RMSE the second controller has, which has the term, than the first, or how many times
more. `none shown`: the 95 % interval holds 1; `unknown`: and its ends are more than {wide} times apart. With * the
second is among what not to use on that rig, for the worlds that it loses; `lost`: these are more than half."""
_FIRST = re.compile(r"([\w-]+(?: \(steps\))?) [\w-]+ (\d+) and (\d+ of \d+)(?=[;.])")


@dataclass(frozen=True)
class Study:
    """What the page shows of a run.

    What to use, rankings by family, best first, what the families are, values of terms, orders tuned otherwise,
    how often the best of a family is first, how it was tuned and tested, and what of it a second study finds again: a
    sentence and a section, empty without one.
    """

    answer: Sequence[str]
    rankings: Mapping[str, Sequence[Row]]
    about: Mapping[str, str]
    terms: Sequence[Row]
    sensitivity: Sequence[Row]
    first: Mapping[str, str]
    settings: str
    again: Sequence[str] = ()
    compared: Sequence[str] = ()


def decision(rankings: Mapping[str, Sequence[Row]], first: Mapping[str, str]) -> list[str]:
    """A line for each rig: what to run, how often it is first, what is as good, what comes next, and the gain."""
    lines = [
        "| rig | lowest RMSE | RMSE [deg], 95 % | lowest in: halves of the worlds, tunings "
        "| not distinguished from it | first that is worse | feedforward's RMSE / the lowest "
        "| [do not use](#what-not-to-use) |",
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
            f"| {name} | **{short(best['row'])}** | {interval(best)} | {first.get(name, '-')} | {same or '-'} | {then} "
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

    `otherwise` names what a second study recommends on the rigs where it shares no controller with this one.
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
        words += f" That is not settled: [a second study](#asked-twice) has {joined(unsettled)}."
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
    return "\n".join(textwrap.wrap(f"- **{where}**: {words}", 120, subsequent_indent="  "))


def _log_error(rankings: Iterable[Sequence[Row]], label: str) -> float:
    """Sum of the logarithms of a controller's errors in these rankings."""
    return sum(math.log(row["rmse"]) for rows in rankings for row in rows if row["row"] == label)


def _lost(row: Row) -> float:
    """Share of the worlds in which a controller fails, swings or chatters."""
    return float(row["failures"] + row["swings"])


def lead(run: Run, rankings: Rankings, otherwise: Mapping[str, str]) -> list[str]:
    """What to use, a line for each kind of rig and of motion, and what the controllers are that it names.

    `otherwise` names what a second study recommends on the rigs where it shares no controller with this one.
    """
    lines, named = [], dict[str, None]()
    for rig, steps in itertools.product((True, False), (False, True)):
        alike = {name: rows for name, rows in rankings.items() if _kind(run, name) == (rig, steps)}
        where = f"{'Steps' if steps else 'Smooth motions'} {_RIG if rig else _EXACT}"
        lines += [use(alike, where, otherwise)] if alike else []
        named |= {label.split("/")[0]: None for label in recommended(alike)}
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
        shares = {name: lost.get((name, pair["with"]), 0.0) for name in rankings}
        cells = [
            "lost" if share > USELESS else f"{_times(values[name])}{' *' if share else ''}"
            for name, share in shares.items()
        ]
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


def sensitivity(rows: Sequence[Row]) -> list[str]:
    """What another way to tune does to the order."""
    heads = (
        "tuned otherwise", "pairs of controllers", "told apart both times", "the other way round", "Kendall's tau",
        "lowest before -> after", "all RMSE times",
    )  # fmt: skip
    lines = [
        f"| {row['variant']} | {row['pairs']} | {row['resolved']} | {row['reversed']} | {row['tau']:.2f} "
        f"| {row['best']} | {row['ratio']:.3f} |"
        for row in rows
    ]
    return [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *lines]


def page(study: Study, made: str) -> str:
    """The page: answer and tables; `made` is the paragraph on the run."""
    rankings = study.rankings
    lines = [
        "# Which controller for which rig, tuned at equal budget", "", _SIMULATED, "",
        *study.answer, "",
        *study.again,
        *decision(rankings, study.first), "",
        *(f"- **{name}**: {about}" for name, about in study.about.items()), "",
        study.settings, "",
        "## The paper's controllers", "",
        _PAPER, "",
        *of_the_paper(rankings), "",
        "## What a term buys", "",
        _BOUGHT.format(wide=WIDE), "",
        *bought(study.terms, rankings), "",
        "## What not to use", "", "With the share of worlds that are lost:", "",
        *unusable(rankings), "",
        *(part for name, told in FIGURES.items() for part in (f"![{told}](images/study-{name}.png)", "")),
        made, "",
        *study.compared,
        *(part for name, rows in rankings.items() for part in (f"## {name}", "", *ranking(rows), "")),
        "## Tuned otherwise", "", *sensitivity(study.sensitivity), "", "Made by `python docs/study.py RUN [SECOND]`.",
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


def first_of(run: Run, rankings: Rankings) -> dict[str, str]:
    """How often the best of each family is first, in halves of the worlds and in tunings."""
    if not (run.path / "data" / "firsts.csv").exists():
        return _first_in_words(run)
    table = run.data("firsts").set_index(["family", "row"]).to_dict("index")
    best = {name: (name, first_group(rows)[0]["row"]) for name, rows in rankings.items() if first_group(rows)}
    lines = {name: table[place] for name, place in best.items() if place in table}
    return {
        name: f"{line['first_in_halves']} of {line['halves']}, {line['first_in_tunings']} of {line['tunings']}"
        for name, line in lines.items()
    }


def _first_in_words(run: Run) -> dict[str, str]:
    """The same of a run from before studies had a table of it: from the words of its answer."""
    text = " ".join(_overview(run)).partition("First in how many")[2]
    return {
        name.replace(" (steps)", ", steps"): f"{halves} of {HALVES}, {of_tunings}"
        for name, halves, of_tunings in _FIRST.findall(text)
    }


def _overview(run: Run) -> list[str]:
    """Lines of the answer that a run begins with."""
    lines: list[str] = json.loads(run.file("overview.json").read_text(encoding="utf-8"))["answer"]
    return lines


def rankings_of(run: Run) -> dict[str, list[Row]]:
    """Rankings of a run by family, best first."""
    files = {name: f"ranking-{name.replace(', ', '-')}" for name in named(studied(run))}
    present = {name: file for name, file in files.items() if (run.path / "data" / f"{file}.csv").exists()}
    return {name: list(run.data(file).to_dict("records")) for name, file in present.items()}


def studied(run: Run) -> dict[str, Family]:
    """The families of a study by name."""
    return {name: run.config.families[name] for name in families_of(run.config)}


def _kind(run: Run, name: str) -> tuple[bool, bool]:
    """Whether a ranking is of rigs with a camera, and whether it is of steps."""
    family = studied(run)[name.removesuffix(", steps")]
    return family.loop.sensor.level == "camera", name.endswith(", steps") or set(kinds_of(family)) == {True}


def second_of(run: Run, second: Run) -> tuple[dict[str, str], list[str], list[str]]:
    """What a second study finds again of the families that both have: a sentence, and a section; where nothing, what.

    SystemExit where it asked something else of them, or had the same seed.
    """
    shared = [name for name in studied(run) if name in studied(second)]
    if not shared or asked_of(run, shared) != asked_of(second, shared) or run.config.seed == second.config.seed:
        sys.exit("two studies of the same question differ in their seed, in their families, and in nothing else")
    rankings = rankings_of(run), rankings_of(second)
    families = {name: studied(run)[name] for name in shared}
    rigs = [name for name, family in families.items() if family.loop.sensor.level == "camera"]
    smooth = [name for name in rigs if False in kinds_of(families[name])]
    made = [
        f"`{asked_again(second.manifest.argv)}`, {second.id},",
        f"has the hash `{second.manifest.result_sha256}`.",
        "None of its worlds, searches and noise are those of the first study.",
    ]
    return unsettled(*rankings), again(*rankings, smooth), asked_twice(*rankings, "\n".join(made))


def resumed(run: Run) -> list[Run]:
    """The run, the one that it resumed, and so on, as far as they lie beside it."""
    units = run.manifest.units
    earlier = run.path.parent / units.run if units and units.run else None
    return [run, *(resumed(Run(earlier)) if earlier and earlier.exists() else [])]


def asked_of(run: Run, families: Sequence[str]) -> dict[str, Any]:
    """What a study asked of these families: all but its seed, and what it asked beside."""
    beside = {"families", "variants", "varied", "resume"}
    asked = run.config.model_dump(include={"wrist", "families", "study"})
    of_families = {name: asked["families"][name] for name in families}
    return {
        "wrist": asked["wrist"],
        "families": of_families,
        "study": {key: value for key, value in asked["study"].items() if key not in beside},
    }


def main() -> None:
    """Write the page and its pictures."""
    run = Run(Path(sys.argv[1]))
    for name in FIGURES:
        shutil.copyfile(run.path / "figures" / f"{name}.png", HERE / "images" / f"study-{name}.png")
    budget = run.config.study.budgets[run.config.study.budget]
    rankings = rankings_of(run)
    how = _ABOUT.format(
        worlds=budget.worlds,
        tunings=budget.tunings,
        evaluations=budget.candidates * budget.iterations,
        draws=budget.draws,
        halves=HALVES,
        few=max(round(budget.worlds * _lost(row)) for rows in rankings.values() for row in rows if group(row)),
    )
    differing, *repeated = second_of(run, Run(Path(sys.argv[2]))) if len(sys.argv) > 2 else ({}, [], [])
    about = {name: words for name, words in named(studied(run)).items() if name in rankings}
    terms, otherwise = (run.data(name).to_dict("records") for name in ("terms", "sensitivity"))
    study = Study(
        lead(run, rankings, differing), rankings, about, terms, otherwise, first_of(run, rankings), how, *repeated
    )
    runs = resumed(run)
    minutes = sum(one.manifest.timing.wall_s or 0.0 for one in runs) / 60.0
    part = f" in {len(runs)} parts" if len(runs) > 1 else ""
    made = "\n".join(
        [
            f"`{asked_again(run.manifest.argv)}`, {minutes:.0f} minutes on two cores{part}, {run.id}.",
            "Its result, the same by any executor and after any interruption, has the hash",
            f"`{run.manifest.result_sha256}`. What it costs elsewhere: [cost](cost.md).",
        ]
    )
    (HERE / "study.md").write_text(page(study, made), encoding="utf-8")


if __name__ == "__main__":
    main()
