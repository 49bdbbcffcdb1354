"""A user's settings of matplotlib decide no result, and none of them, however damaged, ends a command."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import pytest

from wristctl.commands.results import Figures
from wristctl.config.study import Study
from wristctl.plotting.style import figure
from wristctl.records import Run, list_runs, start_run

ROOT = Path(__file__).parents[2]
HOSTILE = """
lines.linewidth: 7
font.size: 23
font.family: serif
axes.facecolor: pink
axes.prop_cycle: cycler('color', ['red', 'lime'])
axes.formatter.use_locale: True
figure.dpi: 31
figure.facecolor: yellow
savefig.bbox: tight
savefig.dpi: 37
svg.fonttype: none
path.simplify: False
text.usetex: True
timezone: Asia/Kathmandu
"""


def _named(work: Path, environment: dict[str, str]) -> Path:
    environment["MATPLOTLIBRC"] = str(work.parent / "named")
    return work.parent / "named" / "matplotlibrc"


def _users(work: Path, environment: dict[str, str]) -> Path:
    environment["XDG_CONFIG_HOME"] = str(work.parent / "config")
    return work.parent / "config" / "matplotlib" / "matplotlibrc"


def _users_style(work: Path, environment: dict[str, str]) -> Path:
    environment["MPLCONFIGDIR"] = str(work.parent / "mpl")
    return work.parent / "mpl" / "stylelib" / "classic.mplstyle"


PLACES: dict[str, Callable[[Path, dict[str, str]], Path]] = {
    "the working folder": lambda work, environment: work / "matplotlibrc",
    "MATPLOTLIBRC": _named,
    "the user's configuration": _users,
    "the user's styles": _users_style,
}


def called(work: Path, place: str, write: Callable[[Path], object], *words: str, **more: str) -> tuple[int, str]:
    """Exit code and stderr of a command in a folder, with a file in one of the places."""
    work.mkdir(parents=True)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **more}
    if place:
        file = PLACES[place](work, environment)
        file.parent.mkdir(parents=True, exist_ok=True)
        write(file)
    command = [sys.executable, "-P", *words]
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stderr


SIMULATE = (
    "-m", "wristctl", "simulate", "--set", "horizon=0.3", "--set", "loop={plant_segments: 1}",
    "--set", "reference.duration=0.2",
)  # fmt: skip


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Result hash of a simulation where no settings are."""
    work = tmp_path_factory.mktemp("clean") / "work"
    code, err = called(work, "", Path.touch, *SIMULATE)
    assert code == 0, err
    return list_runs(work / "results")[0].result_hash


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.slow
def test_a_result_is_the_same_beside_hostile_settings(clean: str, tmp_path: Path, place: str) -> None:
    code, err = called(tmp_path / "work", place, lambda file: file.write_text(HOSTILE), *SIMULATE, MPLBACKEND="none")
    (run,) = list_runs(tmp_path / "work" / "results")
    assert code == 0 and run.manifest.undrawn == {} and run.result_hash == clean
    assert "matplotlib" not in err.lower()


IMPORT = """
from wristctl.cli.matplotlib_defaults import use_defaults
use_defaults()
import os
here = os.getcwd()
import matplotlib
from matplotlib.figure import Figure
Figure().savefig(os.devnull, format="svg")
changed = {name for name, value in matplotlib.rcParamsDefault.items() if matplotlib.rcParams[name] != value}
assert changed <= {"backend"}, changed
assert os.getcwd() == here and os.environ["MPLBACKEND"] == "none"
"""
DAMAGED: dict[str, Callable[[Path], object]] = {
    "hostile": lambda file: file.write_text(HOSTILE),
    "malformed": lambda file: file.write_text("lines.linewidth\n:::\nno.such: 3\nlines.linewidth: wide\n"),
    "no text": lambda file: file.write_bytes(bytes(range(256))),
    "a pipe": os.mkfifo,
    "unreadable": lambda file: file.touch(0),
    "a link to itself": lambda file: file.symlink_to(file.name),
    "endless": lambda file: file.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_settings_are_not_read_at_all(tmp_path: Path, damage: str) -> None:
    place = list(PLACES)[list(DAMAGED).index(damage) % 3]
    assert called(tmp_path / "work", place, DAMAGED[damage], "-c", IMPORT, MPLBACKEND="none") == (0, "")


@pytest.mark.painted
def test_a_notebooks_own_settings_are_neither_taken_nor_lost(tmp_path: Path) -> None:
    def draw() -> mpl.figure.Figure:
        picture, axes = figure(width=4.0)
        axes[0, 0].plot([0.0, 1.0])
        return picture

    painted = []
    for width in (1.5, 9.0):
        with mpl.rc_context({"lines.linewidth": width, "axes.facecolor": "pink" if width > 2.0 else "white"}):
            figures = Figures()
            figures.add("line", draw)
            assert figures["line"].axes[0].lines[0].get_linewidth() == 1.5
            with start_run("simulate", Study(), "", tmp_path) as live:
                live.figure("line", draw)
            assert mpl.rcParams["lines.linewidth"] == width
        painted.append(Run(live.path).file("figures/line.svg").read_bytes())
    assert painted[0] == painted[1]
