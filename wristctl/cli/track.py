"""`wristctl track`: the wrist's angle in a recorded video, without any board."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.track import TRACK

app = study_command(
    TRACK,
    shortcuts=("zero", "annotate"),
    argument="video",
    examples=(
        "wristctl track trial.mp4",
        "wristctl track trial.mp4 --calibration latest:calibrate-camera --annotate",
        "wristctl track pictures/ --set frame_rate=60 --set markers.positive=left",
    ),
)
