"""What rollouts cost: time by lanes, segments, horizon; memory; streams; a tuning: `python benchmarks/cost_model.py`.

Each point is a process of its own, so that its peak memory is its own; kernels are compiled before. An exponent is the
slope of log time over log size. Prints PASS or FAIL for what is claimed, and writes JSON with `--out`.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "peers"))

from claims import of_costs  # noqa: E402

LANES = (64, 256, 1024, 4096, 16_384, 100_000)
SEGMENTS = (1, 2, 3, 4, 6, 8)
HORIZONS = (0.25, 0.5, 1.0, 2.0, 4.0)
BATCH, STREAMED = 4096, 100_000
LEAST = 0.3
"""Seconds that a point is measured for, at least."""


def batch(segments: int, horizon: float, threads: int) -> Callable[[int], None]:
    """A closed loop with the sliding mode law, of as many lanes as asked for."""
    from wristctl.config.loop import Loop, Reference, sample_period
    from wristctl.config.wrist import WristParameters
    from wristctl.control.table import controller, gains_of
    from wristctl.simulation.reference import motion
    from wristctl.simulation.rollout import rollout

    loop, wrist, law = Loop(plant_segments=segments), WristParameters(), controller("smc")
    course = motion(Reference(), wrist, horizon, sample_period(loop.control_period))

    def run(count: int) -> None:
        gains = np.tile(gains_of(law, "initial"), (count, 1))
        rollout(law, gains, [course], np.zeros(count, np.int64), loop, wrist, threads=threads)

    run(16)
    return run


def point(lanes: int, segments: int, horizon: float, threads: int) -> dict[str, float]:
    """Median seconds of one batch, and this process's memory [MiB] before and at its peak."""
    run, before = batch(segments, horizon, threads), peak()
    times: list[float] = []
    while len(times) < 3 or sum(times) < LEAST:
        start = time.perf_counter()
        run(lanes)
        times.append(time.perf_counter() - start)
    return {"seconds": float(np.median(times)), "runs": len(times), "before": before, "peak": peak()}


def streamed(threads: int) -> dict[str, float]:
    """Seconds of a stream of rollouts of 5 s (n = 1), and how much the peak memory grows after its first batch."""
    from wristctl.config.loop import Loop, Reference, sample_period
    from wristctl.config.wrist import WristParameters
    from wristctl.control.table import controller
    from wristctl.simulation.reference import motion
    from wristctl.simulation.rollout import stream

    loop, wrist, law = Loop(plant_segments=1), WristParameters(), controller("smc")
    course = motion(Reference(), wrist, 5.0, sample_period(loop.control_period))
    rng = np.random.default_rng(0)

    def batches() -> Iterator[np.ndarray]:
        for first in range(0, STREAMED, BATCH):
            yield np.exp(rng.uniform(0.0, 1.0, (min(BATCH, STREAMED - first), 3)))

    batch(1, 0.1, threads)
    begun, seen, after_first, worst = time.perf_counter(), 0, 0.0, 0.0
    for outcome in stream(law, batches(), course, loop, wrist, threads=threads):
        after_first = after_first or peak()
        seen += len(outcome.failed)
        worst = max(worst, float(np.nanmax(outcome.metrics["rmse"])))
    assert seen == STREAMED and worst > 0.0
    return {
        "seconds": time.perf_counter() - begun, "rollouts": seen, "batches": -(-STREAMED // BATCH), "batch": BATCH,
        "growth_mib": peak() - after_first,
    }  # fmt: skip


def tuned() -> float:
    """Seconds of a particle swarm: 40 particles, 60 iterations, two scenarios of 5 s, n = 4; all cores."""
    from wristctl.config.study import Study
    from wristctl.control.table import controller
    from wristctl.seeds import stream
    from wristctl.tuning.objective import Judge
    from wristctl.tuning.search import search, tuning_cases

    def seconds(iterations: int) -> float:
        tune = {"candidates": 40, "iterations": iterations, "controllers": ("smc",)}
        study = Study.model_validate({"tune": tune})
        assert len(study.tune.scenarios) == 2 and study.tune.optimiser == "pso"
        start = time.perf_counter()
        judge = Judge(tuning_cases(study)[0], study.wrist, study.tune.objective)
        search(study, controller("smc"), lambda name: stream(0, name), (judge, None))
        return time.perf_counter() - start

    seconds(1)
    return float(np.median([seconds(60) for _ in range(3)]))


def peak() -> float:
    """This process's peak memory [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def apart(call: str) -> Any:
    """Value of a call of this module's functions in a process of its own."""
    code = f"import json, cost_model; print(json.dumps(cost_model.{call}))"
    environment = {**os.environ, "PYTHONPATH": str(HERE.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=HERE, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    value = json.loads(done.stdout)
    print(call, json.dumps(value), file=sys.stderr, flush=True)
    return value


def measured(lanes: int, segments: int, horizon: float, threads: int) -> dict[str, Any]:
    """`point` in a process of its own."""
    return {
        "lanes": lanes, "segments": segments, "horizon": horizon,
        **apart(f"point({lanes}, {segments}, {horizon}, {threads})"),
    }  # fmt: skip


def slope(rows: list[dict[str, Any]], over: str) -> float:
    """Exponent of time over one size."""
    return float(np.polyfit(np.log([row[over] for row in rows]), np.log([row["seconds"] for row in rows]), 1)[0])


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="JSON file to write")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    options = parser.parse_args()
    threads = options.threads
    by_lanes = {n: [measured(lanes, n, horizon, threads) for lanes in LANES] for n, horizon in ((1, 2.0), (4, 0.5))}
    by_segments = [measured(1024, n, 0.5, threads) for n in SEGMENTS]
    by_horizon = [measured(1024, 4, horizon, threads) for horizon in HORIZONS]
    many = by_lanes[1][-1]
    result = {
        "threads": threads,
        "lanes": by_lanes,
        "segments": by_segments,
        "horizon": by_horizon,
        "slope_by_lanes": {n: slope(rows, "lanes") for n, rows in by_lanes.items()},
        "slope_by_segments": slope(by_segments, "segments"),
        "slope_by_horizon": slope(by_horizon, "horizon"),
        "bytes_per_lane": (many["peak"] - many["before"]) * 2**20 / many["lanes"],
        "stream": apart(f"streamed({threads})"),
        "tune_seconds": apart("tuned()"),
    }
    result = json.loads(json.dumps(result))
    for claim in of_costs(result):
        print(f"{claim.verdict:12} {claim.wanted}: {claim.measured}")
    if options.out:
        options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
