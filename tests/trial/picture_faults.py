"""Pictures that light, lens or camera spoil while every motor does as it should: what is said of them?

`python -m tests.trial.picture_faults` tries each in a trial in one plane and in one of two, and tells how it ended.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tests.trial.conftest import WRIST
from tests.trial.fault_runs import as_limited
from wristctl.bench.virtual_bench import VirtualBench, VirtualCamera
from wristctl.config.hw_run import HwRunSettings
from wristctl.errors import UserError
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.trials import trials_of
from wristctl.vision.camera import Frame, Image
from wristctl.vision.detector import Detector
from wristctl.vision.view import View

# What a picture becomes so many seconds after the fault began.
Spoil = Callable[[Image, float], Image]

AT = 0.4
"""When it begins: seconds after the motion has."""
_DETECTOR = Detector()


def _lit(image: Image, gain: Any) -> Image:
    lit: Image = np.clip(image * gain, 0.0, 255.0).astype(np.uint8)
    return lit


def _banded(image: Image, time: float) -> Image:
    """A rolling shutter under pulsed light: rows brighter and darker by a quarter, wandering."""
    rows = np.sign(np.sin(math.tau * (np.arange(len(image)) / 40.0 + 7.3 * time)))
    return _lit(image, 1.0 + 0.25 * rows[:, None])


def _packed(image: Image, time: float) -> Image:
    """JPEG of quality 6, for half a second."""
    if time > 0.5:
        return image
    packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 6])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE), np.uint8)


def _mirrored_below(image: Image, time: float) -> Image:
    """A glossy table: the lower half shows the upper one, too."""
    return _lit(0.75 * image + 0.35 * image[::-1], 1.0)


def _zoomed(image: Image, time: float) -> Image:
    """The zoom ring slips: 3 % longer within a second."""
    height, width = image.shape
    turn = cv2.getRotationMatrix2D((0.5 * width, 0.5 * height), 0.0, 1.0 + 0.03 * min(time, 1.0))
    return cv2.warpAffine(image, turn, (width, height), borderMode=cv2.BORDER_REPLICATE).astype(np.uint8)


def _dirty(image: Image, time: float) -> Image:
    """A spot on one corner of each marker, an eighth of a side."""
    image = image.copy()
    for places in _DETECTOR.everywhere(image).values():
        for corners in places:
            size = max(2, round(math.dist(corners[1], corners[0]) / 10.0))
            cv2.circle(image, (int(corners[0][0]), int(corners[0][1])), size, (20,), -1)
    return image


def _rim_covered(image: Image, time: float) -> Image:
    """6 % of the tip's marker hidden at one side, for half a second."""
    image = image.copy()
    if time <= 0.5:
        for corners in _DETECTOR.everywhere(image).get(1, []):
            low, high = corners.min(axis=0), corners.max(axis=0)
            right = int(low[0] + 0.06 * (high[0] - low[0]))
            cv2.rectangle(image, (int(low[0]) - 6, int(low[1]) - 6), (right, int(high[1]) + 6), (120,), -1)
    return image


def _panned(image: Image, time: float, pan: float = 1.0, tilt: float = 0.0) -> Image:
    """The camera turns by so many degrees a second."""
    height, width = image.shape
    focal = 0.5 * width / math.tan(math.radians(30.0))
    lens = np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])
    turn = cv2.Rodrigues(np.radians([tilt * time, pan * time, 0.0]))[0]
    seen = cv2.warpPerspective(
        image, lens @ turn @ np.linalg.inv(lens), (width, height), borderMode=cv2.BORDER_REPLICATE
    )
    return seen.astype(np.uint8)


FAULTS: dict[str, Spoil] = {
    "exposure of a cold start": lambda image, time: _lit(image, 1.0 + 2.5 * max(0.0, 1.0 - time / 0.8)),
    "exposure that hunts": lambda image, time: _lit(image, 1.0 + 0.6 * math.sin(math.tau * 2.0 * time)),
    "bands of pulsed light": _banded,
    "JPEG of quality 6": _packed,
    "reflection in the table": _mirrored_below,
    "zoom of 3 %": _zoomed,
    "dirt on a corner": _dirty,
    "rim covered by 6 %": _rim_covered,
    "pan of 1 deg/s": _panned,
    "tilt of 1 deg/s": lambda image, time: _panned(image, time, 0.0, 1.0),
}


class Spoiled(VirtualCamera):
    """A bench's camera whose pictures are spoiled from a while after the motion has begun."""

    def __init__(self, bench: VirtualBench, number: int, spoil: Spoil) -> None:
        super().__init__(bench, number)
        self._bench, self._spoil = bench, spoil

    def newest(self) -> Frame | None:
        frame = super().newest()
        if frame is None:
            return None
        time = frame.time - self._bench.faults._starts["first trial"] - AT
        return frame if time < 0.0 else frame._replace(image=self._spoil(frame.image, time))


def performed(spoil: Spoil | None, planes: int = 1, **bench: Any) -> tuple[str, str]:
    """How a trial of 30 deg on the emulated rig ended, and what was odd in it, both cameras' pictures spoiled alike."""
    directions = ("ulnar",) if planes == 1 else ("ulnar-flexion",)
    given = {"planes": planes, "directions": directions, "push": {"force": 0.0}, "horizon": 2.5}
    settings = as_limited(HwRunSettings.model_validate({**given, "bench": {"person": {"takes": 0.0}, **bench}}))
    made = VirtualBench(settings.bench, WRIST, 0, settings.markers, settings.markers_2 if planes == 2 else None)
    if spoil is not None:
        made.cameras = tuple(Spoiled(made, number, spoil) for number in range(planes))
    with tempfile.TemporaryDirectory() as folder:
        log = log_of(Path(folder), settings, WRIST)
        done = Experiment(settings, WRIST, trials_of(settings, np.random.default_rng(0)), log)
        try:
            done.run(BoardStand(EmulatedTestbed(made, settings, [View(), View()], None)))
        except UserError:
            pass
        finally:
            log.close()
    return done.outcomes.get(0, "before the trial"), done.odd.get(0, "")


def main() -> int:
    """Tell how each ends."""
    for planes in (1, 2):
        for name, spoil in FAULTS.items():
            print(planes, name, performed(spoil, planes), sep=" | ", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
