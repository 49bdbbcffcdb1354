"""How close to the machine: operations of one tick, counted, and the most that the machine does, measured."""

from __future__ import annotations

import ctypes
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from compile_c import compiled
from equations import Segment, pulls
from rodas3 import step
from venvs import CACHE

from wristctl.lanes.types import LANES

METRICS = {"+": 15, "*": 7}
"""Additions and products of the C loop's gather(), which the equations for arrays leave out."""


class Counted:
    """A number that has no value but counts what is done to it. Comparisons, choices and signs are not counted.

    What is done to `fixed` numbers alone is done before the loop, and dividing by one is a product.
    """

    def __init__(self, tally: Counter[str], fixed: bool = False) -> None:
        self.tally, self.fixed = tally, fixed

    def _with(self, name: str, other: Any) -> Counted:
        if isinstance(other, int) and other == 0:  # what sum() starts from
            return self
        fixed = self.fixed and (not isinstance(other, Counted) or other.fixed)
        if not fixed:
            self.tally[name] += 1
        return Counted(self.tally, fixed)

    def __add__(self, other: Any) -> Counted:
        return self._with("+", other)

    def __mul__(self, other: Any) -> Counted:
        return self._with("*", other)

    def __truediv__(self, other: Any) -> Counted:
        return self._with("*" if not isinstance(other, Counted) or other.fixed else "/", other)

    def __rtruediv__(self, other: Any) -> Counted:
        return self._with("/", other)

    def __neg__(self) -> Counted:
        return self

    def __gt__(self, other: Any) -> Counted:
        return self

    __radd__ = __sub__ = __rsub__ = __add__
    __rmul__ = __mul__


class _Functions:
    """What the law asks of NumPy."""

    @staticmethod
    def tanh(x: Counted) -> Counted:
        """As lanes.h does it: reduction, a polynomial of degree 13, one division."""
        x.tally.update({"*": 21, "+": 19, "/": 1})
        return x

    @staticmethod
    def where(condition: Counted, yes: Counted, no: Counted) -> Counted:
        """A choice."""
        return condition

    @staticmethod
    def clip(x: Counted, low: float, high: float) -> Counted:
        """Two choices."""
        return x


def operations(segments: int) -> dict[str, int]:
    """Additions, products and divisions of one lane's tick: law, allocation, one step of RODAS3, metrics."""
    tally: Counter[str] = Counter()
    known, x = Counted(tally, fixed=True), Counted(tally)
    s = Segment(*[known] * 12)
    plus, minus = pulls(_Functions, s, [x] * 3, known, known, x, x, x)
    step(s, [x] * segments, [x] * segments, plus, minus, 1e-3)
    tally.update({"+": 2 * (segments - 1)})  # angle and rate of the tip
    tally.update(METRICS)
    return dict(tally)


def scratch(segments: int) -> int:
    """Bytes that a step works on, for a block of lanes: chords, sums over masses, four matrices, stages."""
    planes, matrices, rows = 4 + 9, 4, 22
    return 8 * LANES * (2 * planes * segments + matrices * segments**2 + rows * segments)


def peaks(threads: int) -> dict[str, float]:
    """Operations per second of that many threads: fused multiply-adds count two, divisions one."""
    library = compiled("peak.cpp", CACHE)
    found = {}
    for name, each, rounds in (("multiply_add", 2, 4_000_000), ("divide", 1, 400_000)):
        run = getattr(library, name)
        run.argtypes, run.restype = [ctypes.c_long], ctypes.c_double
        rates = []
        with ThreadPoolExecutor(threads) as pool:
            for _ in range(15):
                start = time.perf_counter()
                list(pool.map(run, [rounds] * threads))
                rates.append(each * library.operations() * rounds * threads / (time.perf_counter() - start))
        found[name] = max(rates)
    return found
