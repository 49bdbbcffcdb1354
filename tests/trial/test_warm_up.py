"""Whatever is compiled or loaded is so before the motors are on: a board in motion bears 0.1 s of silence."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

WATCHED = """
import gc, json, os, sys
from numba.core.dispatcher import Dispatcher
from wristctl.board.driver import Board
from wristctl.cli.app import main

enable, close, before = Board.enable, Board.close, []
def loaded():
    gc.unfreeze()  # what is left alone is not listed
    ours = [each for each in gc.get_objects() if isinstance(each, Dispatcher)]
    named = {f"{each.py_func.__module__}.{each.py_func.__qualname__}": len(each.signatures) for each in ours}
    emulated = "wristctl.bench", "wristctl.board.emulator"
    return {each: count for each, count in named.items() if not each.startswith(emulated)}, set(sys.modules)
def on(self):
    before.append(loaded())
    enable(self)
def off(self, emergency=False):
    kernels, modules = loaded()
    late = [name for name, count in kernels.items() if count != before[0][0].get(name, 0)]
    print(json.dumps([sum(kernels.values()), late + [each for each in modules - before[0][1]]]), flush=True)
    os._exit(0)
Board.enable, Board.close = on, off
main()
"""
QUICK = ("bench.person.takes=0", "homing.frames=1", "homing.rest=0.05", "bench.motors.slack=[0, 0, 0, 0]")
TRIAL = (*QUICK, "directions=[ulnar, flexion]", "horizon=0.5", "reference.duration=0.3", "push.force=0")
COMMANDS = {
    "trials": ("hw-run", *TRIAL),
    "trials in two planes": (
        "hw-run", *QUICK, "reference.kind=dart-thrower", "reference.angle_deg=6", "horizon=0.4", "push.force=0",
    ),
    "calibration": ("hw calibrate wrist", *QUICK),
    "calibration in two planes": ("hw calibrate wrist", *QUICK, "planes=2"),
    "one axis": ("hw calibrate wrist --axis 2 --max-deg 2", *QUICK),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.slow
def test_nothing_is_compiled_or_imported_once_the_motors_are_on(name: str, tmp_path: Path) -> None:
    command, *sets = COMMANDS[name]
    given = [sys.executable, "-c", WATCHED, *command.split(), *(part for each in sets for part in ("--set", each))]
    done = subprocess.run(
        given, input="yes\n" * 5, capture_output=True, text=True, timeout=300.0, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert done.returncode == 0 and done.stdout, done.stderr
    kernels, late = json.loads(done.stdout.splitlines()[-1])
    assert not late and (kernels > 5 or not command.startswith("hw-run"))
