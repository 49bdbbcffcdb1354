"""Words for a rig's parts, for what is likely wrong with them, and for what to do about it.

Each is said here once, of a motor board with cameras and of a rig that takes targets: homing, residuals and load cells
have it from here.
"""

from collections.abc import Sequence
from typing import NamedTuple

LOST = "{} is off its pulley, cut or slipped, or its motor has stalled"
"""Of the tendon of a motor."""
CELL = "{} is unplugged or without supply, or a wire of its cell is broken"
"""Of the amplifier of a load cell."""
AGAINST = "tendons pull against each other"
PUSHED = "something holds or pushes the wrist"
DEAD = "its tendon is slack (motors that a stop released keep none taut) or off, or it has no power"
"""Of a motor that bends nothing."""
REPEATS = "the camera or its driver repeats old pictures: plug it in again, another USB port"
SLOW_CALL = "have it return at once, with the newest that a thread of its own has read; or a longer control_period"
"""Of a call of a rig of one's own that takes longer than a tick."""
_LOOK = "slacken the tendons by hand, look"


class Words(NamedTuple):
    """Words for a rig of T tendons in P planes."""

    numbers: tuple[int, ...]
    """Of the tendons."""
    names: tuple[str, ...]
    """Of the motors."""
    motors: tuple[str, ...]
    """Of the motors, with their tendons."""
    slipped: tuple[str, ...]
    """Each plane's sensor that has slipped."""
    wrong: tuple[str, ...]
    """Each plane's sensor that shows or dates bends wrongly."""
    old: str
    """Sensors that show the past."""
    scale: str
    """Likely causes where a motor turns its spool by more or less than it is told."""
    rescale: str
    """What to do about that."""
    exchanged: str
    """Two motors that are exchanged; a template of their axes and their tendons."""
    askew: str
    """Sensors that see bends in other directions."""
    loose: str
    """A sensor that moves."""
    against: str
    """Likely causes where tendons pull against each other."""
    wiring: str
    """What to do about a motor that bends the wrist as another's tendon should."""
    dead: str
    """What to do about one that bends nothing; a template of its `axis`."""
    taut: str
    """What to do about a tendon that was taut when homing began."""
    again: str
    """What to do about a homed wrist that does otherwise."""
    stopped: str
    """What to do about a wrist that does not follow its motors."""


def words_of_board(numbers: Sequence[int], planes: Sequence[str]) -> Words:
    """Of a motor board with a camera for each of these planes."""
    several = len(planes) > 1
    markers = [f"the marker before the {plane} camera" if several else "the tip's marker" for plane in planes]
    cameras = [f"the {plane} camera" if several else "the camera" for plane in planes]
    both = " of both cameras, and which camera sees which plane" if several else ""
    return Words(
        numbers=tuple(numbers),
        names=tuple(f"axis {axis}" for axis in range(len(numbers))),
        motors=tuple(f"axis {axis} (tendon {number})" for axis, number in enumerate(numbers)),
        slipped=tuple(f"{marker} has slipped on its disc" for marker in markers),
        wrong=tuple(f"{camera} shows or dates pictures wrongly" for camera in cameras),
        old=f"{'both cameras show' if several else 'the camera shows'} old pictures",
        scale="wrong pulley or microsteps (DIP switches)",
        rescale="see the DIP switches of the drive and actuator.microstep, and measure the pulley "
        "(actuator.pulley_radius)",
        exchanged="motors of axes {0} and {1}",
        askew="cameras that do not look square at their planes",
        loose="a marker that is not fixed",
        against="steps that nobody counted, a knot, or zero positions that are wrong; or a marker has slipped",
        wiring=f"check which tendon is on which motor, {'' if several else 'and '}markers.positive{both}",
        dead="take its slack up: wristctl hw tension --axis {axis}; see pulley and power: wristctl hw check --wiring "
        "{axis}; or raise homing.slack",
        taut="slacken all tendons first: wristctl hw slacken, or by hand",
        again="calibrate the wrist again",
        stopped=f"cut the motors' supply, {_LOOK} (documentation: Faults and refusals), then wristctl hw check --rig",
    )


def words_of_rig(numbers: Sequence[int], planes: Sequence[str]) -> Words:
    """Of a rig that takes targets and gives bends in these planes."""
    bends = [f"the bend toward {plane}" if len(planes) > 1 else "the bend" for plane in planes]
    targets = tuple(f"target {number}" for number in numbers)
    return Words(
        numbers=tuple(numbers),
        names=targets,
        motors=targets,
        slipped=tuple(f"the sensor of {bend} has slipped" for bend in bends),
        wrong=tuple(f"look() gives or dates {bend} wrongly" for bend in bends),
        old="look() gives old bends",
        scale="facts.metres_per_unit",
        rescale="see facts.metres_per_unit, the tendon's radius, wrist.stiffness and facts.drive.stiffness",
        exchanged="targets {2} and {3}",
        askew="a sensor whose axes are turned",
        loose="a sensor that is not fixed",
        against="a knot, a tendon that is caught, or targets that were not reached; or the sensor has slipped",
        wiring="see the order of facts.tendons and of the targets, and the axes of look()",
        dead="take its slack up; see that its motor has power and its tendon is on; facts.metres_per_unit; or raise "
        "homing.slack",
        taut="slacken all tendons before the rig is connected",
        again="home again",
        stopped=f"cut the motors' power, {_LOOK}, then wristctl check-rig",
    )


def why_dead(one_way: bool) -> str:
    """What is likely with a motor that bends nothing, tried the `one_way` that a calibration says, or both."""
    return "it turns the other way than hw-run.calibration says, or " * one_way + DEAD
