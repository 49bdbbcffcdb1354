"""Wrists drawn at random, and what `recommend` says of each: does it hold on rigs that it has not seen?

Length, stiffness and the hand's mass are drawn; the recommended gains run on 20 rigs of another seed. A recommendation
is sound if it fails, swings or chatters on none of them. Its expected error holds if it contains their median error.
`python -m tests.commands.recommended_wrists --count 20` keeps what has ended, and goes on from there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import wristctl
from tests.drawn_rigs import options, tried
from wristctl.commands.recommend.answer import Recommended, spread
from wristctl.commands.recommend.command import FAMILY
from wristctl.comparison.world_ranking import world_scores
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.simulation.cases import measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.tuning.objective import YARDSTICK

SEED, RIGS = 20261126, 20
METRICS = ("rmse", "oscillation", "sustained")


def drawn(number: int) -> tuple[float, float, float]:
    """Length [m], stiffness [N m/rad] and mass of the hand [kg] of a wrist; the stiffness is drawn by its logarithm."""
    generator = np.random.default_rng([SEED, number])
    stiffness = math.exp(generator.uniform(math.log(0.2), math.log(3.0)))
    return float(generator.uniform(0.06, 0.14)), stiffness, float(generator.uniform(0.0, 0.5))


def study_of(number: int) -> Study:
    """The study that asks for a recommendation for the wrist."""
    names = "wrist.length", "wrist.stiffness", "wrist.hand_mass"
    return wristctl.load_study(None, *(f"{name}={value!r}" for name, value in zip(names, drawn(number), strict=True)))


def judged(number: int) -> dict[str, Any]:
    """What is said of a wrist, and on how many of the other rigs what is recommended is lost."""
    study = study_of(number)
    try:
        result = wristctl.recommend(study)
    except UserError as error:
        return {"refused": str(error), "exit_code": error.exit_code}
    if result.best is None or result.best_row is None:
        return {"refused": result.why_none, "exit_code": 3}
    return {"refused": "", "reach_deg": result.reach_deg, **_on_other_rigs(study, result)}


def _on_other_rigs(study: Study, result: Recommended) -> dict[str, Any]:
    best, row = result.best, result.best_row
    assert best is not None and row is not None
    family = study.recommend.family(result.reach_deg)
    cases = drawn_cases(family, FAMILY, "test", study.seed + 1, RIGS, study.wrist)
    own, open_loop = (
        measure(controller(name), np.array([list(controller(name).values(gains))]), cases, study.wrist, METRICS)
        for name, gains in ((best.controller, best.gains), (YARDSTICK, {}))
    )
    faults = {
        "fails": own.failed, "swings": own.limit_cycles | own.swings_in_motion(open_loop),
        "chatters": own.chatter > 0.0, "has not converged": own.unconverged,
    }  # fmt: skip
    on = {name: int(where.reshape(RIGS, -1).any(axis=1).sum()) for name, where in faults.items()}
    lost = np.logical_or.reduce(list(faults.values())).reshape(RIGS, -1).any(axis=1)
    expected = [math.degrees(value) for value in spread(result.ranking.rows[row].rmse)]
    share = float(result.ranking.standing.lost[row].times) / result.ranking.count
    return {
        "use": best.label, "lost": int(lost.sum()), "faults": on, "said_lost": share,
        "swing_deg": math.degrees(own.largest_swing(open_loop)),
        "expected_deg": expected, "median_deg": math.degrees(float(np.median(world_scores(own, RIGS)))),
    }  # fmt: skip


def main() -> None:
    """Judge the wrists that are asked for, a line each, and count."""
    counted: list[tuple[bool, bool]] = []
    for number, found in tried(options(__doc__, 20, "recommended-wrists").parse_args(), judged):
        length, stiffness, hand = drawn(number)
        wrist = f"{number:3}: {1e3 * length:.0f} mm, {stiffness:.2f} N m/rad, hand {hand:.2f} kg"
        if found["refused"]:
            print(f"{wrist}: {found['refused']}", flush=True)
            continue
        low, _, high = found["expected_deg"]
        why = "".join(f", {name} on {count}" for name, count in found["faults"].items() if count)
        counted.append((found["lost"] == 0, low <= found["median_deg"] <= high))
        print(
            f"{wrist}, to {found['reach_deg']:.0f} deg: {found['use']}, lost {found['lost']} of {RIGS}{why} "
            f"(said: {100.0 * found['said_lost']:.0f} %), {found['median_deg']:.2f} deg of {low:.2f} to {high:.2f}",
            flush=True,
        )
    sound, held = (sum(each) for each in zip(*counted, strict=True)) if counted else (0, 0)
    print(f"of {len(counted)} wrists {sound} on which nothing is lost, {held} with the median in the expected error")


if __name__ == "__main__":
    main()
