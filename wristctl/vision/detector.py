"""Finding square markers in a picture, their print, and the angle of a square."""

from __future__ import annotations

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.vision.camera import Image
from wristctl.vision.outline import outlined

Found = dict[int, list[Array]]
"""Corners (4, 2) [px] of each marker seen, by id: top left, top right, bottom right, bottom left of its print."""

CELLS = 6
"""Cells along a marker's side, with the black border; one more on either side stays white."""
DICTIONARY = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
_WINDOWS = (15, 15), (5, 15)
"""Least and largest threshold window [px] of the usual search and of a fine one."""
_NEXT = [1, 2, 3, 0]
_NEAR_SIDES = 3.0
"""Side of the part searched around the last place, in sides of the marker."""


def print_of(number: int) -> Image:
    """A marker's cells (8, 8) with its quiet zone: 0 is black, 255 white."""
    inner = cv2.aruco.generateImageMarker(DICTIONARY, number, CELLS)
    return np.pad(inner.astype(np.uint8), 1, constant_values=255)


def square_angle(corners: Array) -> float:
    """Angle [rad] by which a square of corners (4, 2) is turned, + clockwise where y goes down, by least squares.

    The square of angle 0 has its top edge up.
    """
    z = corners[:, 0] + 1j * corners[:, 1]
    upright = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    return float(np.angle(np.vdot(upright, z - z.mean())))


def edges(corners: Array) -> Array:
    """The four sides (4, 2) of a square of corners (4, 2), each from its corner to the next."""
    return corners[_NEXT] - corners


def askew(corners: Array) -> float:
    """Largest error [rad] of an angle in a plane where a square looks like this: corners (4, 2), by its affine part."""
    z = corners[:, 0] + 1j * corners[:, 1]
    upright = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    turned, mirrored = (abs(complex(np.vdot(each, z - z.mean()))) for each in (upright, upright.conj()))
    return float(np.arcsin(min(1.0, mirrored / turned)))


class Detector:
    """Finds markers in the whole picture, or around where one was.

    One threshold window and a 3x3 blur: faster than the default passes and more accurate, as long as a marker has 40 px
    or more. A fine search, of narrower windows and without the blur, finds smaller ones: nearly all of 20 px, where
    AprilTags are found no more often and turn more (benchmarks/vision.py). The corners are those of lines through the
    marker's sides.
    """

    def __init__(self) -> None:
        self._whole, self._whole_fine = (cv2.aruco.ArucoDetector(DICTIONARY, _parameters(0.03, w)) for w in _WINDOWS)
        self._near, self._near_fine = (cv2.aruco.ArucoDetector(DICTIONARY, _parameters(0.5, w)) for w in _WINDOWS)

    def everywhere(self, image: Image, fine: bool = False) -> Found:
        """All markers of the picture."""
        return _detect(self._whole_fine if fine else self._whole, image, 0, 0, not fine)

    def around(self, image: Image, corners: Array) -> Found:
        """The markers around where one had these corners (4, 2) [px]; by a fine search where there is none."""
        half = 0.5 * _NEAR_SIDES * float(np.hypot(*edges(corners).T).mean())
        (x, y), (height, width) = corners.mean(axis=0), image.shape
        left, top = max(0, int(x - half)), max(0, int(y - half))
        part = image[top : min(height, int(y + half)), left : min(width, int(x + half))]
        if min(part.shape, default=0) == 0:
            return {}
        return _detect(self._near, part, left, top) or _detect(self._near_fine, part, left, top, blur=False)


def _parameters(least_perimeter: float, windows: tuple[int, int]) -> cv2.aruco.DetectorParameters:
    """With a perimeter of this share of the picture's longer side, and least and largest threshold window [px]."""
    made = cv2.aruco.DetectorParameters()
    made.adaptiveThreshWinSizeMin, made.adaptiveThreshWinSizeMax = windows
    made.minMarkerPerimeterRate = least_perimeter
    return made


def _detect(detector: cv2.aruco.ArucoDetector, image: Image, left: int, top: int, blur: bool = True) -> Found:
    blurred = cv2.GaussianBlur(image, (3, 3), 0) if blur else image
    corners, ids, _ = detector.detectMarkers(blurred)
    found: Found = {}
    offset = np.array([left, top], float)
    for each, number in zip(corners, () if ids is None else ids.ravel(), strict=True):
        exact = outlined(blurred, each.reshape(4, 2).astype(np.float64), CELLS)
        found.setdefault(int(number), []).append(exact + offset)
    return found
