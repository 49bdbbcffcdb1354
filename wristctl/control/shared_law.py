"""A controller out of a shared library, as `export-law` writes its C; it runs as one of plain Python does.

    from wristctl.control.shared_law import shared_law
    from wristctl.plugins.import_hook import data_file

    MINE = shared_law(data_file(__file__, "pid_ff_law.so"), "pid_ff_law")

The library has two functions, by the name NAME of the controller (docs/firmware-law.md):

    void NAME_shape(int shape[3], double *period);
    void NAME_wanted(void *state, const double *bend, const double *rate, const double *reference, double *torque);
"""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.control.law import REFERENCE, Controller
from wristctl.errors import UserError

__all__ = ["shared_law"]

_DOUBLES = ctypes.POINTER(ctypes.c_double)


def shared_law(file: Path, name: str) -> Controller:
    """The controller of this name in a shared library, called in each control period with a state of its own.

    A library of one plane serves each plane by itself; one of two has both. What it reads: bend and rate of each plane
    [rad, rad/s], and for each plane angle, rate and acceleration of the reference, now and in each period of its
    preview. It answers with the torque wanted in each plane [N m]. Its gains are its own constants, and its control
    period should be that of the loop: of another it is warned. Raises UserError for what is no such library.
    """
    try:
        library = ctypes.CDLL(str(file))
        shape_of, wanted = getattr(library, f"{name}_shape"), getattr(library, f"{name}_wanted")
    except (OSError, AttributeError) as error:
        fix = "cc -shared -fPIC of what export-law wrote with loop.sensor.level: ideal"
        raise UserError(f"no controller {name} in the library: {error}", str(file), fix) from error
    shape_of.argtypes, shape_of.restype = (ctypes.POINTER(ctypes.c_int), _DOUBLES), None
    wanted.argtypes, wanted.restype = (ctypes.c_void_p, *[_DOUBLES] * 4), None
    shape, period = (ctypes.c_int * 3)(), ctypes.c_double()
    shape_of(shape, ctypes.byref(period))
    planes, preview, size = shape
    if planes not in (1, 2) or preview < 0 or size < 1 or not period.value > 0.0:
        told = f"{planes} planes, {preview} periods of preview, {size} bytes of state and periods of {period.value:g} s"
        raise UserError(f"{name}_shape says {told}", str(file), "1 or 2 planes, a state, and a period above 0")

    class Called:
        """One rollout's: the library's state, which begins as zeros."""

        def __init__(self) -> None:
            self._state = ctypes.create_string_buffer(size)

        def torques(self, seen: Any) -> Any:
            """Wanted torque (planes,) [N m]; a plane that the loop does not bend in is straight."""
            values = np.zeros((planes, 2 + len(REFERENCE) * (1 + preview)))
            for row, now in zip(values, seen, strict=False):
                ahead = [value for k in range(1, preview + 1) for value in now.ahead(k)]
                row[:] = [now.theta, now.rate, now.theta_ref, now.rate_ref, now.acceleration_ref, *ahead]
            bend, rate, reference = (np.ascontiguousarray(part) for part in (values[:, 0], values[:, 1], values[:, 2:]))
            out = np.full(planes, np.nan)
            wanted(self._state, *(part.ctypes.data_as(_DOUBLES) for part in (bend, rate, reference, out)))
            return out

    class OfEach(Called):
        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any) -> float:
            return float(self.torques((now,))[0])

    class OfBoth(Called):
        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
            torque[:] = self.torques(now)[: len(torque)]

    return Controller(
        name=f"{name.removesuffix('_law').replace('_', '-')}-c",
        law=OfEach if planes == 1 else OfBoth,
        source=f"{file.name}, for control periods of {1e3 * period.value:g} ms",
        gains={},
        presets={"default": {}},
        planes=planes,
        preview=preview,
        plain=True,
        period=period.value,
    )
