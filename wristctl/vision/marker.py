"""The wrist's angle from its two markers, frame by frame, and the gates that an angle must pass."""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Literal, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.camera import Gates, Markers
from wristctl.vision.camera import Frame, Image
from wristctl.vision.camera_pose import CameraPose, pose_of
from wristctl.vision.detector import Detector, edges, side_angle, square_angle
from wristctl.vision.view import View

_UNSEEN = np.full((4, 2), np.nan)
_BEFORE = [3, 0, 1, 2]
# Least length over width of a marker on a tilted disc: 66 deg.
_TILTED = 0.4
# Seconds between two searches of the whole picture for a second marker of the same id, and for another dictionary's.
_LOOK_ROUND, _LOOK_ELSEWHERE = 0.15, 0.5


class SightingVerdict(StrEnum):
    """Whether a sighting can be used, and if not why."""

    OK = "ok"
    NO_TIP = "no tip"
    NO_BASE = "no base"
    DICTIONARY = "other dictionary"
    TWICE = "twice"
    SHAPE = "shape"
    BASE_MOVED = "base moved"
    SWAPPED = "swapped"
    JUMP = "jump"
    FROZEN = "frozen"
    STAMP = "stamp"


MEANING = {
    SightingVerdict.OK: "both markers seen, or the tip's with a base seen shortly before",
    SightingVerdict.NO_TIP: "the marker on the last disc is not seen",
    SightingVerdict.NO_BASE: "the marker on the clamp has not been seen whole for longer than base_memory",
    SightingVerdict.DICTIONARY: "neither marker has been seen yet, and one of another ArUco dictionary is",
    SightingVerdict.TWICE: "a marker's id is seen in two places",
    SightingVerdict.SHAPE: "the tip's marker is no square: a corner is hidden, or it is bent or smeared",
    SightingVerdict.BASE_MOVED: "the marker on the clamp is not where it was: camera or clamp has moved",
    SightingVerdict.SWAPPED: "the markers have changed places",
    SightingVerdict.JUMP: "the angle has changed faster than the motors can move the wrist",
    SightingVerdict.FROZEN: "picture, or corners to 1/1000 px, of a moment ago: the camera repeats itself (in trials)",
    SightingVerdict.STAMP: "the driver's time stamp or count stands still, goes back or is of the future (in trials)",
}


class Sighting(NamedTuple):
    """Result of one frame: the angle, or the verdict why there is none."""

    time: float
    """Time of the frame [s]"""
    number: int
    """Number of the frame"""
    theta: float
    """Bending angle [rad], nan unless the verdict is ok"""
    verdict: SightingVerdict
    corners: Array
    """(2, 4, 2) [px] of the base's and the tip's marker, nan where it is not seen"""
    size: float = math.nan
    """Size of the tip's marker over the base's, by the edges that a bend across the plane does not foreshorten"""
    came: float = math.nan
    """When the frame was there to be looked at [s]; nan in recordings"""
    tip_x: float = math.nan
    """Distance of the tip's marker from the first disc, along the base's marker [m]; nan unless the verdict is ok"""
    tip_y: float = math.nan
    """Distance of the tip's marker across the base's, toward theta > 0 [m]"""
    plane: int = 0
    """Bending plane that the camera looks at: 0 ulnar-radial, 1 flexion-extension"""
    stands: float = math.nan
    """Size of the base's marker over its own average, 1 of one that stands; nan where it is not seen"""
    grey: float = math.nan
    """Mean grey level around the base's marker, 0 to 255; nan where it is not seen"""


class _Base(NamedTuple):
    corners: Array  # (4, 2) rectified
    frames: int
    seen: float


