"""The commands that are killed, refused and interrupted, each as short as it can be, and the runs that they need."""

from __future__ import annotations

import importlib
import json
import math
import os
import re
import sys
from collections.abc import Collection
from pathlib import Path

import cv2
import numpy as np

from tests.identification.benches import LEVEL, UPRIGHT, write_run
from wristctl.config.camera import SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.records import Run, list_runs
from wristctl.vision.scene import Scene

FAST = ("--set", "loops={fast: {plant_segments: 1}}")
MOVE = "{kind: minimum-jerk, duration: 0.1, angle_deg: 20}"
CLAIM = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
LOOPS = (
    "--of", "hysteresis", "--set", "hysteresis.ranges_deg=[[0, 5]]", "--set", "hysteresis.frequencies=[5]",
    "--set", "hysteresis.angles_deg=[]", "--set", "hysteresis.sheaths=[1]",
)  # fmt: skip
SCENARIO = f"scenarios=[{{loop: fast, reference: {MOVE}}}]"
KINDS: dict[str, tuple[str, ...]] = {
    "gen-data": ("gen-data", "--samples", "50"),
    "train": ("train", "--data", "DATA", "--epochs", "2", "--set", "hidden=[4]"),
    "tune": ("tune", *FAST, "--candidates", "4", "--iterations", "2", "--set", SCENARIO),
    "compare": (
        "compare", *FAST, "--horizon", "0.1", "--set", "inverses=[none]", "--set", f"references=[{MOVE}]",
        "--set", "controllers=[{controller: smc, gains: initial}]",
    ),
    "simulate": ("simulate", "--set", "horizon=0.1"),
    "analyse": ("analyse", "--controller", "pid", "--set", "gains={Kp: 10.0, Ki: 20.0, Kd: 0.5}"),
    "analyse --of hysteresis": ("analyse", *LOOPS),
    "audit": ("audit", "--set", f"claims=[{CLAIM}]", "--set", "horizon=0.1"),
    "identify": ("identify", "UPRIGHT", "LEVEL", "--set", "fix.friction=0.1"),
    "track": ("track", "pictures", "--set", "frame_rate=60.0"),
    "calibrate-camera": ("hw", "calibrate", "camera", "--views", "8"),
    "hw-run": (
        "hw-run", "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=0.2", "--set", "back=0.1",
        "--set", "reference={duration: 0.1, angle_deg: 1.0}",
        "--set", "controllers=[{controller: smc-tracking, gains: hardware}]",
        "--set", "homing={move: 1.0e-4, rest: 0.06, frames: 2, slack: 5.0e-4, let_go: 1.0}",
    ),
}  # fmt: skip
"""A run of each kind."""
VERBS: dict[str, tuple[str, ...]] = {
    "tag": ("runs", "tag", "DATA", "new"),
    "rm": ("runs", "rm", "DATA", "--yes"),
    "gc": ("runs", "gc", "--yes"),
    "ls": ("runs", "ls"),
    "show": ("runs", "show", "DATA"),
    "lineage": ("runs", "lineage", "DATA"),
    "diff": ("runs", "diff", "DATA", "UPRIGHT"),
    "verify": ("runs", "verify"),
    "report": ("runs", "report", "DATA", "--to", "results/page.html"),
}
"""What one does with runs."""
COMMANDS = KINDS | VERBS
LOST = "20200101T000000Z-tune-1"
"""A run that is gone, and has a tag still."""


def prepare(work: Path, read: Collection[str]) -> None:
    """The runs and pictures that commands with these words read."""
    run(work, (*COMMANDS["gen-data"], "--label", "base"))
    for pose in (UPRIGHT, LEVEL) if "UPRIGHT" in read else ():
        write_run(work / "results", 0, pose, sides=("ulnar", "extension"))
    scene, drawn = Scene(SceneSettings(), WristParameters()), np.random.default_rng(0)
    (work / "pictures").mkdir()
    for k in range(4 if "pictures" in read else 0):
        cv2.imwrite(str(work / f"pictures/{k}.png"), scene.render(np.full((1, 4), math.radians(k) / 4), drawn))
    tags = {each.id: ["paper"] for each in runs(work)} | {LOST: ["another"]}
    (work / "results/tags.json").write_text(json.dumps(tags))


def leave(work: Path) -> None:
    """What killed processes leave, for `runs gc` to clear away."""
    for each in (f".{LOST}.removed/x", "20200101T000000Z-tune-2/config.yaml", ".index-1"):
        (work / "results" / each).parent.mkdir(exist_ok=True)
        (work / "results" / each).write_text("left")


def run(work: Path, arguments: tuple[str, ...]) -> int:
    """Exit code of a command in this process, with `work` for its folder, `out` and `err` there for its streams."""
    here, streams = os.getcwd(), (os.dup(1), os.dup(2))
    os.chdir(work)
    for number, file in ((1, "out"), (2, "err")):
        opened = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(opened, number)
        os.close(opened)
    sys.argv = ["wristctl", *named(work, arguments)]
    code = 99
    try:
        importlib.import_module("wristctl.cli.app").main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os.chdir(here)
        for number, stream in zip((1, 2), streams, strict=True):
            os.dup2(stream, number)
            os.close(stream)
    return code


def named(work: Path, arguments: tuple[str, ...]) -> list[str]:
    """The arguments with the ids of the runs that they name."""
    there = [each.id for each in runs(work)]
    poses = [each for each in there if "-hw-run-" in each]
    ids = {"DATA": next((each for each in there if "-gen-data-base-" in each), "DATA")}
    ids |= {"LARGE": next((each for each in there if "-gen-data-large-" in each), "LARGE")}
    ids |= dict(zip(("UPRIGHT", "LEVEL"), poses, strict=False))
    return [ids.get(each, each) for each in arguments]


def runs(work: Path) -> list[Run]:
    """The runs of a folder, what is no run left out."""
    return [each for each in list_runs(work / "results") if re.match(r"\d{8}T", each.id)]


def warm() -> None:
    """Import what the commands import, so that a forked process begins at once."""
    from wristctl.cli.app import typer_of
    from wristctl.cli.commands import COMMANDS as ALL

    cv2.setNumThreads(1)
    for entry in ALL.values():
        typer_of(entry)
