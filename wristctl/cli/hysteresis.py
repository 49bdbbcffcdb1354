"""`wristctl hysteresis`: loops of a wrist whose tendons have friction, and a measured one fitted."""

from __future__ import annotations

from wristctl.cli.command import study_command
from wristctl.studies.hysteresis import HYSTERESIS

app = study_command(
    HYSTERESIS,
    shortcuts=("drive", "shape", "measured"),
    examples=(
        "wristctl hysteresis experiments/hysteresis.yaml",
        "wristctl hysteresis --measured loop.csv",
        "wristctl hysteresis --drive tensions --set 'ranges_deg=[[0, 30]]' --set 'sheaths=[0, 1]'",
    ),
)
