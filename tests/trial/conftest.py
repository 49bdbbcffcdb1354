"""A short experiment on the emulated bench in virtual time, at zero from the start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

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

WRIST = WristParameters()
SHORT: dict[str, Any] = {
    "directions": ("ulnar",),
    "rows": ({"controller": "smc-tracking", "gains": "hardware"},),
    "reference": {"duration": 0.3, "angle_deg": 8.0},
    "horizon": 0.4,
    "back": 0.2,
    "rest": 0.1,
    "push": {"force": 0.0},
    "calibration": "given",
    "positions": "stored",
    "homing": {"frames": 1, "rest": 0.1, "let_go": 1.0},
    "bench": {"motors": {"slack": (0.0, 0.0, 0.0, 0.0)}, "person": {"takes": 0.5}},
}


@dataclass
class Done:
    """An experiment and what it left."""

    experiment: Experiment
    bench: VirtualBench
    folder: Path
    error: BaseException | None

    def table(self, name: str) -> pd.DataFrame:
        return pd.read_csv(self.folder / f"{name}.csv")


Run = Callable[..., Done]


def settings_of(**changes: Any) -> HwRunSettings:
    """The short experiment, changed."""
    return HwRunSettings.model_validate({**SHORT, **changes})


@pytest.fixture(scope="session")
def at_zero() -> WristCalibration:
    """A calibration that holds for the bench at power-on without slack."""
    bench = VirtualBench(settings_of().bench, WRIST, 0)
    nonce = Board(bench.transport).connect().boot_nonce
    zero = Zero((1, 1, 1, 1), (960.0,) * 4, (0.0,), (0.0,) * 4)
    return WristCalibration(zero, "ulnar", nonce, (0, 0, 0, 0))


@pytest.fixture
def experiment(tmp_path: Path, at_zero: WristCalibration) -> Run:
    """Performs the short experiment, changed, and keeps what stopped it."""

    def run(
        shown: Callable[[dict[str, Any]], None] | None = None, seed: int = 0,
        wrist: WristParameters = WRIST, **changes: Any,
    ) -> Done:  # fmt: skip
        settings = settings_of(**changes)
        bench = VirtualBench(settings.bench, wrist, seed, settings.markers)
        log = log_of(tmp_path, settings, wrist)
        performed = Experiment(settings, wrist, trials_of(settings, np.random.default_rng(0)), log)
        stand = BoardStand(EmulatedTestbed(bench, settings, [View()], None), at_zero, seed)
        error = None
        try:
            performed.run(stand, shown)
        except BaseException as raised:
            error = raised
        log.close()
        return Done(performed, bench, tmp_path, error)

    return run
