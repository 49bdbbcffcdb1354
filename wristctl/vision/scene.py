"""Pictures of the wrist as a camera before it takes them: pose, lens, light, exposure and noise."""

import cmath
import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from wristctl.arrays import Array
from wristctl.config.camera import CharucoBoard, Markers, SceneSettings
from wristctl.config.choices import PLANTS, PLANTS_IN_SPACE
from wristctl.config.wrist import WristParameters
from wristctl.vision.bodies import Body, Carry, PlanarBody, SpatialBody
from wristctl.vision.camera import Frame, Image
from wristctl.vision.charuco import board_of
from wristctl.vision.detector import print_of
from wristctl.vision.scene_parts import BASE_AT, Stroke, clamp, fingers
from wristctl.vision.view import Pinhole, View

# Pixels of a print's cell, samples along a pixel's side under a marker, fraction bits of drawn corners.
_CELL, _FINE, _BITS = 16, 6, 4
_WALL, _EDGE = 122, 48
_LEVELS = 2**16


class Scene:
    """A camera before the wrist, with the two markers on flags in front of the bending plane.

    Of a wrist in two planes `plane` is the one that the camera looks at; None: it bends in that one alone.
    """

    def __init__(
        self, settings: SceneSettings, wrist: WristParameters, markers: Markers | None = None, plant: str = "pcc",
        plane: Literal[0, 1] | None = None,
    ) -> None:  # fmt: skip
        self._settings, self._markers = settings, markers or Markers()
        self.camera = Pinhole(settings, self._markers.positive)
        self._body: Body
        if plane is None:
            self._body = PlanarBody(PLANTS[plant].backbone, wrist)
        else:
            self._body = SpatialBody(PLANTS_IN_SPACE.named(plant).frames, wrist, plane, self.camera.side)
        numbers = self._markers.base, self._markers.tip
        self._prints = [self._printed(number) for number in numbers]
        self._film = Film(settings)
        still = np.full((settings.height, settings.width), _WALL, np.uint8)
        self._draw(still, *self._projected([clamp()]))
        self._still = [self._with_marker(still.copy(), tag, complex(BASE_AT), 1.0) for tag in self._prints]

    @property
    def view(self) -> View:
        """View of a perfect calibration of this camera."""
        return self.camera.view

    def render(
        self, theta: Array, rng: np.random.Generator, covered: bool = False, swapped: bool = False,
        across: float = 0.0, turned: float = 0.0,
    ) -> Image:  # fmt: skip
        """A picture (height, width) of the plant's coordinates (k, q) at k instants of the exposure, which it averages.

        `covered`: a hand lies over the tip's marker; `swapped`: the two markers have changed places; `across`: the
        wrist is bent away from the camera [rad]; `turned`: the tip's marker has slipped on its flag [rad].
        """
        instants = np.atleast_2d(theta)
        total = np.zeros(self._still[0].shape, np.float32)
        drawings = self._projected([self._body.strokes(instant) for instant in instants], self._body.carry(across))
        for angles, drawing in zip(instants, drawings, strict=True):
            image = self._still[swapped].copy()
            self._draw(image, drawing)
            centre, normal, marker, grip = self._body.disc(angles, across)
            self._with_marker(image, self._prints[not swapped], centre, normal * cmath.exp(1j * turned), marker)
            if covered:
                self._draw(image, *self._projected([fingers(centre, normal, -self._settings.marker_offset)], grip))
            cv2.accumulate(image, total)
        return self._film.expose(total, len(instants), rng)

    def _printed(self, number: int) -> Image:
        grey = 128 + self._settings.contrast * (print_of(number).astype(float) - 128)
        return np.rint(grey).astype(np.uint8).repeat(_CELL, axis=0).repeat(_CELL, axis=1)

    def _projected(
        self, drawings: Sequence[Sequence[Stroke]], carry: Carry | None = None
    ) -> list[list[tuple[Stroke, Array]]]:
        """Project strokes to pixels, carried where they move; all are projected at once."""
        strokes = [stroke for drawing in drawings for stroke in drawing]
        points = np.concatenate([stroke.points for stroke in strokes])
        pixels = self.camera.project(points if carry is None else carry(points))
        parts = iter(np.split(pixels, np.cumsum([len(stroke.points) for stroke in strokes])[:-1]))
        return [[(stroke, next(parts)) for stroke in drawing] for drawing in drawings]

    def _draw(self, image: Image, drawing: Sequence[tuple[Stroke, Array]]) -> None:
        for stroke, pixels in drawing:
            if stroke.how == "line":
                cv2.polylines(image, [_fixed(pixels)], False, stroke.grey, stroke.thickness, cv2.LINE_AA, _BITS)
            elif stroke.how == "hull":
                hull = _fixed(cv2.convexHull(pixels.astype(np.float32))[:, 0])
                cv2.fillConvexPoly(image, hull, stroke.grey, cv2.LINE_AA, _BITS)
                cv2.polylines(image, [hull], True, _EDGE, 1, cv2.LINE_AA, _BITS)
            elif self.camera.side * cv2.contourArea(pixels.astype(np.float32), oriented=True) > 0.0:
                cv2.fillConvexPoly(image, _fixed(pixels), stroke.grey, cv2.LINE_AA, _BITS)

    def _with_marker(
        self, image: Image, print_: Image, centre: complex, along: complex, carry: Carry | None = None
    ) -> Image:
        """Paint a print on its flag, its top edge toward `along`, carried with what it is fixed to.

        The lens's distortion within it is left out.
        """
        half = 0.5 * self._markers.side * print_.shape[0] / (print_.shape[0] - 2 * _CELL)
        right = 1j * self.camera.side
        places = centre + along * half * np.array([1 - right, 1 + right, -1 + right, -1 - right])
        depth = np.full(4, -self._settings.marker_offset)
        points = np.stack([places.real, places.imag, depth], axis=-1)
        corners = self.camera.project(points if carry is None else carry(points))
        start = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
        width, height = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 2, self.camera.size) - start
        if width <= 0 or height <= 0:
            return image
        size = len(print_)
        ends = np.array([[0, 0], [size, 0], [size, size], [0, size]], np.float32) - 0.5
        onto = ((corners - start + 0.5) * _FINE - 0.5).astype(np.float32)
        warp, fine = cv2.getPerspectiveTransform(ends, onto), (int(width) * _FINE, int(height) * _FINE)
        ink = cv2.warpPerspective(print_, warp, fine, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        ink = cv2.resize(ink, (int(width), int(height)), interpolation=cv2.INTER_AREA)
        part = image[start[1] : start[1] + height, start[0] : start[0] + width]
        mask = np.zeros(part.shape, np.uint8)
        cv2.fillConvexPoly(mask, _fixed(corners - start), 255, cv2.LINE_AA, _BITS)
        share = mask * np.float32(1 / 255)
        part[:] = np.rint(part + share * (ink - np.float32(1) * part))
        return image


class Film:
    """Light, blur and noise on the way from what is there to a picture."""

    def __init__(self, settings: SceneSettings) -> None:
        self._blur = settings.blur
        x, y = np.meshgrid(np.linspace(-0.5, 0.5, settings.width), np.linspace(-0.5, 0.5, settings.height))
        self._light = (1.0 - settings.gradient * (0.6 * x + 0.8 * y)).astype(np.float32)  # a lamp above, to the left
        # Normal noise by its quantiles: a fifth of the time of drawing it otherwise, which was most of a picture's.
        self._noise = (settings.noise * ndtri((np.arange(_LEVELS) + 0.5) / _LEVELS)).astype(np.float32)

    def expose(self, total: NDArray[np.float32], instants: int, rng: np.random.Generator) -> Image:
        """A picture (height, width) of the sum of so many instants; the sum is used up."""
        cv2.multiply(total, self._light, total, 1.0 / instants)
        if self._blur:
            cv2.GaussianBlur(total, (0, 0), self._blur, total)
        noise = self._noise.take(rng.integers(0, _LEVELS, total.shape, np.uint16), mode="wrap")
        return cv2.add(total, noise, dtype=cv2.CV_8U).astype(np.uint8, copy=False)


def _fixed(pixels: NDArray[Any]) -> NDArray[np.int32]:
    """Pixels as OpenCV draws fractions of them."""
    fixed_point: NDArray[np.int32] = np.rint(pixels * 2**_BITS).astype(np.int32)
    return fixed_point


# Pixels of a square of the print, samples along a pixel's side, grey of what is behind.
_SQUARE, _BOARD_FINE, _BOARD_WALL = 96, 2, 122
# Ranges [deg] in which the board is held.
_TILT, _ROLL = (15.0, 40.0), (-25.0, 25.0)
# Range of distances: the board's longer side over the picture's height at that distance, inverted.
_NEAR, _FAR = 0.9, 1.5


def board_shots(settings: SceneSettings, board: CharucoBoard, views: int, rng: np.random.Generator) -> Iterator[Frame]:
    """`views` pictures of the board, the last with the board lying in the bending plane."""
    camera, film = Pinhole(settings, "right"), Film(settings)
    rays = camera.rays(_BOARD_FINE)
    print_ = _printed(board, settings.contrast)
    extent = np.array([board.columns, board.rows]) * board.square
    for number in range(views):
        last = number == views - 1
        turn, move = _in_plane(camera, settings) if last else _held(camera, number, views, extent, rng)
        fine = _seen(print_, rays, turn, move, extent)
        total = cv2.resize(fine, camera.size, interpolation=cv2.INTER_AREA).astype(np.float32)
        yield Frame(film.expose(total, 1, rng), float(number), number)


def _printed(board: CharucoBoard, contrast: float) -> Image:
    size = board.columns * _SQUARE, board.rows * _SQUARE
    ideal = np.asarray(board_of(board).generateImage(size, marginSize=0), float)
    return np.rint(128 + contrast * (ideal - 128)).astype(np.uint8)


def _seen(print_: Image, rays: Array, turn: Array, move: Array, extent: Array) -> NDArray[np.uint8]:
    """Picture of a board along the rays (h, w, 2): its axes are `turn` (3, 3), its middle is at `move` (3,) [m]."""
    onto = np.linalg.inv(np.column_stack([turn[:, 0], turn[:, 1], move]))
    met = rays @ onto[:, :2].T + onto[:, 2]
    place = (met[..., :2] / met[..., 2:] + 0.5 * extent) * (print_.shape[1] / extent[0]) - 0.5
    x, y = (np.ascontiguousarray(place[..., k], np.float32) for k in (0, 1))
    picture = cv2.remap(print_, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=_BOARD_WALL)
    return picture.astype(np.uint8, copy=False)


def _held(camera: Pinhole, number: int, views: int, extent: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """In somebody's hands: the middle going over the picture, tilted toward some side."""
    width, height = camera.size
    golden = math.tau * 0.381966 * number
    far = 0.36 * math.sqrt((number + 0.5) / (views - 1))
    pixel = np.array([(0.5 + far * math.cos(golden)) * width, (0.5 + far * math.sin(golden)) * height, 1.0])
    distance = rng.uniform(_NEAR, _FAR) * extent.max() * camera.matrix[0, 0] / height
    tilt, toward, roll = np.radians([rng.uniform(*bounds) for bounds in (_TILT, (0.0, 360.0), _ROLL)])
    quarter = math.pi / 2 if number % 2 else 0.0
    axis = tilt * np.array([math.cos(toward), math.sin(toward), 0.0])
    turn = np.asarray(cv2.Rodrigues(axis)[0] @ cv2.Rodrigues(np.array([0.0, 0.0, roll + quarter]))[0], float)
    return turn, distance * np.linalg.solve(camera.matrix, pixel)


def _in_plane(camera: Pinhole, settings: SceneSettings) -> tuple[Array, Array]:
    """Lying in the bending plane before the wrist, on its side, a little askew."""
    askew = math.radians(93.0)
    right, down = camera.rotation @ [0.0, camera.side, 0.0], camera.rotation @ [-1.0, 0.0, 0.0]
    along = math.cos(askew) * right + math.sin(askew) * down
    across = -math.sin(askew) * right + math.cos(askew) * down
    middle = camera.rotation @ [settings.height_above, 0.0, 0.0] + camera.translation
    return np.stack([along, across, np.cross(along, across)], axis=1), middle
