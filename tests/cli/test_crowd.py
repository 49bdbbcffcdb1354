"""Many processes at once on one results folder: every run is there, no tag is lost, nothing is damaged."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.records import list_runs
from wristctl.records.tags import read_tags

ROOT = Path(__file__).parents[2]
MANY = 8 if os.environ.get("WRISTCTL_THOROUGH") else 3
BEGIN = "import wristctl.cli.app as app; print(); input(); app.main()"
"""wristctl, which begins when all are ready."""


def together(folder: Path, *commands: tuple[str, ...]) -> list[tuple[int, str]]:
    """Exit code and stderr of each of these, begun in one moment."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder)}
    children = [
        subprocess.Popen(
            [sys.executable, "-P", "-c", BEGIN, *each], cwd=folder, env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        for each in commands
    ]  # fmt: skip
    for child in children:
        assert child.stdout is not None
        child.stdout.readline()
    for child in children:
        assert child.stdin is not None
        child.stdin.write("\n")
        child.stdin.flush()
    told = [child.communicate()[1] for child in children]
    return [(child.returncode, said) for child, said in zip(children, told, strict=True)]


@pytest.mark.slow
def test_a_crowd_of_processes_leaves_everything_whole(tmp_path: Path) -> None:
    results = tmp_path / "results"
    done = together(tmp_path, *[("gen-data", "--samples", "50", "-q")] * MANY)
    runs = list_runs(results)
    assert done == [(0, "")] * MANY and len(runs) == MANY and len({run.result_hash for run in runs}) == 1

    done = together(tmp_path, *[("runs", "tag", runs[0].id, f"t{k}") for k in range(MANY)])
    assert {code for code, _ in done} == {0}
    assert read_tags(results) == {runs[0].id: sorted(f"t{k}" for k in range(MANY))}

    reports = [("runs", "report", runs[k].id, "--to", f"{k}.html") for k in range(MANY // 2)]
    lists = [("runs", "ls")] * (MANY - 2)
    done = together(tmp_path, *[("runs", "rm", runs[-1].id, "--yes")] * (MANY // 2), *reports, *lists)
    for code, said in done[: MANY // 2]:
        assert (code, said) == (0, "") or (code == 2 and said.count("\n") == 1 and "bug" not in said), said
    assert [code for code, _ in done[MANY // 2 :]] == [0] * (len(reports) + len(lists))
    assert not runs[-1].path.exists() and len(list((tmp_path).glob("*.html"))) == MANY // 2

    done = together(
        tmp_path, ("runs", "rm", runs[1].id, "--yes"), ("runs", "tag", runs[1].id, "late"),
        ("runs", "rm", runs[0].id, "--yes"), *lists[:3],
    )  # fmt: skip
    assert all(code in (0, 2) and "bug" not in said for code, said in done), done
    left = {run.id for run in list_runs(results)}
    assert left == {run.id for run in runs[2:-1]} and all(run.problems() == [] for run in list_runs(results))
    listed = together(tmp_path, ("runs", "ls"), ("runs", "gc", "--yes"), ("runs", "verify"))
    assert [code for code, _ in listed] == [0, 0, 0]
    index = json.loads((results / ".index.json").read_bytes())
    assert set(index["runs"]) == left and not list(results.glob("*.removed"))
