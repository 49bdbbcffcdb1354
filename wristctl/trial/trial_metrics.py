"""What a log shows of each trial: by its angle or by both bends, and by the truth where it is known."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.simulation.motion import Motion
from wristctl.trial.bend_results import bends_evaluated
from wristctl.trial.trials import Trial, evaluated


def metrics_of_trials(
    folder: Path, trials: Sequence[Trial], motions: Mapping[str, Motion], settings: HwRunSettings,
    wrist: WristParameters,
) -> list[dict[str, float]]:  # fmt: skip
    """Metrics of each of these trials by the log in a folder, as `evaluated` and `bends_evaluated` give them."""
    courses, file = pd.read_csv(folder / "log.csv"), folder / "truth.csv"
    truths = pd.read_csv(file) if file.is_file() else None
    found = []
    for trial in trials:
        course, followed = courses[courses["trial"] == trial.number], motions[trial.direction]
        truth = None if truths is None else truths[truths["trial"] == trial.number]
        if followed.planes == 2:
            found.append(bends_evaluated(trial, course, followed, settings.push, wrist, truth))
        else:
            found.append(evaluated(trial, course, followed, settings.push, settings.control_period, truth))
    return found
