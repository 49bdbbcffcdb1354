"""`wristctl hw-run`: the paper's experiment on the whole chain, from marker to motor."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.cli.operator import YES
from wristctl.studies.hw_run import HW_RUN

app = study_command(
    HW_RUN,
    shortcuts=("port", "camera", "repetitions", "real_time", "video", "priority"),
    flags=YES,
    examples=(
        "wristctl hw-run",
        "wristctl hw-run --set 'directions=[ulnar]' --set push.force=0",
        "wristctl hw-run --dry-run --port /dev/ttyACM0",
        "wristctl hw-run --port /dev/ttyACM0 --camera 0 --calibration latest:calibrate-wrist",
    ),
)
