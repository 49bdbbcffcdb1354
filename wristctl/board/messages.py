"""Messages between host and board. Made from messages.toml by dictionary.py: change that file, not this one."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import NamedTuple

PROTOCOL_VERSION = 4
FIRMWARE_VERSION = (4, 0, 0)
DICTIONARY_HASH = 0xF68DEC2D
BAUD = 250000
AXES = 4  # 1: step/direction drives
MAX_RATE = 20000  # steps/s: of one axis
TOTAL_RATE = 40000  # steps/s: of all axes together: what the step interrupts leave time for
JOG_RATE = 400  # steps/s: of every axis while positions are not trusted
ESTOP_MS = 3  # ms: for which the emergency stop input must read open: shorter is noise
SETTLE_MS = 200  # ms: from energising a drive to its first step
HEARTBEAT_MS = 5  # ms: a main loop silent for longer counts as hung
ENABLE_KEY = 1465010515  # 1: makes an ENABLE that no noise produces
ESTOP_SEQ = 0  # 1: an ESTOP with this sequence number is obeyed on its last byte, whatever waits before it
MAX_PAYLOAD = 48  # bytes: of any message, either way


class State(IntEnum):
    """State of the board."""

    DISABLED = 0  # drives off, nothing moves; from here ENABLE
    ENABLED = 1  # drives on, motion commands are obeyed
    STOPPING = 2  # ramping down on the way to DISABLED or FAULT
    FAULT = 3  # latched: nothing moves until CLEAR


class Result(IntEnum):
    """Result of a command."""

    OK = 0  # done
    LENGTH = 1  # the message has the wrong length
    UNKNOWN = 2  # the board does not know this command
    RANGE = 3  # a value is out of range
    STATE = 4  # not possible in this state
    FAULTED = 5  # a fault is latched
    KEY = 6  # the key of ENABLE is wrong
    UNHOMED = 7  # positions are not trusted
    ESTOP_OPEN = 8  # the emergency stop input is open
    MOVING = 9  # an axis is moving
    CONNECTION = 10  # the command is of another connection
    ALARM = 11  # an alarm input is open
    CONFIGURATION = 12  # the board's settings are not those that the host believes


class Command(IntEnum):
    """Command of a host."""

    HELLO = 1  # who are you? Its answer's first three fields keep their place in every version
    PING = 2  # are you there? Keeps the link watchdog fed while nothing moves
    STATUS = 3  # state, positions and rates
    COUNTERS = 4  # what went well and wrong on the wire since reset
    ENABLE = 5  # energise the drives, if the check of CONFIGURE's and LIMITS' fields is theirs (DISABLED to ENABLED)
    DISABLE = 6  # ramp down, then release the drives; positions are no longer trusted. In FAULT: release held drives
    RATE = 7  # turn each axis at this rate for its life at most, then ramp to rest; below 1 step/s stand still
    TARGET = 8  # go to these positions, no faster than these rates; may be changed on the way
    JOG = 9  # creep home at JOG_RATE while positions are not trusted, within LIMITS' jog of where the drives came on
    HOME = 10  # the axes stand at these positions: trust them from here on
    STOP = 11  # ramp every axis down to rest; stays ENABLED and homed
    ESTOP = 12  # no further step, drives released, FAULT: obeyed in every state
    CLEAR = 13  # FAULT to DISABLED; refused while the emergency stop input is open
    CONFIGURE = 14  # ramps, watchdog and what the drives do in a fault; only in DISABLED, kept until reset
    LIMITS = 15  # soft limits of TARGET, RATE and HOME, and how far JOG may creep; only in DISABLED, kept until reset
    CONNECT = 16  # a connection begins, the next after HELLO's: bound commands of those before are refused
    PULLS = 17  # as STATUS, and what the tendons' load cells read
    TURN = 18  # as RATE, answered with what the tendons' load cells read


class Fault(IntFlag):
    """Reasons of a stop, one bit each."""

    LINK = 1  # no command arrived within the watchdog time
    ESTOP_COMMAND = 2  # the host sent an emergency stop
    ESTOP_INPUT = 4  # the emergency stop button is pressed or its wire is broken
    HANG = 8  # the board's main loop stood still
    WATCHDOG = 16  # the board's millisecond clock stood still
    DRIVE = 32  # a drive reports an alarm, has no power, or its alarm wire is broken


class Flag(IntFlag):
    """Flags of a status, one bit each."""

    HOMED = 1  # positions are trusted
    MOVING = 2  # some axis is moving or waiting for its next step
    DRIVES_ON = 4  # the drives are energised
    ESTOP_OPEN = 8  # the emergency stop input reads pressed
    SETTLING = 16  # drives just energised; motion starts when this clears
    AT_LIMIT = 32  # a soft limit holds some axis back
    LAPSED = 64  # the last RATE's life is over and no other has come: the axes ramp down, or stand
    ALARM = 128  # an alarm input is open: a drive's alarm, no supply, or a broken wire


class Reset(IntFlag):
    """Reasons of a reset, one bit each; a boot loader may have hidden it."""

    POWER_ON = 1  # power came on
    EXTERNAL = 2  # the reset line was pulled: a program has opened the port, or the button was pressed
    BROWN_OUT = 4  # the supply has sagged: another USB port or cable, and see the wiring of the motors' supply
    WATCHDOG = 8  # the chip's watchdog
    JTAG = 16  # a debugger
    WARM = 128  # memory has survived: the supply was never off


class Enable(NamedTuple):
    """Energise the drives, if the check of CONFIGURE's and LIMITS' fields is theirs (DISABLED to ENABLED)."""

    key: int  # 1, 0 to 4294967295
    configuration: int  # 1, 0 to 65535


class Rate(NamedTuple):
    """Turn each axis at this rate for its life at most, then ramp to rest; below 1 step/s stand still."""

    rate: tuple[float, float, float, float]  # steps/s, -20000 to 20000
    life: float = 0.05  # s, 0.01 to 0.2


class Target(NamedTuple):
    """Go to these positions, no faster than these rates; may be changed on the way."""

    position: tuple[int, int, int, int]  # steps, -1000000000 to 1000000000
    rate: tuple[int, int, int, int]  # steps/s, 1 to 20000


class Jog(NamedTuple):
    """Creep home at JOG_RATE while positions are not trusted, within LIMITS' jog of where the drives came on."""

    position: tuple[int, int, int, int]  # steps, -1000000000 to 1000000000


