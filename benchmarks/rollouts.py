"""How fast rollouts are on this machine: `python benchmarks/rollouts.py` (or `make bench`).

Closed loop with the sliding mode law at 1 kHz over 5 s, compiled before; medians of alternating runs.
"""

from __future__ import annotations

import time

import numpy as np

from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.study import Study
from wristctl.control.table import controller, gains_of
from wristctl.seeds import stream
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import search, tuning_cases

HORIZON, REPEATS = 5.0, 5


def timed(lanes: int, segments: int, threads: int) -> float:
    """Seconds of one batch."""
    loop, wrist, law = Loop(plant_segments=segments), Study().wrist, controller("smc")
    course = motion(Reference(), wrist, HORIZON, sample_period(loop.control_period))
    gains = np.tile(gains_of(law, "initial"), (lanes, 1))
    start = time.perf_counter()
    rollout(law, gains, [course], np.zeros(lanes, np.int64), loop, wrist, threads=threads)
    return time.perf_counter() - start


def main() -> None:
    cases = [(n, lanes, threads) for n in (1, 4) for lanes in (1, 256) for threads in (1, 2)]
    for n in (1, 4):
        timed(1, n, 1)
    seconds: dict[tuple[int, int, int], list[float]] = {case: [] for case in cases}
    for _ in range(REPEATS):
        for n, lanes, threads in cases:
            seconds[n, lanes, threads].append(timed(lanes, n, threads))
    print("closed loop, 1 kHz, 5 s, compiled; medians of", REPEATS)
    print(f"{'segments':>8} {'lanes':>6} {'threads':>8} {'ms':>9} {'rollouts/s':>12} {'ticks/s':>12} {'sim s/s':>10}")
    for (n, lanes, threads), times in seconds.items():
        each = float(np.median(times))
        rate = lanes / each
        print(
            f"{n:8d} {lanes:6d} {threads:8d} {1e3 * each:9.2f} {rate:12.1f} "
            f"{rate * HORIZON * 1000:12.3g} {rate * HORIZON:10.0f}"
        )
    study = Study.model_validate({"tune": {"candidates": 40, "iterations": 60, "controllers": ("smc",)}})
    assert len(study.tune.scenarios) == 2
    start = time.perf_counter()
    judge = Judge(tuning_cases(study)[0], study.wrist, study.tune.objective)
    search(study, controller("smc"), lambda name: stream(0, name), (judge, None))
    print(f"PSO, 40 particles x 60 iterations x 2 scenarios of 5 s, 4 segments: {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    main()
