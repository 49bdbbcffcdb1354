"""Rendered pictures of the calibration board, held in all poses and then laid in the bending plane."""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.vision import CharucoBoard, SceneSettings
from wristctl.vision.camera import Frame, Image
from wristctl.vision.charuco import board_of
from wristctl.vision.pinhole import Pinhole
from wristctl.vision.scene import Film

_SQUARE, _FINE, _WALL = 96, 2, 122
"""Pixels of a square of the print, samples along a pixel's side, grey of what is behind."""
_TILT, _ROLL = (15.0, 40.0), (-25.0, 25.0)
"""Ranges [deg] in which the board is held."""
_NEAR, _FAR = 0.9, 1.5
"""Range of distances: the board's longer side over the picture's height at that distance, inverted."""


def board_shots(settings: SceneSettings, board: CharucoBoard, views: int, rng: np.random.Generator) -> Iterator[Frame]:
    """`views` pictures of the board, the last with the board lying in the bending plane."""
    camera, film = Pinhole(settings, "right"), Film(settings)
    rays = camera.rays(_FINE)
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
    """What the rays (h, w, 2) meet: a board with axes `turn` (3, 3), its middle at `move` (3,) [m]."""
    onto = np.linalg.inv(np.column_stack([turn[:, 0], turn[:, 1], move]))
    met = rays @ onto[:, :2].T + onto[:, 2]
    place = (met[..., :2] / met[..., 2:] + 0.5 * extent) * (print_.shape[1] / extent[0]) - 0.5
    x, y = (np.ascontiguousarray(place[..., k], np.float32) for k in (0, 1))
    seen = cv2.remap(print_, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=_WALL)
    return seen.astype(np.uint8, copy=False)


def _held(camera: Pinhole, number: int, views: int, extent: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """In somebody's hands: the middle going over the picture, tilted toward some side."""
    width, height = camera.size
    golden = math.tau * 0.381966 * number
    far = 0.36 * math.sqrt((number + 0.5) / (views - 1))
    pixel = np.array([(0.5 + far * math.cos(golden)) * width, (0.5 + far * math.sin(golden)) * height, 1.0])
    distance = rng.uniform(_NEAR, _FAR) * extent.max() * camera.matrix[0, 0] / height
    tilt, toward, roll = np.radians([rng.uniform(*each) for each in (_TILT, (0.0, 360.0), _ROLL)])
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
