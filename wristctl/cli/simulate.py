"""`wristctl simulate`: one closed loop, with pictures."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.simulate import SIMULATE

app = study_command(
    SIMULATE,
    shortcuts=("controller", "gains"),
    examples=(
        "wristctl simulate --controller smc --gains exchanged",
        "wristctl simulate --set reference.kind=step --set loop.plant_segments=1",
        "wristctl simulate --gains tuned --tuned latest:tune",
    ),
)
