"""Are tuned gains ever worse than a controller's preset? `python docs/tuned.py` tunes all: docs/tuned.md.

On worlds of the tune split of a family, chosen on its validation split, and compared on its test split. As in a
ranking, what swings or fails in more cases is worse, and of two that do so alike the one whose RMSE is greater. Ends
with 1 where tuned gains are worse beyond chance, at 5 % over all rows together (Bonferroni).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from wristctl.comparison.bootstrap import LEVEL, GeometricMean, paired_ratio, penalised
from wristctl.comparison.world_ranking import world_scores
from wristctl.config.study import Study
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.seeds import stream
from wristctl.simulation.cases import measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.study_files.load import load_study
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import judges_of, search

HERE = Path(__file__).parent
EXPERIMENTS = HERE.parent / "experiments"
TEST_WORLDS = 240
CHANCE = 0.05
"""That any tuned gains which are no worse are called so: of each row its share (Bonferroni)."""
CONDITIONS = {"ideal": ("default", "exchanged", "printed"), "camera": ("hardware", "camera", "default")}
"""The presets that a family is within the conditions of, the one for the hardest first; by family."""


class Tuning(NamedTuple):
    """What tuning did for a controller on a family: RMSE [rad] and the preset's over it, over test worlds."""

    law: str
    preset: str
    chosen: str
    rmse: float
    ratio: GeometricMean
    swings: tuple[int, int]
    """Cases in which the tuned gains and the preset swing or fail."""
    worse: bool
    """Whether the tuned gains are the worse ones, beyond chance."""


def preset_of(law: Controller, family: str) -> str:
    """The preset that a controller is used with there; empty where it has none for such conditions."""
    return next((name for name in CONDITIONS[family] if name in law.presets), "")


def tuned(study: Study, law: Controller, judges: tuple[Judge, Judge | None], family: str, chance: float) -> Tuning:
    """Tune a controller, and compare on the test split; worse is what is so beyond this chance."""
    found = search(study, law, lambda name: stream(study.seed, name), judges)
    preset = preset_of(law, family)
    gains = np.array([[found.gains[name] for name in law.gains], gains_of(law, preset)])
    cases = drawn_cases(study.families[family], family, "test", study.seed, TEST_WORLDS, study.wrist)
    done = measure(law, gains, cases, study.wrist, ["rmse", "oscillation"])
    own, known = penalised(world_scores(done, TEST_WORLDS))
    bad = done.swings | done.failed
    ratio, surely = (paired_ratio(known, own, 1, level) for level in (LEVEL, 1.0 - chance))
    rmse = float(np.exp(np.log(own).mean()))
    swings = int(bad[0].sum()), int(bad[1].sum())
    worlds = np.any(bad.reshape(2, TEST_WORLDS, -1), axis=2)
    apart = swings[0] != swings[1] and chance_of(worlds[0], worlds[1]) < chance
    worse = swings[0] > swings[1] if apart else surely.high < 1.0
    return Tuning(law.name, preset, found.finalists[0].origin, rmse, ratio, swings, worse)


def chance_of(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """The sign test (McNemar 1947, exact) of two rows of the same worlds (W,), true where a row swings or fails."""
    alone = int((one & ~other).sum()), int((other & ~one).sum())
    return float(binomtest(alone[0], sum(alone)).pvalue) if sum(alone) else 1.0


def study_of(family: str) -> Study:
    """The study that tunes all controllers on a family, but for those without a preset for it."""
    study = load_study([EXPERIMENTS / "scenarios" / f"{family}.yaml", EXPERIMENTS / "rivals.yaml"])
    budget = study.compare.tuning
    assert budget is not None
    laws = tuple(name for name in budget.controllers if preset_of(controller(name), family))
    objective = budget.objective.model_copy(update={"margin": 0.0})
    asked = {
        "worlds": budget.worlds.model_copy(update={"family": family}), "controllers": laws, "objective": objective
    }  # fmt: skip
    return study.model_copy(update={"tune": budget.model_copy(update=asked)})


def lines_of(study: Study, family: str, chance: float) -> tuple[list[str], list[str]]:
    """The table of a family, and the controllers whose tuned gains are worse."""
    given = study.tune
    judges = judges_of(study)
    rows = [tuned(study, controller(name), judges, family, chance) for name in given.controllers]
    rows.sort(key=lambda each: each.rmse)
    table = [
        f"| {each.law} | {np.degrees(each.rmse):.3f} | {each.chosen} | {each.preset} | {each.ratio.value:.2f} "
        f"[{each.ratio.low:.2f}, {each.ratio.high:.2f}] | {each.swings[0]}, {each.swings[1]} |"
        for each in rows
    ]
    return [f"## {family}: {study.families[family].about}", "", *_HEAD, *table, ""], [
        f"{each.law} on {family}" for each in rows if each.worse
    ]


_HEAD = [
    "| controller | RMSE, tuned [deg] | gains from | preset | preset's over tuned | swings or fails: tuned, preset |",
    "| --- | --- | --- | --- | --- | --- |",
]


def main() -> None:
    """Tune, compare, write the page."""
    studies = {family: study_of(family) for family in CONDITIONS}
    chance = CHANCE / sum(len(each.tune.controllers) for each in studies.values())
    both = [lines_of(study, family, chance) for family, study in studies.items()]
    worse = [name for _, names in both for name in names]
    said = f"Worse: {', '.join(worse)}." if worse else "None is worse than its preset beyond chance."
    begin = [
        "# Tuned gains beside presets",
        "",
        said,
        "",
        "Each is tuned by the budget of experiments/rivals.yaml on drawn worlds of a family, without a",
        "[margin](tuning-margins.md); among the best candidates and its presets the gains are chosen on",
        f"worlds of a second split, and tested here on {TEST_WORLDS} worlds of a third: how many times less the RMSE",
        "is than the preset's (geometric mean, 95 % interval over worlds), and in how many cases either",
        "swings by more than 0.1 deg at rest or fails. As in every ranking, what swings or fails in more of",
        "the worlds is worse, whatever its RMSE. Worse is what is so beyond chance, at 5 % over all rows",
        "together (Bonferroni; a sign test for swings). A ratio of 1 is the preset itself. Made by `python",
        "docs/tuned.py`.",
        "",
    ]
    (HERE / "tuned.md").write_text("\n".join([*begin, *(line for lines, _ in both for line in lines)]).rstrip() + "\n")
    if worse:
        sys.exit(said)


if __name__ == "__main__":
    main()
