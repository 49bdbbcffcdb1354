"""What CONTRIBUTING shows of newcomers is true: its diffs, put into a copy of the package, are run."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from wristctl.records import Run

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text()
KINDS = ("controller", "reference", "metric", "optimiser", "disturbance", "plant", "rig", "log format", "command")
STUDY = """\
compare:
  horizon: 0.5
  controllers: [{controller: pd, gains: tuned}, {controller: pd}]
  references: [{kind: approach, angle_deg: 10, time_constant: 0.1}]
  inverses: [none]
  loops: {still: {plant: {model: hinge}}, shaken: {plant: {model: hinge}, disturbances: {tremor: 5.0}}}
  tuning:
    controllers: [pd]
    optimiser: hill-climbing
    candidates: 4
    iterations: 2
    horizon: 0.5
    objective: {rmse: 1.0, jerk: 1.0e-6}
    loops: {still: {plant: {model: hinge}}}
    scenarios: [{loop: still, reference: {kind: approach, angle_deg: 8}}]
"""


def shown(kind: str) -> str:
    """The diff in CONTRIBUTING's section about newcomers of a kind."""
    (diff,) = re.findall(rf"^### An? {kind}\n.*?```diff\n(.*?)```", PAGE, re.MULTILINE | re.DOTALL)
    return str(diff)


def apply(diff: str, folder: Path) -> list[Path]:
    """Put a diff into a copy; a new file is all `+`, other lines stand beside, or in place of, ones that are there."""
    touched = []
    for part in re.split(r"^\+\+\+ ", diff, flags=re.MULTILINE)[1:]:
        name, _, body = part.partition("\n")
        file, lines = folder / name, body.splitlines()
        content, at = (file.read_text(), 0) if file.exists() else ("", 0)
        assert bool(content) != all(line.startswith("+") for line in lines), name
        for mark, line in ((line[:1], line[1:] + "\n") for line in lines):
            if mark != "+":
                assert content.count(line) == 1, f"{name} has no {line!r}"
                at = content.index(line) + (len(line) if mark == " " else 0)
                content = content.replace(line, "") if mark == "-" else content
            else:
                content, at = content[:at] + line + content[at:], at + len(line)
        file.parent.mkdir(exist_ok=True)
        file.write_text(content)
        touched.append(file)
    return touched


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package and all newcomers in it."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "wristctl", folder / "wristctl", ignore=shutil.ignore_patterns("__pycache__"))
    touched = [file for kind in KINDS for file in apply(shown(kind), folder)]
    shutil.copy(ROOT / "pyproject.toml", folder)
    for check in (["check"], ["format", "--check"]):
        ruff = [sys.executable, "-m", "ruff", *check, *map(str, touched)]
        done = subprocess.run(ruff, cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout
    return folder


def python(copy: Path, *arguments: str) -> str:
    """What Python prints in the copy."""
    own = os.environ | {"PYTHONPATH": str(copy), "COLUMNS": "200"}
    done = subprocess.run([sys.executable, *arguments], cwd=copy, env=own, capture_output=True, text=True)
    assert done.returncode == 0 and "Warning" not in done.stderr, done.stderr
    return done.stdout


def run(copy: Path, *arguments: str) -> tuple[Run, str]:
    """The run that `wristctl ...` of the copy leaves, and what it printed."""
    (copy / "study.yaml").write_text(STUDY)
    said = python(copy, "-m", "wristctl", *arguments)
    return Run(copy / said.splitlines()[-1]), said


@pytest.mark.slow
def test_the_newcomers_shown_are_tuned_compared_and_told_of(copy: Path) -> None:
    compared, said = run(copy, "compare", "study.yaml", "--all")
    table = compared.data("comparison").set_index(["loop", "gains"])
    assert set(table["controller"]) == {"pd"} and set(table["reference"]) == {"approach 0.1 s 10 deg"}
    tuned, default = (table.xs(gains, level="gains") for gains in ("tuned", "default"))
    assert (tuned["rmse"] < 0.5 * default["rmse"]).all() and "jerk [rad/s^3]" in said
    assert default["jerk"]["shaken"] > 1.5 * default["jerk"]["still"] > 0.0


JERK = """
from types import SimpleNamespace
import numpy as np
from wristctl.simulation.jerk import JERK
time = np.linspace(0.0, 1.0, 11)
for planes, rate in ((1, 5.0 * time**2), (2, np.outer(time**2, [3.0, 4.0]))):
    print(JERK.of_trajectory(SimpleNamespace(time=time, rate=rate, planes=planes)))
"""


@pytest.mark.slow
def test_the_metric_shown_is_the_same_in_every_plane(copy: Path) -> None:
    """Rates of 5 t^2 along an axis, and along an oblique one: 10 rad/s^3."""
    assert [float(line) for line in python(copy, "-c", JERK).splitlines()] == pytest.approx([10.0, 10.0])


@pytest.mark.slow
def test_the_rig_shown_is_what_its_facts_say_and_homes_and_follows_a_trial(copy: Path) -> None:
    told = json.loads(python(copy, "-m", "wristctl", "check-rig", "actuators", "--json"))
    passed = {check["asked"]: check["passed"] for check in told["checks"]}
    assert told["fit"] and all(passed[asked] for asked in ("sense", "scale", "delay", "stop", "Ctrl-C", "trial"))


LOGS = """
import sys
from pathlib import Path
import wristctl
from wristctl.commands.identify.logs import logs_of, read_logs
from wristctl.records.open_log import write_log
for number, file in enumerate(sys.argv[1:]):
    study = wristctl.load_study(None, f"identify.logs=['{file}']")
    (log,) = logs_of(study)
    write_log(log, Path(f"read_{number}.csv"))
    print(read_logs([log], study).samples, *log.remarks, sep="; ")
"""


@pytest.mark.slow
def test_the_log_format_shown_is_known_by_how_it_begins_and_read_for_identification(copy: Path) -> None:
    heads, *rows = csv.reader((ROOT / "experiments" / "logs" / "clean.csv").read_text().splitlines())
    labels = [head.replace(" ", "") for head in heads]
    lines = [" ".join(f"{label}:{cell}" for label, cell in zip(labels, row, strict=True)) for row in rows]
    lines[5:5] = ["Homing done", "bend_y[deg]:3.1"]
    (copy / "monitor.txt").write_text("\n".join(lines))
    shutil.copy(ROOT / "experiments" / "logs" / "clean.csv", copy)
    clean, plotter = python(copy, "-c", LOGS, "clean.csv", "monitor.txt").splitlines()
    assert (copy / "read_0.csv").read_text() == (copy / "read_1.csv").read_text()
    assert plotter == f"{clean}; monitor.txt: 2 lines are passed over."


@pytest.mark.slow
def test_the_command_shown_leaves_a_run(copy: Path) -> None:
    reached, said = run(copy, "reach", "--step-deg", "1")
    tips = reached.data("tips")
    theta = tips["theta"].to_numpy()
    np.testing.assert_allclose(np.arctan2(tips["y"], tips["x"]), theta / 2.0, atol=1e-12)  # a chord's direction
    assert len(tips) == 101 and "width [mm]" in said and reached.problems() == []
