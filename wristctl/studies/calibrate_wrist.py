"""Zero, senses of turning and steps per radian of a wrist, by small guarded moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.study import Study
from wristctl.report.printed_table import Table
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.procedure import Procedure
from wristctl.studies.rig_description import describe_rig
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.trial.calibration import WristCalibration

_COLUMNS = ("axis", "tendon", "sense", "steps per rad", "by the model", "slack [mm]", "friction [mm]")


@dataclass(frozen=True, repr=False, eq=False)
class WristCalibrated(StudyResult):
    """Where each tendon is just taut on the straight wrist, and which way its motor turns."""

    kind = "calibrate-wrist"

    calibration: WristCalibration

    def frame(self) -> pd.DataFrame:
        """One row per tendon."""
        import pandas as pd

        return pd.DataFrame(self.tables[0].rows, columns=_COLUMNS)


def plan(study: Study, inputs: Inputs) -> str:
    """What would be done; opens nothing."""
    settings = study.calibrate_wrist
    slack = 1e3 * settings.homing.slack
    return f"{describe_rig(settings)}\neach motor reels in by at most {slack:g} mm until its tendon bends the wrist"


def calibrate_wrist(session: Session) -> WristCalibrated:
    """Find where each tendon is just taut on the straight wrist, which way its motor turns, and steps per radian.

    The wrist stands straight, its tendons slack, both markers in the camera's picture. Later runs reuse what is
    durable: senses of turning and the marker's zero; positions only until the board restarts.
    """
    session.operator.tell(describe_rig(session.study.calibrate_wrist))
    import numpy as np

    from wristctl.trial.calibration import FILE, calibrated
    from wristctl.trial.expected_moves import ExpectedMoves
    from wristctl.trial.testbeds import open_testbed
    from wristctl.vision.view import View
    from wristctl.wrist.directions import ACTIVE

    findings, study = session.findings, session.study
    settings = study.calibrate_wrist
    view = View.of(session.inputs.runs().get("optics"))
    with session.progress("opening board and camera"):
        testbed = open_testbed(settings, study.wrist, study.seed, view, session.operator.confirm)
    with session.progress("homing"):
        found = calibrated(testbed, settings, study.wrist)
    findings.plain(FILE, found.plain())
    zero = found.zero
    findings.metric("marker", zero.marker, "rad", meaning="angle between the markers on the straight wrist")
    by_model = ExpectedMoves(settings, study.wrist, settings.plane).steps()
    rows = []
    for axis, tendon in enumerate(ACTIVE):
        slope, slack, near = zero.steps_per_radian[axis], zero.slack[axis], f"tendon {tendon}, near the straight wrist"
        findings.metric(f"steps_per_radian_{tendon}", slope, "1/rad", meaning=near)
        findings.metric(f"slack_{tendon}", slack, "m", meaning=f"tendon {tendon}, when homing began")
        rows.append((axis, tendon, f"{zero.signs[axis]:+d}", slope, by_model, 1e3 * slack, 1e3 * zero.friction[axis]))
    findings.summary(f"Marker angle of the straight wrist: {np.degrees(zero.marker):.3f} deg")
    return WristCalibrated(study, findings, [Table("Zero", _COLUMNS, rows)], found)


CALIBRATE_WRIST = Procedure(
    "calibrate-wrist", plan, calibrate_wrist, (EarlierRun("optics", kind="calibrate-camera", optional=True),)
)
