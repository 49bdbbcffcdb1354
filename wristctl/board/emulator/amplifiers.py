"""HX711 load cell amplifiers on port F of the emulated chip: DOUT of axis k on bit 2 k, its clock on bit 2 k + 1.

By the data sheet: DOUT is low once a conversion is done. Each rising edge of the clock brings the next of its 24
bits, the highest first; the 25th asks for a gain of 128 again and lets DOUT go high until the next conversion. A
clock that is high for 60 us switches the amplifier off until it falls. Not in the data sheet: a conversion that
ends amid a reading replaces what is being read.
"""

from wristctl.board.emulator.chip import FREQUENCY, NEVER, Chip
from wristctl.lanes.compiled import compiled, kernel

PORT = 5  # F, in LETTERS
LATCH = 0x31
AMPLIFIERS = 4
# Columns of `Chip.amplifiers`: whether there is one, what it has converted (24 bits), pulses since (beyond 24: it has
# been read), the cycle at which the clock rose if it is high, and the cycle since which it is on.
FITTED, CONVERTED, PULSES, ROSE, ON_SINCE = range(5)
_BITS = 24
_READ = _BITS + 1
_LEAST, _MOST = -(1 << 23), (1 << 23) - 1
_OFF_AFTER = 60 * FREQUENCY // 1_000_000


@compiled
def clock_amplifiers(chip: Chip, before: int, after: int) -> None:
    """Take in a change of port F's latch."""
    for axis in range(AMPLIFIERS):
        clock, amplifier = 2 << 2 * axis, chip.amplifiers[axis]
        if not amplifier[FITTED] or not (before ^ after) & clock:
            continue
        if after & clock:
            amplifier[ROSE] = chip.cycles
            amplifier[PULSES] = min(amplifier[PULSES] + 1, _READ)
        elif chip.cycles - amplifier[ROSE] >= _OFF_AFTER:
            amplifier[PULSES], amplifier[ON_SINCE] = _READ, chip.cycles
        if not after & clock:
            amplifier[ROSE] = NEVER
        _drive(chip, axis)


@compiled
def _drive(chip: Chip, axis: int) -> None:
    pulses = chip.amplifiers[axis, PULSES]
    level = 1
    if pulses == 0:
        level = 0
    elif pulses <= _BITS:
        level = chip.amplifiers[axis, CONVERTED] >> (_BITS - pulses) & 1
    dout = 1 << 2 * axis
    chip.inputs[PORT, 0] |= dout
    chip.inputs[PORT, 1] = (chip.inputs[PORT, 1] & ~dout) | dout * level


@kernel
def fit(chip: Chip, axis: int, fitted: int) -> None:
    """Plug an amplifier in (1), or unplug it (0): then nothing drives DOUT."""
    amplifier = chip.amplifiers[axis]
    if amplifier[FITTED] == fitted:
        return
    amplifier[FITTED], amplifier[PULSES], amplifier[ROSE], amplifier[ON_SINCE] = fitted, _READ, NEVER, chip.cycles
    chip.inputs[PORT, 0] &= ~(1 << 2 * axis)
    if fitted:
        _drive(chip, axis)


@kernel
def convert(chip: Chip, axis: int, counts: int, since: int) -> None:
    """End a conversion to so many counts, of 24 bits; none where the amplifier was off after the cycle `since`."""
    amplifier = chip.amplifiers[axis]
    if not amplifier[FITTED] or amplifier[ON_SINCE] > since or chip.cycles - amplifier[ROSE] >= _OFF_AFTER:
        return
    amplifier[CONVERTED], amplifier[PULSES] = max(_LEAST, min(_MOST, counts)) & 0xFFFFFF, 0
    _drive(chip, axis)
