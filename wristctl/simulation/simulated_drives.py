"""Drives of simulated loops as data: motors as they are and as their host believes them, and their state at rest.

How they move is `wristctl.simulation.actuator`'s, which says what the rows of the state are.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import by_type, implements, itself
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import rows_of
from wristctl.simulation.spool_timing import Timing, remembered_commands, timing_of
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Version of the simulated drive: another one where motors deliver something else for the same settings and commands.
# 1 moved spools at the start of a tick; 2 moves them as a board does, after its delay, by its updates and its ramp.
DRIVE = 2
# Tendons at each place in one plane: the + and the - side's.
SIDES = (float(TENDONS_PER_SIDE), float(TENDONS_PER_SIDE))


class Motor(NamedTuple):
    """A motor, SI units; `stiffness` is that of one tendon, what comes last is the `Timing` of its board.

    `step` is a microstep, or the resolution of targets.
    """

    lag: Any
    stiffness: Any
    step: Any
    speed: Any
    acceleration: Any
    ramp: Any
    delay: Any
    update: Any


class IdealDrive(NamedTuple):
    """Pulls are as commanded; nothing of a motor is simulated."""


class LaggedDrive(NamedTuple):
    """Motors whose pulls lag behind their commands; `stiffness` (T,) is that of all tendons of each place [N/m]."""

    motor: Any
    stiffness: Any


class SpoolDrive(NamedTuple):
    """Motors that reel elastic tendons onto spools; `stiffness` (T,) is that of all tendons of each place [N/m].

    `believed` is the Timing that their host reckons with; `sent` is a tuple with an entry, whose value means nothing,
    for each rate of a spool that is remembered.
    """

    motor: Any
    stiffness: Any
    believed: Any
    sent: Any


class ServoDrive(NamedTuple):
    """Motors that reel elastic tendons in by following targets; `stiffness` (T,) is as SpoolDrive's.

    `believed` is the Motor that their host reckons with; `sent` is a tuple with an entry, whose value means nothing,
    for each target of a motor that is remembered.
    """

    motor: Any
    stiffness: Any
    believed: Any
    sent: Any


Drive = IdealDrive | LaggedDrive | SpoolDrive | ServoDrive

# A Motor and a Timing of lanes from rows of lanes, in compiled code.
read_motor, read_timing = tuple_of(Motor), tuple_of(Timing)


class Winding(NamedTuple):
    """Winding error: the motors deliver `scale` times the count of their host, and `offset` [m]."""

    scale: float
    offset: float


def motor_of(actuator: Actuator) -> Motor:
    """The values of an actuator section."""
    step = actuator.step_length
    return Motor(
        lag=actuator.lag,
        stiffness=actuator.tendon_stiffness,
        step=actuator.resolution if actuator.level == "servo" else step,
        speed=step * actuator.step_rate,
        acceleration=step * actuator.step_acceleration,
        **timing_of(actuator, step)._asdict(),
    )


def believed_of(actuator: Actuator) -> Timing | Motor:
    """What a host reckons the places of its motors with: the Timing of a board, or motors that follow targets."""
    return motor_of(actuator) if actuator.level == "servo" else timing_of(actuator, actuator.step_length)


def drive_with(level: str, motor: Any, stiffness: Any, believed: Any, remembered: int) -> Drive:
    """The drive of a level, with the rows of a batch too; an ideal drive has nothing.

    Parameters
    ----------
    level : of an actuator section
    motor : Motor
    stiffness : of places (T,) [N/m]
    believed : `believed_of` its host
    remembered : number of rates or targets that each motor remembers
    """
    if level == "ideal":
        return IdealDrive()
    if level == "lagged":
        return LaggedDrive(motor, stiffness)
    kind = ServoDrive if level == "servo" else SpoolDrive
    return kind(motor, stiffness, believed, (0,) * remembered)


def commands_of(drive: Drive) -> int:
    """Number of rates or targets that each motor of a drive remembers."""
    return len(drive.sent) if isinstance(drive, SpoolDrive | ServoDrive) else 0


def drive_of(
    actuator: Actuator, alike: Array | tuple[float, ...] = SIDES, period: float = math.inf, motor: Motor | None = None
) -> Drive:
    """The drive of an actuator section, as arrays, with so many tendons at each place (T,).

    Parameters
    ----------
    actuator : as its host believes
    alike : tendons at each place (T,)
    period : of control [s], where rates or targets are sent
    motor : as it is; None: as believed
    """
    motor, believed = motor or motor_of(actuator), believed_of(actuator)
    count = remembered_commands(max(motor.delay, believed.delay), period)
    return drive_with(actuator.level, np.array(motor), motor.stiffness * np.asarray(alike), np.array(believed), count)


@by_type
def drive_in_lanes(drive: Any) -> Any:
    """A drive of lanes from a drive whose motor is one block's array."""


implements(drive_in_lanes, IdealDrive)(itself)


@implements(drive_in_lanes, LaggedDrive)
def _lagged_in_lanes(drive: Any) -> Any:
    return LaggedDrive(read_motor(rows_of(drive.motor)), rows_of(drive.stiffness))


@implements(drive_in_lanes, SpoolDrive)
def _spools_in_lanes(drive: Any) -> Any:
    believed = read_timing(rows_of(drive.believed))
    return SpoolDrive(read_motor(rows_of(drive.motor)), rows_of(drive.stiffness), believed, drive.sent)


@implements(drive_in_lanes, ServoDrive)
def _servos_in_lanes(drive: Any) -> Any:
    believed = read_motor(rows_of(drive.believed))
    return ServoDrive(read_motor(rows_of(drive.motor)), rows_of(drive.stiffness), believed, drive.sent)


def counted_motor(believed: Actuator, actual: Actuator) -> Motor:
    """The motor as its host counts: lengths and pulls are what it believes, only how fast it is, it is in truth."""
    step = believed.step_length
    limits = {"lag": actual.lag, "speed": step * actual.step_rate, "acceleration": step * actual.step_acceleration}
    return motor_of(believed)._replace(**limits, **timing_of(actual, step)._asdict())


def winding_of(believed: Actuator, actual: Actuator, pull: float, creep: float = 0.0) -> Winding:
    """Meaning of a count: each tendon was homed at this pull [N] on the straight wrist, where the counts are right.

    `creep` is the share of the tendons' stiffness that had relaxed by then.
    """
    counts, does = motor_of(believed), motor_of(actual)
    counted, delivered = believed.step_length, actual.step_length
    if believed.level == "lagged":
        return Winding(does.stiffness * delivered / (counts.stiffness * counted), 0.0)
    scale = delivered / counted
    return Winding(scale, pull / (does.stiffness * (1.0 - creep)) - scale * (pull / counts.stiffness))


def at_rest(drive: Drive, pulls: Array, straight: float, taut: Array, scale: float = 1.0, planes: int = 1) -> Array:
    """State of the motors at rest at these pulls (T,) [N], none of which withholds anything.

    Tendons that are just taut are `taut` (T,) long on the wrist as it stands, and `straight` on the straight one [m];
    `drive` is as the host counts, `scale` that of the winding.
    """
    count = len(pulls)
    state = np.zeros((2 + commands_of(drive)) * count + 2 * planes)
    counts = state[: 2 * count : 2]
    counts[:] = pulls
    if isinstance(drive, SpoolDrive | ServoDrive):
        counts[:] = pulls / drive.stiffness + straight / scale - taut / scale
    if isinstance(drive, ServoDrive):
        state[1 : 2 * count : 2] = counts
        state[2 * (count + planes) :].reshape(count, -1)[:] = counts[:, None]
    return state
