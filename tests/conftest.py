"""What every test may rely on."""

from __future__ import annotations

import logging
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# A shell starts background jobs with Ctrl-C ignored, and children inherit that: tests that interrupt need it back.
signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes depends on what else the machine does.
settings.register_profile("wristctl", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("wristctl")


@pytest.fixture(autouse=True)
def _log_level() -> None:
    """A command that was called in this process has set how much is logged; the next test begins anew."""
    logging.getLogger("wristctl").setLevel(logging.NOTSET)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Makes a file system of so many MB."""
    disk = tmp_path / "disk"

    def mount(megabytes: int) -> Path:
        disk.mkdir()
        mounted = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(disk)]
        if subprocess.run(mounted, capture_output=True).returncode != 0:
            pytest.skip("mounting a tmpfs needs root")
        return disk

    yield mount
    if disk.is_mount():
        subprocess.run(["umount", str(disk)], check=True)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Over several processes (`pytest -n 2`) each file goes to one, so that its fixtures are made once.

    The boards all go to the same: one process compiles their emulator, and what runs in real time has no rival there.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            board = nodeid.startswith(("tests/board", "tests/bench", "tests/trial", "tests/vision", "tests/firmware"))
            return "board" if board else nodeid.partition("::")[0]

    return ByFile(config, log)
