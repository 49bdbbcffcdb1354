"""View of the bending plane: lens, distortion, and the homography that sets the plane square."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.config.camera import SceneSettings
from wristctl.errors import UserError
from wristctl.plain_files import read_json

if TYPE_CHECKING:
    from wristctl.records import Run


SCHEMA, FILE = "wristctl.camera/1", "data/camera.json"
_ARRAYS = "camera_matrix", "distortion", "plane"


def _nominal() -> Array:
    return np.eye(3)


@dataclass(frozen=True)
class View:
    """A camera's intrinsics and its place before the bending plane. The default one stands square, with no distortion.

    Rectified points are metres in the bending plane where it was calibrated, else pixels; x goes right and y down
    either way, so that a marker's angle is the same up to a constant.
    """

    camera_matrix: Array = field(default_factory=_nominal)
    """(3, 3) [px]"""
    distortion: Array = field(default_factory=lambda: np.zeros(4))
    """k1, k2, p1, p2"""
    plane: Array = field(default_factory=_nominal)
    """(3, 3) undistorted pixels to the bending plane"""
    size: tuple[int, int] | None = None
    """(width, height) [px] of the pictures it holds for; None: any"""

    def rectify(self, points: Array) -> Array:
        """Pixels (k, 2) to points (k, 2) of the bending plane. Exact also for parallel planes, but for a scale."""
        if self.distortion.any():
            points = self.undistort(points)
        homogeneous = points @ self.plane[:, :2].T + self.plane[:, 2]
        return homogeneous[:, :2] / homogeneous[:, 2:]

    def undistort(self, points: Array) -> Array:
        """Pixels (k, 2) as a lens without distortion would give them."""
        lens = self.camera_matrix, self.distortion
        pixels = cv2.undistortPoints(points.reshape(-1, 1, 2), *lens, P=self.camera_matrix)
        return pixels.reshape(-1, 2).astype(np.float64)

    def check_size(self, width: int, height: int, where: str) -> None:
        """Raises UserError where pictures have another size than those it was calibrated with."""
        if self.size is not None and self.size != (width, height):
            problem = f"pictures of {width} x {height}, but the calibration is of {self.size[0]} x {self.size[1]}"
            raise UserError(problem, where, "calibrate the camera at this size: wristctl hw calibrate camera", 4)

    def save(self, file: Path, **more: Any) -> None:
        """Write it as JSON, with what else is known of the calibration."""
        arrays = {name: getattr(self, name).tolist() for name in _ARRAYS}
        text = json.dumps({"schema": SCHEMA, "size": self.size, **arrays, **more}, indent=2, allow_nan=False)
        file.write_text(text + "\n", encoding="utf-8")

    @classmethod
    def of(cls, run: Run | None) -> Self:
        """As a calibrate-camera run found it; square without one. Raises UserError."""
        return cls.load(run.file(FILE)) if run else cls()

    @classmethod
    def load(cls, file: Path) -> Self:
        """Read what `save` wrote. Raises UserError."""
        try:
            arrays = read_json(file)
            if arrays["schema"] != SCHEMA:
                raise ValueError(arrays["schema"])
            matrix, distortion, plane = (np.array(arrays[name], float) for name in _ARRAYS)
            width, height = arrays["size"]
            return cls(matrix, distortion, plane, (int(width), int(height)))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise UserError("not a camera calibration", str(file), "wristctl hw calibrate camera") from error


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
        tilt, pan, roll = (math.radians(deg) for deg in (settings.tilt_deg, settings.pan_deg, settings.roll_deg))
        turned = turn(2, roll) @ turn(0, tilt) @ turn(1, self.side * pan)
        self.rotation = turned @ square
        self.translation = np.array([0.0, 0.0, settings.distance]) - self.rotation @ [settings.height_above, 0.0, 0.0]

    def project(self, points: Array) -> Array:
        """World points (..., 3) [m] to pixels (..., 2)."""
        in_camera = points @ self.rotation.T + self.translation
        u, v = in_camera[..., 0] / in_camera[..., 2], in_camera[..., 1] / in_camera[..., 2]
        stretch = 1.0 + self.distortion[0] * (u * u + v * v)
        (fx, _, cx), (_, fy, cy), _ = self.matrix
        return np.stack([fx * stretch * u + cx, fy * stretch * v + cy], axis=-1)

    @property
    def view(self) -> View:
        """View of a perfect calibration of this camera."""
        onto = np.stack([self.side * self.rotation[:, 1], -self.rotation[:, 0], self.translation], axis=1)
        return View(self.matrix, self.distortion, np.linalg.inv(self.matrix @ onto), self.size)

    def rays(self, fine: int) -> Array:
        """Directions (height * fine, width * fine, 2), where depth is 1, of `fine` x `fine` points of each pixel."""
        x, y = ((np.arange(count * fine) + 0.5) / fine - 0.5 for count in self.size)
        pixels = np.stack(np.meshgrid(x, y), axis=-1)
        undistorted = cv2.undistortPoints(pixels.reshape(-1, 1, 2), self.matrix, self.distortion)
        return undistorted.reshape(pixels.shape).astype(np.float64)


def turn(axis: int, angle: float) -> Array:
    """Rotation (3, 3) about an axis, 0 to 2, by an angle [rad]."""
    rotation: Array = cv2.Rodrigues(angle * np.eye(3)[axis])[0]
    return rotation
