"""Description of a rig: its real and its emulated parts, and the scheduling of its loop."""

from collections.abc import Iterator
from contextlib import contextmanager

from wristctl.commands.session import Session
from wristctl.config.hw_run import RigSettings
from wristctl.loop_priority import prioritised


def describe_rig(settings: RigSettings) -> str:
    """The first that a command on a rig says: in one line, with what is of other rigs in a second."""
    if (own := getattr(settings, "rig", None)) is not None:
        return f"on the rig {own}, {settings.planes} plane{'s' * (settings.planes == 2)}"
    two = settings.planes == 2
    if settings.port is not None:
        cameras = f"cameras {settings.camera} and {settings.camera_2}" if two else f"camera {settings.camera}"
        return f"on hardware: board at {settings.port}, {cameras}"
    clock = "against the wall clock" if settings.real_time else "in virtual time"
    cameras = "two cameras" if two else "camera"
    rig = f"all emulated, {clock}: motor board with its firmware, motors, tendons, wrist and {cameras}"
    return "\n".join([rig, *unread_of_device(settings)])


def unread_of_device(settings: RigSettings) -> list[str]:
    """What of `device` is not at its default and takes no part, as the rig is emulated; in a sentence or none."""
    given = [f"device.{key}" for key in settings.device.model_dump(exclude_defaults=True)]
    if settings.port is not None or getattr(settings, "rig", None) is not None or not given:
        return []
    instead = "pictures of the emulated one are bench.camera.delay_frames old, and their time stamps are exact"
    return [f"no part here takes {', '.join(sorted(given))}, of real cameras: {instead}"]


@contextmanager
def coming_first(session: Session, settings: RigSettings) -> Iterator[None]:
    """Within the block the loop has the priority that the settings ask for; what it has is told and kept."""
    with prioritised(settings.priority) as priority:
        if priority:
            session.operator.tell(priority)
            session.findings.summary(priority)
        yield
