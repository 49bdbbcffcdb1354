"""Wrists drawn at random: does the command that `recommend` prints do on the emulated rig what `recommend` says of it?

`python -m tests.commands.recommended_rigs` draws length, stiffness and the hand's mass of wrists until 20 have been
tried, leaves out those that no rig can home, runs what is printed, and then the same with the gains of every other
finalist that was sound in its rehearsal. What has ended is kept; a later call goes on there. `--planes 2` has all bend
in two planes, `--page` writes the page of what was tried. Writes docs/hardware/recommended-rigs.md.
"""

from __future__ import annotations

import json
import math
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import wristctl
from tests.commands.conftest import session
from tests.drawn_rigs import options, tried
from wristctl.commands.inputs import Inputs
from wristctl.commands.recommend.answer import RECOMMENDED, Recommended
from wristctl.commands.recommend.command import plan, recommend
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import start_run

SEED = 20261126
PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "recommended-rigs.md"
RESTS, CALM = 0.2, 0.95
"""A wrist rests where it swings by no more than this peak to peak [deg]; so many of all are to."""
WRISTS, WIDE, NEAR = 20, 3.0, 1.25
"""Wrists to try; largest ratio of a printed range's ends, and of the error to that of the best rehearsed finalist."""


class Drawn(NamedTuple):
    """A wrist."""

    length: float
    """[m]"""
    stiffness: float
    """[N m/rad]"""
    hand_mass: float
    """[kg]"""


def drawn(number: int) -> Drawn:
    """The wrist of this number; its stiffness is drawn by its logarithm."""
    generator = np.random.default_rng([SEED, number])
    stiffness = math.exp(generator.uniform(math.log(0.2), math.log(3.0)))
    return Drawn(float(generator.uniform(0.06, 0.14)), stiffness, float(generator.uniform(0.0, 0.5)))


def study_of(number: int, planes: int) -> Study:
    """The study that asks for a recommendation for the wrist."""
    wrist = (f"wrist.{name}={value!r}" for name, value in drawn(number)._asdict().items())
    return wristctl.load_study(None, *wrist, f"recommend.loop.planes={planes}")


def judged(number: int, planes: int) -> dict[str, Any]:
    """What `recommend` says of a wrist, and how the commands for its finalists end; angles in degrees."""
    study = study_of(number, planes)
    try:
        plan(study, Inputs({}))
    except UserError as error:
        return {"not_tried": str(error.what)}
    with tempfile.TemporaryDirectory(prefix="wristctl-recommended-") as folder:
        begun = time.process_time()
        with start_run("recommend", study, "", Path(folder)) as live:
            result = recommend(session(study, live))
        took = time.process_time() - begun
        if result.best_row is None or result.on_the_trial is None:
            return {"refused": result.why_none, "processor_s": took}
        sound = [row for row, run in result.rehearsals.items() if not run.fault]
        others = [row for row in sound if row != result.best_row]
        printed = [math.degrees(end) for end in (result.on_the_trial[0], result.on_the_trial[2])]
        best, *rest = [
            _on_the_rig(_command(result, row), Path(folder) / str(row)) for row in [result.best_row, *others]
        ]
    name = result.candidates[result.best_row].label
    return {"use": name, "reach_deg": result.reach_deg, "printed": printed, **best, "others": rest, "processor_s": took}


def _command(result: Recommended, row: int) -> list[str]:
    """The printed command, for another row with the file of its gains."""
    words = shlex.split(result.next_command)
    if row != result.best_row:
        words[-1] = words[-1].replace(RECOMMENDED, result.candidates[row].file)
    return words


def _on_the_rig(command: Sequence[str], out: Path) -> dict[str, Any]:
    """How a command ends, and the true error and swing of its trials [deg]; the error of those without a push."""
    program, *words = command
    done = subprocess.run(
        [sys.executable, "-m", program, *words, "--quiet", "--out", str(out)], capture_output=True, text=True
    )
    if done.returncode:
        return {"stopped": done.stderr.strip().splitlines()[-1]}
    trials = pd.read_csv(Path(done.stdout.split()[-1]) / "data" / "trials.csv")
    errors = trials.loc[trials["push"] == 0.0, "true_rmse"].to_numpy(float)
    swing = 2.0 * float(np.nan_to_num(trials["true_oscillation"].to_numpy(float)).max())
    return {"rmse": math.degrees(math.sqrt(float(np.mean(errors**2)))), "swing": math.degrees(swing)}


class Verdict(NamedTuple):
    """Whether a wrist's recommendation keeps what it promises."""

    rests: bool
    within: bool
    """The error is in the printed range."""
    narrow: bool
    near: bool
    """The error is at most a quarter more than that of any finalist."""


