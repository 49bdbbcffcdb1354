"""A wrist by logs of its tendons' tensions or currents: the models that are tried, the chosen one, what it predicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import ArcFit
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.driven_log import driven_robot
from wristctl.identification.driven_robot import DrivenRobot
from wristctl.identification.log_model import everything_fitted
from wristctl.identification.model_choice import TriedModel, chosen_of, tried_models, whole_fit
from wristctl.records.open_log import OpenLog

LEAST = 0.1
"""Error of the part that was not fitted over its motion, beyond which nothing is identified."""


@dataclass(frozen=True)
class DrivenFit:
    """The chosen model, fitted to all that was recorded, and the models that it was chosen from."""

    fit: ArcFit
    models: tuple[TriedModel, ...]
    chosen: TriedModel
    recordings: tuple[ArcRecording, ...]
    remarks: tuple[str, ...]
    samples: int

    @property
    def robot(self) -> DrivenRobot:
        """Of the fit."""
        assert isinstance(self.fit.robot, DrivenRobot)
        return self.fit.robot

    @cached_property
    def moved(self) -> float:
        """Motion of what was not fitted: RMS length about its mean [rad]."""
        return motion_of([one.measured[one.asked] for one in self.recordings])

    @property
    def share(self) -> float:
        """Error of what was not fitted over its motion."""
        return self.chosen.score.error / self.moved


def motion_of(parts: Sequence[Array]) -> float:
    """RMS length of bends (T, 2) about their mean [rad]."""
    return float(np.sqrt(np.nanvar(np.concatenate(parts), axis=0).sum()))


def fitted_logs(
    logs: Sequence[OpenLog], wrist: WristParameters, settings: IdentifySettings,
    told: Callable[[float], object] = lambda share: None,
) -> DrivenFit:  # fmt: skip
    """Fit logs, of which a part is predicted by each model that is tried. UserError as `driven_robot`.

    `told` is called with the share of the models' work that is done.
    """
    robot, recordings, remarks = driven_robot(logs, wrist, settings)
    models = list(tried_models(robot, [recordings], False, told=told))
    chosen = chosen_of(models)
    fit = whole_fit(models, everything_fitted(recordings))
    return DrivenFit(fit, tuple(models), chosen, tuple(recordings), tuple(remarks), sum(map(len, logs)))
