"""`wristctl gen-data`: samples of tip positions and bending angles."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.gen_data import GEN_DATA

app = study_command(
    GEN_DATA,
    shortcuts=("samples", "source"),
    examples=(
        "wristctl gen-data experiments/paper.yaml",
        "wristctl gen-data --samples 5000 --label large",
        "wristctl gen-data --source plant --set segments=4",
        "wristctl gen-data --source run --run latest:hw-run",
        "wristctl gen-data --source csv --set 'files=[monday.csv,tuesday.csv]'",
    ),
)
