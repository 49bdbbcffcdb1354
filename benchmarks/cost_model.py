"""What a rollout costs: time by lanes, segments and horizon, and memory by lanes: `python benchmarks/cost_model.py`.

Each point is a process of its own, so that its peak memory is its own; the slope is that of log time over log size.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

LANES = (64, 256, 1024, 4096, 16384, 100_000)
SEGMENTS = (1, 2, 3, 4, 6, 8)
HORIZONS = (0.25, 0.5, 1.0, 2.0, 4.0)
MILLION = 1_000_000


def point(lanes: int, segments: int, horizon: float, threads: int, repeats: int) -> dict[str, float]:
    """Median seconds of one batch, compiled before, and this process's memory [MiB] before and at its peak."""
    from wristctl.config.loop import Loop, Reference
    from wristctl.config.wrist import WristParameters
    from wristctl.control.table import controller
    from wristctl.simulation.reference import motion
    from wristctl.simulation.rollout import rollout, sample_period

    loop, wrist, law = Loop(plant_segments=segments), WristParameters(), controller("smc")
    course = motion(Reference(), wrist, horizon, sample_period(loop))

    def batch(count: int) -> float:
        gains = np.tile(law.presets["initial"], (count, 1))
        start = time.perf_counter()
        rollout(law, gains, [course], np.zeros(count, np.int64), loop, wrist, threads=threads)
        return time.perf_counter() - start

    batch(8)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    seconds = float(np.median([batch(lanes) for _ in range(repeats)]))
    return {"seconds": seconds, "before": before, "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def measured(lanes: int, segments: int, horizon: float, threads: int, repeats: int) -> dict[str, Any]:
    """`point` in a process of its own."""
    arguments = [str(value) for value in (lanes, segments, horizon, threads, repeats)]
    done = subprocess.run([sys.executable, __file__, "--point", *arguments], check=True, capture_output=True, text=True)
    row = {"lanes": lanes, "segments": segments, "horizon": horizon, "threads": threads, **json.loads(done.stdout)}
    print(" ".join(f"{name}={value:.6g}" for name, value in row.items()), file=sys.stderr, flush=True)
    return row


def slope(rows: list[dict[str, Any]], over: str) -> float:
    """Exponent of time over one size."""
    return float(np.polyfit(np.log([row[over] for row in rows]), np.log([row["seconds"] for row in rows]), 1)[0])


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--point", nargs=5, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help="JSON file to write")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    if options.point:
        lanes, segments, horizon, threads, repeats = options.point
        print(json.dumps(point(int(lanes), int(segments), float(horizon), int(threads), int(repeats))))
        return
    rest = options.threads, options.repeats
    by_lanes = {n: [measured(lanes, n, 0.2, *rest) for lanes in LANES] for n in (1, 4)}
    by_segments = [measured(256, n, 1.0, *rest) for n in SEGMENTS]
    by_horizon = [measured(256, 4, horizon, *rest) for horizon in HORIZONS]
    many = by_lanes[1][-1]
    result = {
        "lanes": by_lanes,
        "segments": by_segments,
        "horizon": by_horizon,
        "slope": {
            **{f"lanes, n = {n}": slope(rows, "lanes") for n, rows in by_lanes.items()},
            "segments": slope(by_segments, "segments"),
            "horizon": slope(by_horizon, "horizon"),
        },
        "bytes_per_lane": (many["peak"] - many["before"]) * 2**20 / many["lanes"],
        "minutes_of_a_million_5_s_rollouts": many["seconds"] / many["lanes"] * (5.0 / many["horizon"]) * MILLION / 60.0,
    }
    print(json.dumps({key: result[key] for key in list(result)[3:]}, indent=1))
    if options.out:
        options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
