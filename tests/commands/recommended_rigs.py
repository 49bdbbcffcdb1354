"""Wrists drawn at random: does the command that `recommend` prints do on the emulated rig what `recommend` says of it?

`python -m tests.commands.recommended_rigs` draws 20 wrists, half with three tendons and half with four, of each half
hanging and half upright, and runs what is printed for each, with springs weakened to 0.7 and as they are believed, and
then the same with the gains of every other finalist that was sound in its rehearsal. What has ended is kept; a later
call goes on there. `--page` writes the page of what was tried. Writes docs/hardware/recommended-rigs.md.
"""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import wristctl
from tests.commands.conftest import session
from tests.drawn_rigs import COMMITTED, ended, options, tried
from wristctl.commands.inputs import Inputs
from wristctl.commands.recommend.answer import RECOMMENDED, Recommended
from wristctl.commands.recommend.command import plan, recommend
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import start_run

SEED = 20261130
PAGE = Path(__file__).parents[2] / "docs" / "hardware" / "recommended-rigs.md"
RESTS = 0.2
"""A wrist rests where it swings by no more than this peak to peak [deg]."""
WRISTS, KEPT, WIDE, NEAR = 20, 0.95, 3.0, 1.25
"""Wrists to try; share of them that is to keep what is said; largest ratio of a printed range's ends, and of the error
to that of the best rehearsed finalist."""
SPRINGS = 0.7, 1.0
"""Stiffness of the emulated wrist's springs over what is believed."""
_GRAVITY = 9.81


class Drawn(NamedTuple):
    """A wrist."""

    tendons: str
    hanging: bool
    length: float
    """[m]"""
    stiffness: float
    """[N m/rad]"""
    hand_mass: float
    """[kg]"""

    @property
    def study(self) -> Study:
        """The study that asks for a recommendation for the wrist."""
        own = self._asdict()
        own["gravity"] = [_GRAVITY if own.pop("hanging") else -_GRAVITY, 0.0]
        return wristctl.load_study(None, *(f"wrist.{key}={value}" for key, value in own.items()))

    @property
    def buckles(self) -> bool:
        """Whether it is upright and falls over with springs of 0.7, a fifth in hand: K < g (m (L/3 + h) + m_w L/6)."""
        wrist = self.study.wrist
        tips = self.hand_mass * (self.length / 3.0 + wrist.hand_offset) + wrist.mass * self.length / 6.0
        return not self.hanging and SPRINGS[0] * self.stiffness < 1.2 * _GRAVITY * tips


def drawn(number: int) -> Drawn:
    """The wrist of this number: three tendons and four by turns, two hanging and two upright by turns."""
    generator = np.random.default_rng([SEED, number])
    lows, highs = zip((0.06, 0.12), (0.3, 1.5), (0.1, 0.5), strict=True)
    return Drawn("four" if number % 2 else "three", number % 4 < 2, *map(float, generator.uniform(lows, highs)))


def tried_out(number: int) -> dict[str, Any]:
    """What `recommend` says of a wrist, and how the commands for its finalists end; angles in degrees."""
    study = drawn(number).study
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
        runs = [
            {f"{springs:g}": _on_the_rig(_command(result, row, springs), Path(folder)) for springs in SPRINGS}
            for row in [result.best_row, *others]
        ]
    name = result.candidates[result.best_row].label
    found = {"use": name, "reach_deg": result.reach_deg, "printed": printed, "processor_s": took}
    return found | {"rigs": runs[0], "others": runs[1:]}


def _command(result: Recommended, row: int, springs: float) -> list[str]:
    """The printed command for springs of this share, for another row with the file of its gains."""
    words = shlex.split(result.next_command)
    if row != result.best_row:
        words[-1] = words[-1].replace(RECOMMENDED, result.candidates[row].file)
    return [*words, "--set", f"hw-run.bench.plant.stiffness_scale={springs:g}"]


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
    """Whether a wrist's recommendation keeps what it promises, with either springs."""

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
    if any("stopped" in own for own in found["rigs"].values()):
        return Verdict(False, False, narrow, False)
    rests = within = near = True
    for springs, own in found["rigs"].items():
        every = [own, *(other[springs] for other in found["others"])]
        least = min(each["rmse"] for each in every if "rmse" in each)
        rests &= own["swing"] <= RESTS
        within &= low <= own["rmse"] <= high
        near &= own["rmse"] <= NEAR * least
    return Verdict(rests, within, narrow, near)


_CHECKS = {
    "rests": f"swing at rest by at most {RESTS:g} deg peak to peak",
    "within": "err by an RMSE within the printed range",
    "narrow": f"have a range whose upper end is at most {WIDE:g} times the lower",
    "near": f"err at most {NEAR:g} times as much as the best finalist that was sound in its rehearsal",
}


