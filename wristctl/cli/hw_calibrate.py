"""`wristctl hw calibrate`: what must be known before a trial, and the board to print for it."""

from __future__ import annotations

import typer

from wristctl.cli.lazy_commands import lazy_group

COMMANDS = {
    "board-pdf": ("wristctl.cli.board_pdf", None, "Write the board and the markers as a PDF, to print at true scale."),
    "camera": ("wristctl.cli.calibrate_camera", None, "Find lens and bending plane from views of the board."),
    "wrist": ("wristctl.cli.calibrate_wrist", None, "Find zero, senses of turning and steps per radian."),
}

app = typer.Typer(
    cls=lazy_group(COMMANDS), help="Calibrate camera and wrist.", no_args_is_help=True, add_completion=False
)


@app.callback()
def _calibrate() -> None:
    """Calibrate camera and wrist."""
