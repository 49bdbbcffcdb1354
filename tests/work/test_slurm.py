"""Slurm jobs: the very script that dask-jobqueue submits, with kernels on the node's own disk."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from wristctl.config.errors import UserError
from wristctl.work.slurm import SlurmProfile

dask_jobqueue: Any = pytest.importorskip("dask_jobqueue")
DOCS = Path(__file__).parents[2] / "docs"
KERNELS = "export WRISTCTL_KERNELS=${TMPDIR:-/tmp}/wristctl-kernels-$USER"
SAFELY = "export PYTHONSAFEPATH=1"
"""Workers run no module of the folder in which they begin."""


def profile(folder: Path, text: str) -> SlurmProfile:
    file = folder / "profile.yaml"
    file.write_text(text)
    return SlurmProfile.read(file)


def test_the_script_is_the_one_that_dask_jobqueue_would_submit(tmp_path: Path) -> None:
    text = "{jobs: 3, cores: 8, processes: 4, memory: 16GB, queue: short, account: lab, walltime: 01:00:00}"
    job = dask_jobqueue.slurm.SLURMJob(
        scheduler="tcp://SCHEDULER:8786", name="wristctl", cores=8, processes=4, memory="16GB", queue="short",
        account="lab", walltime="01:00:00", job_script_prologue=[KERNELS, SAFELY],
    )  # fmt: skip
    known = profile(tmp_path, text)
    assert known.job_script() == job.job_script() and known.jobs == 3
    lines = known.job_script().splitlines()
    assert {"#SBATCH -p short", "#SBATCH -A lab", "#SBATCH -t 01:00:00", KERNELS, SAFELY} <= set(lines)


def test_a_prologue_of_ones_own_stands_behind(tmp_path: Path) -> None:
    known = profile(tmp_path, "{jobs: 1, cores: 2, memory: 4GB, job_script_prologue: [module load python]}")
    lines = known.job_script().splitlines()
    assert lines.index(KERNELS) + 1 == lines.index(SAFELY) == lines.index("module load python") - 1


def test_the_page_shows_the_script_of_the_profile_beside_it() -> None:
    (shown,) = re.findall(r"^```bash\n(#!/usr/bin/env bash.*?)^```", (DOCS / "cluster.md").read_text(), re.S | re.M)
    made = SlurmProfile.read(DOCS / "slurm.yaml").job_script().replace(sys.executable, "python")
    assert shown.strip() == made.strip()


@pytest.mark.parametrize(
    "text, told",
    [
        ("{jobs: 1, coers: 2, memory: 4GB}", r"unknown key 'coers' - .* did you mean 'cores'"),
        ("{jobs: 1, cores: 2}", r"a profile says memory"),
        ("{jobs: 0, cores: 2, memory: 4GB}", r"a profile says how many jobs"),
        ("[1, 2]", r"a profile holds keys and values"),
    ],
)
def test_a_profile_that_cannot_be_is_named(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(UserError, match=told):
        profile(tmp_path, text)
    with pytest.raises(UserError, match="cannot read the profile"):
        SlurmProfile.read(tmp_path / "missing.yaml")
