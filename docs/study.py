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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ranking_rows import Rankings, Row, deg, first_group, group, interval, short, three
from second_study import again, asked_twice

from wristctl.commands.study.units import families_of
from wristctl.comparison.repeated_tunings import HALVES
from wristctl.comparison.world_ranking import kinds_of
from wristctl.config.families import Family
from wristctl.records import Run
from wristctl.records.manifest import asked_again

HERE = Path(__file__).parent
FIGURES = {"laws": "RMSE of every controller on every rig", "terms": "What each term of a controller buys"}
PAPER = ("smc/tuned", "smc/printed", "smc/exchanged", "pid/printed")

_ABOUT = """All of it is simulated: {worlds} worlds of each family, wrists and rigs drawn anew and held out from tuning.
Each controller was tuned {tunings} times, each time with {evaluations} evaluations on {draws} other worlds. RMSE is the
geometric mean over worlds and tunings; intervals and ties are of 95 %, by paired differences. The first sentence names
one that is in the first group on all rigs of its kind, and the table all that are as good. A world is lost where a
controller fails, swings or chatters. Do not use what is shown, at 95 %, to lose more than 1 % of the worlds; a few of
so many do not show it. Names without a suffix are tuned; [what they mean](choices.md#controllers). The gains: `wristctl
simulate --gains tuned:camera`, [of all families](gains.md). For a wrist of your own: [recommend](recommend.md)."""
_FIRST = re.compile(r"([\w-]+(?: \(steps\))?) [\w-]+ (\d+) and (\d+ of \d+)(?=[;.])")


@dataclass(frozen=True)
class Study:
    """What the page shows of a run.

    Its answer in words, rankings by family, best first, what the families are, values of terms, orders tuned otherwise,
    how often the best of a family is first, how it was tuned and tested, and what of it a second study finds again: a
    sentence and a section, empty without one.
    """

    answer: str
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
        "| rig | lowest RMSE | RMSE [deg], 95 % | first in halves of the worlds, in tunings | not told from it "
        "| the next that is: RMSE [deg] | feedforward's RMSE over the lowest | [do not use](#what-not-to-use) |",
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
        same = ", ".join(short(row["row"]) for row in ties)
        then = f"{short(after['row'])} {deg(after['rmse'])}" if after else "-"
        lines.append(
            f"| {name} | **{best['row']}** | {interval(best)} | {first.get(name, '-')} | {same or '-'} | {then} "
            f"| {three(best['times_better'])} | {lost} of {len(rows)} |"
        )
    return lines


def unusable(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """What must not be used on each rig, with the share of the worlds in which it fails or swings."""
    lines = []
    for name, rows in rankings.items():
        lost = {row["row"]: 100.0 * (row["failures"] + row["swings"]) for row in rows if group(row) is None}
        worst = sorted(lost, key=lambda label: -lost[label])
        lines.append(f"- {name}: {', '.join(f'{short(label)} {lost[label]:.3g} %' for label in worst) or 'none'}")
    return lines


def of_the_paper(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """How many times the best's error the paper's controllers have on each rig; a dash where they must not be used."""
    lines = [f"| the paper's | {' | '.join(rankings)} |", "| --- |" + " --- |" * len(rankings)]
    for label in PAPER:
        cells = []
        for rows in rankings.values():
            row = next(row for row in rows if row["row"] == label)
            lost = f"{100.0 * (row['failures'] + row['swings']):.3g} % lost"
            cells.append(f"{row['rmse'] / first_group(rows)[0]['rmse']:.3g}" if group(row) else lost)
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return lines


def bought(terms: Sequence[Row], families: Sequence[str]) -> list[str]:
    """How many times less the RMSE is with each term, by rig, and which two controllers tell it."""
    lines = [f"| term | {' | '.join(families)} |", "| --- |" + " --- |" * len(families)]
    for term in dict.fromkeys(row["term"] for row in terms):
        values = {row["family"]: row for row in terms if row["term"] == term}
        pair = next(iter(values.values()))
        named = f"{term}: {short(pair['without'])} to {short(pair['with'])}"
        lines.append(f"| {named} | {' | '.join(_times(values[name]) for name in families)} |")
    return lines


def _times(row: Row) -> str:
    """A ratio with its interval, in brackets where the interval holds 1; undecided where its tunings tell none."""
    if not row["high"] < math.inf:
        return f"({three(row['times'])})"
    text = f"{three(row['times'])} [{three(row['low'])}, {three(row['high'])}]"
    return f"({text})" if row["low"] <= 1.0 <= row["high"] else text


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
            str(group(row) or "-"), row["row"], interval(row), ratio, *lost,
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
        "# Which controller for which rig, tuned at equal budget", "", study.answer, "",
        *study.again,
        *decision(rankings, study.first), "",
        *(f"- **{name}**: {about}" for name, about in study.about.items()), "",
        study.settings, "",
        "## The paper's controllers", "",
        "RMSE over the lowest on the rig, or the share of worlds that are lost. `printed`: with the paper's gains;",
        "`exchanged`: with P1 and P2 of these exchanged.", "",
        *of_the_paper(rankings), "",
        "## What a term buys", "",
        "RMSE of the first controller over that of the second, which has the term: above 1 it helps, below it harms.",
        "In parentheses the 95 % interval holds 1: no effect is shown.", "",
        *bought(study.terms, list(rankings)), "",
        "## What not to use", "", "With the share of worlds that are lost:", "",
        *unusable(rankings), "",
        *(part for name, told in FIGURES.items() for part in (f"![{told}](images/study-{name}.png)", "")),
        made, "",
        *study.compared,
        *(part for name, rows in rankings.items() for part in (f"## {name}", "", *ranking(rows), "")),
        "## Tuned otherwise", "", *sensitivity(study.sensitivity), "", "Made by `python docs/study.py RUN [SECOND]`.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def named(families: Mapping[str, Family]) -> dict[str, str]:
    """What the rankings that families may have are of: the family's motions, and its jumps beside smooth ones."""
    return {
        name: about
        for family, content in families.items()
        for name, about in ((family, content.about), (f"{family}, steps", f"{content.about}; its steps alone"))
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


def second_of(run: Run, second: Run) -> tuple[list[str], list[str]]:
    """What a second study finds again of the families that both have: a sentence, and a section.

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
    return again(*rankings, smooth), asked_twice(*rankings, "\n".join(made))


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
    )
    answer = "\n".join(itertools.takewhile(bool, _overview(run)))
    repeated = second_of(run, Run(Path(sys.argv[2]))) if len(sys.argv) > 2 else ([], [])
    about = {name: words for name, words in named(studied(run)).items() if name in rankings}
    terms, otherwise = (run.data(name).to_dict("records") for name in ("terms", "sensitivity"))
    study = Study(answer, rankings, about, terms, otherwise, first_of(run, rankings), how, *repeated)
    minutes = (run.manifest.timing.wall_s or 0.0) / 60.0
    part = " for the last part of a run that was resumed" if "--resume" in run.manifest.argv else ""
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
