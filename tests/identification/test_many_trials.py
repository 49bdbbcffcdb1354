"""At how many instants the trials of open logs are fitted, and that other trials change nothing of what one tells."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.identification.test_log_model import OFFSET, WRIST, planar
from wristctl.identification.arc_fit import fit_arcs
from wristctl.identification.log_model import everything_fitted, recordings_of_logs, robot_of_logs
from wristctl.records.open_log import OpenLog


def stepped(trials: int) -> OpenLog:
    """A wrist in one plane that steps of several sizes in 0.4 s move, at 100 Hz, followed at every 2 ms."""
    parts, rng = [], np.random.default_rng(0)
    robot = robot_of_logs([planar()], WRIST, 0.01)
    truth = {"gain": 1.0, "tendon": 7.0, "delay": 0.01, "damping": 0.1, "inertia": 1.7e-3}
    time = np.arange(0.0, 5.0, 0.002)
    for trial in range(trials):
        held = 0.3 * np.sin(np.floor(2.0 * time + 0.3 * trial) * (1.1 + 0.1 * (trial % 4)))
        wanted = np.convolve(np.r_[np.zeros(200), held], np.hanning(200) / np.hanning(200).sum(), "valid")[: len(time)]
        spools = np.stack([OFFSET * wanted, -OFFSET * wanted], axis=1) + 2e-3
        fine = recordings_of_logs([planar()], robot)[0]
        nothing, pause = np.zeros(len(time), bool), np.r_[math.nan, np.full(len(time) - 1, 0.002)]
        fine = replace(fine, time=time, spools=spools, pause=pause, fitted=nothing, asked=nothing)
        values = {name: np.array([value]) for name, value in truth.items()}
        bends = robot.expected(values, np.zeros((1, 2)), np.zeros((1, 2)), fine)[0][0, ::5, 0]
        parts.append({"time": time[::5], "spool_1": spools[::5, 0], "spool_2": spools[::5, 1],
                      "bend_y": bends + 3e-4 * rng.normal(size=len(bends))})  # fmt: skip
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return OpenLog(Path("steps.csv"), "log", whole, {"trial": np.repeat([f"t{k}" for k in range(trials)], 500)})


@pytest.mark.parametrize(("trials", "logs"), [(4, 1), (4, 3), (12, 1), (30, 2)])
def test_other_trials_do_not_make_the_instants_of_one_fewer_than_one_in_25_ms(trials: int, logs: int) -> None:
    read = [planar(trials=trials)] * logs
    recordings = recordings_of_logs(read, robot_of_logs(read, WRIST, 0.01))
    assert len(recordings) == trials * logs
    assert all(np.diff(one.time).max() < 0.0305 for one in recordings)


@pytest.mark.slow
@pytest.mark.parametrize(("trials", "logs"), [(4, 3), (12, 1)])
def test_more_trials_tell_the_same_delay_and_inertia_closer(trials: int, logs: int) -> None:
    fits = []
    for some in ([stepped(4)], [stepped(trials)] * logs):
        robot = robot_of_logs(some, WRIST, 0.01)
        fits.append(fit_arcs(robot, (), everything_fitted(recordings_of_logs(some, robot))))
    for name in ("gain", "delay", "inertia"):
        few, more = (fit.told[name] for fit in fits)
        assert few.low < more.value < few.high
        assert more.high - more.low < 1.05 * (few.high - few.low)
