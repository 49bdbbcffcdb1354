"""A linear loop in discrete time that repeats after a cycle of ticks: its poles, and its answer to a cut."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from wristctl.arrays import Array

Complex = NDArray[np.complex128]


class LinearTick(NamedTuple):
    """One tick of a closed loop: x becomes transition x + into w + reference r, r that of the bend.

    The loop may be cut at a signal, back x: w is added to it, and is felt where `cut`. `outputs` are rows for other
    signals, by name. In one plane the signal is a number, `into` and `reference` are (x,) and `back` is (x,); in two it
    has an entry for each, and they are (x, 2), (x, 2) and (2, x).
    """

    transition: Array
    into: Array
    back: Array
    reference: Array
    cut: bool
    outputs: dict[str, Array]

    @property
    def sends(self) -> Array:
        """`into` as (x, P)."""
        return self.into.reshape(len(self.into), -1)

    @property
    def brings(self) -> Array:
        """`back` as (P, x)."""
        return self.back.reshape(-1, len(self.into))


class Mode(NamedTuple):
    """A way in which a loop swings: how fast it grows [1/s] and turns [Hz], and the state at each tick, (N, x)."""

    growth: float
    frequency: float
    states: Complex


@dataclass(frozen=True)
class SampledLoop:
    """The ticks of a cycle, `period` [s] apart. The loop's gain multiplies what comes back over the cut."""

    period: float
    ticks: Sequence[LinearTick]

    @property
    def lasts(self) -> float:
        """A cycle [s]."""
        return self.period * len(self.ticks)

    @property
    def cuts(self) -> list[int]:
        """The ticks at which it is cut."""
        return [k for k, tick in enumerate(self.ticks) if tick.cut]

    @property
    def planes(self) -> int:
        """Planes of the signal that it is cut at."""
        return len(self.ticks[0].brings)

    @property
    def is_steady(self) -> bool:
        """Whether it is cut once in a cycle, and so is the same at each cut: of one sampling rate."""
        return len(self.cuts) == 1

    def transitions(self, factor: float = 1.0) -> list[Array]:
        """Transition matrices of the ticks with a factor on the gain: 1 is the closed loop, 0 the open one."""
        return [tick.transition + (factor - 1.0) * tick.cut * (tick.sends @ tick.brings) for tick in self.ticks]

    def multipliers(self, factor: float = 1.0) -> Complex:
        """Multipliers of the loop's modes over a cycle: z at poles, (x,)."""
        return np.asarray(np.linalg.eigvals(_product(self.transitions(factor))), complex)

    def growth(self, factor: float = 1.0) -> float:
        """Growth rate of the least stable mode [1/s]."""
        return float(np.log(max(np.abs(self.multipliers(factor)).max(), 1e-300)) / self.lasts)

    def modes(self, factor: float = 1.0) -> list[Mode]:
        """All that swing or not, least stable first; each pair once. What dies out within a tick is left out.

        A mode's frequency is followed from tick to tick: after a cycle several would have turned as far.
        """
        ticks = self.transitions(factor)
        multipliers, states = np.linalg.eig(_product(ticks))
        least = np.exp(-_FORGOTTEN * len(ticks))
        order = np.argsort(-np.abs(multipliers), kind="stable")
        chosen = [k for k in order if multipliers[k].imag >= 0.0 and abs(multipliers[k]) > least]
        multipliers, course = multipliers[chosen].astype(complex), [states[:, chosen].astype(complex)]
        for transition in ticks:
            course.append(transition @ course[-1].real + 1j * (transition @ course[-1].imag))
        steps = pairwise(course)
        turned = sum(np.angle(np.sum(before.conj() * after, axis=0)) for before, after in steps)
        turned = np.angle(multipliers) + 2.0 * np.pi * np.round((turned - np.angle(multipliers)) / (2.0 * np.pi))
        growth, frequency = np.log(np.abs(multipliers)) / self.lasts, np.abs(turned) / (2.0 * np.pi * self.lasts)
        shapes = np.moveaxis(np.array(course[:-1]), -1, 0)
        return [Mode(*mode) for mode in zip(growth.tolist(), frequency.tolist(), shapes, strict=True)]

    def returned(self, z: Complex) -> Complex:
        """Signals that return over the cut at the ticks where z^(cycles) is sent at one of them, (n, ticks, cuts).

        In P planes there are P times as many ticks and cuts, planes beside each other. The loop is open: nothing that
        comes back goes out again.
        """
        triangle, rows, forced, direct = self._opened
        returns = np.empty((len(z), *direct.shape), complex)
        for k, point in enumerate(np.asarray(z, complex)):
            start = scipy.linalg.solve_triangular(point * np.eye(len(triangle)) - triangle, forced)
            returns[k] = rows @ start + direct
        return returns

    @cached_property
    def _opened(self) -> tuple[Complex, Complex, Complex, Array]:
        """A Schur form of the open loop's cycle; in its coordinates what is seen at each tick and what goes in."""
        x, cuts, planes = len(self.ticks[0].into), self.cuts, self.planes
        far, forced = np.eye(x), np.zeros((x, planes * len(cuts)))
        outputs, direct = np.empty((planes * len(self.ticks), x)), np.zeros((planes * len(self.ticks), forced.shape[1]))
        for k, (tick, transition) in enumerate(zip(self.ticks, self.transitions(0.0), strict=True)):
            rows = slice(planes * k, planes * (k + 1))
            outputs[rows], direct[rows] = tick.brings @ far, tick.brings @ forced
            far, forced = transition @ far, transition @ forced
            if tick.cut:
                first = planes * cuts.index(k)
                forced[:, first : first + planes] += tick.sends
        triangle, turn = scipy.linalg.schur(far, output="complex")
        return triangle, outputs @ turn, turn.conj().T @ forced, direct

    def response(self, omega: Array) -> Complex:
        """The loop's transfer L at frequencies [rad/s], positive where it is fed back negatively.

        It is (n,) in one plane, and in P planes (n, P, P), from what is sent in each to what comes back in each. The
        closed loop amplifies what is added at the cut by 1/(1 + L) at its own frequency. Of a loop that is cut once
        in a cycle it is the open loop's transfer; of another that with all frequencies fed back into which uneven cuts
        turn this one (a Schur complement of the harmonic transfer function, Wereley 1991).
        """
        transfer = self.transfer(omega)
        return transfer[:, 0, 0] if self.planes == 1 else transfer

    def transfer(self, omega: Array) -> Complex:
        """`response` as (n, P, P)."""
        omega, planes = np.atleast_1d(omega), self.planes
        cuts, own = np.array(self.cuts), np.eye(planes)
        back = self.returned(np.exp(1j * omega * self.lasts))[:, self.rows_at(self.cuts)]
        if self.is_steady:
            return np.asarray(-back)
        sent = np.exp(1j * np.outer(omega * self.period, cuts))
        columns = (sent[:, :, None, None] * own).reshape(len(omega), -1, planes)
        amplified = np.linalg.solve(np.eye(back.shape[-1]) - back, columns).reshape(*sent.shape, planes, planes)
        sensitivity = np.mean(sent.conj()[:, :, None, None] * amplified, axis=1)
        return np.asarray(np.linalg.inv(sensitivity) - own)

    def rows_at(self, ticks: Sequence[int]) -> NDArray[np.int64]:
        """Rows of `returned` at some of the ticks, planes beside each other."""
        return np.asarray(self.planes * np.asarray(ticks)[:, None] + np.arange(self.planes)).ravel()


# Decay of a forgotten mode in one tick, as an exponent.
_FORGOTTEN = 12.0


def _product(transitions: Sequence[Array]) -> Array:
    product = np.eye(len(transitions[0]))
    for transition in transitions:
        product = transition @ product
    return product
