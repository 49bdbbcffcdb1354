"""Slow motion of arcs on elastic tendons, with damping, friction of tendons and arcs, and creep; spools are given.

Each arc bends by a vector (u_y, u_z) and may shorten. A tendon shortens in proportion to the bends of the arcs that it
runs along and to their shortening, and pulls only where it is stretched. Its friction is capstan friction by Dahl's
bristle, as in `wristctl.wrist.tendon_mechanics`: from the spool to the middle of an arc, bent by the angle phi until
there, the pull falls to exp(-(mu phi + sheath) z). Friction inside an arc is a bristle too, a vector along the way of
its bend (`wristctl.wrist.dahl` in one plane). A tendon that runs straight between g + 1 discs of an arc of length l is
(l - c.u) S(|u|/2g) long, with S(x) = sin x / x (`wristctl.wrist.tendon_layout`): bent, its arm is shorter, and its pull
bends the arc further. Without damping and inertia the robot is at rest at each sample; inertia is for slow motions, by
differences of second order over even samples.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import compiled, kernel

# Newton's method: steps at most, largest change of a coordinate in one [rad], change at which it ends [rad].
_ITERATIONS, _STRIDE, _ENDS = 60, 0.3, 1e-10
SMOOTH = 2e-5
"""Stretch below which a tendon passes smoothly from slack to taut [m], where nothing else is said."""


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
    lengths: tuple[float, ...] = ()
    """Of the arcs [m], where tendons run straight between discs."""
    spans: int = 0
    """Straight spans of a tendon along an arc; 0: it follows the arc."""
    inertia: Array | None = None
    """Inertia of bending over its stiffness (V,) [s^2]."""
    smooth: float = SMOOTH
    """Stretch below which a tendon passes smoothly from slack to taut [m]: one that is so tight pulls 21 % too hard."""

    def rest(self, reeled: Array, pause: Array) -> Array:
        """Coordinates (V, T, N) at rest, sample by sample.

        Parameters
        ----------
        reeled : length that each spool has reeled in since its tendon was taut on the straight robot (V, T, M) [m]
        pause : time since the sample before (T,) [s]; nan at the begin of a recording, where the robot was straight
        """
        out = np.empty((*reeled.shape[:2], self.stiffness.shape[1]))
        inertia = np.zeros_like(self.damping) if self.inertia is None else self.inertia
        ways = (
            self.friction, 1.0 / self.presliding, self.inner, 1.0 / self.inner_presliding, self.creep, self.creep_time,
            self.sheath, self.damping, np.full_like(self.damping, self.spans), inertia,
            np.full_like(self.damping, self.smooth),
            *(np.full_like(self.damping, length) for length in self.lengths),
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
        stretch = reeled - self.reeled_by(coordinates)
        pulls: Array = 0.5 * self.tendon[:, None, :] * (stretch + np.hypot(stretch, self.smooth))
        return pulls

    def reeled_by(self, coordinates: Array) -> Array:
        """Length (V, T, M) by which tendons' paths are shorter at coordinates (V, T, N) than straight [m]."""
        shorter: Array = np.einsum("vmn,vtn->vtm", self.arms, coordinates)
        for k, length in enumerate(self.lengths if self.spans else ()):
            bend = coordinates[..., 2 * k : 2 * k + 2]
            along = np.einsum("vmn,vtn->vtm", self.arms[..., 2 * k : 2 * k + 2], bend)
            straight = np.sinc(np.hypot(*np.moveaxis(bend, -1, 0)) / (2.0 * math.pi * self.spans))[..., None]
            shorter = shorter + (self.ends > k) * (length - along) * (1.0 - straight)
        return shorter


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


@compiled
def _chords(q: Any, k: int, spans: float) -> tuple[float, float]:
    """S(x) = sin x / x at half the bend of a span of an arc, and S'(x)/x over (2 spans)^2."""
    square = (q[2 * k] ** 2 + q[2 * k + 1] ** 2) / (4.0 * spans * spans)
    straight = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
    falling = -(1.0 - square / 10.0 * (1.0 - square / 28.0 * (1.0 - square / 54.0))) / 3.0
    return straight, falling / (4.0 * spans * spans)


@compiled
def _along(arms: Any, q: Any, ways: Any, arcs: int, here: Any) -> tuple[float, float]:
    """Length that a path along arcs is shorter by, with its derivatives into `here`, and how fast these grow."""
    shorter, grows = 0.0, 0.0
    for i in range(len(q)):
        here[i] = arms[i]
        shorter += arms[i] * q[i]
    if ways[8] > 0.0:
        for k in range(arcs):
            y, w = 2 * k, 2 * k + 1
            straight, falling = _chords(q, k, ways[8])
            left = arms[y] * q[y] + arms[w] * q[w] - ways[11 + k]
            shorter += left * (straight - 1.0)
            here[y] = arms[y] * straight + left * falling * q[y]
            here[w] = arms[w] * straight + left * falling * q[w]
            grows += left * falling / arcs
    return shorter, grows


