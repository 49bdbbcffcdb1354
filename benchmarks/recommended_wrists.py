"""Is what `recommend` says of a wrist true of it? Wrists are drawn, and what is recommended is tried on fresh rigs.

`python benchmarks/recommended_wrists.py COUNT [KEY=VALUE ...]`: lengths of 0.06 to 0.14 m, stiffness of 0.2 to 3
N m/rad, a hand of 0 to 0.5 kg. Settings such as recommend.draws=8 make the searches shorter.
"""

from __future__ import annotations

import math
import sys
import time
from typing import NamedTuple

import numpy as np

import wristctl
from wristctl.commands.recommend.command import FAMILY, reach_deg
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.simulation.cases import measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.tuning.objective import YARDSTICK

# Rigs of each wrist that nothing has been tuned or tested on, and the seed that draws them.
RIGS, FRESH = 20, 4711
_METRICS = ("rmse", "oscillation", "sustained")


class Tried(NamedTuple):
    """What was recommended for a wrist, and how it did on fresh rigs; angles in degrees."""

    label: str
    expected: tuple[float, float]
    median: float
    failed: int
    swung: int

    @property
    def holds(self) -> bool:
        """Whether it neither fails, swings nor chatters on any rig."""
        return self.failed == self.swung == 0

    @property
    def true(self) -> bool:
        """Whether the expected range holds the median."""
        return self.expected[0] <= self.median <= self.expected[1]


def drawn(count: int) -> list[tuple[str, ...]]:
    """Settings of wrists; stiffness is drawn by its logarithm."""
    draw = np.random.default_rng(39)
    rows = zip(
        draw.uniform(0.06, 0.14, count),
        np.exp(draw.uniform(math.log(0.2), math.log(3.0), count)),
        draw.uniform(0.0, 0.5, count),
        strict=True,
    )
    return [
        (f"wrist.length={length:.3g}", f"wrist.stiffness={stiffness:.3g}", f"wrist.hand_mass={hand:.3g}")
        for length, stiffness, hand in rows
    ]


def tried(study: Study) -> Tried | None:
    """Recommend, and try it on fresh rigs; None where nothing is recommended."""
    found = wristctl.recommend(study)
    if found.best is None:
        return None
    cases = drawn_cases(study.recommend.family(reach_deg(study)), FAMILY, "test", FRESH, RIGS, study.wrist)
    law = controller(found.best.controller)
    own = measure(law, np.array([law.values(found.best.gains)]), cases, study.wrist, _METRICS)
    open_loop = measure(controller(YARDSTICK), np.zeros((1, 0)), cases, study.wrist, _METRICS)
    of_rigs = np.exp(np.log(own.metrics["rmse"]).reshape(RIGS, -1).mean(axis=1))
    swung, failed = (
        int(flags.reshape(RIGS, -1).any(axis=1).sum()) for flags in (own.swings_beside(open_loop), own.failed)
    )
    low, high = (math.degrees(found.metrics[name]) for name in ("rmse_low", "rmse_high"))
    return Tried(found.best.label, (low, high), math.degrees(float(np.median(of_rigs))), failed, swung)


def main() -> None:
    """A line for each wrist, then how many held and were told truly."""
    count, *overrides = sys.argv[1:]
    sound = true = 0
    for settings in drawn(int(count)):
        begin, wrist = time.process_time(), " ".join(each.removeprefix("wrist.") for each in settings)
        study = wristctl.load_study(None, *settings, *overrides)
        try:
            done = tried(study)
        except UserError as error:
            print(f"{wrist}: {error}")
            continue
        spent = f"{time.process_time() - begin:.0f} s of processor"
        if done is None:
            print(f"{wrist}: nothing is recommended ({spent})", flush=True)
            continue
        sound, true = sound + done.holds, true + done.true
        low, high = done.expected
        print(
            f"{wrist}: {done.label}, fails on {done.failed} and swings or chatters on {done.swung} of {RIGS} rigs; "
            f"{done.median:.3g} deg, told {low:.3g} to {high:.3g} ({spent})",
            flush=True,
        )
    print(f"of {count} wrists {sound} hold on all rigs; in {true} the range that is told holds the median")


if __name__ == "__main__":
    main()