def verdict(found: dict[str, Any]) -> Verdict:
    """Of a wrist for which something was recommended; a trial that is stopped keeps nothing but the range's width."""
    low, high = found["printed"]
    narrow = high <= WIDE * low
    if "stopped" in found:
        return Verdict(False, False, narrow, False)
    least = min([found["rmse"], *(other["rmse"] for other in found["others"] if "rmse" in other)])
    return Verdict(found["swing"] <= RESTS, low <= found["rmse"] <= high, narrow, found["rmse"] <= NEAR * least)


_CHECKS = {
    "rests": f"swing at rest by at most {RESTS:g} deg peak to peak",
    "within": "err by an RMSE within the printed range",
    "narrow": f"have a range whose upper end is at most {WIDE:g} times the lower",
    "near": f"err at most {NEAR:g} times as much as the best finalist that was sound in its rehearsal",
}


def page(rows: Sequence[tuple[int, dict[str, Any]]], left_out: int, planes: int) -> str:
    """The table: a row for each wrist that was tried."""
    verdicts = [verdict(found) for _, found in rows if "refused" not in found]
    counts = [f"- {sum(getattr(each, name) for each in verdicts)} {words}" for name, words in _CHECKS.items()]
    lines = [
        "# Does what `recommend` prints hold on the emulated rig?", "",
        f"Wrists in {'one plane' if planes == 1 else 'two planes'}, drawn with lengths of 60 to 140 mm,",
        "stiffness of 0.2 to 3 N m/rad and a hand of 0 to 0.5 kg. For each, the command that `recommend` prints was",
        "run on the emulated rig: a board with its firmware, motors, elastic tendons, a camera, and springs 30 %",
        "weaker than believed. Errors and swings are of the emulated wrist's own angle; a swing is the largest of all",
        f"trials, pushed ones too. {left_out} more were drawn that no rig can home: they buckle under their hand.",
        f"`make recommended-rigs` has tried {len(rows)} of {WRISTS}, and goes on there.", "",
        f"Of {len(verdicts)} with a recommendation", "", *counts, "",
        "| wrist: length, stiffness, hand | use | RMSE [deg] | printed range [deg] | best finalist [deg] | "
        "swing [deg] | kept |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for number, found in rows:
        wrist = drawn(number)
        name = f"{1e3 * wrist.length:.0f} mm, {wrist.stiffness:.2g} N m/rad, {wrist.hand_mass:.2g} kg"
        if "refused" in found:
            lines.append(f"| {name} | none: {found['refused']} | | | | | |")
            continue
        low, high = found["printed"]
        every = [found, *found["others"]]
        least = min((each["rmse"] for each in every if "rmse" in each), default=math.nan)
        kept = [word for word, holds in verdict(found)._asdict().items() if not holds]
        failed = f"**not {', not '.join(kept)}**" if kept else "yes"
        shown = (
            f"{found[name]:.2g}" if name in found else f"stopped: {found['stopped']}" for name in ("rmse", "swing")
        )
        rmse, swing = shown
        lines.append(
            f"| {name} | {found['use']} | {rmse} | {low:.2g} to {high:.2g} | {least:.2g} | {swing} | {failed} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Try wrists until there are enough, a line each, and write the page; 1 where they do not keep what is promised."""
    parser = options(__doc__, 400, "recommended-rigs")
    parser.add_argument("--wrists", type=int, default=WRISTS, help="so many are to be tried")
    parser.add_argument("--planes", type=int, default=1, choices=(1, 2))
    parser.add_argument("--page", action="store_true", help="only write the page, of what was tried")
    asked, rows, left_out = parser.parse_args(), list[tuple[int, dict[str, Any]]](), 0
    ended: Iterable[tuple[int, dict[str, Any]]] = tried(asked, partial(judged, planes=asked.planes), f"{asked.planes}")
    if asked.page:
        files = (asked.kept / f"{asked.planes}").glob("*.json")
        ended = sorted(((int(file.stem), json.loads(file.read_text())) for file in files), key=itemgetter(0))
    for number, found in ended:
        if "not_tried" in found:
            left_out += 1
            continue
        rows.append((number, found))
        print(number, found, flush=True)
        if len(rows) == asked.wrists:
            break
    text = page(rows, left_out, asked.planes)
    print(text)
    PAGE.write_text(text)
    kept = [verdict(found) if "refused" not in found else Verdict(False, False, False, False) for _, found in rows]
    calm = sum(each.rests for each in kept) >= CALM * len(kept)
    return int(not (calm and all(each.within and each.narrow and each.near for each in kept)))


if __name__ == "__main__":
    sys.exit(main())
