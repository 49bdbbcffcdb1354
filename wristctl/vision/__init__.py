"""From a camera's picture to the bending angle: cameras, markers, calibration, and a rendered scene for all of it."""
