"""The answer of a study of controllers, as a page: `python docs/study.py RUN` writes docs/study.md from a sealed run.

RUN is of `wristctl study experiments/fair_study.yaml --budget full --executor processes`.
"""

from __future__ import annotations

import json
import math
import shlex
import shutil
import sys
from pathlib import Path

from wristctl.records import Run

HERE = Path(__file__).parent
FIGURES = {"laws": "Every controller on every rig", "terms": "What each term of a controller buys"}


def answer_of(run: Run) -> list[str]:
    """The lines of its first screen, as a terminal shows them."""
    lines: list[str] = json.loads((run.path / "overview.json").read_text(encoding="utf-8"))["answer"]
    return ["```", *lines, "```"]


def ranking(run: Run, family: str) -> list[str]:
    """The table of a family of worlds, the best row first."""
    rows = [
        f"| {'-' if math.isnan(each['group']) else round(each['group'])} | {each['row']} | {_deg(each['rmse'])} "
        f"[{_deg(each['rmse_low'])}, {_deg(each['rmse_high'])}] | {each['times_better']:.3g} "
        f"[{each['times_better_low']:.3g}, {each['times_better_high']:.3g}] | {100.0 * each['failures']:.3g} "
        f"| {100.0 * each['swings']:.3g} | {each['chattering']:.3g} |"
        for each in run.data(f"ranking-{family}").to_dict("records")
    ]
    heads = (
        "group", "row", "RMSE [deg], 95 %", "times below feedforward's, 95 %", "fails [%]", "swings [%]",
        "tension varies by [N/s]",
    )  # fmt: skip
    return [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *rows]


def sensitivity(run: Run) -> list[str]:
    """What another way to tune does to the order."""
    rows = [
        f"| {each['variant']} | {each['pairs']} | {each['resolved']} | {each['reversed']} | {each['tau']:.2f} "
        f"| {each['best']} | {each['ratio']:.3f} |"
        for each in run.data("sensitivity").to_dict("records")
    ]
    heads = (
        "tuned otherwise", "pairs of controllers", "told apart both times", "the other way round", "Kendall's tau",
        "lowest before -> after", "all RMSE times",
    )  # fmt: skip
    return [f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", *rows]


def _deg(value: float) -> str:
    return f"{math.degrees(value):.3g}"


def main() -> None:
    """Write the page and its pictures."""
    run = Run(Path(sys.argv[1]))
    manifest = json.loads((run.path / "run.json").read_text(encoding="utf-8"))
    families = sorted(each.stem.removeprefix("ranking-") for each in (run.path / "data").glob("ranking-*.csv"))
    for name in FIGURES:
        shutil.copyfile(run.path / "figures" / f"{name}.png", HERE / "images" / f"study-{name}.png")
    minutes = manifest["timing"]["wall_s"] / 60.0
    command = shlex.join(["wristctl", *manifest["argv"][1:]])
    pictures = [f"![{told}](images/study-{name}.png)" for name, told in FIGURES.items()]
    lines = [
        "# Which controller for which rig, tuned at equal budget",
        "",
        *answer_of(run),
        "",
        *(part for each in pictures for part in (each, "")),
        f"`{command}`, {minutes:.0f} minutes on two cores, {run.id}. Its result, the same by any executor and",
        f"after any interruption, has the hash `{manifest['result_sha256']}`. What it costs",
        "elsewhere: [cost](cost.md).",
        "",
        *(part for name in families for part in (f"## {name}", "", *ranking(run, name), "")),
        "## Tuned otherwise",
        "",
        *sensitivity(run),
        "",
        "Made by `python docs/study.py RUN`.",
    ]
    (HERE / "study.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
