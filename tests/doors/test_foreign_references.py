"""A reference from a file is told apart from our own bugs: what is wrong with it, where, before anything runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.doors.conftest import wristctl
from wristctl.records import Run

OWN = """
import numpy as np
from wristctl.simulation.reference import ReferenceKind

def course(reference, time):
    return COURSE

def deeper():
    return 1 / 0

OWN = ReferenceKind("own", course=course, described=lambda reference: "own")
"""
SOUND = "np.array([time > 0.5, 0.0 * time, 0.0 * time])"


@pytest.mark.parametrize(
    ("course", "told"),
    [
        ("1 / 0", "the course failed at {folder}/own.py:6: ZeroDivisionError: division by zero"),
        ("deeper()", "the course failed at {folder}/own.py:9: ZeroDivisionError: division by zero"),
        ("exit(0)", "the course failed at"),
        ("np.stack([time, time])", "is an array of (2, 10), not of (3, 10)"),
        ("np.array([time, 1.0 / time, 0.0 * time])", "is no number at 0 s"),
        ("np.array([time, 0.0 * time, np.where(time > 0.35, np.nan, 0.0)])", "is no number at 0.4 s"),
    ],
)
@pytest.mark.slow
def test_a_course_that_is_none_is_refused_before_anything_runs(tmp_path: Path, course: str, told: str) -> None:
    (tmp_path / "own.py").write_text(OWN.replace("COURSE", course))
    done = wristctl(tmp_path, "simulate", "--dry-run", "--set", "simulate.reference.kind=own.py:OWN")
    assert done.returncode == 2 and told.format(folder=tmp_path) in done.stderr, done.stderr
    assert "simulate.reference.kind" in done.stderr and "bug in wristctl" not in done.stderr


@pytest.mark.slow
def test_what_shows_only_later_ends_the_run_and_is_named(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN.replace("COURSE", SOUND.replace("0.0 * time]", "np.sqrt(1.5 - time)]")))
    given = ("--set", "simulate.reference.kind=own.py:OWN", "--set", "simulate.horizon=2")
    assert wristctl(tmp_path, "simulate", "--dry-run", *given).returncode == 0
    done = wristctl(tmp_path, "simulate", *given)
    assert done.returncode == 2 and "own.py:OWN is no number at 1.501 s" in done.stderr, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("growing", ["time", "-np.exp(30.0 * time)"])
def test_a_course_beyond_the_range_of_the_wrist_is_refused_and_no_bug(tmp_path: Path, growing: str) -> None:
    (tmp_path / "own.py").write_text(OWN.replace("COURSE", f"np.array([9.0 * {growing}, 0.0 * time, 0.0 * time])"))
    done = wristctl(tmp_path, "simulate", "--set", "simulate.reference.kind=own.py:OWN", "--set", "simulate.horizon=1")
    assert done.returncode == 2 and "beyond the wrist's range of 50 deg" in done.stderr, done.stderr


@pytest.mark.slow
def test_a_sound_one_runs(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN.replace("COURSE", SOUND))
    given = ("--set", "simulate.reference.kind=own.py:OWN", "--set", "simulate.horizon=1")
    assert wristctl(tmp_path, "simulate", "--dry-run", *given).returncode == 0


ASLANT = """
import numpy as np
from wristctl.config.section import Parameter
from wristctl.simulation.reference import ReferenceKind

def course(reference, time):
    phase = 2.0 * np.pi * np.maximum(time, 0.0)
    size = np.deg2rad(reference.end_deg)
    swing = size * np.stack([0.5 - 0.5 * np.cos(phase), np.pi * np.sin(phase), 2.0 * np.pi**2 * np.cos(phase)])
    return np.stack([swing, -reference.value("lean") * swing])

ASLANT = ReferenceKind(
    "a line aslant", course=course, described=lambda reference: "aslant", targets="none", planes=2,
    parameters={"lean": Parameter(0.5, "", "of flexion to ulnar")},
)
"""
TRIAL = (
    "--set", "hw-run.reference={kind: aslant.py:ASLANT, angle_deg: 8}", "--set", "hw-run.horizon=1.2",
    "--set", "hw-run.push={force: 0}", "--set", "hw-run.back=0.4", "--set", "hw-run.push_toward_deg=90",
    "--set", "hw-run.homing={frames: 1, rest: 0.1, move: 1.0e-4, slack: 4.0e-4, let_go: 0.6}",
    "--set", "hw-run.bench={motors: {slack: [0, 0, 0, 0]}, person: {takes: 0}}",
)  # fmt: skip


@pytest.mark.slow
def test_one_that_bends_in_two_planes_is_followed_in_two_planes(tmp_path: Path) -> None:
    """By a simulated loop and by a rig, which nobody has told its planes."""
    (tmp_path / "aslant.py").write_text(ASLANT)
    simulated = ("--set", "simulate.reference={kind: aslant.py:ASLANT, lean: 0.4}", "--set", "simulate.horizon=1")
    done = wristctl(tmp_path, "simulate", *simulated)
    assert done.returncode == 0 and "in two planes" in done.stdout, done.stdout + done.stderr
    planned = wristctl(tmp_path, "hw-run", *TRIAL, "--dry-run")
    assert planned.returncode == 0 and "1 trials" in planned.stdout, planned.stdout + planned.stderr
    done = wristctl(tmp_path, "hw-run", *TRIAL)
    assert done.returncode == 0, done.stdout + done.stderr
    shown = wristctl(tmp_path, "runs", "show", "latest:hw-run")
    assert shown.returncode == 0 and "nobody has said that it may run" not in shown.stderr
    (run,) = (tmp_path / "results").glob("*hw-run*")
    assert "planes: 2 " in (run / "config.yaml").read_text()
    log = Run(run).data("log")
    bends = log[["bend_ref_ulnar", "bend_ref_flexion"]].to_numpy()
    assert np.rad2deg(bends.max(axis=0)) == pytest.approx([8.0, 0.0], abs=0.01)
    assert np.rad2deg(bends.min(axis=0)) == pytest.approx([0.0, -4.0], abs=0.01)


@pytest.mark.slow
def test_a_rig_that_is_said_to_bend_in_one_plane_refuses_one_that_bends_in_two(tmp_path: Path) -> None:
    (tmp_path / "aslant.py").write_text(ASLANT)
    (tmp_path / "mine.yaml").write_text("hw-run:\n  reference: {kind: aslant.py:ASLANT}\n  planes: 1\n")
    done = wristctl(tmp_path, "hw-run", "mine.yaml", "--dry-run")
    assert done.returncode == 2 and "aslant.py:ASLANT bends in two planes, and the rig in one" in done.stderr
    assert "mine.yaml:3: hw-run.planes" in done.stderr and "planes: 2" in done.stderr
