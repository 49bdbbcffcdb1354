"""A law that is plain Python: a way out of compiled code, one rollout at a time, that no compiling is needed for."""

import ctypes
import math
from collections import namedtuple
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numba.core import types
from numba.experimental import function_type

from wristctl.errors import UserError
from wristctl.plugins.places import contained

__all__ = ["PlainLaw"]
# Imported for what it does: numba learns there what an object with an address is.
_TEACHES_NUMBA = function_type
# Function that kernels call of a rollout alone: four pointers to doubles, and a lane of width one, which is a double.
_CALLBACK = ctypes.CFUNCTYPE(ctypes.c_double, *[ctypes.c_void_p] * 4)
_REFERENCE = 3


class PlainLaw(types.WrapperAddressProtocol):
    """A plain law as kernels know laws. `check` raises what went wrong in it, after which it has answered nan.

    The law is called with a named tuple of what it sees, on which `ahead(k)` is the reference k periods from now, named
    tuples of the wrist and of the gains, and an array of its memory; all but that are copies.
    """

    def __init__(
        self, name: str, law: Any, fields: tuple[Sequence[str], Any, tuple[str, ...]], sizes: tuple[int, int], kind: Any
    ) -> None:
        now, wrist, gains = fields
        self._name, self._kind = name, kind
        self._error: BaseException | None = None
        self._preview, self._memory = sizes
        self._now, self._wrist, self._gains = _seen(tuple(now)), wrist, _named(gains)
        self._law, self._of_plane = law, dict[int, Callable[..., Any]]()
        self._signals = len(now) + _REFERENCE * self._preview
        code = getattr(law.__call__ if isinstance(law, type) else law, "__code__", None)
        self._where = f"{code.co_filename}:{code.co_firstlineno}" if code else name
        self._callback = _CALLBACK(self._call)

    def __wrapper_address__(self) -> int:
        """Address at which compiled code enters Python."""
        return int(ctypes.cast(self._callback, ctypes.c_void_p).value or 0)

    def signature(self) -> Any:
        """Signature that kernels call."""
        return self._kind

    def check(self) -> None:
        """Raise what the law has raised, or a UserError for what it has returned."""
        error, self._error = self._error, None
        if error is not None:
            with contained(self._name, self._where):
                raise error

    def _call(self, now: int, wrist: int, gains: int, memory: int) -> float:
        if self._error is not None:
            return math.nan
        try:
            signals = _doubles(now, self._signals)
            current = self._now(signals)
            believed, gains_type = self._wrist(*_doubles(wrist, len(self._wrist._fields))), self._gains
            kept = np.ctypeslib.as_array((ctypes.c_double * max(1, self._memory)).from_address(memory))[: self._memory]
            torque = self._in(memory)(current, believed, gains_type(*_doubles(gains, len(gains_type._fields))), kept)
            return self._finite(torque, current)
        except BaseException as error:  # nothing may be raised through compiled code
            self._error = error
            return math.nan

    def _in(self, memory: int) -> Callable[..., Any]:
        """The law of the plane whose memory is at this address: of a class an object of its own."""
        if memory not in self._of_plane:
            self._of_plane[memory] = self._law() if isinstance(self._law, type) else self._law
        return self._of_plane[memory]

    def _finite(self, torque: Any, now: Any) -> float:
        value = float(torque)
        if not math.isfinite(value):
            problem = f"{self._name} returned {value} at theta = {now.theta:.4g} rad, rate = {now.rate:.4g} rad/s"
            raise UserError(problem, self._where, "return a finite torque [N m] whatever it sees")
        return value


def _doubles(address: int, count: int) -> list[float]:
    return list((ctypes.c_double * count).from_address(address)) if count else []


@cache
def _named(fields: tuple[str, ...]) -> Any:
    return namedtuple("Gains", fields)


@cache
def _seen(fields: tuple[str, ...]) -> Any:
    """Type of the signals that a law sees, by its fields, and after them the reference to come."""

    class Now(namedtuple("Now", fields)):  # type: ignore[misc]
        _to_come: Sequence[float] = ()

        def ahead(self, periods: int) -> tuple[float, float, float]:
            """The reference so many periods from now: angle, rate and acceleration."""
            first = _REFERENCE * (periods - 1)
            if periods < 1 or first + _REFERENCE > len(self._to_come):
                raise IndexError(f"{periods} periods ahead, and the controller states a preview of fewer")
            angle, rate, acceleration = self._to_come[first : first + _REFERENCE]
            return angle, rate, acceleration

    def made(signals: list[float]) -> Any:
        now = Now(*signals[: len(fields)])
        now._to_come = signals[len(fields) :]
        return now

    return made
