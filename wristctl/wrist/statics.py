"""Statics of the n-segment wrist: equilibria under tendons and gravity, stiffness and buckling."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.kinematics import unit_arc
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE


class Equilibria(NamedTuple):
    """Wrists at rest with wanted tip angles."""

    theta: Array
    """(B, n) segment angles [rad]"""
    pulls: Array
    """(B, 2) total tensions of the + and the - side [N]"""
    stable: NDArray[np.bool_]
    """(B,) whether it was found and stays there under held tensions"""


def stiffness(wrist: WristParameters, n: int, theta: Array, tensions: tuple[float, float]) -> Array:
    """Stiffness matrix (n, n) [N m/rad] at segment angles (n,), with gravity and tensions [N per tendon, + and -]."""
    still = np.zeros(n)
    pulls = TENDONS_PER_SIDE * np.asarray(tensions)
    return linearised(segments(wrist, n), theta, still, still, pulls)[1]


def least_stiffness(wrist: WristParameters, n: int) -> float:
    """Smallest eigenvalue of the straight wrist's stiffness at pretension, as a torque per tip angle [N m/rad].

    An eigenvector of n segment angles with unit norm bends the tip by up to sqrt(n); the eigenvalue over n is the
    stiffness of the whole wrist. Negative: the wrist buckles.
    """
    return float(np.linalg.eigvalsh(straight_stiffness(wrist, n))[0] / n)


def straight_stiffness(wrist: WristParameters, n: int) -> Array:
    """Stiffness matrix (n, n) [N m/rad] of the straight wrist at pretension, in closed form.

    Chord j turns by a_j, the sum of the angles before it and half of its own, and is shortened by the share
    theta_j^2/24. A weight beyond it sinks by the chord's length times a_j^2/2 + theta_j^2/24. A tendon is shortened by
    the same law, span by span.
    """
    segment = Segments(*segments(wrist, n))
    turned = np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n)
    carried = segment.mass * (n - 0.5 - np.arange(n)) + segment.hand_mass
    falling = segment.length * (np.einsum("j,jk,jl->kl", carried, turned, turned) + np.diag(carried) / 12.0)
    falling += segment.hand_mass * segment.hand_offset
    pulled = 2 * TENDONS_PER_SIDE * wrist.pretension * segment.length / (12.0 * segment.spans**2)
    stiff: Array = (segment.stiffness - pulled) * np.eye(n) + segment.gravity_x * falling
    return stiff


def equilibrium(wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
    """Segment angles (n,) [rad] at rest under tensions [N per tendon, + and - side].

    UserError where the wrist buckles, so that no stable equilibrium is found.
    """
    still, pulls = np.zeros(n), TENDONS_PER_SIDE * np.asarray(tensions)
    under = f"{tensions[0]:g} N and {tensions[1]:g} N"
    return settled(lambda theta: linearised(segments(wrist, n), theta, still, still, pulls)[:2], still, under)


def settled(balance: Callable[[Array], tuple[Array, Array]], guess: Array, under: str) -> Array:
    """Coordinates of a stable rest (n,) [rad], by Newton's method from a guess.

    There a `balance` of n torques, given with its derivative, is 0. `under` says of which pulls, where the wrist
    buckles and so meets no stable rest, which is a UserError.
    """
    q = guess
    for _ in range(100):
        r, tangent = balance(q)
        change = np.linalg.solve(tangent, -r)
        q = q + change * min(1.0, 0.3 / max(1e-300, float(np.abs(change).max())))
        if np.abs(change).max() < 1e-13:
            break
    tangent = 0.5 * (tangent + tangent.T)
    if not np.all(np.isfinite(q)) or np.linalg.eigvalsh(tangent)[0] <= 0.0 or np.abs(r).max() > 1e-9:
        raise UserError(
            f"the wrist buckles: no stable equilibrium under {under}",
            where="wrist",
            fix="lower wrist.hand_mass, hand_offset or the tensions, or raise wrist.stiffness",
        )
    return q


def equilibria_at(parameters: Array, n: int, angle: Array, pretension: float) -> Equilibria:
    """Equilibria with the last disc at `angle` (B,) [rad], one side at `pretension` (of all its tendons) [N].

    `parameters` are rows of Segments, (B, 12). Newton's method on the segments' angles and the difference of the two
    sides' pulls, for all wrists at once; the wanted angle as a side condition keeps it regular where a load buckles.
    """
    count, still = len(angle), np.zeros((len(angle), n))
    theta, difference = np.repeat(angle[:, None] / n, n, axis=1), np.zeros(count)
    bordered = np.zeros((count, n + 1, n + 1))
    bordered[:, n, :n] = 1.0
    for _ in range(60):
        r, tangent, _ = linearised(parameters, theta, still, still, _pulls(difference, pretension))
        side = np.where(difference >= 0.0, 1.0, -1.0)  # the pull that grows: r is linear in it
        more = linearised(parameters, theta, still, still, _pulls(difference + side, pretension))[0]
        bordered[:, :n, :n], bordered[:, :n, n] = tangent, (more - r) * side[:, None]
        residual = np.concatenate([r, theta.sum(axis=1, keepdims=True) - angle[:, None]], axis=1)
        change = np.linalg.solve(bordered, -residual[..., None])[..., 0]
        theta, difference = theta + change[:, :n], difference + change[:, n]
        if np.abs(change[:, :n]).max() < 1e-12 and np.abs(change[:, n]).max() < 1e-9:
            break
    pulls = _pulls(difference, pretension)
    r, tangent, _ = linearised(parameters, theta, still, still, pulls)
    least = np.linalg.eigvalsh(0.5 * (tangent + tangent.transpose(0, 2, 1)))[:, 0]
    return Equilibria(theta, pulls, (np.abs(r).max(axis=1) < 1e-9) & (least > 0.0))


def _pulls(difference: Array, pretension: float) -> Array:
    """(B, 2) pulls whose difference is the given one, the lesser at pretension [N]."""
    return pretension + np.stack([difference.clip(0.0), (-difference).clip(0.0)], axis=-1)


# Number of angles at which a range of bending is looked at.
_ANGLES = 2001


class Balance(NamedTuple):
    """Torques that hold one arc at some angles, (T,) each."""

    asked: Array
    """Torque that holds it there [N m]."""
    least: Array
    """The tendons' least and largest torque there [N m], as `wristctl.wrist.tendons.reach` has it."""
    most: Array
    arm_plus: Array
    """Moment arms of the + and the - side [m]."""
    arm_minus: Array


