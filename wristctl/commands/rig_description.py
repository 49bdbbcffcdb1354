"""Description of a rig: its real and its emulated parts, and the scheduling of its loop."""

from collections.abc import Iterator
from contextlib import contextmanager

from wristctl.commands.session import Session
from wristctl.config.hw_run import RigSettings
from wristctl.loop_priority import prioritised


def describe_rig(settings: RigSettings) -> str:
    """In one line, the first that a command on a rig says."""
    if settings.port is not None:
        return f"on hardware: board at {settings.port}, camera {settings.camera}"
    clock = "against the wall clock" if settings.real_time else "in virtual time"
    return f"all emulated, {clock}: motor board with its firmware, motors, tendons, wrist and camera"


@contextmanager
def coming_first(session: Session, settings: RigSettings) -> Iterator[None]:
    """Within the block the loop has the priority that the settings ask for; what it has is told and kept."""
    with prioritised(settings.priority) as priority:
        if priority:
            session.operator.tell(priority)
            session.findings.summary(priority)
        yield