def right(number: int, found: dict[str, Any]) -> bool:
    """Whether a wrist that falls over is refused before a motor turns, and no other."""
    return "not_tried" in found if drawn(number).buckles else "rigs" in found


def page(rows: Sequence[tuple[int, dict[str, Any]]]) -> str:
    """The table: a row for each wrist that was tried."""
    verdicts = [verdict(found) for _, found in rows if "rigs" in found]
    counts = [f"- {sum(getattr(each, name) for each in verdicts)} {words}" for name, words in _CHECKS.items()]
    met = sum(right(number, found) for number, found in rows)
    falling = sum(drawn(number).buckles for number, _ in rows)
    lines = [
        "# Does what `recommend` prints hold on the emulated rig?", "",
        "Wrists drawn with lengths of 60 to 120 mm, stiffness of 0.3 to 1.5 N m/rad and a hand of 0.1 to 0.5 kg: half",
        "with three tendons, so in two planes, half with four; half of each hanging, half upright. For each, the",
        "command that `recommend` prints was run on the emulated rig: a board with its firmware, motors, elastic",
        "tendons, a camera for each plane, and springs weakened to 0.7 of what is believed, then as believed. Errors",
        "and swings are of the emulated wrist's own angle; a swing is the largest of all trials, pushed ones too.",
        f"`make recommended-rigs` has tried {len(rows)} of {WRISTS}, and goes on there.", "",
        f"{falling} of {len(rows)} fall over: upright, with springs of 0.7 too soft for the hand, a fifth in hand.",
        f"Such a wrist is to be refused before a motor turns, and no other: {met} of {len(rows)} are treated so.", "",
        f"Of {len(verdicts)} with a recommendation", "", *counts, "", *_outside([found for _, found in rows]), "",
        "| wrist: tendons, length, stiffness, hand | use | RMSE [deg], springs x0.7, x1 | printed range [deg] | "
        "best finalist [deg] | swing [deg] | kept |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for number, found in rows:
        wrist = drawn(number)
        name = (
            f"{wrist.tendons}, {1e3 * wrist.length:.0f} mm, {wrist.stiffness:.2g} N m/rad, {wrist.hand_mass:.2g} kg, "
            f"{'hanging' if wrist.hanging else 'upright'}"
        )
        if "rigs" not in found:
            why = found.get("not_tried", found.get("refused"))
            lines.append(f"| {name} | none: {why} | | | | | {'yes' if right(number, found) else '**no**'} |")
            continue
        low, high = found["printed"]
        every = [found["rigs"], *found["others"]]
        least = [min(run[key].get("rmse", math.inf) for run in every) for key in found["rigs"]]
        kept = [word for word, holds in verdict(found)._asdict().items() if not holds]
        kept += ["refused"] * (not right(number, found))
        failed = f"**not {', not '.join(kept)}**" if kept else "yes"
        runs = found["rigs"].values()
        rmse, swing = (
            ", ".join(f"{own[what]:.2g}" if what in own else f"stopped: {own['stopped']}" for own in runs)
            for what in ("rmse", "swing")
        )
        best = ", ".join(f"{each:.2g}" for each in least)
        lines.append(f"| {name} | {found['use']} | {rmse} | {low:.2g} to {high:.2g} | {best} | {swing} | {failed} |")
    return "\n".join(lines) + "\n"


def _outside(every: Sequence[dict[str, Any]]) -> list[str]:
    """On which side of the printed range errors are that it does not hold."""
    runs = [(run, *found["printed"]) for found in every for run in found.get("rigs", {}).values() if "rmse" in run]
    below, above = sum(run["rmse"] < low for run, low, _ in runs), sum(run["rmse"] > high for run, _, high in runs)
    return [
        f"Of the {len(runs)} errors {below} are below the printed range, {above} above. Of a simulated rig all facts",
        "are drawn, its hand never weighs less than is believed, and something pushes it. The emulated rig has every",
        "fact but its springs as believed, and nothing pushes: it is among the kindest that the range is of.",
    ]


def main() -> int:
    """Try wrists, a line each, and write the page; 1 where they do not keep what is promised."""
    parser = options(__doc__, WRISTS, "recommended-rigs", COMMITTED)
    parser.add_argument("--page", action="store_true", help="only write the page, of what was tried")
    asked = parser.parse_args()
    for number, found in () if asked.page else tried(asked, tried_out):
        print(number, found, flush=True)
    rows = [*ended(asked).items()]
    text = page(rows)
    print(text)
    PAGE.write_text(text)
    met = [right(number, found) and ("rigs" not in found or all(verdict(found))) for number, found in rows]
    return int(sum(met) < KEPT * len(rows))


if __name__ == "__main__":
    sys.exit(main())
