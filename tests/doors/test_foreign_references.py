"""A reference from a file is told apart from our own bugs: what is wrong with it, where, before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.doors.conftest import wristctl

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
def test_a_sound_one_runs(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN.replace("COURSE", SOUND))
    given = ("--set", "simulate.reference.kind=own.py:OWN", "--set", "simulate.horizon=1")
    assert wristctl(tmp_path, "simulate", "--dry-run", *given).returncode == 0
