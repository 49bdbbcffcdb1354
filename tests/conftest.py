"""What every test may rely on."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings

from tests.plotting.browser import CHROMIUM, DRIVER, Browser
from wristctl.config.choices import CONTROLLERS, OPTIMISERS, REFERENCES
from wristctl.records import formats, provenance, start
from wristctl.records.manifest import Code

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A shell starts background jobs with Ctrl-C ignored, and children inherit that: tests that interrupt need it back.
signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes depends on what else the machine does.
settings.register_profile("wristctl", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("wristctl")


@pytest.fixture(autouse=True)
def _log_level() -> None:
    """A command that was called in this process has set how much is logged; the next test begins anew."""
    logging.getLogger("wristctl").setLevel(logging.NOTSET)


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    """What a test lends to the tables of controllers, optimisers and references is gone after it."""
    tables = CONTROLLERS, OPTIMISERS, REFERENCES
    before = [{name for name in table if table.origin(name)} for table in tables]
    yield
    for table, names in zip(tables, before, strict=True):
        for name in [one for one in table if one not in names and table.origin(one)]:
            del table[name]


@pytest.fixture(autouse=True, scope="session")
def _a_home_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What commands note for the user is not noted for who runs the tests."""
    with pytest.MonkeyPatch.context() as session:
        session.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(autouse=True, scope="session")
def _runs_begin_and_end_soon() -> Iterator[None]:
    """Runs of this process read sources and installed packages once, and do not wait for the disk.

    Where these are the subject, tests call them themselves (tests/records) or run processes (tests/faults).
    """
    installed = [SimpleNamespace(metadata=package.metadata) for package in metadata.distributions()]
    code_of = cache(lambda package: provenance.code_state())

    def code_state() -> tuple[Code, bytes, str]:
        code, patch, listing = code_of(provenance._PACKAGE)
        return code.model_copy(), patch, listing

    with pytest.MonkeyPatch.context() as session:
        session.setattr(provenance, "metadata", SimpleNamespace(distributions=lambda: installed))
        session.setattr(start, "code_state", code_state)
        session.setattr(os, "fsync", lambda descriptor: None)
        yield


_scandir = os.scandir


class _FromTheEnd:
    """What `os.scandir` gives, the last name first."""

    def __init__(self, path: Any = ".") -> None:
        with _scandir(path) as listing:
            self._entries = iter(sorted(listing, key=lambda entry: entry.name, reverse=True))

    def __iter__(self) -> Iterator[os.DirEntry[str]]:
        return self._entries

    def __next__(self) -> os.DirEntry[str]:
        return next(self._entries)

    def __enter__(self) -> _FromTheEnd:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture(autouse=True, scope="session")
def _folders_are_listed_from_the_end() -> Iterator[None]:
    """A file system lists a folder in whatever order it likes: here never in the one that most of them happen to."""
    listdir = os.listdir
    with pytest.MonkeyPatch.context() as session:
        session.setattr(os, "scandir", _FromTheEnd)
        session.setattr(os, "listdir", lambda path=None: sorted(listdir(path), reverse=True))
        yield


pictures = formats.pictures
_PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010806000000"
    "1f15c4890000000b49444154789c6360000200000500017a5eab3f0000000049454e44ae426082"
)


def _blank(figure: Figure, name: str, dpi: int = 150) -> dict[str, bytes]:
    width, height = 72.0 * figure.get_size_inches()
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}pt" height="{height:g}pt"></svg>\n'
    return {".png": _PIXEL, ".svg": svg.encode()}


@pytest.fixture(autouse=True, scope="session")
def _blank_pictures() -> Iterator[None]:
    """Figures are made, and in the runs of this process blank pictures of their size written.

    A picture costs more than all else in most runs. Every figure is painted in tests/plotting, and what each command
    leaves, in tests that are marked `painted`.
    """
    with pytest.MonkeyPatch.context() as session:
        session.setattr(formats, "pictures", _blank)
        yield


def _paint(request: pytest.FixtureRequest) -> Iterator[None]:
    """Pictures are painted where a test, or a whole file with the runs that its tests share, is marked so."""
    with pytest.MonkeyPatch.context() as during:
        if request.node.get_closest_marker("painted"):
            during.setattr(formats, "pictures", pictures)
        yield


_painted_files = pytest.fixture(autouse=True, scope="module")(_paint)
_painted_tests = pytest.fixture(autouse=True)(_paint)


def pytest_configure(config: pytest.Config) -> None:
    """Markers of this suite."""
    config.addinivalue_line("markers", "painted: pictures of runs are painted, not blank")
    config.addinivalue_line(
        "markers", "slow: half a second of processor time or more, or a loop of its own to compile (make test-slow)"
    )


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


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A headless Chromium for the tests of a module, which skip without one."""
    if not (CHROMIUM and DRIVER):
        pytest.skip("needs Debian's chromium and chromium-driver")
    made = Browser(tmp_path_factory.mktemp("profile"))
    yield made
    made.close()
