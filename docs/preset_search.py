"""Gains that come to rest behind motors, tendons and a camera: `python docs/preset_search.py CONTROLLER [--seed 1]`.

The cross-entropy method on the logarithms of the gains (Rubinstein, Eur. J. Oper. Res. 99 (1997) 89): the geometric
mean of the RMSE over a family of worlds, and ten times over where any of them swings by more than 0.06 deg. Prints the
gains with two digits; a preset is what then holds in docs/margins.py.
"""

from __future__ import annotations

import argparse
import itertools
import sys

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.kernel import RECORDED
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

WRIST, PERIOD, HORIZON, QUIET = WristParameters(), 5e-3, 3.0, np.deg2rad(0.06)
FAMILY = tuple(itertools.product((6.5e3, 20e3, 45e3), (0.0, 3.0)))
TARGETS = (5.0, -15.0, 30.0, 45.0, -45.0)
CANDIDATES, ELITE, GENERATIONS = 96, 12, 14


def cost(name: str, gains: Array, generation: int) -> Array:
    """Of each candidate (count, g): geometric mean of the RMSE [rad], tenfold where a world swings, inf if it fails."""
    loops = [
        Loop(
            control_period=PERIOD,
            actuator=Actuator(level="tendon", tendon_stiffness=stiffness, sheath=sheath),
            sensor=Sensor(level="camera"),
        )
        for stiffness, sheath in FAMILY
    ]
    motions = [motion(Reference(angle_deg=target), WRIST, HORIZON, PERIOD) for target in TARGETS]
    cases = list(itertools.product(range(len(loops)), range(len(motions))))
    lanes = [(row, *case) for row in range(len(gains)) for case in cases]
    done = rollout(
        controller(name), np.repeat(gains, len(cases), axis=0), motions, np.array([at for _, _, at in lanes]),
        [loops[world] for _, world, _ in lanes], WRIST, streams=[(generation, at) for _, _, at in lanes],
        record=True,
    )  # fmt: skip
    assert done.samples is not None
    swing = np.ptp(done.samples[:, -round(1.0 / PERIOD) :, RECORDED.index("theta")], axis=1) / 2.0
    rmse = np.where(done.failed, np.inf, done.metrics["rmse"]).reshape(len(gains), -1)
    bad = (np.where(np.isfinite(swing), swing, np.inf).reshape(len(gains), -1) > QUIET).any(axis=1)
    found: Array = np.exp(np.log(rmse).mean(axis=1)) * np.where(bad, 10.0, 1.0)
    return found


def search(name: str, seed: int) -> tuple[dict[str, float], float]:
    """The best gains found, and their cost [rad]."""
    law, rng = controller(name), np.random.default_rng(seed)
    start = next(iter(law.presets.values()))
    middle, width = np.log([start[each] for each in law.gains]) - 0.7, np.full(len(law.gains), 1.5)
    best: tuple[float, Array] = (np.inf, np.exp(middle))
    for generation in range(GENERATIONS):
        tried = middle + width * rng.standard_normal((CANDIDATES, len(middle)))
        tried[0] = np.log(best[1])
        value = cost(name, np.exp(tried), generation)
        order = np.argsort(value)[:ELITE]
        middle, width = tried[order].mean(axis=0), tried[order].std(axis=0) + 0.02
        best = float(value[order[0]]), np.exp(tried[order[0]])
    return {each: float(f"{gain:.2g}") for each, gain in zip(law.gains, best[1], strict=True)}, best[0]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("law")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    gains, value = search(given.law, given.seed)
    sys.stdout.write(f"{given.law} {gains} {np.degrees(value):.3g} deg\n")
