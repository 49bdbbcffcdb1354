"""Ship the gains that a study published: `python docs/published_gains.py RUN` writes them and docs/gains.md.

RUN is of `wristctl study experiments/shipped_gains.yaml --executor processes`. Families that it has not are left as
they were, each with the run that it is from. Without RUN the page alone is written, from what is shipped.
"""

from __future__ import annotations

import json
import math
import shlex
import sys
from pathlib import Path
from typing import Any

from wristctl.commands.study.published import PUBLISHED
from wristctl.control.shipped_gains import FILE, PREFIX
from wristctl.records import Run

HERE = Path(__file__).parent
ONE_MACHINES = {"--out", "--resume"}
"""Options that say where a run lies, and what it was cut short as: no part of how it is asked for again."""
SHIPPED = HERE.parent / "wristctl" / "control" / FILE


def with_run(content: dict[str, Any], run: Run) -> dict[str, Any]:
    """What is shipped, with the families of a study's run in it."""
    manifest = json.loads((run.path / "run.json").read_text(encoding="utf-8"))
    words = manifest["argv"][1:]
    kept = [word for word, before in zip(words, ["", *words], strict=False) if not {word, before} & ONE_MACHINES]
    command = shlex.join(["wristctl", *kept])
    source = {"run": run.id, "result_sha256": manifest["result_sha256"], "command": command}
    families = json.loads((run.path / PUBLISHED).read_text(encoding="utf-8"))
    return content | {name: of_family | source for name, of_family in families.items()}


def page(content: dict[str, Any]) -> str:
    """The page: every controller's gains, and how they did on worlds that no search has seen."""
    lines = [
        "# Gains that are shipped",
        "",
        f"`--gains {PREFIX}camera` of `simulate`, and `gains: {PREFIX}camera` of a row in a file, name gains that a",
        "study found on a family of worlds, for the paper's wrist; for another wrist: [recommend](recommend.md). Each",
        "controller was tuned several times, each time on other worlds; shipped is the tuning in the middle, not the",
        "luckiest. RMSE is the geometric mean over worlds that no search has seen, with its 95 % interval over tunings",
        "and worlds; beside it that of the best and of the worst tuning. Lost are worlds where the gains fail, swing",
        "or chatter; on gains that are shown to lose more than one in a hundred nobody should rely. Outside a family's",
        "conditions, and with such gains, a command warns. The searches were short (experiments/shipped_gains.yaml): a",
        "longer one may find less error.",
    ]
    for name, of_family in content.items():
        lines += ["", f"## {name}", "", *_family(name, of_family)]
    return "\n".join([*lines, "", "Made by `python docs/published_gains.py RUN`."]) + "\n"


def _family(name: str, of_family: dict[str, Any]) -> list[str]:
    limits, worlds = of_family["conditions"], of_family["worlds"]
    about = f"{of_family['about'][:1].upper()}{of_family['about'][1:]}."
    if limits:
        (fast, _), (soft, stiff) = limits["period"], limits["tendon_stiffness"]
        about += f" Made for a tick of {1e3 * fast:g} ms and tendons of {soft / 1e3:g} to {stiff / 1e3:g} kN/m."
    heads = ("controller", "gains", "RMSE [deg], 95 %", "tunings [deg]", f"lost of {worlds} worlds", "to rely on")
    rows = sorted(of_family["controllers"].items(), key=lambda item: (not item[1]["reliable"], item[1]["rmse"]))
    if rows[0][1]["reliable"]:
        about += f" On {name} {rows[0][0]} errs least of those to rely on."
    return [
        about,
        "",
        f"| {' | '.join(heads)} |",
        "| --- " * len(heads) + "|",
        *(_row(controller, row) for controller, row in rows),
        "",
        f"`{of_family['command']}`, {of_family['run']},",
        f"hash `{of_family['result_sha256']}`.",
    ]


def _row(name: str, row: dict[str, Any]) -> str:
    gains = ", ".join(f"{gain} = {value:.4g}" for gain, value in row["gains"].items())
    mean, low, high = (_deg(row[key]) for key in ("rmse", "rmse_low", "rmse_high"))
    best, worst = map(_deg, row["tunings"])
    reliable = "yes" if row["reliable"] else "no"
    return f"| {name} | {gains} | {mean} [{low}, {high}] | {best} to {worst} | {row['lost']} | {reliable} |"


def _deg(value: float) -> str:
    return f"{math.degrees(value):.3g}"


def main() -> None:
    """Write what is shipped, and the page."""
    content = json.loads(SHIPPED.read_text(encoding="utf-8"))
    for path in sys.argv[1:]:
        content = with_run(content, Run(Path(path)))
    SHIPPED.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    (HERE / "gains.md").write_text(page(content), encoding="utf-8")


if __name__ == "__main__":
    main()
