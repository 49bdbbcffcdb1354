"""How good the angles of a recording are, by the recording alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.vision.detector import askew
from wristctl.vision.marker import Sighting
from wristctl.vision.view import View


def angle_noise(angles: Array) -> float:
    """Standard deviation of one angle of a sequence (F,), in its unit; nan where no three in a row are finite.

    From second differences, in which a steady motion is nothing: of independent errors of one variance they have six
    times that variance (1 + 4 + 1).
    """
    jerks = np.diff(angles, 2)
    found = jerks[np.isfinite(jerks)]
    return float(np.sqrt(np.mean(found**2) / 6.0)) if len(found) else math.nan


def base_askew(view: View, sightings: Sequence[Sighting]) -> float:
    """How far off an angle may be [rad], by how square the base's marker looks on average in the calibrated view.

    Of the sightings with an angle, of which there must be one.
    """
    seen = np.array([each.corners[0] for each in sightings if math.isfinite(each.theta)])
    return askew(view.rectify(np.nanmean(seen, axis=0)))
