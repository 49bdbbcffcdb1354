"""The calibration board (ChArUco), seen in pictures, and the camera that those views tell."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.camera import CalibrateCameraSettings, CharucoBoard
from wristctl.errors import UserError
from wristctl.vision.camera import Frame, Image
from wristctl.vision.view import View

DICTIONARY = cv2.aruco.DICT_5X5_50
LEAST_VIEWS = 8
_LEAST_CORNERS = 8
# Rows and columns of the picture's parts by which coverage is counted.
_CELLS = (6, 8)
# A view is new where the corners it shares with each one taken before lie this share of the width away, on average.
_NEW = 0.06
_PLACES = (("upper left", "top", "upper right"), ("left", "middle", "right"), ("lower left", "bottom", "lower right"))


class BoardView(NamedTuple):
    """The board's inner corners in one picture."""

    name: str
    corners: Array
    """(k, 2) [px]"""
    places: Array
    """(k, 2) on the board [m]: x along its columns, y down its rows, from the upper left"""
    numbers: NDArray[np.int64]
    """(k,) which corner of the board each is"""


class CameraCalibration(NamedTuple):
    """A camera as its views tell it."""

    view: View
    error: float
    """Reprojection error (RMS over all corners) [px]"""
    errors: Array
    """(v,) the same for each view [px]"""
    residuals: list[Array]
    """(k, 2) of each view: seen less expected [px]"""
    deviation: Array
    """(8,) standard deviation of fx, fy, cx, cy [px], k1, k2, p1, p2"""
    tilts: Array
    """(v,) angle between the board and the picture [rad]"""
    coverage: float
    """Share of the picture in which corners were seen"""
    plane_error: float
    """Distance of the corners of the view in the bending plane from where its homography puts them (RMS) [m]"""


def board_of(settings: CharucoBoard) -> cv2.aruco.CharucoBoard:
    """The board in OpenCV's terms."""
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    return cv2.aruco.CharucoBoard((settings.columns, settings.rows), settings.square, settings.marker, dictionary)


class BoardFinder:
    """Finds the board in pictures."""

    def __init__(self, settings: CharucoBoard) -> None:
        board = board_of(settings)
        self._detector = cv2.aruco.CharucoDetector(board)
        self._places = np.asarray(board.getChessboardCorners(), np.float64)[:, :2]

    def find(self, image: Image, name: str) -> BoardView | None:
        """The board in a picture (height, width), None where too little of it is seen to count."""
        corners, ids, _, _ = self._detector.detectBoard(image)
        if ids is None or len(ids) < _LEAST_CORNERS:
            return None
        numbers = np.asarray(ids, np.int64).ravel()
        places = self._places[numbers]
        if np.linalg.matrix_rank(places - places.mean(axis=0), tol=1e-6) < 2:
            return None  # all on one line of the board
        return BoardView(name, np.asarray(corners, np.float64).reshape(-1, 2), places, numbers)


class Album:
    """Views as they come: at most `most` that differ from each other are kept (None: all), and the last one seen."""

    def __init__(self, settings: CharucoBoard, most: int | None = None) -> None:
        self._finder, self._most = BoardFinder(settings), most
        self.views: list[BoardView] = []
        self.last: BoardView | None = None
        self.last_picture: Image | None = None
        self.pictures = 0
        self.size: tuple[int, int] | None = None

    def look(self, frame: Frame, name: str) -> bool:
        """Whether the frame's view was kept. Raises UserError where pictures differ in size."""
        size = frame.image.shape[1], frame.image.shape[0]
        if self.size is not None and self.size != size:
            problem = f"pictures of {size[0]} x {size[1]} and of {self.size[0]} x {self.size[1]}"
            raise UserError(problem, name, "calibrate with pictures of one size, that of the later recordings")
        self.size, self.pictures = size, self.pictures + 1
        board = self._finder.find(frame.image, name)
        if board is None:
            return False
        self.last, self.last_picture = board, frame.image
        new = all(_apart(board, view) > _NEW * size[0] for view in self.views)
        if self._most is None or (len(self.views) < self._most and new):
            self.views.append(board)
            return True
        return False

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Mask (rows, columns) of the picture's parts that hold corners."""
        return _seen(self.views, self.size or (1, 1))


def _apart(a: BoardView, b: BoardView) -> float:
    _, first, second = np.intersect1d(a.numbers, b.numbers, return_indices=True)
    return float(np.linalg.norm(a.corners[first] - b.corners[second], axis=1).mean()) if len(first) else math.inf


