"""Dynamixel servos of the X series: control table, units, models and errors.

By the maker's e-manual (emanual.robotis.com, pages of each model). All of these take a current: Goal Current
limits what they pull with in the operating mode `CURRENT_BASED_POSITION`.
"""

import math
from typing import NamedTuple


class Item(NamedTuple):
    """Item of the control table."""

    address: int
    size: int
    """Bytes, least significant first."""
    signed: bool = False

    def encoded(self, value: int) -> bytes:
        """A value as the servo has it. Raises OverflowError where it does not fit."""
        return int(value).to_bytes(self.size, "little", signed=self.signed)

    def decoded(self, data: bytes | bytearray) -> int:
        """The value of such bytes."""
        return int.from_bytes(data, "little", signed=self.signed)


MODEL_NUMBER = Item(0, 2)
FIRMWARE = Item(6, 1)
RETURN_DELAY = Item(9, 1)
DRIVE_MODE = Item(10, 1)
OPERATING_MODE = Item(11, 1)
TEMPERATURE_LIMIT = Item(31, 1)
CURRENT_LIMIT = Item(38, 2)
TORQUE_ENABLE = Item(64, 1)
STATUS_RETURN_LEVEL = Item(68, 1)
HARDWARE_ERROR = Item(70, 1)
POSITION_P_GAIN = Item(84, 2)
BUS_WATCHDOG = Item(98, 1, signed=True)
GOAL_CURRENT = Item(102, 2, signed=True)
PROFILE_ACCELERATION = Item(108, 4)
PROFILE_VELOCITY = Item(112, 4)
GOAL_POSITION = Item(116, 4, signed=True)
REALTIME_TICK = Item(120, 2)
PRESENT_CURRENT = Item(126, 2, signed=True)
PRESENT_VELOCITY = Item(128, 4, signed=True)
PRESENT_POSITION = Item(132, 4, signed=True)
PRESENT_TEMPERATURE = Item(146, 1)
INDIRECT_ADDRESS = 168
"""Of the first of the two-byte addresses whose bytes stand side by side in the indirect data."""
INDIRECT_DATA = (224, 208)
"""Where that begins: at 208 in some firmware of the XL330 and XC330."""

COUNTS = 4096
"""Positions of a turn."""
FURTHEST = 256 * COUNTS
"""Position to either side that `CURRENT_BASED_POSITION` takes."""
CURRENT_BASED_POSITION = 5
"""Operating mode: positions over several turns, with no more than Goal Current."""
VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""[rad/s]"""
WATCHDOG_UNIT = 20e-3
"""[s]"""
TICKS = 32768
"""Milliseconds after which Realtime Tick begins anew."""

ERRORS = {0: "input voltage", 2: "overheating", 3: "motor encoder", 4: "electrical shock", 5: "overload"}
"""Names of the bits of Hardware Error Status."""


def named_errors(status: int) -> list[str]:
    """Names of a Hardware Error Status."""
    return [ERRORS.get(bit, f"bit {bit}") for bit in range(8) if status >> bit & 1]


class Model(NamedTuple):
    """A model that takes a current."""

    name: str
    current_unit: float
    """[A]"""


MODELS = {
    1000: Model("XH430-W350", 1.34e-3), 1010: Model("XH430-W210", 1.34e-3),
    1001: Model("XD430-T350", 1.34e-3), 1011: Model("XD430-T210", 1.34e-3),
    1040: Model("XH430-V350", 1.34e-3), 1050: Model("XH430-V210", 1.34e-3),
    1020: Model("XM430-W350", 2.69e-3), 1030: Model("XM430-W210", 2.69e-3),
    1100: Model("XH540-W270", 2.69e-3), 1110: Model("XH540-W150", 2.69e-3),
    1140: Model("XH540-V270", 2.69e-3), 1150: Model("XH540-V150", 2.69e-3),
    1120: Model("XM540-W270", 2.69e-3), 1130: Model("XM540-W150", 2.69e-3),
    1190: Model("XL330-M077", 1.0e-3), 1200: Model("XL330-M288", 1.0e-3),
    1210: Model("XC330-T181", 1.0e-3), 1220: Model("XC330-T288", 1.0e-3),
    1230: Model("XC330-M181", 1.0e-3), 1240: Model("XC330-M288", 1.0e-3),
}  # fmt: skip
"""By model number."""