@compiled
def _even_samples(pause: Any, sample: int, since: int) -> int:
    """Number of steps alike that have ended with a sample, of so many before it."""
    if math.isnan(pause[sample]):
        return 0
    return since + 1 if sample > 0 and abs(pause[sample] - pause[sample - 1]) < 1e-6 * pause[sample] else 1


@compiled
def _difference(now: float, before: float, older: float, since: int, step: float) -> tuple[float, float]:
    """Derivative by time after so many even steps, and its own by the value now; 0 where there was no step."""
    if since < 1:
        return 0.0, 0.0
    if since < 2:
        return (now - before) / step, 1.0 / step
    return (1.5 * now - 2.0 * before + 0.5 * older) / step, 1.5 / step


@kernel
def _rest(reeled: Any, arms: Any, stiffness: Any, tendon: Any, ways: Any, pause: Any, ends: Any, out: Any) -> None:
    count, tendons, arcs = arms.shape[2], arms.shape[1], 0
    for t in range(tendons):
        arcs = max(arcs, ends[t])
    bends, coordinates = 2 * arcs, count // arcs
    q, before, r, slope = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros((count, count))
    crept, inside, inside_now, wrapped = np.zeros(bends), np.zeros(bends), np.zeros(bends), np.zeros(arcs)
    older, rate, rate_before, rate_older = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    path, z, z_now, here = np.zeros(tendons), np.zeros(tendons), np.zeros(tendons), np.zeros(count)
    for v in range(reeled.shape[0]):
        friction, bristle, inner = ways[v, 0], ways[v, 1], ways[v, 2]
        inner_bristle, creep, creep_time, sheath = ways[v, 3], ways[v, 4], ways[v, 5], ways[v, 6]
        damping, inertia, since = ways[v, 7], ways[v, 9], 0
        for sample in range(reeled.shape[1]):
            if math.isnan(pause[sample]):
                for memory in (q, crept, inside, path, z):
                    memory[:] = 0.0
            since = _even_samples(pause, sample, since)
            older[:] = before
            before[:] = q
            if v > 0:  # variants are alike: the first one's rest is near
                q[:] = out[0, sample]
            for _ in range(_ITERATIONS):
                for i in range(count):
                    for j in range(count):
                        slope[i, j] = 0.0
                    r[i] = stiffness[v, i] * q[i]
                    slope[i, i] = stiffness[v, i]
                if inertia > 0.0 and since > 0:
                    step = pause[sample]
                    for i in range(2 * arcs):
                        rate[i], by_q = _difference(q[i], before[i], older[i], since, step)
                        faster, by_rate = _difference(rate[i], rate_before[i], rate_older[i], since - 1, step)
                        r[i] += stiffness[v, i] * (damping * rate[i] + inertia * faster)
                        slope[i, i] += stiffness[v, i] * by_q * (damping + inertia * by_rate)
                angle = 0.0
                for k in range(arcs):
                    y, w = 2 * k, 2 * k + 1
                    bend = math.hypot(q[y], q[w])
                    wrapped[k] = angle + 0.5 * bend
                    angle += bend
                    if damping > 0.0 and inertia == 0.0 and not math.isnan(pause[sample]):
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
                    shorter, grows = _along(arms[v, t], q, ways[v], ends[t], here)
                    stretch = reeled[v, sample, t] - shorter
                    smooth = math.hypot(stretch, ways[v, 10])
                    pull = 0.5 * tendon[v, t] * (stretch + smooth)
                    taut = 0.5 * tendon[v, t] * (1.0 + stretch / smooth)
                    z_now[t], by_path = _turned(z[t], shorter - path[t], bristle)
                    for k in range(ends[t]):
                        exponent = friction * wrapped[k] + sheath
                        there = math.exp(-exponent * z_now[t]) if exponent > 0.0 else 1.0
                        softer = there * (taut + pull * exponent * by_path)
                        for which in range(coordinates):
                            i = 2 * k + which if which < 2 else bends + k
                            r[i] -= here[i] * pull * there
                            if which < 2:
                                slope[i, i] -= grows * pull * there
                            for j in range(count):
                                slope[i, j] += here[i] * softer * here[j]
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
                shorter, _ = _along(arms[v, t], q, ways[v], ends[t], here)
                z[t], _ = _turned(z[t], shorter - path[t], bristle)
                path[t] = shorter
            if inertia > 0.0:
                rate_older[:] = rate_before
                for i in range(2 * arcs):
                    rate_before[i], _ = _difference(q[i], before[i], older[i], since, pause[sample])
            inside[:] = inside_now
            if creep > 0.0 and not math.isnan(pause[sample]):
                kept = math.exp(-pause[sample] / creep_time)
                for i in range(bends):
                    crept[i] = q[i] + (crept[i] - q[i]) * kept
            out[v, sample] = q
