"""`wristctl compare`: controllers under the same conditions, beside the paper's numbers."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.compare import COMPARE

app = study_command(
    COMPARE,
    shortcuts=("horizon",),
    examples=(
        "wristctl compare experiments/paper.yaml --network latest:train --tuned latest:tune",
        "wristctl compare --set 'inverses=[none]' --set 'rows=[{controller: computed-torque, gains: default}]'",
    ),
)
