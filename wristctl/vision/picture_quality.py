"""How well a marker is pictured: its size, how sharp its outline is, and how dark and bright its print comes out."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from wristctl.arrays import Array
from wristctl.vision.camera import Image
from wristctl.vision.detector import CELLS, edges

_PLACES, _FINE = 24, 0.25
"""Places along a side at which its outline is looked at; distance of samples across it [px]."""


class PictureQuality(NamedTuple):
    """Of one marker in one picture."""

    side: float
    """Of the black square [px]."""
    blur: float
    """Of its outline: standard deviation of a normal blur [px]."""
    black: float
    """Grey of its border, of 255."""
    white: float
    """Grey of the rim around it."""


def quality_of(image: Image, corners: Array) -> PictureQuality:
    """Of the marker with these corners (4, 2) [px]."""
    side = float(np.hypot(*edges(corners).T).mean())
    reach = 0.5 * side / CELLS
    across = np.arange(-reach, reach + _FINE, _FINE)
    at = corners[:, 0] + 1j * corners[:, 1]
    along = np.roll(at, -1) - at
    out = -1j * along / np.abs(along)
    places = at[:, None] + along[:, None] * np.linspace(0.15, 0.85, _PLACES)
    points = (places[..., None] + across * out[:, None, None]).reshape(-1, len(across)).astype(np.complex64)
    grey = cv2.remap(image, points.real, points.imag, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    profile = grey.reshape(4, _PLACES, -1).astype(float).mean(axis=1)
    return PictureQuality(side, float(np.median([_width(each) for each in profile])),
                          float(np.median(profile[:, :3])), float(np.median(profile[:, -3:])))  # fmt: skip


def _width(profile: Array) -> float:
    """Standard deviation [px] of a rise, about its middle."""
    rise = np.diff(profile).clip(0.0)
    at = _FINE * np.arange(len(rise))
    total = rise.sum() + 1e-9
    middle = float(rise @ at) / total
    return float(np.sqrt(rise @ (at - middle) ** 2 / total))
