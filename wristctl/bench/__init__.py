"""The emulated bench: the step pulses of an emulated board move a simulated wrist, which a rendered camera sees."""
