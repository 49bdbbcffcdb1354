"""What a user waits for at first: imports, and each command with an empty and with a filled cache of compiled kernels.

`python benchmarks/cold_start.py` prints a table; `--out FILE` writes JSON as well.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import datetime
from pathlib import Path

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[1])}
STUDY = """\
gen-data: {samples: 1000}
train: {epochs: 20}
tune: {controllers: [smc], candidates: 8, iterations: 2}
compare: {controllers: [{controller: smc, gains: initial}], inverses: [closed-form]}
"""
COMMANDS: dict[str, list[str]] = {
    "--help": [],
    "gen-data": ["STUDY"],
    "train": ["STUDY", "--data", "latest:gen-data"],
    "simulate": [],
    "tune": ["STUDY"],
    "compare": ["STUDY"],
}
"""Each command's smallest run, in this order; train needs gen-data's."""
FIRST, AGAIN = 3, 5
"""Runs with an empty cache, and with a filled one; their medians count."""


def seconds_of(command: str, folder: Path, cache: Path) -> dict[str, float]:
    """Wall and processor time of one command, and the former until it reports progress, to the user or in its run."""
    arguments = [str(folder / "study.yaml") if word == "STUDY" else word for word in COMMANDS[command]]
    out = [] if command == "--help" else ["--out", str(folder / "results")]
    start = time.time()
    begun = time.perf_counter()
    program = [sys.executable, "-c", "from wristctl.cli.app import main; main()"]
    process = subprocess.Popen(
        [*program, command, *arguments, *out], cwd=folder, text=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={**ENVIRONMENT, "XDG_CACHE_HOME": str(cache)},
    )  # fmt: skip
    assert process.stderr is not None
    first, said = None, []
    for line in process.stderr:
        said.append(line)
        if first is None and re.search(r"\b[1-9]\d*\s*(/|of)\s*\d+|compil|simulat", line):
            first = time.time() - start
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"wristctl {command}: {''.join(said)}")
    whole = time.perf_counter() - begun
    firsts = [each - start for each in counted(folder / "results", command)] + ([first] if first is not None else [])
    return {
        "whole": whole,
        "processor": used.ru_utime + used.ru_stime,
        **({"first_progress": min(firsts)} if firsts else {}),
    }


def counted(results: Path, command: str) -> list[float]:
    """When the newest run of a command told that something is done, an epoch for one [s since 1970]."""
    journal = max(results.glob(f"*-{command}-*/events.jsonl"), default=None)
    events = [json.loads(line) for line in journal.read_text().splitlines()] if journal else []
    return [datetime.fromisoformat(each["time"]).timestamp() for each in events if each.get("count")]


def import_seconds(command: str) -> float:
    """Time to import the module of one command."""
    module = "wristctl.cli.app" if command == "--help" else f"wristctl.commands.{command.replace('-', '_')}.command"
    code = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, env=ENVIRONMENT)
    return float(done.stdout)


def median(runs: list[dict[str, float]]) -> dict[str, float]:
    """Of each of the times."""
    return {each: statistics.median(run[each] for run in runs) for each in runs[0]}


def main() -> None:
    """Measure every command with its cache empty and, several times, filled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="JSON file to write")
    options = parser.parse_args()
    rows = {}
    heads = "import s", "first s", "again s", "processor, first s", "again s", "progress, first s", "again s"
    print(f"{'command':10} " + " ".join(head.rjust(max(9, len(head))) for head in heads))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "study.yaml").write_text(STUDY)
        for command in COMMANDS:
            caches = [folder / f"cache-{command.strip('-')}-{k}" for k in range(FIRST)]  # of others' no help either
            first = median([seconds_of(command, folder, cache) for cache in caches])
            again = median([seconds_of(command, folder, caches[0]) for _ in range(AGAIN)])
            rows[command] = {"import": import_seconds(command), "first": first, "again": again}
            progress = [f"{run['first_progress']:.2f}" if "first_progress" in run else "-" for run in (first, again)]
            print(
                f"{command:10} {rows[command]['import']:9.2f} {first['whole']:9.2f} {again['whole']:9.2f} "
                f"{first['processor']:18.2f} {again['processor']:9.2f} "
                f"{progress[0]:>17} {progress[1]:>9}",
                flush=True,
            )
    if options.out:
        options.out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
