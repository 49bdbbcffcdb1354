"""All measurements of docs/benchmarks.md, and the page itself: `python benchmarks/all.py` (or `make bench-all`).

Some twelve minutes on a quiet machine, more the first time, when peers are installed and compiled. Results go to a
folder under results/ and from there to benchmarks/results, of which the page is made; these are meant to be committed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent


def main() -> None:
    """Measure one thing after the other; the first that fails ends it."""
    out = ROOT / "results" / time.strftime("%Y%m%dT%H%M%SZ-benchmarks", time.gmtime())
    out.mkdir(parents=True)
    kept = HERE / "results"
    kept.mkdir(exist_ok=True)
    steps = [
        ["peers/run.py", "--out", str(out), *sys.argv[1:]],
        ["cost_model.py", "--out", str(out / "cost_model.json")],
        ["cold_start.py", "--out", str(out / "cold_start.json")],
        ["scaling.py", "--out", str(out / "scaling.json")],
    ]
    for step in steps:
        run(step)
    for file in out.glob("*.json"):
        shutil.copy(file, kept)
    run(["peers/docs.py", str(kept)])
    print(out)


def run(step: list[str]) -> None:
    """One script of this folder, on this checkout's wristctl."""
    start = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, str(HERE / step[0]), *step[1:]], check=True, env=environment)
    print(f"{step[0]}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
