"""What of a rig is real and what is emulated."""

from __future__ import annotations

from wristctl.config.hw_run import RigSettings


def describe_rig(settings: RigSettings) -> str:
    """In one line, the first that a command on a rig says."""
    if settings.port is not None:
        return f"on hardware: board at {settings.port}, camera {settings.camera}"
    clock = "against the wall clock" if settings.real_time else "in virtual time"
    return f"all emulated, {clock}: motor board with its firmware, motors, tendons, wrist and camera"
