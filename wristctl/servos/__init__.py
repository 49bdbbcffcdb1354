"""Smart servos on a serial bus as a rig: Dynamixel X, sensors of the bend, and a bus that is emulated."""