def _seen(views: Sequence[BoardView], size: tuple[int, int]) -> NDArray[np.bool_]:
    corners = np.concatenate([view.corners for view in views]) if views else np.empty((0, 2))
    x, y = (np.clip(corners[:, k] / size[k] * _CELLS[1 - k], 0, _CELLS[1 - k] - 1).astype(int) for k in (0, 1))
    covered = np.zeros(_CELLS, bool)
    covered[y, x] = True
    return covered


def least_seen(covered: NDArray[np.bool_]) -> str:
    """The ninth of the picture with the fewest corners, in words."""
    thirds = [np.array_split(row, 3, axis=1) for row in np.array_split(covered, 3, axis=0)]
    shares = np.array([[part.mean() for part in row] for row in thirds])
    row, column = np.unravel_index(int(shares.argmin()), shares.shape)
    return _PLACES[row][column]


def calibrate(
    views: Sequence[BoardView], plane: BoardView | None, size: tuple[int, int], settings: CalibrateCameraSettings
) -> CameraCalibration:
    """Intrinsics and distortion from views of the board (Zhang 2000), and the bending plane from the view in it.

    Raises UserError (exit code 3) where views are too few, leave too much of the picture unseen, are all square to
    the camera, or fit no camera.
    """
    _refuse_few(views, size, settings)
    flat = [np.column_stack([view.places, np.zeros(len(view.places))]).astype(np.float32) for view in views]
    pixels = [view.corners.astype(np.float32) for view in views]
    start, nothing = np.eye(3), np.zeros(5)
    error, matrix, distortion, turns, moves, deviation, _, errors = cv2.calibrateCameraExtended(
        flat, pixels, size, start, nothing, flags=cv2.CALIB_FIX_K3
    )
    residuals = [
        corners - cv2.projectPoints(board, turn, move, matrix, distortion)[0].reshape(-1, 2)
        for corners, board, turn, move in zip(pixels, flat, turns, moves, strict=True)
    ]
    tilts = np.array([math.acos(min(1.0, abs(float(cv2.Rodrigues(turn)[0][2, 2])))) for turn in turns])
    if math.degrees(tilts.max()) < settings.tilt_deg:
        problem = f"no view is tilted by {settings.tilt_deg:g} deg: the focal length cannot be told from the distance"
        raise _refused(problem, "turn the board 20 to 40 deg to the camera in most views, in different directions")
    if error > settings.error:
        worst = views[int(np.argmax(errors))].name
        problem = f"reprojection error {error:.2f} px (worst: view {worst}), more than {settings.error:g} px"
        raise _refused(problem, "use a flat board, sharp pictures, and the board's own squares: --set board.square=...")
    lens = View(np.asarray(matrix, float), np.asarray(distortion, float).ravel()[:4], size=size)
    homography, off = _plane(lens, plane) if plane is not None else (np.eye(3), math.nan)
    return CameraCalibration(
        view=View(lens.camera_matrix, lens.distortion, homography, size),
        error=float(error),
        errors=np.asarray(errors, float).ravel(),
        residuals=[np.asarray(residual, float) for residual in residuals],
        deviation=np.asarray(deviation, float).ravel()[:8],
        tilts=tilts,
        coverage=float(_seen(views, size).mean()),
        plane_error=off,
    )


def plane_tilt(view: View) -> float:
    """Angle [rad] between the camera's axis and the bending plane's normal, from the plane's homography."""
    across, down = (np.linalg.inv(view.plane)[:, k] for k in (0, 1))
    normal = np.cross(np.linalg.solve(view.camera_matrix, across), np.linalg.solve(view.camera_matrix, down))
    return math.acos(min(1.0, abs(float(normal[2])) / float(np.linalg.norm(normal))))


def _plane(lens: View, board: BoardView) -> tuple[Array, float]:
    """The homography from undistorted pixels to the plane that the board lies in, and its RMS error [m]."""
    straight = lens.undistort(board.corners)
    homography = np.asarray(cv2.findHomography(straight, board.places)[0], float)
    off = View(plane=homography).rectify(straight) - board.places
    return homography, float(np.sqrt((off**2).sum(axis=1).mean()))


def _refuse_few(views: Sequence[BoardView], size: tuple[int, int], settings: CalibrateCameraSettings) -> None:
    if len(views) < LEAST_VIEWS:
        problem = f"{len(views)} different views of the board, {LEAST_VIEWS} are needed"
        raise _refused(problem, "show the whole board sharp and well lit, each time in another place and tilt")
    covered = _seen(views, size)
    if covered.mean() < settings.coverage:
        problem = f"the board was seen in {covered.mean():.0%} of the picture, {settings.coverage:.0%} are needed"
        raise _refused(problem, f"show it nearer, and toward the edges: least was seen at the {least_seen(covered)}")


def _refused(problem: str, fix: str) -> UserError:
    return UserError(problem, "calibration", fix, exit_code=3)
