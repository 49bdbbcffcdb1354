"""Workers that Slurm starts, by dask-jobqueue: a profile is its own keywords and how many jobs there are to be."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from wristctl.config.errors import UserError, meant
from wristctl.config.strict_yaml import parse_yaml
from wristctl.config.wording import Argument
from wristctl.lanes.kernel_folder import NAMED
from wristctl.work.serving import SAFE_PATH

_BEFORE = (f"export {NAMED}=${{TMPDIR:-/tmp}}/wristctl-kernels-$USER", f"export {SAFE_PATH}=1")
"""Kernels are compiled for the node's own processor, and kept there; no worker looks for modules where it begins."""
_INSTALL = "pip install 'wristctl[cluster]'"
_EXAMPLE = "jobs: 4, cores: 16, processes: 16, memory: 32GB, queue: NAME, walltime: 02:00:00"


@dataclass(frozen=True)
class SlurmProfile:
    """How many jobs, and what `dask_jobqueue.SLURMCluster` is told of each."""

    jobs: int
    keywords: dict[str, Any]

    @classmethod
    def read(cls, file: Path) -> Self:
        """From YAML. UserError for what cannot be read, an unknown keyword, or none of those that must be there."""
        try:
            text = file.read_bytes()
        except OSError as error:
            raise UserError(f"cannot read the profile: {error.strerror}", str(file), "check the path") from error
        data = parse_yaml(text, str(file)).data
        if not isinstance(data, dict):
            raise UserError("a profile holds keys and values", str(file), _EXAMPLE)
        known = _known()
        for name in data:
            if name not in known:
                raise UserError(f"unknown key '{name}'", str(file), meant(name, known))
        missing = [name for name in ("jobs", "cores", "memory") if name not in data]
        jobs = data.get("jobs")
        if missing or not isinstance(jobs, int) or jobs < 1:
            raise UserError(f"a profile says {', '.join(missing) or 'how many jobs'}", str(file), _EXAMPLE)
        given = {name: list(each) if isinstance(each, tuple) else each for name, each in data.items() if name != "jobs"}
        prologue = [*_BEFORE, *given.pop("job_script_prologue", [])]
        return cls(jobs, {**given, "job_script_prologue": prologue})

    def job_script(self, scheduler: str = "tcp://SCHEDULER:8786") -> str:
        """What dask-jobqueue hands to sbatch for each job."""
        job: Any = _jobqueue().slurm.SLURMJob
        made: str = job(scheduler=scheduler, name="wristctl", **self.keywords).job_script()
        return made

    @contextmanager
    def client(self) -> Iterator[Any]:
        """A Dask client of a cluster with these jobs, which end with the block. UserError where Slurm is not there."""
        from distributed import Client

        try:
            cluster: Any = _jobqueue().SLURMCluster(**self.keywords)
        except (OSError, ValueError) as error:
            raise UserError(
                f"no Slurm cluster: {error}", Argument("slurm", metavar="FILE"), "start it on a login node"
            ) from error
        with cluster, Client(cluster, set_as_default=False) as client:
            cluster.scale(jobs=self.jobs)
            yield client


def _jobqueue() -> Any:
    try:
        import dask_jobqueue
    except ImportError as error:
        raise UserError("dask-jobqueue is not installed", Argument("slurm", metavar="FILE"), _INSTALL) from error
    return dask_jobqueue


def _known() -> set[str]:
    """The keywords of a Slurm job, and of any."""
    queue = _jobqueue()
    kinds = queue.slurm.SLURMJob, queue.core.Job
    found = {name for kind in kinds for name in inspect.signature(kind.__init__).parameters}
    return (found | {"jobs"}) - {"self", "scheduler", "name", "kwargs", "args", "base_class_kwargs", "config_name"}
