"""How well and how fast markers are read on one thread: `python benchmarks/vision.py` (or `make bench`)."""

from __future__ import annotations

import math
import time

import cv2
import numpy as np

from wristctl.config.vision import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.detector import Detector
from wristctl.vision.marker import SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View

COUNT = 200
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
    print(f"\nrendering a picture: {rendering(1):.1f} ms, as the mean of 4 instants {rendering(4):.1f} ms")


if __name__ == "__main__":
    main()
