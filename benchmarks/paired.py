"""The speed of two checkouts side by side: `python benchmarks/paired.py BASE` compares BASE with this one.

Two processes of each loop, one of each checkout, take turns, so that both meet the machine in the same mood, and are
started anew a few times: where a process has its memory makes some per cent. What counts is processor time, of each
process the least of its turns. A ratio above 1 means that this checkout is faster. The interval of its median over the
pairs of processes is that of order statistics. Exit code 1 where the lower end of an interval is below 0.97 in blocks,
0.95 in two planes and 0.93 of a rollout alone, or where friction, backlash and creep cost more than a quarter of a
tendon loop's time with four segments (with one the step itself costs little).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

import numpy as np
from scipy.stats import quantile_test

HERE = Path(__file__).resolve().parents[1]
LEAST = {"blocks": 0.97, "two planes": 0.95, "one lane": 0.93}
"""Of the lower end of the ratio's 95 % interval."""

MOST_COST = 1.25
"""Processor time with all that real tendons have, over that with none of it."""

_FREE = {"level": "tendon", "friction": 0.0}
CASES: dict[str, dict[str, Any]] = {
    "ideal": {},
    "lagged": {"actuator": {"level": "lagged"}},
    "tendon": {"actuator": _FREE},
    "camera": {"actuator": _FREE, "sensor": {"level": "camera"}},
}
"""Loops by name; each with one and with four segments."""
_REAL = {"creep": 0.1, "actuator": {"friction": 0.1, "sheath": 1.0, "backlash": 1e-4, "creep": 0.05}}
"""What a loop's plant has beyond ideal tendons and springs."""
LANES = {1: 1024, 4: 256}
"""Rollouts side by side, by segments."""
ALONE = 12
"""Times that a rollout alone is run, one after the other."""
IN_SPACE = {"three": 64, "four": 64}
"""Rollouts side by side in two planes, by layout of tendons."""

WORKER = """
import json, sys, time
import numpy as np
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.worlds import World
try:
    from wristctl.simulation.spatial_references import bend_path
    from wristctl.simulation.motion import Motion
except ImportError:  # a checkout in which two planes have a loop of their own
    from wristctl.simulation.two_planes import bend_path, rollout_bends

def in_one_plane(case, loop):
    law, wrist = controller("smc-tracking"), WristParameters()
    followed = motion(Reference(duration=0.5), wrist, case["horizon"], loop.control_period)
    gains = np.tile(gains_of(law, "camera"), (case["lanes"], 1))
    began = time.process_time()
    for _ in range(case.get("times", 1)):
        done = rollout(law, gains, [followed], np.zeros(len(gains), np.int64), loop, wrist, threads=1, converge=False)
    return time.process_time() - began, float(done.metrics["rmse"][0])

def in_two_planes(case, loop):
    law, wrist = controller("pid-ff"), WristParameters(tendons=case["tendons"])
    path = bend_path("circumduction", 20.0, 1.0, case["horizon"])
    path = np.ascontiguousarray(path[:, :, :: max(1, round(loop.control_period / 1e-3))])
    gains, lanes = np.tile(gains_of(law, "default"), (case["lanes"], 1)), case["lanes"]
    began = time.process_time()
    if "Motion" in globals():
        followed, which = Motion.of_bends(path, loop.control_period, wrist.length), np.zeros(lanes, np.int64)
        done = rollout(law, gains, [followed], which, loop, wrist, threads=1, converge=False)
    else:
        done = rollout_bends(law, gains, path, [World(loop, wrist)] * lanes, threads=1)
    return time.process_time() - began, float(done.metrics["rmse"][0])

for line in sys.stdin:
    case = json.loads(line)
    loop = Loop.model_validate({"plant_segments": case["segments"], **case["loop"]})
    print(json.dumps((in_two_planes if "tendons" in case else in_one_plane)(case, loop)), flush=True)
"""


TURNS = 4
"""Of each pair of processes."""


