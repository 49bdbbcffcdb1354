"""`wristctl audit`: the paper's claims, one by one."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.audit import AUDIT

app = study_command(
    AUDIT,
    examples=(
        "wristctl audit experiments/claims.yaml",
        "wristctl audit experiments/claims.yaml --table1 RUN --selection RUN",
    ),
)
