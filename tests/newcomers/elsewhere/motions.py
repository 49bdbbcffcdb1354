"""A swing that gets faster, and a hand that trembles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wristctl.config.loop import Reference
from wristctl.config.plant import Disturbances
from wristctl.config.section import Parameter
from wristctl.simulation.disturbances import Disturbance
from wristctl.simulation.reference import ReferenceKind

Array = NDArray[np.float64]


def _chirp(reference: Reference, time: Array) -> Array:
    """(1 - cos(phase))/2 with the phase's rate going linearly from `frequency` to `end_frequency` in `duration`."""
    first, last = 2.0 * np.pi * reference.frequency, 2.0 * np.pi * reference.value("end_frequency")
    slope = (last - first) / reference.duration
    phase, rate = first * time + 0.5 * slope * time**2, first + slope * time
    bend = rate**2 * np.cos(phase) + slope * np.sin(phase)
    return 0.5 * np.stack([1.0 - np.cos(phase), rate * np.sin(phase), bend])


def _tremor(settings: Disturbances, time: Array) -> Array:
    return settings.value("tremor") * np.sin(2.0 * np.pi * settings.value("tremor_frequency") * time)


CHIRP = ReferenceKind(
    "swinging between straight and the angle, faster and faster",
    course=_chirp,
    rest=lambda reference, begin, horizon: horizon,
    described=lambda reference: f"chirp {reference.frequency:g} to {reference.value('end_frequency'):g} Hz",
    parameters={"end_frequency": Parameter(2.0, "1/s", "frequency after `duration`")},
)
TREMOR = Disturbance(
    "a trembling hand",
    acts=lambda settings: settings.value("tremor") != 0.0,
    force=_tremor,
    parameters={
        "tremor": Parameter(0.0, "N", "largest force of a tremor"),
        "tremor_frequency": Parameter(8.0, "1/s", "its frequency"),
    },
)
