"""`wristctl hw calibrate wrist`: zero, senses of turning and steps per radian, by small guarded moves."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.cli.operator import YES
from wristctl.studies.calibrate_wrist import CALIBRATE_WRIST

app = study_command(
    CALIBRATE_WRIST,
    shortcuts=("port", "camera", "plane", "axis", "max_deg", "real_time", "priority"),
    flags=YES,
    examples=(
        "wristctl hw calibrate wrist",
        "wristctl hw calibrate wrist --port /dev/ttyACM0 --camera 0 --optics latest:calibrate-camera",
        "wristctl hw calibrate wrist --port /dev/ttyACM0 --camera 0 --axis 0 --max-deg 2",
        "wristctl hw-run --port /dev/ttyACM0 --calibration latest:calibrate-wrist",
    ),
)
