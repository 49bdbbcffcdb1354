"""Many small sealed runs in a folder, each as a command leaves one: sealed, with an answer, a figure and an input."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wristctl.config.study import Study
from wristctl.records import start_run
from wristctl.records.manifest import MANIFEST, OVERVIEW, REPORT, SUMS, Overview
from wristctl.records.seal import write_seal

KINDS = ("simulate", "compare", "tune", "hw-run", "train")
_FIRST = datetime(2026, 1, 1, tzinfo=UTC)


def _figure(kind: str) -> Figure:
    figure = Figure(figsize=(8.0, 5.0))
    axes = figure.subplots()
    rng = np.random.default_rng(len(kind))
    axes.plot(rng.normal(size=(300, 4)).cumsum(axis=0), label=["a", "b", "c", kind])
    axes.set(xlabel="time [s]", ylabel="error [deg]")
    axes.legend()
    return figure


def run_name(number: int) -> str:
    """Name of a run of `many_runs`; the kinds take turns, and a later run has a later date."""
    started = _FIRST + timedelta(minutes=number)
    return f"{started:%Y%m%dT%H%M%SZ}-{KINDS[number % len(KINDS)]}-n{number}-abcdef"


def many_runs(results: Path, count: int) -> None:
    """Make runs in a folder, the first the oldest; each but the first was made from the one before.

    A run of each kind is made as commands make one, and its files serve the others of its kind.
    """
    kept: dict[str, tuple[dict[str, object], dict[str, bytes]]] = {}
    for kind in KINDS[:count]:
        with start_run(kind, Study(), "", results / ".templates", ["wristctl", kind]) as live:
            live.metric("rmse", 1e-3, "rad", "lower")
            live.figure("answer", lambda kind=kind: _figure(kind))  # type: ignore[misc]
        files = {str(path.relative_to(live.path)): path.read_bytes() for path in live.path.rglob("*") if path.is_file()}
        kept[kind] = json.loads(files.pop(MANIFEST)), files
    for number in range(count):
        name, kind = run_name(number), KINDS[number % len(KINDS)]
        manifest, files = kept[kind]
        started = (_FIRST + timedelta(minutes=number)).isoformat()
        manifest |= {"id": name, "label": f"n{number}", "timing": {"started": started, "wall_s": 1.0 + number}}
        before = {"role": "before", "kind": KINDS[(number - 1) % len(KINDS)], "path": "", "result_sha256": ""}
        manifest["inputs"] = [before | {"run": run_name(number - 1)}] * (number > 0)
        answer = Overview(
            [f"Run {number} of {kind} has an error of", f"{number} deg [0.1, 0.2]. More follows."], "answer"
        )
        folder, report = results / name, f"<!doctype html><title>{name}</title><p>report of {number}".encode()
        changed = {MANIFEST: json.dumps(manifest).encode(), OVERVIEW: answer.text().encode(), REPORT: report}
        contents = {file: content for file, content in (files | changed).items() if file != SUMS}
        for file, content in contents.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(content)
        write_seal(folder, {file: hashlib.sha256(content).hexdigest() for file, content in contents.items()})
