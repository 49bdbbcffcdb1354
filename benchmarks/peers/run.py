"""wristctl beside its peers: `make bench-peers`, or `python benchmarks/peers/run.py --out DIR`.

Writes peers.json, peers.md and peers.png/svg into DIR. Peers are installed in environments of their own first; one that
cannot be is left out and named.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import truth
from bends import two_planes
from claims import beside_peers, in_two_planes
from errors import errors, variants
from measure import speeds
from picture import figure
from rates import Result
from report import claims_table, markdown
from roofline import operations, peaks, scratch
from say import say
from table import BEND_SIDES, OURS, SIDES, Side
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


def installed(sides: tuple[Side, ...]) -> tuple[tuple[Side, ...], dict[str, str]]:
    """The sides that can run, and why others cannot."""
    missing: dict[str, str] = {}
    for side in sides:
        try:
            python_of(side.venv)
        except (OSError, subprocess.CalledProcessError) as failure:
            missing[side.name] = f"could not be installed: {failure}"
    if shutil.which("g++") is None:
        missing |= {side.name: "no g++ here" for side in sides if side.peer == "C"}
    for name, why in missing.items():
        say(f"left out: {name}: {why}")
    return tuple(side for side in sides if side.name not in missing), missing


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="directory to write to")
    parser.add_argument("--sides", nargs="*", help="names of table.py; all by default")
    parser.add_argument("--segments", nargs="*", type=int, default=[1, 4])
    parser.add_argument("--lanes", nargs="*", type=int, default=[1, 64, 1024])
    parser.add_argument("--budget", type=float, default=0.2, help="seconds of one timed run")
    parser.add_argument("--rounds", type=int, default=5, help="alternating runs of each side")
    options = parser.parse_args()
    chosen = tuple(side for side in SIDES if not options.sides or side.name in (OURS, *options.sides))
    CACHE.mkdir(parents=True, exist_ok=True)
    options.out.mkdir(parents=True, exist_ok=True)
    sides, missing = installed(chosen)
    raw: dict[str, Any] = {
        "machine": machine(),
        "task": {"period": truth.PERIOD, "gains": truth.GAINS, "move": truth.MOVE},
        "sides": {side.name: {"peer": side.peer, "problem": side.problem} for side in sides},
        "missing": missing, "errors": {}, "speeds": [],
    }  # fmt: skip
    cores = len(os.sched_getaffinity(0))
    if shutil.which("g++"):
        say("peak of the machine")
        raw["peaks"] = {threads: peaks(threads) for threads in sorted({1, cores})}
        raw["operations"] = {n: operations(n) for n in options.segments}
        raw["scratch"] = {n: scratch(n) for n in options.segments}
    for n in options.segments:
        present = tuple(side for side in sides if n in side.segments)
        task, file = truth.make_task(n), CACHE / f"task-{n}.npz"
        task.save(file)
        say(f"implicit reference trajectory, n = {n} (minutes the first time, then from {CACHE})")
        found = errors(present, file, n, truth.implicit(task, CACHE))
        raw["errors"][str(n)] = found
        for threads in sorted({1, cores}):
            pairs = variants(present, found)
            raw["speeds"] += speeds(pairs, file, n, threads, options.lanes, options.budget, options.rounds)
            (options.out / "peers.json").write_text(json.dumps(raw, indent=1) + "\n")
    chosen = tuple(side for side in BEND_SIDES if not options.sides or side.name in (OURS, *options.sides))
    raw["bends"] = two_planes(*installed(chosen), options.segments, options.budget, options.rounds)
    (options.out / "peers.json").write_text(json.dumps(raw, indent=1) + "\n")
    result = Result(json.loads(json.dumps(raw)))
    bends = Result(result.raw["bends"])
    claims = beside_peers(result) + in_two_planes(bends, result)
    text = claims_table(claims) + "\n" + markdown(result) + "\n## Two planes\n\n" + markdown(bends)
    (options.out / "peers.md").write_text(text)
    figure(result, options.out / "peers")
    print(text)
    print(options.out)


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main()
