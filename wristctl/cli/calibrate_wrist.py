"""`wristctl hw calibrate wrist`: zero, senses of turning and steps per radian, by small guarded moves."""

from __future__ import annotations

import json

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.cli.rig_description import rig_described
from wristctl.config.study import Study
from wristctl.records import Run


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What would be done; opens nothing."""
    settings = study.calibrate_wrist
    slack = 1e3 * settings.homing.slack
    return f"{rig_described(settings)}\neach motor reels in by at most {slack:g} mm until its tendon bends the wrist"


def calibrate_wrist(session: Session) -> Table:
    """Find where each tendon is just taut on the straight wrist, which way its motor turns, and steps per radian.

    The wrist stands straight, its tendons slack, both markers in the camera's picture. Later runs reuse what is
    durable: senses of turning and the marker's zero; positions only until the board restarts.
    """
    session.console.print(rig_described(session.settings), markup=False, highlight=False, soft_wrap=True)
    import numpy as np

    from wristctl.cli.operator import operator
    from wristctl.trial.calibration import FILE, calibrated
    from wristctl.trial.testbeds import open_testbed
    from wristctl.vision.view import View
    from wristctl.wrist.directions import ACTIVE

    run, settings, study = session.run, session.settings, session.study
    view = View.of(session.inputs.get("optics"))
    with session.progress("opening board and camera"):
        testbed = open_testbed(settings, study.wrist, study.seed, view, operator(session))
    with session.progress("homing"):
        found = calibrated(testbed, settings)
    run.file(FILE).write_text(json.dumps(found.plain(), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    zero = found.zero
    run.metric("marker", zero.marker, "rad", meaning="angle between the markers on the straight wrist")
    by_model = settings.actuator.step_length / study.wrist.tendon_offset
    rows = []
    for axis, tendon in enumerate(ACTIVE):
        slope, slack = zero.steps_per_radian[axis], zero.slack[axis]
        run.metric(f"steps_per_radian_{tendon}", slope, "1/rad", meaning=f"tendon {tendon}, near the straight wrist")
        run.metric(f"slack_{tendon}", slack, "m", meaning=f"tendon {tendon}, when homing began")
        rows.append((axis, tendon, f"{zero.signs[axis]:+d}", slope, 1.0 / by_model, 1e3 * slack))
    columns = ("axis", "tendon", "sense", "steps per rad", "by the model", "slack [mm]")
    run.summary(f"Marker angle of the straight wrist: {np.degrees(zero.marker):.3f} deg")
    return Table("Zero", columns, rows)


app = study_command(
    "calibrate-wrist",
    work=calibrate_wrist,
    plan=plan,
    inputs=(EarlierRun("optics", kind="calibrate-camera", optional=True),),
    shortcuts=("port", "camera", "plane", "real_time"),
    flags={"yes": "Ask nobody before the motors of real hardware move."},
    examples=(
        "wristctl hw calibrate wrist",
        "wristctl hw calibrate wrist --port /dev/ttyACM0 --camera 0 --optics latest:calibrate-camera",
        "wristctl hw-run --port /dev/ttyACM0 --calibration latest:calibrate-wrist",
    ),
)
