"""What to do about what homing finds, of a board with its cameras and of a rig that takes targets."""

from typing import NamedTuple

_SCREWED = (
    "check which tendon is on which motor, and markers.positive",
    "check which tendon is on which motor, markers.positive of both cameras, and which camera sees which plane",
)
"""What to do about tendons that bend the wrist elsewhere, before one camera and before two."""


DEAD = "its tendon is slack (motors that a stop released keep none taut) or off, or it has no power"
"""Likely causes where a motor bends nothing."""


class Fixes(NamedTuple):
    """What to do about what homing finds."""

    wiring: str
    """Of a motor that bends the wrist as another's tendon should."""
    dead: str
    """Of one that bends nothing."""
    scale: str
    """Of one that makes another way than it should."""
    scaled: str
    """Its likely causes."""
    taut: str
    again: str
    """Of a homed wrist that does otherwise."""
    against: str
    """What makes tendons pull against each other."""


_OF_BOARD = Fixes(
    "",
    "take its slack up: wristctl hw tension --axis {axis}; see pulley and power: wristctl hw check --wiring {axis}; or "
    "raise homing.slack",
    "see the DIP switches of the drive and actuator.microstep, and measure the pulley (actuator.pulley_radius)",
    "wrong microsteps (DIP switches), a wrong pulley",
    "slacken all tendons first: wristctl hw slacken, or by hand",
    "calibrate the wrist again",
    "steps that nobody counted, a knot, or zero positions that are wrong; or a marker has slipped",
)
OF_RIG = Fixes(
    "see the order of facts.tendons and of the targets, and the axes of look()",
    "take its slack up; see that its motor has power and its tendon is on; facts.metres_per_unit; or raise "
    "homing.slack",
    "see facts.metres_per_unit, the tendon's radius, wrist.stiffness and facts.drive.stiffness",
    "wrong facts",
    "slacken all tendons before the rig is connected",
    "home again",
    "a knot, a tendon that is caught, or targets that were not reached; or the sensor has slipped",
)


def of_board(cameras: int) -> Fixes:
    """Of a board before so many cameras."""
    return _OF_BOARD._replace(wiring=_SCREWED[cameras - 1])
