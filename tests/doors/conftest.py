"""A stranger's files, and wristctl as a stranger calls it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

LAW = """
from helper import scaled
from wristctl.control.law import Controller, Gain
from wristctl.control.model import one_segment

def law(now, wrist, gains, memory):
    _, load = one_segment(wrist, now.theta_ref, 0.0 * now.theta_ref)
    return load - scaled(gains.Kp, now.theta - now.theta_ref) - gains.Kd * (now.rate - now.rate_ref)

GAINS = {"Kp": Gain("N m/rad", "spring", 1e-2, 1e2), "Kd": Gain("N m s/rad", "damper", 1e-3, 1e1)}
PRESETS = {"default": {"Kp": 4.0, "Kd": 0.2}, "rig": {"Kp": 0.3, "Kd": 0.02}}
STRANGE = Controller("strange", law, "a stranger", GAINS, PRESETS)
"""
HELPER = """
from wristctl.lanes.compiled import compiled

@compiled
def scaled(k, e):
    return k * e
"""


@pytest.fixture(autouse=True)
def _distrusted() -> Iterator[None]:
    """What a test agrees to is gone after it."""
    before = os.environ.pop("WRISTCTL_TRUSTED_CODE", None)
    yield
    os.environ.pop("WRISTCTL_TRUSTED_CODE", None)
    if before is not None:
        os.environ["WRISTCTL_TRUSTED_CODE"] = before


@contextmanager
def elsewhere(folder: Path) -> Iterator[None]:
    """Within the block runs are made by somebody else: nothing is noted as this user's own, or agreed to."""
    with pytest.MonkeyPatch.context() as their:
        their.setenv("XDG_STATE_HOME", str(folder / "state of another"))
        their.setenv("WRISTCTL_TRUSTED_CODE", "")
        yield


@pytest.fixture
def stranger(tmp_path: Path) -> Path:
    """A folder with a law and the module beside it that it imports."""
    (tmp_path / "strange.py").write_text(LAW)
    (tmp_path / "helper.py").write_text(HELPER)
    return tmp_path


def wristctl(folder: Path, *arguments: str, path: str = "") -> subprocess.CompletedProcess[str]:
    """`wristctl ...` in a folder, off a terminal."""
    own = {name: value for name, value in os.environ.items() if name != "WRISTCTL_TRUSTED_CODE"}
    own |= {"PYTHONPATH": os.pathsep.join(filter(None, (str(ROOT), path))), "COLUMNS": "200"}
    command = [sys.executable, "-P", "-m", "wristctl", *arguments]
    return subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True, stdin=subprocess.DEVNULL)
