"""A short experiment on the emulated bench in two planes, at zero from the start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.trial.conftest import WRIST, Done
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.homing import Zero
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.trials import trials_of
from wristctl.vision.view import View

CIRCLING: dict[str, Any] = {
    "planes": 2,
    "rows": ({"controller": "ct-dob", "gains": "hardware"},),
    "reference": {"kind": "circumduction", "angle_deg": 12.0, "turn": 1.2},
    "horizon": 1.4,
    "back": 0.4,
    "rest": 0.1,
    "push": {"force": 0.0},
    "calibration": "given",
    "positions": "stored",
    "homing": {"frames": 1, "rest": 0.1, "let_go": 0.5},
    "bench": {"motors": {"slack": (0.0, 0.0, 0.0, 0.0)}, "person": {"takes": 0.1}},
}


def circling(**changes: Any) -> HwRunSettings:
    """The short experiment, changed."""
    return HwRunSettings.model_validate({**CIRCLING, **changes})


def bench_of(settings: HwRunSettings, seed: int = 0, wrist: WristParameters = WRIST) -> VirtualBench:
    """The bench of these settings."""
    return VirtualBench(settings.bench, wrist, seed, settings.markers, settings.markers_2)


AT_ZERO = Zero((1, 1, 1, 1), (1380.0,) * 4, (0.0, 0.0), (0.0,) * 4)
THREE = WristParameters(tendons="three")
THREE_AT_ZERO = Zero((1, 1, 1), (1460.0,) * 3, (0.0, 0.0), (0.0,) * 3)


def performed(
    folder: Path, seed: int = 0, zero: Zero = AT_ZERO, wrist: WristParameters = WRIST, **changes: Any
) -> Done:
    """The short experiment, changed, done on a bench that stands at zero; what stopped it is kept."""
    settings = circling(**changes)
    nonce = Board(bench_of(settings, wrist=wrist).transport).connect().boot_nonce
    at_zero = WristCalibration(zero, "ulnar", nonce, (0, 0, 0, 0))
    bench, log = bench_of(settings, seed, wrist), log_of(folder, settings, wrist)
    experiment, error = Experiment(settings, wrist, trials_of(settings, np.random.default_rng(0)), log), None
    try:
        experiment.run(BoardStand(EmulatedTestbed(bench, settings, [View(), View()], None), at_zero, seed))
    except BaseException as raised:
        error = raised
    log.close()
    return Done(experiment, bench, folder, error)


def true_errors(done: Done, trial: int = 0) -> np.ndarray:
    """True bend less its reference at every tick (T, 2) [deg]."""
    log, truth = (table[table["trial"] == trial] for table in (done.table("log"), done.table("truth")))
    apart = [np.interp(log["time"], truth["time"], truth[f"bend_{p}"]) - log[f"bend_ref_{p}"] for p in PLANES]
    return np.degrees(np.stack(apart, axis=1))


PLANES = ("ulnar", "flexion")


def rmse(errors: np.ndarray) -> np.ndarray:
    """By plane (2,)."""
    values: np.ndarray = np.sqrt(np.mean(errors**2, axis=0))
    return values