class Shortfall(NamedTuple):
    """Angle at which the tendons fall short by most, and what would hold the wrist there."""

    theta: float
    """Bending angle [rad]."""
    asked: float
    """Torque that holds it there [N m]."""
    given: float
    """The tendons' torque nearest to that [N m]."""
    angle: float
    """Angle toward theta to which they hold it, from straight [rad]; nan where they do not hold it straight."""
    tension_limit: float
    """Least limit of each tendon's tension that would do [N]; negative where none would."""
    tendon_radius: float
    """Least radius of the circle of tendons that would do [m]."""


def balance(wrist: WristParameters, theta: Array, force: float = 0.0) -> Balance:
    """Torques that hold the wrist at angles (T,) [rad] under a force at the tip, across the straight wrist [N]."""
    one = Segments(*segments(wrist, 1))
    tip, turned = one.length * unit_arc(theta)[1], np.stack([-np.sin(theta), np.cos(theta)], axis=-1)
    lifted = 0.5 * one.mass * tip + one.hand_mass * (tip + one.hand_offset * turned)
    plus, minus = _moment_arms(one, theta)
    low, high = TENDONS_PER_SIDE * wrist.pretension, TENDONS_PER_SIDE * wrist.tension_limit
    asked = one.stiffness * theta - (lifted * wrist.gravity).sum(axis=1) - force * tip[:, 1]
    return Balance(asked, plus * low + minus * high, plus * high + minus * low, plus, minus)


def _moment_arms(one: Segments, theta: Array) -> tuple[Array, Array]:
    """Moment arms of the + and the - side of one arc at angles (T,) [m], as `wristctl.wrist.tendons` has them."""
    y = theta / (2.0 * one.spans)
    place, slope, _ = (row[:, 0] + 1j * row[:, 1] for row in unit_arc(2.0 * y))
    shortening = -((2.0 * slope - 1j * place) * np.exp(-1j * y)).real  # of sin(y)/y
    bending, compression = one.tendon_offset * np.cos(y), one.length / (2.0 * one.spans) * shortening
    return bending + compression, compression - bending


