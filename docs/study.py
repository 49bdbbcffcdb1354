"""The answer of a study of controllers, as a page: `python docs/study.py RUN` writes docs/study.md from a sealed run.

RUN is of `wristctl study experiments/fair_study.yaml --budget full --executor processes`.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wristctl.config.families import Family
from wristctl.records import Run
from wristctl.records.manifest import asked_again

HERE = Path(__file__).parent
FIGURES = {"laws": "RMSE of every controller on every rig", "terms": "What each term of a controller buys"}
PAPER = ("smc/tuned", "smc/printed", "smc/exchanged", "pid/printed")

_ABOUT = """All of it is simulated: {worlds} worlds of each family, wrists and rigs drawn anew and held out from tuning.
Each controller was tuned {tunings} times, each time with {evaluations} evaluations on {draws} other worlds. RMSE is the
geometric mean over worlds and tunings; intervals and ties are of 95 %, by paired differences. The first sentence names
what is in the first group on all rigs of its kind. A world is lost where a controller fails, swings or chatters. Do not
use what is shown, at 95 %, to lose more than 1 % of the worlds; a few of so many do not show it. Names without a suffix
are tuned; [what they mean](choices.md#controllers). The gains: `wristctl simulate --gains tuned:camera`, [of all
families](gains.md). For a wrist of your own: [recommend](recommend.md)."""
_ANSWER = re.compile(r"## Result\n\n```\n(.*?)\n\n", re.DOTALL)
_FIRST = re.compile(r"([\w-]+(?: \(steps\))?) [\w-]+ (\d+) and (\d+ of \d+)(?=[;.])")

Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Study:
    """What the page shows of a run.

    Its answer in words, rankings by family, best first, what the families are, values of terms, orders tuned otherwise,
    how often the best of a family is first, and how it was tuned and judged.
    """

    answer: str
    rankings: Mapping[str, Sequence[Row]]
    about: Mapping[str, str]
    terms: Sequence[Row]
    sensitivity: Sequence[Row]
    first: Mapping[str, str]
    settings: str


def group(row: Row) -> int | None:
    """Number of the row's group; None for what must not be used."""
    return None if math.isnan(row["group"]) else round(row["group"])


def first_group(rows: Sequence[Row]) -> list[Row]:
    """Rows that nothing is told apart from for the better; the one of the lowest RMSE comes first."""
    return sorted((row for row in rows if group(row) == 1), key=lambda row: float(row["rmse"]))


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
        same = ", ".join(_short(row["row"]) for row in ties)
        then = f"{_short(after['row'])} {_deg(after['rmse'])}" if after else "-"
        lines.append(
            f"| {name} | **{best['row']}** | {_interval(best)} | {first.get(name, '-')} | {same or '-'} | {then} "
            f"| {_three(best['times_better'])} | {lost} of {len(rows)} |"
        )
    return lines


def unusable(rankings: Mapping[str, Sequence[Row]]) -> list[str]:
    """What must not be used on each rig, with the share of the worlds in which it fails or swings."""
    lines = []
    for name, rows in rankings.items():
        lost = {row["row"]: 100.0 * (row["failures"] + row["swings"]) for row in rows if group(row) is None}
        worst = sorted(lost, key=lambda label: -lost[label])
        lines.append(f"- {name}: {', '.join(f'{_short(label)} {lost[label]:.3g} %' for label in worst) or 'none'}")
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
        named = f"{term}: {_short(pair['without'])} to {_short(pair['with'])}"
        lines.append(f"| {named} | {' | '.join(_times(values[name]) for name in families)} |")
    return lines


def _times(row: Row) -> str:
    """A ratio with its interval, in brackets where the interval holds 1."""
    text = f"{_three(row['times'])} [{_three(row['low'])}, {_three(row['high'])}]"
    return f"({text})" if row["low"] <= 1.0 <= row["high"] else text


