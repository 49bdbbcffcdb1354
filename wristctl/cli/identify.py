"""`wristctl identify`: the wrist's parameters from logged trials."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.identify import IDENTIFY

app = study_command(
    IDENTIFY,
    argument="runs",
    examples=(
        "wristctl identify latest:hw-run",
        "wristctl identify UPRIGHT_RUN LEVEL_RUN --set fix.friction=0.1",
        "wristctl tune experiments/paper.yaml --from-identified latest:identify",
    ),
)
