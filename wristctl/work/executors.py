"""Executors of units: this process, processes of this machine, a Dask cluster, or an executor of one's own."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from wristctl.errors import Argument, UserError
from wristctl.interrupt import deferred
from wristctl.processes import cores, safe_path, serve_parent

EXECUTOR = Argument("executor", metavar="WHO")
KINDS = "serial, processes, processes:N, dask://host:port or module:factory"
_PROCESSES = re.compile(r"processes(?::([0-9]+))?")
_PLACE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
_CLUSTER = "pip install 'wristctl[cluster]'"
# Seconds in which a scheduler answers.
_ANSWERS = 10.0


class Here(Executor):
    """Works at once, in this process, with all its cores."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do it; Ctrl-C comes through."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@dataclass(frozen=True)
class Pool:
    """An executor, how many units it is given at once, and what has become of it."""

    executor: Executor
    width: Callable[[], int]
    """Number of units that the pool can work at now."""
    lost: Callable[[], str] = lambda: ""
    """Description of a pool that is lost for good, else empty."""
    apart: bool = True
    """Whether its workers are other processes, which must show that they compute the same."""


@dataclass(frozen=True)
class Workers:
    """Workers that an `--executor` names. `opened` makes a pool of them, and another after one has broken."""

    named: str
    many: int
    """Workers that are known before; 1 where only the cluster knows."""
    open: Callable[[], Any]
    """A context manager that yields a Pool."""

    @classmethod
    def of(cls, named: str) -> Workers:
        """UserError for what names no executor."""
        if named == "serial":
            return cls(named, 1, _here)
        if match := _PROCESSES.fullmatch(named):
            many = int(match[1]) if match[1] else cores()
            if not 1 <= many <= 1024:
                raise UserError(f"{many} processes", EXECUTOR, "1 to 1024")
            return cls(named, many, lambda: _processes(many))
        if named.startswith("dask://"):
            return cls(named, 1, lambda: _dask(named.removeprefix("dask://")))
        if _PLACE.fullmatch(named):
            factory = _factory(named)
            return cls(named, 1, lambda: _of_factory(named, factory))
        raise UserError(f"unknown executor '{named}'", EXECUTOR, KINDS)


@contextmanager
def _here() -> Iterator[Pool]:
    yield Pool(Here(), lambda: 1, apart=False)


def _begin(threads: int) -> None:
    os.environ["OMP_NUM_THREADS"] = str(threads)
    serve_parent()


@contextmanager
def _processes(many: int) -> Iterator[Pool]:
    before = set(active_children())
    with safe_path():  # to the end: a pool begins workers when it likes
        pool = ProcessPoolExecutor(many, get_context("spawn"), _begin, (max(1, cores() // many),))
        try:
            with deferred():  # the workers', too, which begin with it
                for _ in range(many):
                    pool.submit(int)
            yield Pool(pool, lambda: many)
        finally:
            for worker in set(active_children()) - before:  # a pool waits for whatever it was given
                worker.kill()
            pool.shutdown(cancel_futures=True)


@contextmanager
def _dask(address: str) -> Iterator[Pool]:
    try:
        from distributed import Client
    except ImportError as error:
        raise UserError("Dask is not installed", EXECUTOR, _CLUSTER) from error
    try:
        client: Any = Client(f"tcp://{address}", timeout=_ANSWERS, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        problem = f"no Dask scheduler answers at tcp://{address}"
        fix = ("start one (`dask scheduler`), or another ", EXECUTOR)
        raise UserError(problem, EXECUTOR, fix) from error
    try:
        yield _of_client(client, address)
    finally:
        client.close(timeout=2)


def _of_client(client: Any, address: str) -> Pool:
    def width() -> int:
        """Twice the threads, so that none waits for the way here and back; none where nobody answers."""
        try:
            threads: dict[str, int] = client.nthreads()
            return max(2, 2 * sum(threads.values()))
        except OSError:
            return 0

    def lost() -> str:
        return "" if client.status == "running" else f"the Dask cluster at tcp://{address} is gone"

    return Pool(client.get_executor(pure=False, retries=0), width, lost)


def _factory(named: str) -> Callable[[], Any]:
    module, _, name = named.partition(":")
    directory = str(Path.cwd())
    if directory not in sys.path:  # a factory stands beside the study, and takes nobody's place there
        sys.path.append(directory)
    try:
        factory: Callable[[], Any] = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise UserError(f"no executor at {named}: {error}", EXECUTOR, KINDS) from error
    return factory


@contextmanager
def _of_factory(named: str, factory: Callable[[], Any]) -> Iterator[Pool]:
    with safe_path():
        executor = factory()
        if not callable(getattr(executor, "submit", None)):
            problem = f"{named} gives {type(executor).__name__}, and no concurrent.futures.Executor"
            raise UserError(problem, EXECUTOR, "a factory that returns one")
        many = int(getattr(executor, "_max_workers", 0) or cores())
        with executor:
            yield Pool(executor, lambda: many)