class Worker:
    """A checkout's process, which ends with the block."""

    def __init__(self, checkout: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(checkout)}
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER], env=environment, cwd=checkout, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

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
    parser.add_argument("--pairs", type=int, default=9, help="pairs of processes of each loop, at least 9")
    parser.add_argument("--horizon", type=float, default=5.0, help="of a rollout [s]")
    given = parser.parse_args()
    if given.pairs < 9:
        parser.error("fewer than 9 pairs tell too little")
    checkouts = [given.base.resolve(), HERE]
    print(f"{'loop':12} {'segments':>8}  {'base':>9} {'here':>9}  {'speed':>6}  95 % interval  same RMSE")
    slow = []
    for name, loop in CASES.items():
        for segments, lanes in LANES.items():
            case = {"loop": loop, "segments": segments, "lanes": lanes, "horizon": given.horizon}
            low, _ = in_turns(f"{name:12} {segments:8}", [(checkout, case) for checkout in checkouts], given.pairs)
            slow += too_slow(f"{name}, {segments} segments", "blocks", low)
    kinds: list[tuple[str, dict[str, Any]]] = [
        *(("one lane", {"segments": segments, "lanes": 1, "times": ALONE}) for segments in LANES),
        *(("two planes", {"segments": 4, "lanes": lanes, "tendons": name}) for name, lanes in IN_SPACE.items()),
    ]
    for kind, more in kinds:
        tendons = f", {more['tendons']} tendons" if "tendons" in more else ""
        print(f"\n{kind}{tendons}")
        for name, loop in CASES.items():
            case = {"loop": loop, "horizon": given.horizon, **more}
            low, _ = in_turns(
                f"{name:12} {more['segments']:8}", [(checkout, case) for checkout in checkouts], given.pairs
            )
            slow += too_slow(f"{name}, {kind}", kind, low)
    print("\nideal tendons and springs, and with friction, backlash and creep, both here")
    for name in ("tendon", "camera"):
        for segments, lanes in LANES.items():
            case = {"segments": segments, "lanes": lanes, "horizon": given.horizon}
            loops = CASES[name], CASES[name] | {"plant": _REAL}
            both = [(HERE, case | {"loop": loop}) for loop in loops]
            _, high = in_turns(f"{name:12} {segments:8}", both, given.pairs)
            if segments == max(LANES) and high < 1.0 / MOST_COST:
                slow.append(f"{name}, {segments} segments: friction, backlash and creep cost more than {MOST_COST}")
    if slow:
        sys.exit("; ".join(slow))


def too_slow(title: str, kind: str, low: float) -> list[str]:
    """What is said of a loop whose interval's lower end is too low."""
    return [f"{title}: slower than {LEAST[kind]} of the base"] if low < LEAST[kind] else []


def in_turns(title: str, sides: list[tuple[Path, dict[str, Any]]], pairs: int) -> tuple[float, float]:
    """Measure both sides in turns and print a line; the ends of the interval of the first's time over the second's."""
    least, errors = list[tuple[float, float]](), set[float]()
    for number in range(pairs):
        with Worker(sides[0][0]) as base, Worker(sides[1][0]) as here:
            both = [(base, sides[0][1]), (here, sides[1][1])]
            errors |= {worker.measure(case)[1] for worker, case in both}  # compiles
            if number % 2:
                both.reverse()
            turns = np.array([[worker.measure(case)[0] for worker, case in both] for _ in range(TURNS)])
            before, now = turns.min(axis=0)[:: -1 if number % 2 else 1]
            least.append((float(before), float(now)))
    before, now = np.median(least, axis=0)
    ratio, low, high = interval([before / now for before, now in least])
    same = "yes" if len(errors) == 1 else "no"
    print(
        f"{title}  {1e3 * before:6.0f} ms {1e3 * now:6.0f} ms  {ratio:6.3f}  {low:.3f} - {high:.3f}  {same}", flush=True
    )
    return low, high


if __name__ == "__main__":
    main()
