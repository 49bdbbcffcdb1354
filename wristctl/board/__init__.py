"""The motor board: protocol, firmware, flashing, and the emulator that runs the very same image."""
