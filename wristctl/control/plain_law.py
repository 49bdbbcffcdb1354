"""A law that is plain Python: a way out of compiled code, one rollout at a time, that no compiling is needed for."""

import ctypes
import math
from collections import namedtuple
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.experimental import function_type

from wristctl.errors import UserError
from wristctl.plugins.places import contained

__all__ = ["PlainLaw"]
# Imported for what it does: numba learns there what an object with an address is.
_TEACHES_NUMBA = function_type
# Function that kernels call of a rollout alone: eight pointers to doubles.
_CALLBACK = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 8)
_REFERENCE, _DOUBLE = 3, ctypes.sizeof(ctypes.c_double)


class Shape(NamedTuple):
    """Numbers that a law is called with: planes, places of tendons (0 for a law of each plane), periods of preview, and
    rows of memory of each plane."""

    planes: int
    places: int
    preview: int
    memory: int


class PlainLaw(types.WrapperAddressProtocol):
    """A plain law as kernels know laws. `check` raises what went wrong in it, after which it has answered nan.

    The law is called with a named tuple of what it sees, on which `ahead(k)` is the reference k periods from now, named
    tuples of the wrist and of the gains, and an array of its memory; all but that are copies. A law of both planes gets
    a tuple of them, with the tendons and an array of torques that it writes.
    """

    def __init__(
        self, name: str, law: Any, fields: tuple[Sequence[str], Any, tuple[str, ...], Any], shape: Shape, memory: int,
        kind: Any,
    ) -> None:  # fmt: skip
        now, self._wrist, gains, self._tendons = fields
        self._name, self._kind = name, kind
        self._error: BaseException | None = None
        self._shape, self._memory = shape, memory
        self._now, self._gains = _seen(tuple(now)), named_gains(gains)
        self._law, self._of_plane = law, dict[int, Callable[..., Any]]()
        self._signals = len(now) + _REFERENCE * shape.preview
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

    def _call(
        self, now: int, wrist: int, gains: int, memory: int, arms: int, least: int, greatest: int, torque: int
    ) -> None:
        wanted = _array(torque, self._shape.planes)
        wanted[:] = math.nan
        if self._error is not None:
            return
        try:
            planes = range(self._shape.planes)
            seen = [self._now(_doubles(now + _DOUBLE * self._signals * p, self._signals)) for p in planes]
            size = len(self._wrist._fields)
            believed = [self._wrist(*_doubles(wrist + _DOUBLE * size * p, size)) for p in planes]
            values = self._gains(*_doubles(gains, len(self._gains._fields)))
            addresses = [memory + _DOUBLE * self._shape.memory * p for p in planes]
            kept = [_array(address, self._memory) for address in addresses]
            if places := self._shape.places:
                levers = np.array(_doubles(arms, places * len(planes))).reshape(len(planes), places)
                tendons = self._tendons(levers, *(np.array(_doubles(limit, places)) for limit in (least, greatest)))
                self._in(memory)(tuple(seen), tuple(believed), values, tuple(kept), tendons, wanted)
            else:
                for p in planes:
                    wanted[p] = float(self._in(addresses[p])(seen[p], believed[p], values, kept[p]))
            self._check_finite(wanted, seen)
        except BaseException as error:  # nothing may be raised through compiled code
            self._error = error
            wanted[:] = math.nan

    def _in(self, memory: int) -> Callable[..., Any]:
        """The law whose memory is at this address, of a plane or of both: of a class an object of its own."""
        if memory not in self._of_plane:
            self._of_plane[memory] = self._law() if isinstance(self._law, type) else self._law
        return self._of_plane[memory]

    def _check_finite(self, torques: Any, seen: Sequence[Any]) -> None:
        for value, now in zip(map(float, torques), seen, strict=True):
            if not math.isfinite(value):
                verb = "wrote" if self._shape.places else "returned"
                problem = f"{self._name} {verb} {value} at theta = {now.theta:.4g} rad, rate = {now.rate:.4g} rad/s"
                raise UserError(problem, self._where, "return a finite torque [N m] whatever it sees")


def _array(address: int, count: int) -> Any:
    """View of so many doubles at an address."""
    return np.ctypeslib.as_array((ctypes.c_double * max(1, count)).from_address(address))[:count]


def _doubles(address: int, count: int) -> list[float]:
    return list((ctypes.c_double * count).from_address(address)) if count else []


@cache
def named_gains(fields: tuple[str, ...]) -> Any:
    """Type of gains by their names, as a plain law sees them."""
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
