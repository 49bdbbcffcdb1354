"""`wristctl hw calibrate camera`: lens and bending plane, from views of the board."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.calibrate_camera import CALIBRATE_CAMERA

app = study_command(
    CALIBRATE_CAMERA,
    shortcuts=("camera", "views"),
    examples=(
        "wristctl hw calibrate camera",
        "wristctl hw calibrate camera --camera 0",
        "wristctl hw calibrate camera --camera pictures/ --set board.square=0.0248",
        "wristctl track trial.mp4 --calibration latest:calibrate-camera",
    ),
)
