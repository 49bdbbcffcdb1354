"""`wristctl study`: every law tuned and judged at equal budget, on one machine or many."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.fair_study import FAIR_STUDY

app = study_command(
    FAIR_STUDY,
    shortcuts=("budget",),
    examples=(
        "wristctl study experiments/fair_study.yaml",
        "wristctl study experiments/fair_study.yaml --budget full --executor processes",
        "wristctl study experiments/fair_study.yaml --budget full --resume RUN --executor dask://host:8786",
    ),
)
