"""USART0, 8N1: a transmitter with one byte waiting, a receiver with its FIFO of two bytes (data sheet, ch. 22).

The receiver keeps a third byte in its shift register until the next start bit; then that byte is lost and DOR set.
"""

from wristctl.board.emulator.chip import BUFFER_FULL, BYTE_SENT, LOOK, NEVER, RX_BYTE, TX_BYTE, Chip
from wristctl.lanes.compiled import compiled

UCSRA, UCSRB, UBRR, UDR = 0xC0, 0xC1, 0xC4, 0xC6
RXC, TXC, UDRE, DOR, U2X = 0x80, 0x40, 0x20, 0x08, 0x02
RXEN, TXEN = 0x10, 0x08


@compiled
def byte_cycles(chip: Chip) -> int:
    """Cycles that ten bits take at the rate the program has set."""
    memory = chip.memory
    return 10 * (8 if memory[UCSRA] & U2X else 16) * ((memory[UBRR] | memory[UBRR + 1] << 8) + 1)


@compiled
def _start_bit(chip: Chip) -> None:
    """A byte begins on the line; where a byte still waits behind the full FIFO, that one is lost."""
    if chip.held >= 0:
        chip.held = -1
        chip.lost += 1
        chip.memory[UCSRA] |= DOR
    chip.due[RX_BYTE] = chip.cycles + (chip.line_byte if chip.line_byte else byte_cycles(chip))
    chip.next = min(chip.next, chip.due[RX_BYTE])


@compiled
def start_line(chip: Chip) -> None:
    """Let the bytes that wait on the line begin to arrive."""
    if chip.due[RX_BYTE] == NEVER and chip.line_tail < chip.line_head:
        _start_bit(chip)


@compiled
def byte_arrived(chip: Chip) -> None:
    """The receiver has shifted in a whole byte."""
    memory = chip.memory
    byte = chip.line[chip.line_tail % len(chip.line)]
    chip.line_tail += 1
    if memory[UCSRB] & RXEN:
        if chip.fifo_count == 0:
            chip.fifo_first = byte
        elif chip.fifo_count == 1:
            chip.fifo_second = byte
        else:
            chip.held = byte
        chip.fifo_count = min(chip.fifo_count + 1, 2)
        memory[UCSRA] |= RXC
        chip.check |= LOOK
    chip.due[RX_BYTE] = NEVER
    start_line(chip)


@compiled
def read_byte(chip: Chip) -> int:
    """Read UDR."""
    memory = chip.memory
    byte = chip.fifo_first
    if chip.fifo_count:
        chip.fifo_first = chip.fifo_second
        chip.fifo_count -= 1
        if chip.held >= 0:
            chip.fifo_second, chip.held = chip.held, -1
            chip.fifo_count += 1
    if chip.fifo_count == 0:
        memory[UCSRA] &= ~RXC
    memory[UCSRA] &= ~DOR
    return byte


@compiled
def write_byte(chip: Chip, byte: int) -> None:
    """Write UDR."""
    memory = chip.memory
    if not memory[UCSRB] & TXEN:
        return
    if chip.shifting < 0:
        chip.shifting = byte
        chip.due[TX_BYTE] = chip.cycles + byte_cycles(chip)
        chip.next = min(chip.next, chip.due[TX_BYTE])
    else:
        chip.waiting = byte
        memory[UCSRA] &= ~UDRE


@compiled
def byte_sent(chip: Chip) -> None:
    """The transmitter has shifted out a whole byte."""
    memory = chip.memory
    chip.sent[chip.sent_count] = chip.shifting
    chip.sent_count += 1
    if chip.stop_when_sent:
        chip.halt = BYTE_SENT
    if chip.sent_count == len(chip.sent):
        chip.halt = BUFFER_FULL
    chip.shifting, chip.waiting = chip.waiting, -1
    if chip.shifting >= 0:
        chip.due[TX_BYTE] += byte_cycles(chip)
        memory[UCSRA] |= UDRE
    else:
        chip.due[TX_BYTE] = NEVER
        memory[UCSRA] |= TXC
    chip.check |= LOOK


@compiled
def write_control(chip: Chip, address: int, value: int) -> None:
    """Write UCSR0A or UCSR0B."""
    memory = chip.memory
    if address == UCSRA:
        memory[UCSRA] = (memory[UCSRA] & ~3 & ~(value & TXC)) | (value & 3)
        return
    memory[UCSRB] = value
    chip.check |= LOOK
    if not value & RXEN:
        chip.fifo_count, chip.held = 0, -1
        memory[UCSRA] &= ~(RXC | DOR)
