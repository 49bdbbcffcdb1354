"""How well and how fast markers are read on one thread: `python benchmarks/vision.py` (or `make bench`).

Small markers and those behind a tendon beside AprilTags (Olson, ICRA 2011; OpenCV's own quadrilaterals and corners).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame, Image
from wristctl.vision.detector import CELLS, Detector, outlined, print_of, square_angle
from wristctl.vision.marker import SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View

COUNT = 200
SIDES = (12, 16, 20, 25, 30, 40, 60)
WRIST = WristParameters(length=0.06)  # short, so that both markers are in the picture at 80 px too


def row(what: str, settings: SceneSettings, calibrated: bool = True) -> None:
    """Angles from -40 to 40 deg: their error, and processor time a frame with the last place known and without."""
    scene, rng = Scene(settings, WRIST), np.random.default_rng(0)
    tracker = Tracker(Markers(), scene.view if calibrated else View(), Gates())
    degrees, off, refused, side = np.linspace(-40.0, 40.0, COUNT), [], 0, 0.0
    bent = np.radians(degrees)[:, None, None] * np.full((1, 4), 0.25)
    frames = [Frame(scene.render(each, rng), k / 60, k) for k, each in enumerate(bent)]
    began = time.process_time()
    for frame, angle in zip(frames, degrees, strict=True):
        seen = tracker.see(frame)
        if seen.verdict is SightingVerdict.OK:
            off.append(math.degrees(seen.theta) - angle)
            side = float(np.linalg.norm(seen.corners[1][1] - seen.corners[1][0]))
        else:
            refused += 1
    tracked, detector = time.process_time(), Detector()
    for frame in frames:
        detector.everywhere(frame.image)
    searched = time.process_time()
    ms = 1e3 * (tracked - began) / COUNT, 1e3 * (searched - tracked) / COUNT
    sd, mean, worst = np.std(off), np.mean(off), np.abs(off).max()
    print(f"{what:34} {side:5.0f} {sd:9.3f} {mean:9.3f} {worst:9.3f} {refused:8d} {ms[0]:11.2f} {ms[1]:11.2f}")


def rendering(instants: int) -> float:
    """Processor time [ms] of one picture."""
    scene, rng = Scene(SceneSettings(), WristParameters()), np.random.default_rng(0)
    theta = np.linspace(0.1, 0.11, instants)[:, None] * np.ones(4)
    began = time.process_time()
    for _ in range(50):
        scene.render(theta, rng)
    return 20.0 * (time.process_time() - began)


class Reader(NamedTuple):
    """A kind of marker: its cells by its number, and what finds it in a picture."""

    drawn: Callable[[int], Image]
    read: Callable[[Image], dict[int, list[Array]]]


def one_marker(cells: Image, side: float, angle: float, crossed: bool, rng: np.random.Generator) -> Image:
    """A print, turned by an angle on grey, of a side [px] with its border, perhaps with a line of 2 px across it."""
    over, size = 8, int(2.4 * side) + 8
    centre = over * (0.5 * size + rng.uniform(-0.5, 0.5, 2))
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    turn *= over * side / (len(cells) - 2)
    shift = centre - 0.5 * turn @ np.full(2, len(cells) - 1.0)
    fine = cv2.warpAffine(
        cells, np.c_[turn, shift], (over * size, over * size), flags=cv2.INTER_NEAREST, borderValue=150
    )
    if crossed:
        lean, beside = rng.uniform(0.0, math.pi), rng.uniform(-0.3, 0.3) * side * over
        along = np.array([math.cos(lean), math.sin(lean)])
        begin, end = (centre + beside * np.array([-along[1], along[0]]) + far * over * size * along for far in (-1, 1))
        cv2.line(fine, tuple(begin.astype(int)), tuple(end.astype(int)), 40, 2 * over)
    small = cv2.resize(cv2.GaussianBlur(fine, (0, 0), 0.7 * over), (size, size), interpolation=cv2.INTER_AREA)
    seen = 13.0 + 0.6 * small + rng.normal(0.0, 4.0, small.shape)
    found: Image = np.clip(seen, 0.0, 255.0).round().astype(np.uint8)
    return found


def april(name: int, bits: int, our_corners: bool) -> Reader:
    """How AprilTags of so many bits across are drawn and read, with their own corners or those of our lines."""
    tags, parameters = cv2.aruco.getPredefinedDictionary(name), cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    detector = cv2.aruco.ArucoDetector(tags, parameters)

    def drawn(number: int) -> Image:
        return np.pad(cv2.aruco.generateImageMarker(tags, number, bits + 2).astype(np.uint8), 1, constant_values=255)

    def read(image: Image) -> dict[int, list[Array]]:
        corners, ids, _ = detector.detectMarkers(image)
        found = {}
        for each, number in zip(corners, () if ids is None else ids.ravel(), strict=True):
            own = each.reshape(4, 2).astype(np.float64)
            found[int(number)] = [outlined(image, own, CELLS) if our_corners else own]
        return found

    return Reader(drawn, read)


def small(crossed: bool) -> None:
    """Share found and scatter of the angle, by the marker's side."""
    detector = Detector()
    readers = {
        "ours, usual": Reader(print_of, detector.everywhere),
        "ours, fine": Reader(print_of, lambda image: detector.everywhere(image, fine=True)),
        "AprilTag 16h5": april(cv2.aruco.DICT_APRILTAG_16h5, 4, our_corners=False),
        "AprilTag 16h5, our corners": april(cv2.aruco.DICT_APRILTAG_16h5, 4, our_corners=True),
        "AprilTag 36h11": april(cv2.aruco.DICT_APRILTAG_36h11, 6, our_corners=False),
    }
    line = ", a line of 2 px across them" if crossed else ""
    print(f"\n{COUNT} markers turned by up to 45 deg{line}: found [%] and sd [deg], by side [px]")
    print(f"{'':26}" + "".join(f"{side:>15}" for side in SIDES))
    for label, reader in readers.items():
        cells = []
        for side in SIDES:
            rng, off = np.random.default_rng(1), []
            for _ in range(COUNT):
                angle, number = rng.uniform(-0.8, 0.8), int(rng.integers(0, 2))
                found = reader.read(one_marker(reader.drawn(number), side, angle, crossed, rng))
                if number in found:
                    turned = square_angle(found[number][0]) - angle
                    off.append(math.degrees(math.remainder(turned, 2.0 * math.pi)))
            cells.append(f"{100.0 * len(off) / COUNT:7.0f} {np.std(off) if off else math.nan:7.3f}")
        print(f"{label:26}" + "".join(cells))


def main() -> None:
    cv2.setNumThreads(1)
    print(f"{COUNT} rendered frames of 640 x 480 each, angles in deg, processor time in ms a frame")
    heads = ("side px", "sd", "mean", "worst", "refused", "tracking", "searching")
    print(f"{'':32} {heads[0]} {heads[1]:>9} {heads[2]:>9} {heads[3]:>9} {heads[4]:>8} {heads[5]:>11} {heads[6]:>11}")
    for distance in (0.30, 0.21, 0.165):
        for noise in (4.0, 10.0):
            row(f"noise {noise:g}", SceneSettings(distance=distance, height_above=0.019, noise=noise))
    for calibrated in (False, True):
        what = "homography" if calibrated else "no calibration"
        row(f"tilt 10 deg, {what}", SceneSettings(height_above=0.019, tilt_deg=10.0), calibrated)
    for crossed in (False, True):
        small(crossed)
    print(f"\nrendering a picture: {rendering(1):.1f} ms, as the mean of 4 instants {rendering(4):.1f} ms")


if __name__ == "__main__":
    main()
