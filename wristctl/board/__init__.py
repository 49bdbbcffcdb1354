"""The motor board and the camera, real or emulated."""
