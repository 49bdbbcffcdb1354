"""`wristctl tune`: gains by search, the same budget and objective for every controller."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.tune import TUNE

app = study_command(
    TUNE,
    shortcuts=("candidates", "iterations"),
    examples=(
        "wristctl tune experiments/paper.yaml",
        "wristctl tune --set 'controllers=[smc, pid]' --iterations 20",
        "wristctl tune experiments/paper.yaml --from-identified latest:identify",
    ),
)
