"""Environment steps a second of `wristctl.gym`, one tick of 1 ms each: `python benchmarks/gym_steps.py`.

Random actions, 1,024 environments, compiled before; the resets are timed by themselves, and with them. Prints PASS or
FAIL for what is claimed: at least 1,000,000 steps a second at n = 1 with ideal sensors and actuators.
"""

from __future__ import annotations

import statistics
import sys
import time

import numpy as np

from wristctl.gym import WristVectorEnv
from wristctl.processes import cores
from wristctl.study_files.load import load_study

COUNT, EPISODES, WANTED = 1024, 3, 1e6
RIG = ("simulate.loop.sensor.level=camera", "simulate.loop.actuator.level=tendon")
LOOPS: dict[str, tuple[str, ...]] = {
    "ideal, n = 1": ("simulate.loop.plant_segments=1",),
    "ideal, n = 4": (),
    "camera and tendons, n = 1": ("simulate.loop.plant_segments=1", *RIG),
    "camera and tendons, n = 4": RIG,
}


def measured(*overrides: str) -> tuple[float, float, float]:
    """Median steps a second of an episode, the same with its reset, and the median reset [s]."""
    env = WristVectorEnv(COUNT, load_study([], overrides))
    env.action_space.seed(0)
    env.reset(seed=0)
    actions = env.action_space.sample()
    env.step(actions)
    steps: list[float] = []
    resets: list[float] = []
    for _ in range(EPISODES):
        began = time.perf_counter()
        env.reset()
        resets.append(time.perf_counter() - began)
        began, ended, count = time.perf_counter(), False, 0
        while not ended:
            *_, truncated, _ = env.step(actions)
            ended, count = bool(truncated[0]), count + COUNT
        steps.append((time.perf_counter() - began) / count)
    step, reset = statistics.median(steps), statistics.median(resets)
    return 1.0 / step, count / (count * step + reset), reset


def main() -> int:
    """Print a line for each loop, and what is claimed."""
    print(f"{COUNT} environments, {cores()} cores, numpy {np.__version__}")
    print(f"{'':28} steps/s  with resets  reset [s]")
    rates = {}
    for name, overrides in LOOPS.items():
        rates[name], whole, reset = measured(*overrides)
        print(f"{name:28} {rates[name]:7.3g}  {whole:11.3g}  {reset:9.3f}", flush=True)
    rate = rates["ideal, n = 1"]
    print(f"at least {WANTED:.0e} steps/s, ideal, n = 1: {rate:.3g} {'PASS' if rate >= WANTED else 'FAIL'}")
    return int(rate < WANTED)


if __name__ == "__main__":
    sys.exit(main())
