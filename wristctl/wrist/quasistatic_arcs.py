"""Slow motion of arcs on elastic tendons, with damping, friction of tendons and arcs, and creep; spools are given.

Each arc bends by a vector (u_y, u_z) and may shorten. A tendon shortens in proportion to the bends of the arcs that it
runs along and to their shortening, and pulls only where it is stretched. Its friction is capstan friction by Dahl's
bristle, as in `wristctl.wrist.tendon_mechanics`: from the spool to the middle of an arc, bent by the angle phi until
there, the pull falls to exp(-(mu phi + sheath) z). Friction inside an arc is a bristle too, a vector along the way of
its bend (`wristctl.wrist.dahl` in one plane). Inertia is left out: without damping the robot is at rest at each sample.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel

# Newton's method: steps at most, largest change of a coordinate in one [rad], change at which it ends [rad].
_ITERATIONS, _STRIDE, _ENDS = 60, 0.3, 1e-10
# Stretch below which a tendon passes smoothly from slack to taut [m].
_SMOOTH = 2e-5


@dataclass(frozen=True)
class QuasistaticArcs:
    """V variants of a robot of S arcs on M tendons with N coordinates: 2 S bends, and S shortenings or none.

    SI units; stiffness of bending may be relative, so that torques of friction and tendons are in its unit too.
    """

    arms: Array
    """Path that a tendon shortens by per coordinate (V, M, N) [m, for bends: m/rad]."""
    ends: Array
    """Number of arcs that each tendon runs along (M,)."""
    stiffness: Array
    """Of each coordinate (V, N)."""
    tendon: Array
    """Stiffness of each tendon (V, M)."""
    friction: Array
    """Coefficient of the tendons' friction (V,)."""
    sheath: Array
    """What that adds to the exponent before the robot: coefficient times angle (V,)."""
    presliding: Array
    """Path in which that turns round (V,) [m]."""
    inner: Array
    """Torque of friction inside each arc (V,)."""
    inner_presliding: Array
    """Bend of an arc in which that turns round (V,) [rad]."""
    creep: Array
    """Share of the bending stiffness that relaxes, by one Maxwell branch (V,)."""
    creep_time: Array
    """Time constant of that (V,) [s]."""
    damping: Array
    """Damping of bending over its stiffness (V,) [s]."""

    def rest(self, reeled: Array, pause: Array) -> Array:
        """Coordinates (V, T, N) at rest, sample by sample.

        Parameters
        ----------
        reeled : length that each spool has reeled in since its tendon was taut on the straight robot (V, T, M) [m]
        pause : time since the sample before (T,) [s]; nan at the begin of a recording, where the robot was straight
        """
        out = np.empty((*reeled.shape[:2], self.stiffness.shape[1]))
        ways = (
            self.friction, 1.0 / self.presliding, self.inner, 1.0 / self.inner_presliding, self.creep, self.creep_time,
            self.sheath, self.damping,
        )  # fmt: skip
        reeled, arms, stiffness, tendon, pause, coefficients = (
            np.ascontiguousarray(array, np.float64)
            for array in (reeled, self.arms, self.stiffness, self.tendon, pause, np.stack(ways, axis=1))
        )
        ends = self.ends.astype(np.int64)
        _rest(reeled, arms, stiffness, tendon, coefficients, pause, ends, out)
        return out

    def pulls(self, reeled: Array, coordinates: Array) -> Array:
        """Pulls of the tendons at their spools (V, T, M) at coordinates (V, T, N)."""
        stretch = reeled - np.einsum("vmn,vtn->vtm", self.arms, coordinates)
        pulls: Array = 0.5 * self.tendon[:, None, :] * (stretch + np.hypot(stretch, _SMOOTH))
        return pulls


@compiled
def _copy(source: Any, into: Any) -> None:
    for i in range(len(into)):
        into[i] = source[i]


@compiled
def _clear(values: Any) -> None:
    for i in range(len(values)):
        values[i] = 0.0


@compiled
def _solve(matrix: Any, right: Any) -> None:
    """Solution of matrix x = right, into `right`; by Gauss's elimination with pivots."""
    n = len(right)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]


@compiled
def _turned(z: float, travel: float, slope: float) -> tuple[float, float]:
    """State of a tendon's bristle after it has slid, and its derivative by that path."""
    sign = -1.0 if travel < 0.0 else 1.0
    left = math.exp(-slope * abs(travel))
    return sign + (z - sign) * left, slope * left * (1.0 - z * sign)


