"""`wristctl analyse`: margins of the linearised loop, with pictures."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.analyse import ANALYSE

app = study_command(
    ANALYSE,
    shortcuts=("controller", "gains", "over"),
    examples=(
        "wristctl analyse --controller computed-torque --gains default",
        "wristctl analyse --controller pid --set 'gains={Kp: 10.0, Ki: 20.0, Kd: 0.5}' --over Kp",
        "wristctl analyse --controller smc-tracking --gains stepper --set loop.control_period=5e-3 "
        "--set 'loop={actuator: {level: tendon}, sensor: {level: camera}}'",
    ),
)