def ranking(rows: Sequence[Row]) -> list[str]:
    """The table of a family of worlds, the best row first."""
    heads = (
        "group", "controller", "RMSE [deg], 95 %", "times below feedforward's, 95 %", "fails [%]", "swings [%]",
        "tension varies by [N/s]",
    )  # fmt: skip
    lines = []
    for row in rows:
        times = [_three(row[f"times_better{end}"]) for end in ("", "_low", "_high")]
        lost = [f"{100.0 * row[fate]:.3g}" for fate in ("failures", "swings")]
        cells = (
            str(group(row) or "-"), row["row"], _interval(row), f"{times[0]} [{times[1]}, {times[2]}]", *lost,
            _three(row["chattering"]),
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
        *(part for name, rows in rankings.items() for part in (f"## {name}", "", *ranking(rows), "")),
        "## Tuned otherwise", "", *sensitivity(study.sensitivity), "", "Made by `python docs/study.py RUN`.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _short(label: str) -> str:
    """A label without what most have: tuned gains."""
    return label.removesuffix("/tuned")


def _interval(row: Row) -> str:
    """RMSE of a row [deg] with its interval."""
    return f"{_deg(row['rmse'])} [{_deg(row['rmse_low'])}, {_deg(row['rmse_high'])}]"


def _three(value: float) -> str:
    """Three digits, without a power of ten."""
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 1000.0 else f"{value:.3g}"


def _deg(value: float) -> str:
    return f"{math.degrees(value):.3g}"


def named(families: Mapping[str, Family]) -> dict[str, str]:
    """What the rankings that families may have are of: the family's motions, and its jumps beside smooth ones."""
    return {
        name: about
        for family, content in families.items()
        for name, about in ((family, content.about), (f"{family}, steps", f"{content.about}; its steps alone"))
    }


def main() -> None:
    """Write the page and its pictures."""
    run = Run(Path(sys.argv[1]))
    manifest = json.loads((run.path / "run.json").read_text(encoding="utf-8"))
    for name in FIGURES:
        shutil.copyfile(run.path / "figures" / f"{name}.png", HERE / "images" / f"study-{name}.png")
    settings = run.config.study
    budget = settings.budgets[settings.budget]
    terms = run.data("terms").to_dict("records")
    families = {name: run.config.families[name] for name in settings.families}
    files = {name: f"ranking-{name.replace(', ', '-')}" for name in named(families)}
    files = {name: file for name, file in files.items() if (run.path / "data" / f"{file}.csv").exists()}
    about = {name: told for name, told in named(families).items() if name in files}
    told = (run.path / "README.md").read_text(encoding="utf-8")
    (answer,) = _ANSWER.findall(told)
    firsts = _FIRST.findall(" ".join(told.partition("First in how many")[2].partition("\n```")[0].split()))
    first = {
        name.replace(" (steps)", ", steps"): f"{halves} of 50, {of_tunings}" for name, halves, of_tunings in firsts
    }
    rankings = {name: run.data(file).to_dict("records") for name, file in files.items()}
    otherwise = run.data("sensitivity").to_dict("records")
    how = _ABOUT.format(
        worlds=budget.worlds,
        tunings=budget.tunings,
        evaluations=budget.candidates * budget.iterations,
        draws=budget.draws,
    )
    study = Study(answer, rankings, about, terms, otherwise, first, how)
    command, minutes = asked_again(manifest["argv"]), manifest["timing"]["wall_s"] / 60.0
    part = " for the last part of a run that was resumed" if "--resume" in manifest["argv"] else ""
    made = "\n".join(
        [
            f"`{command}`, {minutes:.0f} minutes on two cores{part}, {run.id}.",
            "Its result, the same by any executor and after any interruption, has the hash",
            f"`{manifest['result_sha256']}`. What it costs elsewhere: [cost](cost.md).",
        ]
    )
    (HERE / "study.md").write_text(page(study, made), encoding="utf-8")


if __name__ == "__main__":
    main()
