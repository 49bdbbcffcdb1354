"""`hw calibrate`: the camera, the wrist, and the board to print."""
