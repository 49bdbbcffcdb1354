"""An ATmega2560 of our own: the board's firmware runs on it without a board, in virtual or in real time."""

from wristctl.board.emulator.atmega2560 import Atmega2560, Halted

__all__ = ["Atmega2560", "Halted"]