def shortfall(wrist: WristParameters, low: float, high: float, force: float = 0.0) -> Shortfall | None:
    """Largest shortfall of the tendons between two bending angles [rad]; None where they hold the wrist everywhere.

    `force` is a constant one at the tip, across the straight wrist [N].
    """
    theta = np.linspace(low, high, _ANGLES)
    torques = balance(wrist, theta, force)
    beyond = np.maximum(torques.asked - torques.most, torques.least - torques.asked)
    worst = int(beyond.argmax())
    if beyond[worst] <= 0.0:
        return None
    asked, least, most, plus, minus = (float(column[worst]) for column in torques)
    ahead = asked > most
    pulls, arm_opposite = (plus, minus) if ahead else (minus, plus)
    limit = (asked / TENDONS_PER_SIDE - arm_opposite * wrist.pretension) / pulls
    squeezed = 0.5 * (plus + minus) * (wrist.tension_limit + wrist.pretension)
    per_radius = 0.5 * (plus - minus) * (wrist.tension_limit - wrist.pretension) / wrist.tendon_radius
    radius = abs(asked / TENDONS_PER_SIDE - squeezed) / per_radius
    angle = _held_to(wrist, float(theta[worst]), force)
    return Shortfall(float(theta[worst]), asked, most if ahead else least, angle, limit, radius)


def _held_to(wrist: WristParameters, theta: float, force: float) -> float:
    way = np.linspace(0.0, theta, _ANGLES)
    torques = balance(wrist, way, force)
    spare = np.minimum(torques.asked - torques.least, torques.most - torques.asked)
    first = int((spare < 0.0).argmax())
    if first == 0:
        return math.nan
    share = spare[first - 1] / (spare[first - 1] - spare[first])
    return float(way[first - 1] + share * (way[first] - way[first - 1]))


# Step of difference quotients [rad].
_SMALL = 1e-6
# States of the + and the - side's bristle.
FROM_BELOW, FROM_ABOVE, UNBENT = (1.0, -1.0), (-1.0, 1.0), (0.0, 0.0)


class HeldTendons(NamedTuple):
    """Tendons of wrists (B,) at rest on what holds them; in one plane the places are both sides."""

    given: Array
    """(B, T) what the tendons of each place have reeled in since they were taut and free of tension on the straight
    wrist [m]; pulls at the spools [N] where these are held."""
    stiffness: Array
    """Stiffness of a place's tendons together [N/m], (B, 1) or (T,); 0 where pulls are held."""
    friction: Array
    sheath: Array
    """[rad]"""

    def pulls(self, shorter: Array, wrapped: Array, z: Array) -> Array:
        """Pulls at the wrist (B, T) [N] on paths that are so much shorter (B, T) [m] and wrapped by bends [rad].

        `z` are the states of the bristles.
        """
        at_spool = np.where(self.stiffness > 0.0, self.stiffness * (self.given - shorter).clip(0.0), self.given)
        pulls: Array = at_spool * np.exp(-self.friction[:, None] * (self.sheath[:, None] + wrapped) * z)
        return pulls


def at_rest_with(parameters: Array, tendons: HeldTendons, z: tuple[float, float], guess: Array) -> Array:
    """Segments' angles (B, n) [rad] at rest with both sides' bristles in this state, by Newton's method from a guess.

    `parameters` are rows of Segments, (B, 12). Raises UserError where there is no such rest.
    """
    still = 0.0 * guess
    length = parameters[:, Segments._fields.index("length")] * guess.shape[1]

    def residual(theta: Array) -> Array:
        shorter = length[:, None] - terms(parameters, theta, still).tendon_lengths.sum(axis=1)
        pulls = tendons.pulls(shorter, np.abs(theta).sum(axis=1, keepdims=True), np.asarray(z))
        return linearised(parameters, theta, still, still, pulls)[0]

    return at_rest_where(residual, guess)


def at_rest_where(residual: Callable[[Array], Array], guess: Array) -> Array:
    """Coordinates (B, m) at which residuals (B, m) [N m] of wrists are 0, by Newton's method from a guess.

    Raises UserError where there is no such rest.
    """
    x, steps = np.array(guess, float), _SMALL * np.eye(guess.shape[1])
    for _ in range(100):
        r = residual(x)
        columns = [(residual(x + step) - residual(x - step)) / (2.0 * _SMALL) for step in steps]
        change = np.linalg.solve(np.stack(columns, axis=2), -r[..., None])[..., 0]
        largest = np.abs(change).max(axis=1, initial=1e-300)
        x = x + change * np.minimum(1.0, 0.3 / largest)[:, None]
        if largest.max() < 1e-12:
            break
    if not np.abs(residual(x)).max() < 1e-9:
        fix = "less friction, sheath or bend, or more pull"
        raise UserError("no rest was found on held tendons with this friction", "wrist", fix)
    return x
