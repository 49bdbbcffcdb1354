"""How many poles of a closed loop are unstable, by Nyquist's criterion for loops of several rates.

det(1 + L(z)) of what comes back over all cuts of a cycle has the closed loop's poles for its zeros and the open one's
for its poles; how often it goes round 0 while z goes round the unit circle tells their numbers apart (Astrom and Murray
2008, section 9.2). Another gain or delay is another determinant of the same answers, and no other eigenvalues.
"""

from __future__ import annotations

import math

import numpy as np

from wristctl.arrays import Array
from wristctl.stability.sampled_loop import Complex, SampledLoop

_FINE, _PER_DECADE, _LEAST = 1000, 40, 1e-9
_NEAR, _CLOSE = 0.1, (0.0, 0.1, 0.3, 1.0, 3.0)


class PoleCount:
    """Counts poles that grow faster than `neutral` [1/s], at other gains and with more delay than the loop has."""

    def __init__(self, loop: SampledLoop, neutral: float) -> None:
        self._loop = loop
        self._radius = max(math.exp(neutral * loop.lasts), 1.0 + _ROUNDING)
        closed = loop.multipliers()
        self._own = int(np.sum(np.abs(closed) > self._radius))
        self._z = self._radius * np.exp(1j * self._angles(np.concatenate([closed, loop.multipliers(0.0)])))
        self._back = loop.returned(self._z)
        self._turns = self._winding(1.0, 0.0)

    def unstable(self, factor: float, delay: float = 0.0) -> int:
        """How many there are with the loop's gain times a factor and so much more delay [s]."""
        return self._own + self._turns - self._winding(factor, delay)

    def _winding(self, factor: float, delay: float) -> int:
        """How often the determinant goes round 0, which half a circle tells, since the other is its mirror image."""
        back = self._back[:, self._loop.cuts] if delay == 0.0 else self._late(delay)
        whole = np.linalg.det(np.eye(back.shape[-1]) - factor * back)
        return round(float(np.sum(np.angle(whole[1:] / whole[:-1]))) / math.pi)

    def _late(self, delay: float) -> Complex:
        """What comes back at the cuts later by a delay [s], on the straight line between two ticks."""
        count, ticks = len(self._loop.ticks), delay / self._loop.period
        whole = math.floor(ticks)
        found = np.zeros((len(self._z), len(self._loop.cuts), len(self._loop.cuts)), complex)
        for row, cut in enumerate(self._loop.cuts):
            for back, share in ((whole, 1.0 + whole - ticks), (whole + 1, ticks - whole)):
                cycles, at = divmod(cut - back, count)
                found[:, row] += share * (self._z**cycles)[:, None] * self._back[:, at]
        return found

    def _angles(self, poles: Complex) -> Array:
        """Of z on the upper half of its circle, closer together near the poles."""
        angles, damping = np.abs(np.angle(poles)), np.abs(np.abs(poles) - self._radius)
        angles, damping = angles[damping < _NEAR * angles], damping[damping < _NEAR * angles]
        close = [np.abs(angles + side * width * damping) for width in _CLOSE for side in (-1.0, 1.0)]
        decades = np.geomspace(_LEAST, math.pi, round(_PER_DECADE * math.log10(math.pi / _LEAST)))
        every = np.unique(np.concatenate([[0.0, math.pi], np.linspace(0.0, math.pi, _FINE), decades, *close]))
        return np.asarray(every[every <= math.pi])


_ROUNDING = 1e-7
"""By how much a pole on the unit circle may be off it."""
