"""Tables of hw-run: beside the paper's experiment and a simulation of the same trials, and trial by trial."""

from __future__ import annotations

from typing import Any

import pandas as pd

from wristctl.benchmark.paper import EXPERIMENT
from wristctl.cli.command import Session, Table


def tables(session: Session, trials: pd.DataFrame) -> list[Table]:
    """What is printed at the end."""
    columns = ("trial", "direction", "push", "controller", "rmse", "settling", "steady_state", "true_rmse", "true_settling", "true_steady_state", "recovery", "true_recovery", "push_torque", "peak_tension", "outcome")
    return [Table("Trials", columns, trials[list(columns)].to_numpy().tolist())]
