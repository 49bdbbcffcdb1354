"""The experiment on hardware, real or emulated: homing, closed loop, trials, safety, log."""
