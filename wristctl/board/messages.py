"""Messages between host and board. Made from messages.toml by dictionary.py: change that file, not this one."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import NamedTuple

from wristctl.board.layout import Field, Layout

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


RESULT_MEANING = {
    Result.OK: "done",
    Result.LENGTH: "the message has the wrong length",
    Result.UNKNOWN: "the board does not know this command",
    Result.RANGE: "a value is out of range",
    Result.STATE: "not possible in this state",
    Result.FAULTED: "a fault is latched",
    Result.KEY: "the key of ENABLE is wrong",
    Result.UNHOMED: "positions are not trusted",
    Result.ESTOP_OPEN: "the emergency stop input is open",
    Result.MOVING: "an axis is moving",
    Result.CONNECTION: "the command is of another connection",
    Result.ALARM: "an alarm input is open",
    Result.CONFIGURATION: "the board's settings are not those that the host believes",
}
RESULT_FIX = {
    Result.OK: "",
    Result.LENGTH: "flash the firmware that belongs to this host: wristctl hw flash",
    Result.UNKNOWN: "flash the firmware that belongs to this host: wristctl hw flash",
    Result.RANGE: "stay within the ranges of the message table and the soft limits",
    Result.STATE: "enable first to move, disable first to configure or to jog a homed wrist",
    Result.FAULTED: "mend its cause, then clear and home",
    Result.KEY: "send ENABLE_KEY",
    Result.UNHOMED: "jog to the home position, then home",
    Result.ESTOP_OPEN: "release the button (D41 must be closed to GND)",
    Result.MOVING: "stop and wait until MOVING clears",
    Result.CONNECTION: "another program has taken the board over: close it, and start again",
    Result.ALARM: "switch the motors' supply on, see which drive's red lamp blinks; without ALM join the input to GND",
    Result.CONFIGURATION: "send CONFIGURE and LIMITS again, then enable",
}
FAULT_MEANING = {
    Fault.LINK: "no command arrived within the watchdog time",
    Fault.ESTOP_COMMAND: "the host sent an emergency stop",
    Fault.ESTOP_INPUT: "the emergency stop button is pressed or its wire is broken",
    Fault.HANG: "the board's main loop stood still",
    Fault.WATCHDOG: "the board's millisecond clock stood still",
    Fault.DRIVE: "a drive reports an alarm, has no power, or its alarm wire is broken",
}
FAULT_FIX = {
    Fault.LINK: "see why the host fell silent (cable, load, crash), then clear and home",
    Fault.ESTOP_COMMAND: "clear and home when it is safe",
    Fault.ESTOP_INPUT: "release the button (D41 must be closed to GND), then clear and home",
    Fault.HANG: "reset the board; report it, with the log: this is a firmware bug",
    Fault.WATCHDOG: "reset the board; report it, with the log: this is a firmware bug",
    Fault.DRIVE: "see which drive's red lamp blinks, mend that and switch the supply off and on, then clear and home",
}
RESET_MEANING = {
    Reset.POWER_ON: "power came on",
    Reset.EXTERNAL: "the reset line was pulled: a program has opened the port, or the button was pressed",
    Reset.BROWN_OUT: "the supply has sagged: another USB port or cable, and see the wiring of the motors' supply",
    Reset.WATCHDOG: "the chip's watchdog",
    Reset.JTAG: "a debugger",
    Reset.WARM: "memory has survived: the supply was never off",
}


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


LAYOUTS: dict[type, Layout] = {
    Enable: Layout(
        Field("key", "I", 1, 1, "1", 0, 4294967295, None),
        Field("configuration", "H", 1, 1, "1", 0, 65535, None),
    ),
    Rate: Layout(
        Field("rate", "i", 4, 65536, "steps/s", -20000, 20000, None),
        Field("life", "B", 1, 1000, "s", 0.01, 0.2, None),
    ),
    Target: Layout(
        Field("position", "i", 4, 1, "steps", -1000000000, 1000000000, None),
        Field("rate", "H", 4, 1, "steps/s", 1, 20000, None),
    ),
    Jog: Layout(
        Field("position", "i", 4, 1, "steps", -1000000000, 1000000000, None),
    ),
    Home: Layout(
        Field("position", "i", 4, 1, "steps", -1000000000, 1000000000, None),
    ),
    Configure: Layout(
        Field("watchdog", "H", 1, 1000, "s", 0.01, 2.0, None),
        Field("hold_on_fault", "B", 1, 1, "1", 0, 1, None),
        Field("acceleration", "I", 1, 1, "steps/s^2", 1000, 200000, None),
        Field("stop_acceleration", "I", 1, 1, "steps/s^2", 20000, 2000000, None),
    ),
    Limits: Layout(
        Field("lowest", "i", 4, 1, "steps", -1000000000, 1000000000, None),
        Field("highest", "i", 4, 1, "steps", -1000000000, 1000000000, None),
        Field("jog", "H", 1, 1, "steps", 1, 65535, None),
    ),
    Connect: Layout(
        Field("number", "H", 1, 1, "1", 0, 65535, None),
    ),
    Turn: Layout(
        Field("rate", "i", 4, 65536, "steps/s", -20000, 20000, None),
        Field("life", "B", 1, 1000, "s", 0.01, 0.2, None),
    ),
    Hello: Layout(
        Field("protocol", "B", 1, 1, "1", None, None, None),
        Field("dictionary", "I", 1, 1, "1", None, None, None),
        Field("firmware", "B", 3, 1, "1", None, None, None),
        Field("boot_nonce", "I", 1, 1, "1", None, None, None),
        Field("reset_cause", "B", 1, 1, "Reset", None, None, Reset),
        Field("axes", "B", 1, 1, "1", None, None, None),
        Field("max_rate", "H", 1, 1, "steps/s", None, None, None),
        Field("total_rate", "H", 1, 1, "steps/s", None, None, None),
        Field("connection", "H", 1, 1, "1", None, None, None),
    ),
    Status: Layout(
        Field("time", "I", 1, 1000000, "s", None, None, None),
        Field("state", "B", 1, 1, "State", None, None, State),
        Field("faults", "B", 1, 1, "Fault", None, None, Fault),
        Field("flags", "B", 1, 1, "Flag", None, None, Flag),
        Field("watchdog_left", "H", 1, 1000, "s", None, None, None),
        Field("position", "i", 4, 1, "steps", None, None, None),
        Field("rate", "h", 4, 1, "steps/s", None, None, None),
        Field("lapses", "B", 1, 1, "1", None, None, None),
    ),
    Pulls: Layout(
        Field("time", "I", 1, 1000000, "s", None, None, None),
        Field("state", "B", 1, 1, "State", None, None, State),
        Field("faults", "B", 1, 1, "Fault", None, None, Fault),
        Field("flags", "B", 1, 1, "Flag", None, None, Flag),
        Field("watchdog_left", "H", 1, 1000, "s", None, None, None),
        Field("position", "i", 4, 1, "steps", None, None, None),
        Field("rate", "h", 4, 1, "steps/s", None, None, None),
        Field("lapses", "B", 1, 1, "1", None, None, None),
        Field("counts", "h", 4, 1, "256 counts", None, None, None),
        Field("age", "B", 4, 1000, "s", None, None, None),
    ),
    Counters: Layout(
        Field("frames", "I", 1, 1, "1", None, None, None),
        Field("bad_crc", "H", 1, 1, "1", None, None, None),
        Field("bad_frame", "H", 1, 1, "1", None, None, None),
        Field("dropped_answers", "H", 1, 1, "1", None, None, None),
        Field("uart_errors", "H", 1, 1, "1", None, None, None),
        Field("late_steps", "H", 1, 1, "1", None, None, None),
    ),
}
COMMAND_OF: dict[type, Command] = {
    Enable: Command.ENABLE,
    Rate: Command.RATE,
    Target: Command.TARGET,
    Jog: Command.JOG,
    Home: Command.HOME,
    Configure: Command.CONFIGURE,
    Limits: Command.LIMITS,
    Connect: Command.CONNECT,
    Turn: Command.TURN,
}
ANSWER_TO: dict[Command, type] = {
    Command.HELLO: Hello,
    Command.STATUS: Status,
    Command.COUNTERS: Counters,
    Command.ENABLE: Status,
    Command.DISABLE: Status,
    Command.RATE: Status,
    Command.TARGET: Status,
    Command.JOG: Status,
    Command.HOME: Status,
    Command.STOP: Status,
    Command.ESTOP: Status,
    Command.CLEAR: Status,
    Command.CONFIGURE: Status,
    Command.LIMITS: Status,
    Command.PULLS: Pulls,
    Command.TURN: Pulls,
}
BOUND = frozenset(
    {
        Command.PING,
        Command.ENABLE,
        Command.RATE,
        Command.TARGET,
        Command.JOG,
        Command.HOME,
        Command.CLEAR,
        Command.CONFIGURE,
        Command.LIMITS,
        Command.TURN,
    }
)
FEEDS_WATCHDOG = frozenset(
    {
        Command.PING,
        Command.ENABLE,
        Command.RATE,
        Command.TARGET,
        Command.JOG,
        Command.HOME,
        Command.STOP,
        Command.TURN,
    }
)
