"""Zero, senses of turning and steps per radian of a wrist, by small guarded moves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.rig_description import coming_first, describe_rig
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.plain_files import read_json
from wristctl.records.find import Content

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.trial.calibration import WristCalibration
    from wristctl.trial.testbeds import Testbed

# What a run of one axis alone lacks.
CALIBRATION = Content("data/wrist.json", "calibration of all axes")


def calibration_in(planes: int) -> Content:
    """Calibration of all axes of a rig that bends in so many planes."""

    def fits(file: Path) -> bool:
        try:
            return ("marker_2" in read_json(file)) == (planes == 2)
        except (OSError, ValueError, TypeError):  # which is said where it is read
            return True

    where = "one plane" if planes == 1 else "two planes"
    return CALIBRATION._replace(what=f"{CALIBRATION.what} in {where}", fits=fits)


_OF_AXIS = ("axis", "tendon", "sense", "taken up [mm]", "bend [deg]")
_TOWARD = ("toward [deg]", "its tendon [deg]")
_COLUMNS = ("axis", "tendon", "sense", "steps per rad", "by the model", "slack [mm]", "friction [mm]")


@dataclass(frozen=True, repr=False, eq=False)
class AxisFound(StudyResult):
    """Sense of one motor, and the slack of its tendon."""

    kind = "calibrate-wrist"

    def frame(self) -> pd.DataFrame:
        """One row per tendon."""
        import pandas as pd

        return pd.DataFrame(self.tables[0].rows, columns=list(self.tables[0].columns))


@dataclass(frozen=True, repr=False, eq=False)
class WristCalibrated(AxisFound):
    """Position where each tendon is just taut on the straight wrist, and the sense of its motor."""

    calibration: WristCalibration


def plan(study: Study, inputs: Inputs) -> str:
    """Plan of a calibration. Opens no device."""
    settings = study.calibrate_wrist
    slack = 1e3 * settings.homing.slack
    if settings.axis is not None:
        until = f"until its tendon bends the wrist, by {settings.max_deg:g} deg at most"
        return f"{describe_rig(settings)}\naxis {settings.axis} reels in by at most {slack:g} mm {until}"
    return f"{describe_rig(settings)}\neach motor reels in by at most {slack:g} mm until its tendon bends the wrist"


def calibrate_wrist(session: Session) -> AxisFound:
    """Find where each tendon is just taut on the straight wrist, which way its motor turns, and steps per radian.

    The wrist stands straight, its tendons slack, both markers in the camera's picture. Later runs reuse what is
    durable: senses of turning and the marker's zero; positions only until the board restarts. With --axis one motor is
    tried by itself, up to --max-deg, and nothing is kept for later runs.
    """
    session.operator.tell(describe_rig(session.study.calibrate_wrist))
    import numpy as np

    from wristctl.trial.calibration import calibrated
    from wristctl.trial.expected_moves import ExpectedMoves
    from wristctl.trial.testbeds import open_testbed
    from wristctl.vision.view import View
    from wristctl.wrist.directions import ACTIVE

    findings, study = session.findings, session.study
    settings = study.calibrate_wrist
    runs = session.inputs.runs()
    view, view_2 = View.of(runs.get("optics")), View.of(runs.get("optics_2"))
    with coming_first(session, settings):
        with session.progress("opening board and camera"):
            confirm = session.operator.confirm
            testbed = open_testbed(settings, study.wrist, study.seed, view, confirm, view_2=view_2)
        if settings.axis is not None:
            return _one_axis(session, testbed, settings.axis)
        with session.progress("homing"):
            calibration = calibrated(testbed, settings, study.wrist)
    findings.plain(CALIBRATION.file, calibration.plain())
    zero = calibration.zero
    meanings = "angle between the markers on the straight wrist", "the same before the second camera"
    for name, angle, meaning in zip(("marker", "marker_2"), zero.markers, meanings, strict=False):
        findings.metric(name, angle, "rad", meaning=meaning)
    by_model = ExpectedMoves(settings, study.wrist, settings.plane).steps()
    rows = []
    for axis, tendon in enumerate(ACTIVE):
        slope, slack, near = zero.steps_per_radian[axis], zero.slack[axis], f"tendon {tendon}, near the straight wrist"
        findings.metric(f"steps_per_radian_{tendon}", slope, "1/rad", meaning=near)
        findings.metric(f"slack_{tendon}", slack, "m", meaning=f"tendon {tendon}, when homing began")
        rows.append((axis, tendon, f"{zero.signs[axis]:+d}", slope, by_model, 1e3 * slack, 1e3 * zero.friction[axis]))
    findings.summary(f"Marker angle of the straight wrist: {np.degrees(zero.markers[0]):.3f} deg")
    tables = [Table("Zero", _COLUMNS, rows)]
    if zero.directions:
        for tendon, toward in zip(ACTIVE, zero.directions, strict=True):
            findings.metric(f"direction_{tendon}", toward, "rad", meaning=f"tendon {tendon}, from ulnar toward flexion")
        cells = [(tendon, float(np.degrees(y))) for tendon, y in zip(ACTIVE, zero.directions, strict=True)]
        tables.append(Table("Directions, from ulnar toward flexion", ("tendon", "bends toward [deg]"), cells))
    return WristCalibrated(study, findings, tables, calibration)


def _one_axis(session: Session, testbed: Testbed, axis: int) -> AxisFound:
    import numpy as np

    from wristctl.trial.expected_moves import ExpectedMoves
    from wristctl.trial.rig_strokes import axis_tried
    from wristctl.wrist.directions import ACTIVE

    findings, study, settings = session.findings, session.study, session.study.calibrate_wrist
    with session.progress(f"trying axis {axis}"):
        tried = axis_tried(testbed, settings, study.wrist, axis)
    findings.metric("taken_up", tried.taken_up, "m", meaning=f"tendon {ACTIVE[axis]}, until the wrist bent")
    bend, columns, directions = tried.bend.theta, list(_OF_AXIS), list[float]()
    if settings.planes == 2:
        bend, toward = tried.bend.askew, float(np.arctan2(tried.bend.away, tried.bend.theta))
        place = ExpectedMoves(settings, study.wrist, settings.plane).place(axis)
        findings.metric("direction", toward, "rad", meaning="of that bend, from ulnar toward flexion")
        columns, directions = [*_OF_AXIS, *_TOWARD], [float(np.degrees(angle)) % 360.0 for angle in (toward, place)]
    findings.metric("bend", bend, "rad", meaning="of the wrist then")
    row = axis, ACTIVE[axis], f"{tried.sense:+d}", 1e3 * tried.taken_up, float(np.degrees(bend)), *directions
    return AxisFound(study, findings, [Table("One axis", columns, [row])])


CALIBRATE_WRIST: Procedure[AxisFound] = Procedure(
    "calibrate-wrist",
    plan,
    calibrate_wrist,
    tuple(EarlierRun(name, kind="calibrate-camera", optional=True) for name in ("optics", "optics_2")),
)
