"""A camera of known place and lens: world points to pixels, and the calibration that would find it."""

from __future__ import annotations

import math
from typing import Literal

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.config.vision import SceneSettings
from wristctl.vision.view import View


class Pinhole:
    """The rendered camera. World: x along the base's tangent, y toward theta > 0, depth away from the camera.

    It stands `distance` from the point (height_above, 0, 0) of the bending plane, where depth is 0, and looks at it,
    x up in the picture and y to the right (`positive` right) or left.
    """

    def __init__(self, settings: SceneSettings, positive: Literal["right", "left"]) -> None:
        self.size = settings.width, settings.height
        focal = 0.5 * settings.width / math.tan(math.radians(0.5 * settings.field_deg))
        centre = (0.5 * (settings.width - 1), 0.5 * (settings.height - 1))
        self.matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
        self.distortion = np.array([settings.distortion, 0.0, 0.0, 0.0])
        self.side = 1.0 if positive == "right" else -1.0
        # Rows: the camera's right, down and forward axes in the world.
        square = np.array([[0.0, self.side, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        tilt, pan, roll = (math.radians(each) for each in (settings.tilt_deg, settings.pan_deg, settings.roll_deg))
        turned = _turn(2, roll) @ _turn(0, tilt) @ _turn(1, self.side * pan)
        self.rotation = turned @ square
        self.translation = np.array([0.0, 0.0, settings.distance]) - self.rotation @ [settings.height_above, 0.0, 0.0]

    def project(self, points: Array) -> Array:
        """World points (..., 3) [m] to pixels (..., 2)."""
        seen = points @ self.rotation.T + self.translation
        u, v = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
        stretch = 1.0 + self.distortion[0] * (u * u + v * v)
        (fx, _, cx), (_, fy, cy), _ = self.matrix
        return np.stack([fx * stretch * u + cx, fy * stretch * v + cy], axis=-1)

    @property
    def view(self) -> View:
        """What a perfect calibration of this camera finds."""
        onto = np.stack([self.side * self.rotation[:, 1], -self.rotation[:, 0], self.translation], axis=1)
        return View(self.matrix, self.distortion, np.linalg.inv(self.matrix @ onto), self.size)

    def rays(self, fine: int) -> Array:
        """Directions (height * fine, width * fine, 2), where depth is 1, of `fine` x `fine` points of each pixel."""
        x, y = ((np.arange(count * fine) + 0.5) / fine - 0.5 for count in self.size)
        pixels = np.stack(np.meshgrid(x, y), axis=-1)
        found = cv2.undistortPoints(pixels.reshape(-1, 1, 2), self.matrix, self.distortion)
        return found.reshape(pixels.shape).astype(np.float64)


def _turn(axis: int, angle: float) -> Array:
    made: Array = cv2.Rodrigues(angle * np.eye(3)[axis])[0]
    return made
