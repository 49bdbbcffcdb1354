"""One side in a process of its own: `worker.py MODULE TASK STEPS THREADS`; requests and answers are lines of JSON.

A side is a module in sides/ with `prepare(task, lanes, threads, steps) -> run`, where `run(ticks)` does that many
control periods of all lanes from rest and returns the first lane's tip angle at each tick (wristctl: only where one
lane runs), in two planes its coordinates. `steps` is the number of integration steps in one control period.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent


def main() -> None:
    answers, sys.stdout = sys.stdout, sys.stderr
    sys.path[:0] = [str(HERE), str(HERE / "sides")]
    import task as tasks

    module, path, steps, threads = sys.argv[1:5]
    side, task = importlib.import_module(module), tasks.load(path)
    prepared: dict[int, Callable[[int], Any]] = {}
    for line in sys.stdin:
        request = json.loads(line)
        lanes, ticks = request["lanes"], request["ticks"]
        start = time.perf_counter()
        if lanes not in prepared:
            prepared[lanes] = side.prepare(task, lanes, int(threads), int(steps))
        run = prepared[lanes]
        begun = time.perf_counter()
        for _ in range(request["repeats"]):
            theta = np.asarray(run(ticks))
        answer: dict[str, Any] = {"prepare": begun - start, "seconds": time.perf_counter() - begun}
        if request.get("theta"):
            answer["theta"] = [float(x) for x in theta]
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
