"""wristctl beside its peers: `make bench-peers`, or `python benchmarks/peers/run.py --out DIR [--quick]`.

Writes result.json, table.md and rates.png/svg into DIR. Peers are installed in environments of their own first.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import truth
from measure import errors, say, speeds
from report import figure, markdown
from table import SIDES
from venvs import CACHE, HERE, python_of


def machine() -> dict[str, Any]:
    """What the numbers depend on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    model = next(names, platform.processor())
    flags = next((line for line in lines if line.startswith("flags")), "")
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=HERE, capture_output=True, text=True).stdout
    compiler = subprocess.run(["g++", "--version"], capture_output=True, text=True).stdout.splitlines()[:1]
    return {
        "processor": model, "cores": len(os.sched_getaffinity(0)), "avx512": "avx512f" in flags,
        "python": platform.python_version(), "compiler": compiler[0] if compiler else "", "commit": commit.strip(),
        "date": time.strftime("%Y-%m-%d", time.gmtime()), "load": os.getloadavg()[0],
        "requirements": {path.stem: path.read_text().split() for path in sorted((HERE / "requirements").glob("*.txt"))},
    }  # fmt: skip


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="directory to write to")
    parser.add_argument("--sides", nargs="*", help="names of table.py; all by default")
    parser.add_argument("--segments", nargs="*", type=int, default=[1, 4])
    parser.add_argument("--lanes", nargs="*", type=int, default=[1, 64, 1024])
    parser.add_argument("--budget", type=float, default=1.0, help="seconds of one timed run")
    parser.add_argument("--rounds", type=int, default=7, help="alternating runs of each side")
    parser.add_argument("--quick", action="store_true", help="short runs, three rounds")
    options = parser.parse_args()
    if options.quick:
        options.budget, options.rounds = 0.2, 3
    sides = tuple(side for side in SIDES if not options.sides or side.name in options.sides)
    for venv in {side.venv for side in sides}:
        python_of(venv)
    options.out.mkdir(parents=True, exist_ok=True)
    task_values = {"period": truth.PERIOD, "gains": truth.GAINS, "move": truth.MOVE}
    result: dict[str, Any] = {"machine": machine(), "task": task_values}
    result["sides"] = {side.name: {"problem": side.problem, "steps": side.steps} for side in sides}
    result["errors"], result["speeds"] = {}, []
    for n in options.segments:
        present = tuple(side for side in sides if n in side.steps)
        task, file = truth.make_task(n), CACHE / f"task-{n}.npz"
        CACHE.mkdir(parents=True, exist_ok=True)
        task.save(file)
        say(f"implicit reference trajectory, n = {n} (minutes the first time, then from {CACHE})")
        result["errors"][str(n)] = errors(present, file, n, truth.implicit(task, CACHE))
        for threads in sorted({1, len(os.sched_getaffinity(0))}):
            rows = speeds(present, file, n, threads, options.lanes, options.budget, options.rounds)
            result["speeds"] += rows
            (options.out / "result.json").write_text(json.dumps(result, indent=1) + "\n")
    (options.out / "table.md").write_text(markdown(result))
    figure(result, options.out / "rates")
    print(markdown(result))
    print(options.out)


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main()
