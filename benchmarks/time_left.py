"""Whether the time that commands announce as left is right: `python benchmarks/time_left.py [--runs 4] [COMMAND ...]`.

Each run is a process of its own, whose live line is read four times a second. A run holds where after its first tenth,
and two seconds, every reading is within a factor of 1.5 of what was left, as long as that was two seconds or more; the
share of readings that are, the first one's factor, and the longest time for which a count stood at its total are told
too. Kernels are to be compiled before: run it twice. Results: a line for each run, and JSON with --out.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FACTOR, SHARE, LEAST = 1.5, 0.1, 2.0
"""Permitted factor, share of a run before which nothing counts, and seconds left from which it does."""

COMMANDS: dict[str, list[str]] = {
    "compare": ["compare", "experiments/shipped.yaml", "--set", "worlds.family=handling", "--set", "worlds.draws=12"],
    "tune": ["tune", "smc", "pid", "adrc", "--candidates", "12", "--iterations", "12"],
    "study": ["study", "benchmarks/small_study.yaml"],
    "recommend": ["recommend", "ct-dob", "pid-ff", "--set", "tests=24", "--set", "rehearsed=0"],
    "identify": ["identify", "experiments/logs/clean.csv"],
}  # fmt: skip
"""What is run, by command; the seed is added."""

CHILD = """
import json, sys, threading, time
from pathlib import Path

from wristctl.cli import app, progress


class Read(progress.Bar):
    def __enter__(self):
        self.readings, self.over = [], threading.Event()
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        return self

    def read(self):
        while not self.over.wait(0.25):
            count, passed = self._count, time.monotonic() - self._began
            left = self._ahead.seconds_left(count)
            self.readings.append((passed, left, count.what, count.count, count.total))

    def __exit__(self, *error):
        self.over.set()
        self.reader.join()
        whole = time.monotonic() - self._began
        Path(sys.argv.pop(1)).write_text(json.dumps({"whole": whole, "readings": self.readings}))
        super().__exit__(*error)


progress.Bar = Read
app.main()
"""


def read(command: list[str], seed: int) -> dict[str, Any]:
    """Readings of a run and what it took [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "readings.json"
        words = [*command, "--seed", str(seed), "--out", folder, "--quiet", "--force"]
        code = CHILD.replace("sys.argv.pop(1)", repr(str(file)))
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", code, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode not in (0, 3) or not file.exists():
            raise SystemExit(done.stderr)
        found: dict[str, Any] = json.loads(file.read_text())
        return found


def judged(run: dict[str, Any]) -> dict[str, Any]:
    """Whether the time left held, the worst factors to both sides, and how long a count stood at its total."""
    whole, factors, stood, longest, before = run["whole"], list[float](), 0.0, 0.0, 0.0
    silent = 0
    for passed, left, _, count, total in run["readings"]:
        stood = stood + passed - before if total and count >= total else 0.0
        longest, before = max(longest, stood), passed
        actual = whole - passed
        if passed < max(SHARE * whole, LEAST) or actual < LEAST:
            continue
        if left is None:
            silent += 1
        else:
            factors.append(left / actual)
    ends = min(factors, default=1.0), max(factors, default=1.0)
    within = sum(1.0 / FACTOR <= factor <= FACTOR for factor in factors)
    every = len(factors) + silent
    return {
        "seconds": whole, "held": within == every, "within": within / every if every else 1.0,
        "first": factors[0] if factors else float("nan"),
        "silent": silent / every if every else 0.0, "least": ends[0], "most": ends[1], "stood": longest,
    }  # fmt: skip


def main() -> None:
    """Run the commands, and say in how many runs the time left held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commands", nargs="*", default=list(COMMANDS))
    parser.add_argument("--runs", type=int, default=4)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    results = []
    for name in options.commands:
        for seed in range(options.runs):
            run = read(COMMANDS[name], seed)
            results.append({"command": name, "seed": seed, **judged(run), "readings": run["readings"]})
            last = {key: value for key, value in results[-1].items() if key != "readings"}
            print(" ".join(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}"
                           for key, value in last.items()), flush=True)  # fmt: skip
    held = sum(result["held"] for result in results)
    print(f"the time left held in {held} of {len(results)} runs")
    if options.out:
        options.out.write_text(json.dumps(results))


if __name__ == "__main__":
    main()
