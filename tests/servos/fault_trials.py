"""A trial on emulated servos, homed and returned, with a fault or without; what came of it."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.rig import Tendon
from wristctl.servos.dynamixel import DynamixelRig, Servo, ServoSettings
from wristctl.servos.emulated import Emulated
from wristctl.servos.servo_bench import SETTINGS
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.rig_settings import settings_of, wrist_of
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.trials import trials_of

# Bend of each motion [deg].
_SIZES = {"circumduction": 30.0, "dart-thrower": 20.0}
SURVIVED = ("", "packet-lost")
"""Faults with which a trial is to end well."""


class Came(NamedTuple):
    """What came of a trial; SI units but for the name."""

    fault: str
    servo: int
    tendons: int
    outcome: str
    """ok, or why it ended early."""
    named_within: float
    """From the fault until the rig was stopped [s]; nan of one that was there from the start."""
    largest_pull: float
    """True tension [N]."""
    limit: float
    """Tension that the servos are set to [N]."""
    error_deg: float
    """Largest error of the trial [deg]; nan where it did not begin."""
    slack_error: float
    """By how much homing erred about a tendon's slack [m]; nan where it did not end."""
    lost: int
    """Answers that were lost."""


def settings_with(tendons: int) -> ServoSettings:
    """The bench's settings with so many tendons all around."""
    begin = 0.0 if tendons == 3 else 45.0
    places = [Tendon(begin + 360.0 / tendons * k, 0.020) for k in range(tendons)]
    return replace(SETTINGS, servos=[Servo(number, place) for number, place in enumerate(places, 1)])


def tried(
    fault: str, servo: int = 2, tendons: int = 3, motion: str = "circumduction", bent_deg: float = 8.0,
    angle_deg: float | None = None,
) -> Came:  # fmt: skip
    """Home, follow a motion, of a usual bend or this one, and come back."""
    servos = settings_with(tendons)
    rig = DynamixelRig(servos, Emulated(fault, servo=servo, bent_deg=bent_deg))
    assert rig.rehearsal is not None
    rows = (RigRow(controller="pid-ff", gains="hardware"),)
    reference = Reference(kind=motion, angle_deg=angle_deg or _SIZES[motion])
    given = HwRunSettings(rig="servos", rows=rows, reference=reference, directions=("ulnar",), horizon=4.0)
    settings, wrist = settings_of(rig.facts, given, "servos"), wrist_of(rig.facts, WristParameters(), "servos")
    stops, stop = list[float](), rig.stop

    def noted() -> None:
        stops.append(rig.clock.now())
        stop()

    rig.stop = noted  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as scratch:
        log = log_of(Path(scratch), settings, wrist)
        experiment = Experiment(settings, wrist, trials_of(settings, np.random.default_rng(0)), log)
        try:
            experiment.run(RigStand(GuardedRig(rig, "servos")))
            outcome = experiment.outcomes[0]
        except UserError as error:
            outcome = experiment.outcomes.get(0, f"before it: {error.what}")
        finally:
            log.close()
        error_deg = _largest_error(Path(scratch) / "log.csv")
    began = rig.rehearsal.began
    slack = math.nan if experiment.zero is None else float(np.abs(np.array(experiment.zero.slack) - 4e-4).max())
    return Came(
        fault, servo, tendons, outcome, math.nan if began is None else stops[0] - began, rig.rehearsal.largest_pull,
        servos.tension, error_deg, slack, rig.missed,
    )  # fmt: skip


def _largest_error(file: Path) -> float:
    table: Any = pd.read_csv(file)
    errors = table[[name for name in table.columns if name.startswith("error")]]
    return math.nan if errors.empty else float(np.rad2deg(errors.abs().max().max()))
