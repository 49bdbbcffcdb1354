"""Memory, time and space on the disk of large jobs: 10,000,000 samples drawn, networks trained on 1,000,000.

`python benchmarks/large.py` prints a table.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
JOBS: dict[str, tuple[str, ...]] = {
    "gen-data, 10,000,000 samples": ("gen-data", "--samples", "10000000"),
    "gen-data, 1,000,000 equilibria": ("gen-data", "--samples", "1000000", "--source", "plant"),
    "train, 1,000,000 samples, 2 epochs": ("train", "--set", "gen-data.samples=1000000", "--epochs", "2"),
}


def measured(folder: Path, arguments: tuple[str, ...]) -> tuple[float, float, float, float]:
    """Wall time [s], processor time [s], memory [MB] and space on the disk [MB] of a command."""
    began = time.monotonic()
    command = [sys.executable, "-m", "wristctl", *arguments, "--out", str(folder), "-q"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    child = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{arguments[0]} has failed")
    bytes_ = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    return time.monotonic() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, bytes_ / 1e6


def main() -> None:
    """Print a line for each job."""
    print(f"{'':36} wall [s]  processor [s]  memory [MB]  disk [MB]")
    for name, arguments in JOBS.items():
        with tempfile.TemporaryDirectory() as folder:
            wall, processor, memory, disk = measured(Path(folder), arguments)
        print(f"{name:36} {wall:8.1f}  {processor:13.1f}  {memory:11.0f}  {disk:9.0f}", flush=True)


if __name__ == "__main__":
    main()