class Tracker:
    """Follows the two markers; `zero` [rad] is the angle between them on the straight wrist.

    The base is clamped, so its place is averaged over `base_memory` and believed for as long while it is not seen.
    Markers are looked for around their last place, and in the whole picture where they are not found there, and several
    times a second for others of the same id, at every frame while there is one: finely, which takes longer, as long as
    no usual search has found both.

    Of a wrist that bends in two planes `plane` is the one that the camera looks at. The tip's marker may then be tilted
    by the other bend: the angle is that of its sides alone, and what is judged of its shape is that they are parallel.
    """

    def __init__(
        self, markers: Markers, view: View, gates: Gates, zero: float = 0.0, plane: Literal[0, 1] | None = None
    ) -> None:
        self._plane = plane
        self._markers, self._view, self._gates, self.zero = markers, view, gates, zero
        self._detector, self._calibrated = Detector(), view.size is not None
        self._last_seen: dict[int, Array] = {}
        self._base: _Base | None = None
        self._used: tuple[float, float] | None = None
        self._look_round = self._look_elsewhere = -math.inf
        self._elsewhere = False
        self._small = True
        self._picture = 0, 0
        self._pose: CameraPose | None = None

    @property
    def side(self) -> float:
        """1 where the angle counts positive toward the right of the picture, else -1."""
        return 1.0 if self._markers.positive == "right" else -1.0

    @property
    def view(self) -> View:
        """The view by which the next frame is seen."""
        return self._view if self._pose is None else self._pose.view

    def stand_square(self, sightings: Sequence[Sighting]) -> CameraPose | None:
        """Set the plane square by the markers of these sightings of a wrist at rest, from the next frame on.

        None, and nothing changed, where the camera has been calibrated, or the markers are not seen.
        """
        whole = [sighting.corners for sighting in sightings if np.isfinite(sighting.corners).all()]
        if not whole or self._calibrated:
            return None
        self._pose = pose_of(whole, self._picture, self._markers)
        return self._pose

    def see(self, frame: Frame) -> Sighting:
        """The angle in a frame; frames come in the order of time. Raises UserError for pictures of another size."""
        self._picture = frame.image.shape[1], frame.image.shape[0]
        self._view.check_size(*self._picture, "camera")
        if self._pose is not None:
            self._view, self._base, self._pose = self._pose.view, None, None
        markers = self._find(frame)
        bases, tips = (markers.get(number, []) for number in (self._markers.base, self._markers.tip))
        verdict, theta = self._judge(frame.time, bases, tips)
        if verdict is SightingVerdict.NO_TIP and self._sees_another_dictionary(frame):
            verdict = SightingVerdict.DICTIONARY
        size, tip, looks = math.nan, (math.nan, math.nan), (math.nan, math.nan)
        if verdict is SightingVerdict.OK and self._base is not None:
            self._used = frame.time, theta
            rectified = self._view.rectify(tips[0])
            size, tip = _width(rectified) / _width(self._base.corners), self._place(self._base.corners, rectified)
            if bases:
                stands = _side(self._view.rectify(bases[0])) / _side(self._base.corners)
                looks = stands, _grey(frame.image, bases[0])
        shown = np.stack([corners[0] if corners else _UNSEEN for corners in (bases, tips)])
        return Sighting(frame.time, frame.number, theta, verdict, shown, size, math.nan, *tip, self._plane or 0, *looks)

    def _find(self, frame: Frame) -> dict[int, list[Array]]:
        wanted = (self._markers.base, self._markers.tip)
        markers = {}
        for number, corners in self._last_seen.items():
            near = self._detector.around(frame.image, corners)
            if number in near:
                markers[number] = near[number]
        if len(markers) < 2 or frame.time >= self._look_round:
            self._look_round = frame.time + _LOOK_ROUND
            everywhere = self._everywhere(frame.image, wanted)
            twice = {number: places for number, places in everywhere.items() if len(places) > 1}
            markers = {**markers, **twice} if len(markers) == 2 else everywhere
            if twice:
                self._look_round = frame.time
        self._last_seen = {number: places[0] for number, places in markers.items()}
        return markers

    def _sees_another_dictionary(self, frame: Frame) -> bool:
        """Whether the picture shows a marker of one, where none of ours has been seen yet."""
        if self._base is not None or self._used is not None or self._last_seen:
            return False
        if frame.time >= self._look_elsewhere:
            self._look_elsewhere = frame.time + _LOOK_ELSEWHERE
            self._elsewhere = self._detector.other_dictionary(frame.image) is not None
        return self._elsewhere

    def _everywhere(self, image: Image, wanted: tuple[int, int]) -> dict[int, list[Array]]:
        markers = self._detector.everywhere(image)
        self._small = self._small and not markers.keys() >= set(wanted)
        if self._small:
            markers = self._detector.everywhere(image, fine=True) | markers
        return {number: self._followed(number, places) for number, places in markers.items() if number in wanted}

    def _followed(self, number: int, places: list[Array]) -> list[Array]:
        """Markers of one id, sorted by their distance from its last place."""
        last = self._last_seen.get(number)
        return places if last is None else sorted(places, key=lambda corners: float(np.abs(corners - last).max()))

    def _judge(self, time: float, bases: list[Array], tips: list[Array]) -> tuple[SightingVerdict, float]:
        if len(bases) > 1 or len(tips) > 1:
            return SightingVerdict.TWICE, math.nan
        base, tip = ([self._view.rectify(marker) for marker in corners] for corners in (bases, tips))
        base = [marker for marker in base if self._is_square(marker)]
        if tip and not (self._is_square(tip[0]) if self._plane is None else self._is_tilted_square(tip[0])):
            return SightingVerdict.SHAPE, math.nan
        if self._base is not None and time - self._base.seen > self._gates.base_memory:
            self._base = None
        moved = base and self._has_moved(base[0])
        if tip and (references := [self._base.corners] if self._base else base) and not _ahead(references[0], tip[0]):
            return SightingVerdict.SWAPPED, math.nan
        if moved:
            return SightingVerdict.BASE_MOVED, math.nan
        if base:
            self._average(time, base[0])
        if not tip:
            return SightingVerdict.NO_TIP, math.nan
        if self._base is None:
            return SightingVerdict.NO_BASE, math.nan
        theta = self._angle(self._base.corners, tip[0])
        if self._used is not None:
            before, last = self._used
            allowed = self._gates.rate * (time - before) + math.radians(self._gates.margin_deg)
            if abs(theta - last) > allowed:
                return SightingVerdict.JUMP, math.nan
        return SightingVerdict.OK, theta

    def _angle(self, base: Array, tip: Array) -> float:
        angle = square_angle if self._plane is None else side_angle
        turned = self.side * (angle(tip) - square_angle(base)) - self.zero
        return math.remainder(turned, math.tau)

    def _place(self, base: Array, tip: Array) -> tuple[float, float]:
        """Middle of the tip's marker in the base's axes [m]; the base's own sides are the scale, so none is asked."""
        along, right = base[0] + base[1] - base[2] - base[3], base[1] + base[2] - base[0] - base[3]
        away, side = tip.mean(axis=0) - base.mean(axis=0), self._markers.side
        x, y = (2.0 * side * float(away @ axis) / float(axis @ axis) for axis in (along, right))
        return self._markers.base_at + x, self.side * y

    def _is_square(self, corners: Array) -> bool:
        along = edges(corners)
        sides = np.hypot(*along.T)
        cosines = (along * along[_BEFORE]).sum(axis=1) / (sides * sides[_BEFORE])
        skew = math.degrees(math.asin(min(1.0, float(np.abs(cosines).max()))))
        return bool(sides.max() <= self._gates.side_ratio * sides.min()) and skew <= self._gates.corner_deg

    def _is_tilted_square(self, corners: Array) -> bool:
        """Whether opposite sides are alike and parallel, and the print is not seen from too far aside."""
        along = edges(corners)
        ratio = along[:2, 0] + 1j * along[:2, 1]
        ratio /= -(along[2:, 0] + 1j * along[2:, 1])
        alike = np.abs(np.log(np.abs(ratio))).max() <= math.log(self._gates.side_ratio)
        parallel = np.abs(np.angle(ratio)).max() <= math.radians(self._gates.corner_deg)
        least, most = np.linalg.svd(along[:2] - along[2:], compute_uv=False)[::-1]
        return bool(alike and parallel and least >= _TILTED * most)

    def _has_moved(self, corners: Array) -> bool:
        if self._base is None:
            return False
        side = math.dist(*self._base.corners[:2])
        away = float(np.hypot(*(corners - self._base.corners).T).max())
        return away > self._gates.base_shift * side

    def _average(self, time: float, corners: Array) -> None:
        if self._base is None:
            self._base = _Base(corners, 1, time)
            return
        count = self._base.frames + 1
        share = max(1.0 / count, -math.expm1((self._base.seen - time) / self._gates.base_memory))
        self._base = _Base(self._base.corners + share * (corners - self._base.corners), count, time)


def _ahead(base: Array, tip: Array) -> bool:
    """Whether the tip's marker lies before the base's, in the direction of its top edge, by a side at least."""
    up = base[0] + base[1] - base[2] - base[3]
    return float(up @ (tip.mean(axis=0) - base.mean(axis=0))) > 0.5 * float(up @ up)


def _width(corners: Array) -> float:
    return 0.5 * (math.dist(corners[0], corners[1]) + math.dist(corners[3], corners[2]))


def _side(corners: Array) -> float:
    return float(np.hypot(*edges(corners).T).mean())


def _grey(image: Image, corners: Array) -> float:
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    return float(image[max(0, low[1]) : high[1], max(0, low[0]) : high[0]].mean())
