"""Ship the gains that a study published: `python docs/published_gains.py RUN` writes them and docs/gains.md.

RUN is of `wristctl study experiments/fair_study.yaml --budget full --executor processes`. Families that it has not are
left as they were, each with the run that it is from. Where controllers have changed since, RUN is of `wristctl compare`
with the shipped gains over worlds of a family: errors and lost worlds are then that run's, the gains stay. Without RUN
the page alone is written, from what is shipped.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

from wristctl.commands.study.published import PUBLISHED, what_changed
from wristctl.control.shipped_gains import FILE, PREFIX
from wristctl.records import Run
from wristctl.records.manifest import asked_again

HERE = Path(__file__).parent
# Table of a comparison over worlds, and the fates of its rows on which nobody should rely.
RANKING = "ranking"
UNUSABLE = ("unreliable", "does not arrive", "not physical")
SHIPPED = HERE.parent / "wristctl" / "control" / FILE


def source_of(run: Run) -> dict[str, str]:
    """A run's identifier, the hash of its result, and how it is asked for again."""
    manifest = json.loads((run.path / "run.json").read_text(encoding="utf-8"))
    return {"run": run.id, "result_sha256": manifest["result_sha256"], "command": asked_again(manifest["argv"])}


def with_run(content: dict[str, Any], run: Run) -> dict[str, Any]:
    """What is shipped, with the families of a study's run in it."""
    families = json.loads((run.path / PUBLISHED).read_text(encoding="utf-8"))
    return content | {name: of_family | source_of(run) for name, of_family in families.items()}


def with_comparison(content: dict[str, Any], run: Run) -> dict[str, Any]:
    """What is shipped, with errors and lost worlds as a comparison of these gains found them."""
    worlds = run.config.compare.worlds
    of_family, lines = content[worlds.family], run.data(RANKING).set_index("row")
    controllers = dict(of_family["controllers"])
    for name, row in controllers.items():
        line: dict[Any, Any] = lines.loc[f"{name}/{PREFIX}{worlds.family}"].to_dict()
        errors = {key: float(line[key]) for key in ("rmse", "rmse_low", "rmse_high")}
        lost = round(float(line["lost"]) * worlds.draws)
        controllers[name] = row | errors | {"lost": lost, "reliable": line["fate"] not in UNUSABLE}
    found = {"worlds": worlds.draws, "controllers": controllers, "compared": source_of(run)}
    return content | {worlds.family: of_family | found}


def page(content: dict[str, Any]) -> str:
    """The page: every controller's gains, and how they did on worlds that no search has seen."""
    lines = [
        "# Gains that are shipped",
        "",
        f"`--gains {PREFIX}camera` of `simulate`, and `gains: {PREFIX}camera` of a row in a file, name gains that a",
        "study found on a family of worlds, for the paper's wrist; for another wrist: [recommend](recommend.md). Each",
        "controller was tuned several times, each time on other worlds; shipped is the tuning in the middle, not the",
        "luckiest. RMSE is the geometric mean over worlds that no search has seen, with its 95 % interval over these",
        "worlds, and over tunings where a study is named alone; beside it that of the best and of the worst tuning, as",
        "the study found them. Lost are worlds where the gains fail, swing or chatter; on gains that are shown to lose",
        "more than one in a hundred nobody should rely. Outside a family's conditions, and with such gains, a command",
        "warns. How the controllers of a family compare: [study](study.md).",
        "",
        "The same worlds again, with these gains: `wristctl compare experiments/shipped.yaml`, for another family with",
        "`--set worlds.family=uneven`, for two planes `experiments/shipped_two_planes.yaml`. The RMSE of every",
        "controller in every world (`data/worlds.csv`) is to the last bit that in `data/worlds-FAMILY.csv` of the",
        "study's run, and as many worlds are lost, as long as neither the family nor the simulated drive has changed",
        "since. Where one has, this page and every command that uses the gains say so. Intervals are over worlds,",
        "since these gains are of one tuning.",
    ]
    for name, of_family in content.items():
        lines += ["", f"## {name}", "", *_family(name, of_family)]
    return "\n".join([*lines, "", "Made by `python docs/published_gains.py RUN`."]) + "\n"


def _family(name: str, of_family: dict[str, Any]) -> list[str]:
    limits, worlds, compared = of_family["conditions"], of_family["worlds"], of_family.get("compared")
    about = f"{of_family['about'][:1].upper()}{of_family['about'][1:]}."
    if limits:
        (fast, _), (soft, stiff) = limits["period"], limits["tendon_stiffness"]
        about += f" Made for a tick of {1e3 * fast:g} ms and tendons of {soft / 1e3:g} to {stiff / 1e3:g} kN/m."
    if changed := what_changed(name, of_family["family_sha256"], of_family["drive"]):
        about += f" **{changed[:1].upper()}{changed[1:]}.**"
    heads = ("controller", "gains", "RMSE [deg], 95 %", "tunings [deg]", f"lost of {worlds} worlds", "to rely on")
    rows = sorted(of_family["controllers"].items(), key=lambda item: (not item[1]["reliable"], item[1]["rmse"]))
    return [
        about,
        "",
        f"| {' | '.join(heads)} |",
        "| --- " * len(heads) + "|",
        *(_row(controller, row) for controller, row in rows),
        "",
        *_source("Gains", of_family),
        *(_source("Errors and lost worlds, with today's controllers", compared) if compared else []),
    ]


def _source(subject: str, source: dict[str, Any]) -> list[str]:
    return [f"- {subject}: `{source['command']}`, {source['run']},", f"  hash `{source['result_sha256']}`."]


def _row(name: str, row: dict[str, Any]) -> str:
    gains = ", ".join(f"{gain} = {value:.4g}" for gain, value in row["gains"].items())
    mean, ends = _deg(row["rmse"]), (row["rmse_low"], row["rmse_high"])
    interval = f" [{_deg(ends[0])}, {_deg(ends[1])}]" if None not in ends else ""
    best, worst = map(_deg, row["tunings"])
    reliable = "yes" if row["reliable"] else "no"
    return f"| {name} | {gains} | {mean}{interval} | {best} to {worst} | {row['lost']} | {reliable} |"


def _deg(value: float) -> str:
    return f"{math.degrees(value):.3g}"


def main() -> None:
    """Write what is shipped, and the page."""
    content = json.loads(SHIPPED.read_text(encoding="utf-8"))
    for path in sys.argv[1:]:
        run = Run(Path(path))
        content = with_comparison(content, run) if run.kind == "compare" else with_run(content, run)
    SHIPPED.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    (HERE / "gains.md").write_text(page(content), encoding="utf-8")


if __name__ == "__main__":
    main()
