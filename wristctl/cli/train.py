"""`wristctl train`: networks from tip position to bending angle."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.train import TRAIN

app = study_command(
    TRAIN,
    shortcuts=("search", "preset", "epochs", "seeds", "device"),
    examples=(
        "wristctl train experiments/paper.yaml --data latest:gen-data",
        "wristctl train --preset recommended --seeds 5",
        "wristctl train experiments/table1.yaml",
        "wristctl train --search experiments/model_selection.yaml",
    ),
)
