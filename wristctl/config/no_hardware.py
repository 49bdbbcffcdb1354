"""A process that must leave the rig alone: whatever its settings say, it opens no board and no camera."""

from __future__ import annotations

import os

from wristctl.config.errors import UserError

NO_HARDWARE = "WRISTCTL_NO_HARDWARE"
"""Environment variable that says so, to this process and to all that it begins."""


def check_hardware_allowed(what: str, where: str) -> None:
    """Called by whatever opens a device. Raises UserError where this process may open none."""
    if os.environ.get(NO_HARDWARE):
        fix = f"do it by its own command, with a person at the rig and without {NO_HARDWARE}"
        raise UserError(f"this process opens no {what}", where, fix, exit_code=3)
