"""What spoils a picture on its way from the camera."""

from __future__ import annotations

import cv2
import numpy as np

from wristctl.config.injected import FaultKind
from wristctl.vision.camera import Image
from wristctl.vision.detector import print_of

PICTURE_FAULTS: tuple[FaultKind, ...] = (
    "camera-frozen-clock", "picture-dark", "picture-bright", "picture-blurred", "picture-smeared", "picture-mirrored",
    "picture-turned", "picture-shifted", "picture-other", "marker-twice",
)  # fmt: skip
_HAZE, _SIDE, _CORNER = 60.0, 64, 20


def spoiled(image: Image, kind: FaultKind, size: float, number: int, rng: np.random.Generator) -> Image:
    """The picture (height, width) of frame `number` under a fault of this kind."""
    height, width = image.shape
    if kind in ("picture-dark", "picture-bright"):
        haze = _HAZE if kind == "picture-bright" and size > 2.0 else 0.0
        lit: Image = np.clip(size * image.astype(np.float32) + haze, 0, 255).astype(np.uint8)
        return lit
    if kind == "picture-blurred":
        return cv2.GaussianBlur(image, (0, 0), size).astype(np.uint8, copy=False)
    if kind == "picture-smeared":
        return cv2.blur(image, (round(size), 1)).astype(np.uint8, copy=False)
    if kind == "picture-mirrored":
        return cv2.flip(image, 1).astype(np.uint8, copy=False)
    if kind == "picture-turned":
        turn = cv2.getRotationMatrix2D((0.5 * width, 0.5 * height), size, 1.0)
        return cv2.warpAffine(image, turn, (width, height), borderMode=cv2.BORDER_REPLICATE).astype(np.uint8)
    if kind == "picture-shifted":
        rolled: Image = np.roll(image, round(size), axis=1)
        return rolled
    if kind == "picture-other":
        return rng.integers(0, 255, image.shape, np.uint8)
    image = image.copy()
    if kind == "marker-twice":
        part = cv2.resize(print_of(round(size)), (_SIDE, _SIDE), interpolation=cv2.INTER_NEAREST)
        image[_CORNER : _CORNER + _SIDE, _CORNER : _CORNER + _SIDE] = part
    else:
        image[0, 0] = number % 256
    return image
