"""The speed of two checkouts side by side: `python benchmarks/paired.py BASE` compares BASE with this one.

One process of each stays up. They take turns, one closed loop after the other, so that both meet the machine in the
same mood; what counts is processor time. A ratio above 1 means that this checkout is faster. The interval of its median
is that of order statistics. Exit code 1 where the lower end of an interval is below 0.97.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import quantile_test

HERE = Path(__file__).resolve().parents[1]
LEAST = 0.97
"""Of the lower end of the ratio's 95 % interval."""

CASES = {
    "ideal": {},
    "lagged": {"actuator": {"level": "lagged"}},
    "tendon": {"actuator": {"level": "tendon"}},
    "camera": {"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}},
}
"""Loops by name; each with one and with four segments."""
LANES = {1: 1024, 4: 256}
"""Rollouts side by side, by segments."""

WORKER = """
import json, sys, time
import numpy as np
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

law, wrist = controller("smc-tracking"), WristParameters()
for line in sys.stdin:
    case = json.loads(line)
    loop = Loop.model_validate({"plant_segments": case["segments"], **case["loop"]})
    followed = motion(Reference(duration=0.5), wrist, case["horizon"], loop.control_period)
    gains = np.tile(gains_of(law, "camera"), (case["lanes"], 1))
    began = time.process_time()
    done = rollout(law, gains, [followed], np.zeros(len(gains), np.int64), loop, wrist, threads=1)
    print(json.dumps([time.process_time() - began, float(done.metrics["rmse"][0])]), flush=True)
"""


class Worker:
    """A checkout's process."""

    def __init__(self, checkout: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(checkout)}
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER], env=environment, cwd=checkout, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def measure(self, case: dict[str, Any]) -> tuple[float, float]:
        """Processor time of one batch [s], and the RMSE of its first rollout [rad]."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(case) + "\n")
        self._process.stdin.flush()
        seconds, rmse = json.loads(self._process.stdout.readline())
        return seconds, rmse


def interval(ratios: list[float]) -> tuple[float, float, float]:
    """Median and its 95 % interval."""
    found: Any = quantile_test(ratios, q=0, p=0.5).confidence_interval(0.95)
    return float(np.median(ratios)), float(found.low), float(found.high)


def main() -> None:
    """Measure, print a table, and say by the exit code whether this checkout keeps up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=Path, metavar="BASE", help="the other checkout")
    parser.add_argument("--rounds", type=int, default=21, help="turns of each loop, at least 15")
    parser.add_argument("--horizon", type=float, default=5.0, help="of a rollout [s]")
    given = parser.parse_args()
    if given.rounds < 15:
        parser.error("fewer than 15 rounds tell too little")
    workers = [Worker(given.base.resolve()), Worker(HERE)]
    print(f"{'loop':12} {'segments':>8}  {'base':>9} {'here':>9}  {'speed':>6}  95 % interval  same RMSE")
    slow = []
    for name, loop in CASES.items():
        for segments, lanes in LANES.items():
            case = {"loop": loop, "segments": segments, "lanes": lanes, "horizon": given.horizon}
            first = [worker.measure(case) for worker in workers]  # compiles
            pairs = []
            for turn in range(given.rounds):
                order = (0, 1) if turn % 2 == 0 else (1, 0)
                seconds = {which: workers[which].measure(case)[0] for which in order}
                pairs.append((seconds[0], seconds[1]))
            base, here = np.median(pairs, axis=0)
            ratio, low, high = interval([before / now for before, now in pairs])
            same = "yes" if first[0][1] == first[1][1] else "no"
            line = f"{name:12} {segments:8}  {1e3 * base:6.0f} ms {1e3 * here:6.0f} ms  {ratio:6.3f}"
            print(f"{line}  {low:.3f} - {high:.3f}  {same}", flush=True)
            if low < LEAST:
                slow.append(f"{name}, {segments} segments")
    if slow:
        sys.exit(f"slower than {LEAST} of the base: {'; '.join(slow)}")


if __name__ == "__main__":
    main()
