"""Finding square markers in a picture, their print, and the angle of a square."""

import math
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.vision.camera import Image

# Rounds of refining: a round looks along the lines of the last one; a rough corner may be off by 2 px.
_ROUNDS = 2
# Distance of samples across a side [px]; places along a side at which it is looked for, at most.
_FINE, _PLACES = 0.5, 32


def outlined(image: NDArray[Any], corners: Array, cells: int) -> Array:
    """Corners (4, 2) [px], clockwise, of a black square of `cells` cells a side, found from rough ones.

    White is expected beyond the square, and looked for up to half a cell to either side of its rough outline; half a
    cell at either end of a side is left out, since corners are rounded by blur.
    """
    vertices = corners[:, 0] + 1j * corners[:, 1]
    for _ in range(_ROUNDS):
        vertices = _meeting(*_lines(image, vertices, 0.5 / cells))
    return np.stack([vertices.real, vertices.imag], axis=1)


def _lines(image: NDArray[Any], vertices: NDArray[np.complex128], margin: float) -> tuple[Any, Any]:
    """A point on, and the direction of, each side (4,) of the square of corners `vertices`.

    Across each of many places along a side, the edge is the centre of the rise to white, wherever it lies between
    pixels; a place counts by how much rise there is.
    """
    side = np.roll(vertices, -1) - vertices
    length = float(np.abs(side).mean())
    out, reach = -1j * side / np.abs(side), margin * length
    along = np.linspace(margin, 1.0 - margin, min(_PLACES, max(8, round(length))))
    across = np.linspace(-reach, reach, int(np.ceil(2.0 * reach / _FINE)) + 1)
    rise = np.diff(_greys(image, vertices, along, across), axis=2).clip(0.0)
    weight = rise.sum(axis=2) + 1e-9
    edge = rise @ (0.5 * (across[1:] + across[:-1])) / weight
    middle, off = (np.average(np.broadcast_to(values, edge.shape), 1, weight)[:, None] for values in (along, edge))
    from_middle = along - middle
    slope = (weight * from_middle * (edge - off)).sum(axis=1) / (weight * from_middle**2).sum(axis=1)
    return vertices + side * middle[:, 0] + out * off[:, 0], side + out * slope


def _greys(image: NDArray[Any], vertices: NDArray[np.complex128], along: Array, across: Array) -> Array:
    """Grey levels (4, a, b) at shares (a,) along each side of a square, so far (b,) [px] out of it."""
    side = np.roll(vertices, -1) - vertices
    out = -1j * side / np.abs(side)
    places = (vertices[:, None] + side[:, None] * along)[..., None] + across * out[:, None, None]
    flat = places.reshape(-1, len(across)).astype(np.complex64)
    grey = cv2.remap(image, flat.real, flat.imag, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return grey.reshape(places.shape).astype(float)


def _meeting(point: NDArray[np.complex128], along: NDArray[np.complex128]) -> NDArray[np.complex128]:
    before, ahead = np.roll(point, 1), np.roll(along, 1)
    share = ((point - before).conj() * along).imag / (ahead.conj() * along).imag
    met: NDArray[np.complex128] = before + share * ahead
    return met


# Corners (4, 2) [px] of each marker seen, by id: top left, top right, bottom right, bottom left of its print.
Found = dict[int, list[Array]]

# Dictionaries that a print may be of by mistake, those in which least is taken for a marker first.
_OTHERS = (
    "DICT_APRILTAG_36h11", "DICT_7X7_1000", "DICT_6X6_1000", "DICT_ARUCO_MIP_36h12", "DICT_5X5_1000",
    "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_25h9", "DICT_APRILTAG_16h5",
)  # fmt: skip

# Cells along a marker's side, with the black border; one more on either side stays white.
CELLS = 6
DICTIONARY = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
# Least and largest threshold window [px] of the usual search and of a fine one.
_WINDOWS = (15, 15), (5, 15)
_NEXT = [1, 2, 3, 0]
# Side of the part searched around the last place, in sides of the marker.
_NEAR_SIDES = 3.0


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


def side_angle(corners: Array) -> float:
    """Angle [rad] by which the left and right sides of a marker of corners (4, 2) are turned, as `square_angle`."""
    right, down = corners[0] + corners[1] - corners[2] - corners[3]
    return math.atan2(right, -down)


def edges(corners: Array) -> Array:
    """The four sides (4, 2) of a square of corners (4, 2), each from its corner to the next."""
    return corners[_NEXT] - corners


def askew(corners: Array) -> float:
    """Largest error [rad] of an angle in a plane where a square looks like this: corners (4, 2), by its affine part."""
    z = corners[:, 0] + 1j * corners[:, 1]
    upright = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    turned, mirrored = (abs(complex(np.vdot(shape, z - z.mean()))) for shape in (upright, upright.conj()))
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

    def other_dictionary(self, image: Image) -> str | None:
        """Name of another dictionary of which the picture shows a marker; None where it shows none."""
        for name in _OTHERS:
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
            corners, _, _ = cv2.aruco.ArucoDetector(dictionary, _parameters(0.03, _WINDOWS[0])).detectMarkers(image)
            if corners:
                return name
        return None

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
    parameters = cv2.aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMin, parameters.adaptiveThreshWinSizeMax = windows
    parameters.minMarkerPerimeterRate = least_perimeter
    return parameters


def _detect(detector: cv2.aruco.ArucoDetector, image: Image, left: int, top: int, blur: bool = True) -> Found:
    blurred = cv2.GaussianBlur(image, (3, 3), 0) if blur else image
    corners, ids, _ = detector.detectMarkers(blurred)
    markers: Found = {}
    offset = np.array([left, top], float)
    for rough, number in zip(corners, () if ids is None else ids.ravel(), strict=True):
        exact = outlined(blurred, rough.reshape(4, 2).astype(np.float64), CELLS)
        markers.setdefault(int(number), []).append(exact + offset)
    return markers


# Places along a side at which its outline is looked at; distance of samples across it [px].
_EDGE_PLACES, _EDGE_FINE = 24, 0.25


class PictureQuality(NamedTuple):
    """Sharpness and contrast of one marker in one picture."""

    side: float
    """Side of the black square [px]."""
    blur: float
    """Blur of the outline: standard deviation of a normal blur [px]."""
    black: float
    """Grey of its border, of 255."""
    white: float
    """Grey of the rim around it."""


def quality_of(image: Image, corners: Array) -> PictureQuality:
    """Measure the quality of the marker with these corners (4, 2) [px]."""
    side = float(np.hypot(*edges(corners).T).mean())
    reach = 0.5 * side / CELLS
    across = np.arange(-reach, reach + _EDGE_FINE, _EDGE_FINE)
    along = np.linspace(0.15, 0.85, _EDGE_PLACES)
    profile = _greys(image, corners[:, 0] + 1j * corners[:, 1], along, across).mean(axis=1)
    return PictureQuality(side, float(np.median([_width(rise) for rise in profile])),
                          float(np.median(profile[:, :3])), float(np.median(profile[:, -3:])))  # fmt: skip


def _width(profile: Array) -> float:
    rise = np.diff(profile).clip(0.0)
    distance = _EDGE_FINE * np.arange(len(rise))
    total = rise.sum() + 1e-9
    middle = float(rise @ distance) / total
    return float(np.sqrt(rise @ (distance - middle) ** 2 / total))