@kernel
def _rest(reeled: Any, arms: Any, stiffness: Any, tendon: Any, ways: Any, pause: Any, ends: Any, out: Any) -> None:
    count, tendons, arcs = arms.shape[2], arms.shape[1], 0
    for t in range(tendons):
        arcs = max(arcs, ends[t])
    bends, coordinates = 2 * arcs, count // arcs
    q, before, r, slope = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros((count, count))
    crept, inside, inside_now, wrapped = np.zeros(bends), np.zeros(bends), np.zeros(bends), np.zeros(arcs)
    path, z, z_now = np.zeros(tendons), np.zeros(tendons), np.zeros(tendons)
    for v in range(reeled.shape[0]):
        friction, bristle, inner = ways[v, 0], ways[v, 1], ways[v, 2]
        inner_bristle, creep, creep_time, sheath = ways[v, 3], ways[v, 4], ways[v, 5], ways[v, 6]
        damping = ways[v, 7]
        for sample in range(reeled.shape[1]):
            if math.isnan(pause[sample]):
                for memory in (q, crept, inside, path, z):
                    _clear(memory)
            _copy(q, before)
            if v > 0:  # variants are alike: the first one's rest is near
                _copy(out[0, sample], q)
            for _ in range(_ITERATIONS):
                for i in range(count):
                    for j in range(count):
                        slope[i, j] = 0.0
                    r[i] = stiffness[v, i] * q[i]
                    slope[i, i] = stiffness[v, i]
                angle = 0.0
                for k in range(arcs):
                    y, w = 2 * k, 2 * k + 1
                    bend = math.hypot(q[y], q[w])
                    wrapped[k] = angle + 0.5 * bend
                    angle += bend
                    if damping > 0.0 and not math.isnan(pause[sample]):
                        slower_y = damping * stiffness[v, y] / pause[sample]
                        slower_w = damping * stiffness[v, w] / pause[sample]
                        r[y] += slower_y * (q[y] - before[y])
                        r[w] += slower_w * (q[w] - before[w])
                        slope[y, y] += slower_y
                        slope[w, w] += slower_w
                    if creep > 0.0:
                        r[y] -= creep * stiffness[v, y] * crept[y]
                        r[w] -= creep * stiffness[v, w] * crept[w]
                    if inner > 0.0:
                        dy, dw = q[y] - before[y], q[w] - before[w]
                        way = math.hypot(dy, dw)
                        if way > 1e-14:
                            dy, dw = dy / way, dw / way
                            left = math.exp(-inner_bristle * way)
                            inside_now[y], inside_now[w] = dy + (inside[y] - dy) * left, dw + (inside[w] - dw) * left
                            along, turning = inner_bristle * left, (1.0 - left) / way
                        else:
                            inside_now[y], inside_now[w] = inside[y], inside[w]
                            along, turning = inner_bristle, inner_bristle
                        r[y] += inner * inside_now[y]
                        r[w] += inner * inside_now[w]
                        slope[y, y] += inner * (along * (dy - inside[y]) * dy + turning * (1.0 - dy * dy))
                        slope[y, w] += inner * (along * (dy - inside[y]) * dw - turning * dy * dw)
                        slope[w, y] += inner * (along * (dw - inside[w]) * dy - turning * dw * dy)
                        slope[w, w] += inner * (along * (dw - inside[w]) * dw + turning * (1.0 - dw * dw))
                for t in range(tendons):
                    shorter = 0.0
                    for i in range(count):
                        shorter += arms[v, t, i] * q[i]
                    stretch = reeled[v, sample, t] - shorter
                    smooth = math.hypot(stretch, _SMOOTH)
                    pull = 0.5 * tendon[v, t] * (stretch + smooth)
                    taut = 0.5 * tendon[v, t] * (1.0 + stretch / smooth)
                    z_now[t], by_path = _turned(z[t], shorter - path[t], bristle)
                    for k in range(ends[t]):
                        exponent = friction * wrapped[k] + sheath
                        there = math.exp(-exponent * z_now[t]) if exponent > 0.0 else 1.0
                        softer = there * (taut + pull * exponent * by_path)
                        for which in range(coordinates):
                            i = 2 * k + which if which < 2 else bends + k
                            r[i] -= arms[v, t, i] * pull * there
                            for j in range(count):
                                slope[i, j] += arms[v, t, i] * softer * arms[v, t, j]
                _solve(slope, r)
                largest = 0.0
                for i in range(count):
                    largest = max(largest, abs(r[i]))
                share = min(1.0, _STRIDE / max(largest, 1e-300))
                for i in range(count):
                    q[i] -= share * r[i]
                if largest < _ENDS:
                    break
            for t in range(tendons):
                shorter = 0.0
                for i in range(count):
                    shorter += arms[v, t, i] * q[i]
                z[t], _ = _turned(z[t], shorter - path[t], bristle)
                path[t] = shorter
            _copy(inside_now, inside)
            if creep > 0.0 and not math.isnan(pause[sample]):
                kept = math.exp(-pause[sample] / creep_time)
                for i in range(bends):
                    crept[i] = q[i] + (crept[i] - q[i]) * kept
            _copy(q, out[v, sample])
