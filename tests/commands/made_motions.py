"""Runs that were written by hand, with motions whose every sample is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from wristctl.records import Run, start_run
from wristctl.study_files.load import load_study
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.recordings import COLUMNS, RawVideo

# Ticks of a trial, and the time between two [s].
TICKS, TICK = 20, 0.01
# Begin of each of two trials on the run's clock [s].
BEGINS = (10.0, 20.0)


def rig_run(folder: Path, film: bool = False) -> Run:
    """Two trials, ulnar and flexion: counts of four spools at 10 ms, pictures every 25 ms from 4 ms on."""
    time = np.tile(TICK * np.arange(TICKS), 2)
    trial = np.repeat([0, 1], TICKS)
    ticks = {"trial": trial, "time": time, "clock": time + np.array(BEGINS)[trial], "counted": time + 1e-5}
    for tendon in (1, 2, 4, 5):
        ticks[f"position_{tendon}"] = 10.0 * tendon + np.arange(2.0 * TICKS)
        ticks[f"target_{tendon}"] = 10.0 * tendon + np.arange(2.0 * TICKS) + 0.5
    ticks["theta_ref"] = 0.2 * time
    captured = 0.004 + 0.025 * np.arange(8)
    frames = {
        "trial": np.repeat([0, 1], 8),
        "captured": np.tile(captured, 2),
        "theta": 0.1 * np.arange(1.0, 17.0),
        "tip_x": np.full(16, 0.08),
        "tip_y": 0.01 * np.arange(16.0),
        "verdict": np.array(["ok"] * 15 + ["blurred"]),
    }
    kinds = {"trial": np.array([0, 1]), "direction": np.array(["ulnar", "flexion"]), "push": np.array([0.0, 2.0])}
    with start_run("hw-run", load_study(), "", folder) as live:
        live.table("data/log.csv", ticks, {"theta_ref": "rad"}, {"theta_ref": "reference that the controller follows"})
        live.table("data/frames.csv", frames)
        live.table("data/trials.csv", kinds)
        if film:
            video = RawVideo(live.file("data/raw.avi"), 40.0)
            for number, begin in enumerate(BEGINS):
                for second in (captured - 0.025).tolist():
                    picture = np.full((48, 64), 40 + 160 * number, np.uint8)
                    sighting = Sighting(0.0, 0, np.nan, SightingVerdict.NO_TIP, np.full((2, 4, 2), np.nan))
                    video.add(Frame(picture, begin + second, 0), sighting)
            video.close()
            live.columns("data/raw.csv", COLUMNS)
    return Run(live.path)


def simulated(folder: Path) -> Run:
    """A motion in one plane behind motors, 40 samples at 5 ms, from a draw."""
    rng, time = np.random.default_rng(3), 0.005 * np.arange(40)
    names = ("theta", "theta_ref", "tip_x", "tip_y", "tension_plus", "tension_minus", "spool_plus", "spool_minus")
    columns = {"time": time} | {name: rng.normal(size=40) for name in (*names, "acting_plus", "acting_minus")}
    with start_run("simulate", load_study([], ["simulate.loop.actuator.level=tendon"]), "", folder) as live:
        live.table("data/trajectory.csv", columns)
    return Run(live.path)


def compared(folder: Path) -> Run:
    """Two rows of a comparison in two planes on three tendons."""
    rng, shape = np.random.default_rng(4), (2, 12)
    names = ("bend_ulnar", "bend_flexion", "tip_x", "tip_y", "tip_z", "pull_1", "pull_2", "pull_3", "bend_ref_ulnar")
    arrays = {name: rng.normal(size=shape) for name in names} | {"time": np.tile(0.01 * np.arange(12), (2, 1))}
    rows = {name: np.array(["a", "b"]) for name in ("loop", "reference", "controller", "gains")}
    with start_run("compare", load_study(), "", folder) as live:
        live.arrays("data/trajectories.npz", arrays)
        live.table("data/comparison.csv", rows)
    return Run(live.path)
