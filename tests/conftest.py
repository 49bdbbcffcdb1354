"""What every test may rely on."""

from __future__ import annotations

import logging
import signal
import subprocess
from collections import Counter
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


_TOGETHER = {"board": ("tests/board", "tests/firmware"), "trial": ("tests/bench", "tests/trial")}
"""Folders whose files all go to one process."""


@pytest.hookimpl(tryfirst=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How many tests were skipped, by what they lack: a suite that is green has not tried them."""
    reasons = [str(each.longrepr[2]) for each in terminalreporter.stats.get("skipped", []) if len(each.longrepr) == 3]
    kinds = Counter(_lacking(reason.removeprefix("Skipped: ")) for reason in reasons)
    if kinds:
        told = "; ".join(f"{count} {kind}" for kind, count in kinds.most_common())
        terminalreporter.write_line(f"not tried: {told}")


_LACKS = {
    "simavr": "simavr", "octave": "Octave", "avr-gcc": "the firmware's compiler", "chrom": "a browser",
    "runs alone": "a run alone (make test-rig)", "long": "WRISTCTL_THOROUGH", "minutes": "WRISTCTL_THOROUGH",
    "thorough": "WRISTCTL_THOROUGH",
}  # fmt: skip
"""Kinds of what a skipped test lacks, by a word of its reason; any other reason is a kind of its own."""


def _lacking(reason: str) -> str:
    return next((kind for word, kind in _LACKS.items() if word in reason.lower()), reason)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Over several processes (`pytest -n 2`) each file goes to one, so that its fixtures are made once.

    Benches and trials run in one process, where what is in real time has no rival; so do the boards, in another.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            for group, folders in _TOGETHER.items():
                if nodeid.startswith(folders):
                    return group
            return nodeid.partition("::")[0]

    return ByFile(config, log)
