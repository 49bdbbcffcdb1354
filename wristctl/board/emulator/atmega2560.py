"""An ATmega2560 at 16 MHz in virtual time: run cycles, write and read bytes, see and drive pins."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.board.emulator import amplifiers
from wristctl.board.emulator import chip as state
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.execute import run
from wristctl.board.emulator.interrupts import EXTERNAL, POWER_ON, reset
from wristctl.board.emulator.peripherals import LETTERS, levels
from wristctl.board.emulator.program import decode, read_hex, self_program
from wristctl.board.emulator.registers import GLOBAL_INTERRUPT, SREG, read, write

FIRMWARE = Path(__file__).parents[1] / "firmware" / "wrist.hex"
# Byte address at which a Mega's boot loader begins.
BOOT_SECTION = 0x3E000

ESTOP_INPUT = ("G", 0)  # D41
ALARM_INPUTS = tuple(("L", bit) for bit in range(4))  # D49 to D46

EDGE = np.dtype([("cycle", np.uint64), ("port", np.uint8), ("value", np.uint8)])


class Halted(RuntimeError):
    """The program did what this emulator, or the chip, cannot do."""


class Atmega2560:
    """The chip of a Mega 2560 board, running an Intel hex file from flash; its inputs are closed to GND.

    `baud` is the rate of bytes to the receiver; None means the rate that the program itself has set. With a
    `boot_loader` (another hex file) reset starts that. The first chip on a machine takes some 15 s, to be compiled.
    """

    def __init__(
        self, program: Path | None = FIRMWARE, baud: int | None = None, boot_loader: Path | None = None
    ) -> None:
        self._chip = state.new_chip()
        for image in (program, boot_loader):
            for address, payload in (read_hex(Path(image)) if image else {}).items():
                self._chip.flash[address : address + len(payload)] = np.frombuffer(payload, np.uint8)
        decode(self._chip.flash, self._chip.program)
        self._chip.reset_pc = BOOT_SECTION // 2 if boot_loader else 0
        self._chip.line_byte = round(10 * state.FREQUENCY / baud) if baud else 0
        self._sent = bytearray()
        self._edges: list[NDArray[np.int64]] = []
        for closed in (ESTOP_INPUT, *ALARM_INPUTS):
            self.drive(*closed, False)
        reset(self._chip, POWER_ON)
        self.run(0)

    @property
    def cycles(self) -> int:
        """Cycles since power-on."""
        return int(self._chip.cycles)

    @property
    def lost_bytes(self) -> int:
        """Bytes that overran the receiver's FIFO since power-on."""
        return int(self._chip.lost)

    @property
    def bytes_coming(self) -> int:
        """Bytes written that have not arrived in the receiver yet."""
        return int(self._chip.line_head - self._chip.line_tail)

    def run(self, cycles: int, until_sent: bool = False) -> None:
        """Run for `cycles` and at most an instruction more, or until a byte has been sent. Raises Halted."""
        chip = self._chip
        chip.stop_when_sent = until_sent
        until = chip.cycles + int(cycles)
        while True:
            why = run(chip, until)
            if chip.sent_count:
                self._sent += chip.sent[: chip.sent_count].tobytes()
                chip.sent_count = 0
            if why in (state.RUNNING, state.BYTE_SENT):
                return
            if why == state.FLASH_CHANGED:
                self_program(chip)
            elif why == state.BUFFER_FULL:
                self._keep_edges()
            else:
                raise self._halted(why)

    def write(self, data: bytes) -> None:
        """Queue bytes on the line to the receiver; they arrive one after another."""
        chip, line = self._chip, self._chip.line
        if self.bytes_coming + len(data) > len(line):
            raise ValueError(f"more than {len(line)} bytes on the line")
        places = np.arange(int(chip.line_head), int(chip.line_head) + len(data)) % len(line)
        line[places] = np.frombuffer(data, np.uint8)
        chip.line_head += len(data)

    def read(self) -> bytes:
        """Read the transmitter's bytes since the last call."""
        sent = bytes(self._sent)
        self._sent.clear()
        return sent

    def pin(self, port: str, bit: int) -> bool:
        """Level on a pin: of an output its latch, of an input what drives it, else its pull-up."""
        return bool(int(levels(self._chip, LETTERS.index(port))) >> bit & 1)

    def drive(self, port: str, bit: int, level: bool) -> None:
        """Put a level on an input from outside."""
        row = self._chip.inputs[LETTERS.index(port)]
        row[0] |= 1 << bit
        row[1] = (row[1] & ~(1 << bit)) | level << bit

    def fit_amplifier(self, axis: int, fitted: bool) -> None:
        """Plug the HX711 of an axis in, or unplug it; at power-on there is none."""
        amplifiers.fit(self._chip, axis, int(fitted))

    def convert(self, axis: int, counts: int, since: int) -> None:
        """Let the HX711 of an axis have converted so many of its 24 bits' counts from the cycle `since` until now."""
        amplifiers.convert(self._chip, axis, counts, since)

    def events(self) -> NDArray[np.void]:
        """Changes of the output latches since the last call: cycle, port (ord of its letter), value."""
        self._keep_edges()
        rows = np.concatenate(self._edges)
        self._edges.clear()
        events = np.zeros(len(rows), EDGE)
        for column, name in enumerate(("cycle", "port", "value")):
            events[name] = rows[:, column]
        return events

    def jump(self, address: int) -> int:
        """Put the main program at a byte address, once it has interrupts on; the byte address where it was."""
        while not self._chip.memory[SREG] & GLOBAL_INTERRUPT:
            self.run(1)
        was, self._chip.pc = 2 * self._chip.pc, address // 2
        return int(was)

    def poke(self, address: int, value: int) -> None:
        """Store a byte at an address of the data space, as a program would."""
        write(self._chip, address, value)
        if self._chip.halt == state.NOT_EMULATED:
            raise self._halted(state.NOT_EMULATED)

    def peek(self, address: int) -> int:
        """Load a byte from an address of the data space, as a program would."""
        return int(read(self._chip, address))

    def ram(self, address: int, count: int) -> NDArray[np.int32]:
        """Bytes of memory, read from outside the chip."""
        return self._chip.memory[address : address + count].copy()

    def reset(self) -> None:
        """Pull the reset pin; bytes on the line are lost."""
        reset(self._chip, EXTERNAL)

    def close(self) -> None:
        """Nothing to give back: here so that every emulator ends alike."""

    def _halted(self, why: int) -> Halted:
        problem = "not an instruction" if why == state.ILLEGAL else "a device mode that is not emulated"
        return Halted(f"{problem}, near byte address {2 * self._chip.pc - 2:#x}")

    def _keep_edges(self) -> None:
        self._edges.append(self._chip.edges[: self._chip.edge_count].copy())
        self._chip.edge_count = 0


class VirtualTransport:
    """The wire to an emulated chip in the same process."""

    name = "emulated"
    boot_time = 0.0

    def __init__(self, chip: Atmega2560 | None = None) -> None:
        self.chip = chip or Atmega2560()

    def write(self, data: bytes) -> None:
        """Put bytes on the line."""
        self.chip.write(data)

    def read(self, timeout: float) -> bytes:
        """Read the chip's bytes; runs it for up to `timeout` s until there are some."""
        end = self.chip.cycles + max(1, round(timeout * FREQUENCY))
        while not (data := self.chip.read()) and self.chip.cycles < end:
            self.chip.run(end - self.chip.cycles, until_sent=True)
        return data

    def now(self) -> float:
        """Seconds on the chip's clock."""
        return self.chip.cycles / FREQUENCY

    def wait(self, seconds: float) -> None:
        """Run the chip for so long."""
        self.chip.run(round(seconds * FREQUENCY))

    def close(self) -> None:
        """Nothing to give back."""
