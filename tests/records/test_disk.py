"""A disk that fills up costs the run that fills it, says so, and touches no other."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import list_runs, start_run
from wristctl.records.find import entries


@pytest.fixture
def disk(small_disk: Callable[[int], Path]) -> Path:
    """A file system of 3 MB, with a run on it."""
    made = small_disk(3)
    with start_run("gen-data", Study(), "earlier", made) as run:
        run.metric("rmse", 1.0)
    return made


def _leave(disk: Path, free: int) -> None:
    """Fill the disk until `free` bytes are left."""
    (disk / "ballast").unlink(missing_ok=True)
    (disk / "ballast").write_bytes(bytes(shutil.disk_usage(disk).free - free))


@pytest.mark.parametrize("large", [False, True], ids=["metric", "table"])
@pytest.mark.slow
def test_whenever_the_disk_fills_the_run_fails_in_words_and_earlier_runs_stand(disk: Path, large: bool) -> None:
    said, states = set(), set()
    (earlier,) = list_runs(disk)
    needed = 512 + sum(file.stat().st_size for file in earlier.path.iterdir()) // 1024  # with its reserve
    for free in (0, 40, 200, *range(needed - 32, needed + 96, 8), 1500):
        _leave(disk, 1024 * free)
        known = {run.id for run in list_runs(disk)}
        try:
            with start_run("tune", Study(), str(free), disk, page=lambda *_: "x" * 300_000) as run:
                run.metric("rmse", 2.0)
                if large:
                    run.table("data/samples.csv", pd.DataFrame({"x": range(200_000)}))
        except UserError as error:
            said.add(str(error).split(" - ")[0])
            assert error.exit_code == 2 and str(disk) in error.where
        assert not logging.getLogger("wristctl").handlers, "nothing listens for a run that is over"
        for new in (each for each in list_runs(disk) if each.id not in known):
            states.add(new.state)
            assert new.problems() == [] and new.state in ("ok", "failed")
            if new.state == "failed":
                assert new.manifest.error is not None and new.manifest.error.what.startswith("cannot write")
            shutil.rmtree(new.path)
        assert [each.id for each in list_runs(disk)] == [earlier.id]
        earlier.check()
        assert [each.state for each in entries(disk)] == ["ok"]
    assert all("No space left on device" in each for each in said) and said
    assert states == ({"failed"} if large else {"ok", "failed"})


@pytest.mark.slow
def test_a_full_disk_is_one_line_on_the_command_line(disk: Path) -> None:
    _leave(disk, 1_000_000)
    command = [sys.executable, "-P", "-m", "wristctl", "gen-data", "--samples", "100000", "--out", str(disk)]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
    assert done.returncode == 2 and len(errors) == 1 and "No space left on device" in errors[0]
    assert sorted(run.state for run in list_runs(disk)) == ["failed", "ok"]
