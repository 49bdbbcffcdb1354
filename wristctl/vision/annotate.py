"""Frames with what was seen in them drawn in: single ones, a few of a recording, a video."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.vision.camera import Frame, Image
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.raw_video import Video

_SPREAD, _REFUSED = 6, 3
_BASE, _TIP, _BAD, _PAPER = (178, 114, 0), (115, 158, 0), (0, 94, 213), (255, 255, 255)
"""Okabe and Ito's blue, green and vermillion, as OpenCV orders colours."""


def annotate(image: Image, sighting: Sighting) -> NDArray[np.uint8]:
    """A colour picture (height, width, 3, blue first): the markers' corners, the angle or why there is none."""
    made: Any = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    usable = sighting.verdict is SightingVerdict.OK
    for corners, colour in zip(sighting.corners, (_BASE, _TIP if usable else _BAD), strict=True):
        if np.isfinite(corners).all():
            cv2.polylines(made, [np.rint(8 * corners).astype(np.int32)], True, colour, 2, cv2.LINE_AA, 3)
            cv2.circle(made, np.rint(corners[0]).astype(int).tolist(), 4, colour, -1, cv2.LINE_AA)
    said = f"{math.degrees(sighting.theta):+.2f} deg" if usable else str(sighting.verdict)
    text = f"{sighting.time:.3f} s   {said}"
    size = max(0.4, image.shape[1] / 1100)
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    pad = height // 2
    cv2.rectangle(made, (0, 0), (width + 2 * pad, height + below + 2 * pad), _PAPER, -1)
    place = (pad, height + pad)
    cv2.putText(made, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, (0, 0, 0) if usable else _BAD, 1, cv2.LINE_AA)
    return np.asarray(made, np.uint8)


class Picked:
    """Six frames or so of a recording of any length: evenly spread, and the first of each kind that cannot be used."""

    def __init__(self) -> None:
        self._spread: list[tuple[int, NDArray[np.uint8]]] = []
        self._refused: dict[SightingVerdict, tuple[int, NDArray[np.uint8]]] = {}
        self._seen, self._every = 0, 1

    def offer(self, frame: Frame, sighting: Sighting) -> None:
        """Keep it if it is one of them."""
        number, self._seen = self._seen, self._seen + 1
        if number % self._every == 0:
            self._spread.append((number, annotate(frame.image, sighting)))
            if len(self._spread) > _SPREAD:
                self._spread, self._every = self._spread[::2], 2 * self._every
        if sighting.verdict is not SightingVerdict.OK and sighting.verdict not in self._refused:
            self._refused[sighting.verdict] = number, annotate(frame.image, sighting)

    def pictures(self) -> list[NDArray[np.uint8]]:
        """In the order of the recording."""
        known = dict(self._spread) | dict(list(self._refused.values())[:_REFUSED])
        return [known[number] for number in sorted(known)]


class AnnotatedVideo:
    """An annotated video."""

    def __init__(self, file: Path, frame_rate: float) -> None:
        self._video = Video(file, frame_rate)

    def add(self, frame: Frame, sighting: Sighting) -> None:
        """The next frame, annotated."""
        self._video.write(annotate(frame.image, sighting))

    def close(self) -> None:
        """Finish the file."""
        self._video.close()