class Home(NamedTuple):
    """The axes stand at these positions: trust them from here on."""

    position: tuple[int, int, int, int]  # steps, -1000000000 to 1000000000


class Configure(NamedTuple):
    """Ramps, watchdog and what the drives do in a fault; only in DISABLED, kept until reset."""

    watchdog: float = 0.1  # s, 0.01 to 2.0
    hold_on_fault: int = 0  # 1, 0 to 1
    acceleration: int = 50000  # steps/s^2, 1000 to 200000
    stop_acceleration: int = 400000  # steps/s^2, 20000 to 2000000


class Limits(NamedTuple):
    """Soft limits of TARGET, RATE and HOME, and how far JOG may creep; only in DISABLED, kept until reset."""

    lowest: tuple[int, int, int, int] = (-1000000000,) * 4  # steps, -1000000000 to 1000000000
    highest: tuple[int, int, int, int] = (1000000000,) * 4  # steps, -1000000000 to 1000000000
    jog: int = 200  # steps, 1 to 65535


class Connect(NamedTuple):
    """A connection begins, the next after HELLO's: bound commands of those before are refused."""

    number: int  # 1, 0 to 65535


class Turn(NamedTuple):
    """As RATE, answered with what the tendons' load cells read."""

    rate: tuple[float, float, float, float]  # steps/s, -20000 to 20000
    life: float = 0.05  # s, 0.01 to 0.2


class Hello(NamedTuple):
    """Who the board is."""

    protocol: int  # 1
    dictionary: int  # 1
    firmware: tuple[int, int, int]  # 1
    boot_nonce: int  # 1
    reset_cause: Reset  # Reset
    axes: int  # 1
    max_rate: int  # steps/s
    total_rate: int  # steps/s
    connection: int  # 1


class Status(NamedTuple):
    """State, faults and flags at one instant, positions and rates right after it."""

    time: float  # s
    state: State  # State
    faults: Fault  # Fault
    flags: Flag  # Flag
    watchdog_left: float  # s
    position: tuple[int, int, int, int]  # steps
    rate: tuple[int, int, int, int]  # steps/s
    lapses: int  # 1


class Pulls(NamedTuple):
    """A Status, and the newest reading of each tendon's load cell with its age; an age of 0.255 s: none for as long."""

    time: float  # s
    state: State  # State
    faults: Fault  # Fault
    flags: Flag  # Flag
    watchdog_left: float  # s
    position: tuple[int, int, int, int]  # steps
    rate: tuple[int, int, int, int]  # steps/s
    lapses: int  # 1
    counts: tuple[int, int, int, int]  # 256 counts
    age: tuple[float, float, float, float]  # s


class Counters(NamedTuple):
    """All count from reset and wrap."""

    frames: int  # 1
    bad_crc: int  # 1
    bad_frame: int  # 1
    dropped_answers: int  # 1
    uart_errors: int  # 1
    late_steps: int  # 1
