"""The paper's augmented form in two planes: each segment as a rigid chain, the readable reference in NumPy.

As in the plane (`tests.oracles.augmented`) a segment turns, slides, slides and turns, and its point mass is between
the slides; but a turn is now by a rotation vector across the tangent, half of the segment's: rho/2 with rho = (0, -u_z,
u_y), and a slide is d = l/2 S(|u|/2), S(x) = sin(x)/x, along the chord. So the joints of a segment are mu = (u/2, d, d,
u/2), six numbers, and J_mu = d(mu)/du reduces them to two. A turn's axes are the columns of the rotation vector's
Jacobian, so that nothing is singular at the straight wrist.

All is written without absolute values and branches: at complex coordinates it gives the analytic functions, whose
imaginary part over a small step is a derivative to rounding. One state at a time; SI units. `spatial_motion` moves a
wrist by these equations with an integrator of SciPy's.
"""

from math import factorial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wristctl.config.wrist import WristParameters
from wristctl.wrist.spatial.spatial_segments import FIELDS, OF_A_TENDON, SpatialSegments

# Real or complex.
Numbers = NDArray[Any]

_TERMS = 20


def stumpff_of(s: Any, k: int) -> Any:
    """c_k(s) by Taylor's series."""
    return sum((-s) ** j / factorial(2 * j + k) for j in range(_TERMS))


def hat(v: Numbers) -> Numbers:
    """The matrix of v x."""
    return np.array([[0.0 * v[0], -v[2], v[1]], [v[2], 0.0 * v[0], -v[0]], [-v[1], v[0], 0.0 * v[0]]])


def cross(a: Numbers, b: Numbers) -> Numbers:
    """a x b, sooner than NumPy's for one vector."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


class Turn(NamedTuple):
    """A turn by a bend u."""

    rotation: Numbers
    """(3, 3)"""
    axes: Numbers
    """Angular velocity by each component of u's rate, (3, 2)."""
    axes_rate: Numbers
    """Its time derivative at the given rate of u."""


# Columns: the rotation vectors of bends by u_y and by u_z.
_RHO = np.array([[0.0, 0.0], [0.0, -1.0], [1.0, 0.0]])


def turned(u: Numbers, rate: Numbers) -> Turn:
    """The turn by u (2,) that changes at a rate (2,)."""
    s, s_rate = u @ u, 2.0 * (u @ rate)
    c1, c2, c3, c4, c5 = (stumpff_of(s, k) for k in range(1, 6))
    # by s: half of k c_{k+2} - c_{k+1}
    c1_rate, c2_rate, c3_rate = (0.5 * s_rate * slope for slope in (c3 - c2, 2.0 * c4 - c3, 3.0 * c5 - c4))
    rho, rho_rate = _RHO @ u, _RHO @ rate
    w, w_rate = hat(rho), hat(rho_rate)
    rotation = np.eye(3) + c1 * w + c2 * w @ w
    outer, outer_rate = np.outer(rho, rho), np.outer(rho_rate, rho) + np.outer(rho, rho_rate)
    axes = c1 * np.eye(3) + c2 * w + c3 * outer
    axes_rate = c1_rate * np.eye(3) + c2_rate * w + c2 * w_rate + c3_rate * outer + c3 * outer_rate
    return Turn(rotation, axes @ _RHO, axes_rate @ _RHO)


def joints(q: Numbers, rate: Numbers, length: float) -> tuple[Numbers, Numbers, Numbers]:
    """mu (6n,), J_mu (6n, 2n) and the time derivative of J_mu at coordinates and rates (2n,)."""
    n = len(q) // 2
    kind = np.result_type(q, rate)
    mu, jacobian, jacobian_rate = np.zeros(6 * n, kind), np.zeros((6 * n, 2 * n), kind), np.zeros((6 * n, 2 * n), kind)
    for k in range(n):
        rows, columns = slice(6 * k, 6 * k + 6), slice(2 * k, 2 * k + 2)
        u, x = q[columns], rate[columns]
        s = 0.25 * u @ u
        c1, c2, c3, c4, c5 = (stumpff_of(s, m) for m in range(1, 6))
        # d = l/2 c_1(|u|^2/4); by u_a: l/8 (c_3 - c_2) u_a
        slope, curvature = c3 - c2, 0.25 * ((3.0 * c5 - c4) - (2.0 * c4 - c3)) * (u @ x)
        slide, by_u = 0.5 * length * c1, 0.125 * length * slope * u
        by_u_rate = 0.125 * length * (curvature * u + slope * x)
        mu[rows] = [*(0.5 * u), slide, slide, *(0.5 * u)]
        jacobian[rows, columns] = np.vstack([0.5 * np.eye(2), by_u, by_u, 0.5 * np.eye(2)])
        jacobian_rate[rows, columns] = np.vstack([np.zeros((2, 2)), by_u_rate, by_u_rate, np.zeros((2, 2))])
    return mu, jacobian, jacobian_rate


class Moved(NamedTuple):
    """A point on the chain, with what moves it."""

    place: Numbers
    jacobian: Numbers
    """d(place)/d(mu), (3, 6n)."""
    jacobian_rate: Numbers
    """Its time derivative."""


class Augmented(NamedTuple):
    """Terms of the equation of motion; as `wristctl.wrist.spatial.spatial_model.SpatialTerms`."""

    mass: Numbers
    coriolis: Numbers
    """C (2n, 2n): C rate are the Coriolis and centrifugal terms, and dM/dt - 2 C is skew."""
    gravity: Numbers
    tip: Numbers
    rotation: Numbers
    tip_jacobian: Numbers
    """d(tip)/dq, (3, 2n)."""


def _chain(mu: Numbers, mu_rate: Numbers, hand_offset: float) -> tuple[list[Moved], Moved, Moved, Numbers]:
    """The segments' masses, the hand, the last disc's centre, and its rotation."""
    size = len(mu)
    kind = np.result_type(mu, mu_rate)
    frame, frame_rate = np.eye(3, dtype=kind), np.zeros((3, 3), kind)
    origin, origin_rate = np.zeros(3, kind), np.zeros(3, kind)
    columns: list[tuple[Any, ...]] = []
    masses = []

    def moved(place: Numbers, place_rate: Numbers) -> Moved:
        jacobian, rate = np.zeros((3, size), kind), np.zeros((3, size), kind)
        for number, (is_turn, axis, axis_rate, about, about_rate) in enumerate(columns):
            if is_turn:
                jacobian[:, number] = cross(axis, place - about)
                rate[:, number] = cross(axis_rate, place - about) + cross(axis, place_rate - about_rate)
            else:
                jacobian[:, number], rate[:, number] = axis, axis_rate
        return Moved(place, jacobian, rate)

    for first in range(0, size, 6):
        for joint in (0, 2, 3, 4):
            at = first + joint
            if joint in (2, 3):
                columns.append((False, frame[:, 0], frame_rate[:, 0], origin, origin_rate))
                origin_rate = origin_rate + mu_rate[at] * frame[:, 0] + mu[at] * frame_rate[:, 0]
                origin = origin + mu[at] * frame[:, 0]
                if joint == 2:
                    masses.append(moved(origin, origin_rate))
                continue
            turn = turned(mu[at : at + 2], mu_rate[at : at + 2])
            axes, axes_rate = frame @ turn.axes, frame_rate @ turn.axes + frame @ turn.axes_rate
            columns += [(True, axes[:, a], axes_rate[:, a], origin, origin_rate) for a in (0, 1)]
            spin = hat(turn.axes @ mu_rate[at : at + 2])
            frame, frame_rate = frame @ turn.rotation, frame_rate @ turn.rotation + frame @ spin @ turn.rotation
    beyond, beyond_rate = hand_offset * frame[:, 0], hand_offset * frame_rate[:, 0]
    return masses, moved(origin + beyond, origin_rate + beyond_rate), moved(origin, origin_rate), frame


def spatial_augmented(parameters: Numbers, q: Numbers, rate: Numbers) -> Augmented:
    """Terms of the equation of motion at coordinates and rates (2n,); `parameters` as `spatial_values` gives them."""
    segment = SpatialSegments(*parameters[:FIELDS])
    mu, j_mu, j_mu_rate = joints(q, rate, segment.length)
    masses, hand, tip, rotation = _chain(mu, j_mu @ rate, segment.hand_offset)
    m_b, c_b, g_b = (np.zeros(shape, mu.dtype) for shape in ((len(mu), len(mu)), (len(mu), len(mu)), len(mu)))
    gravity = np.array([segment.gravity_x, segment.gravity_y, segment.gravity_z])
    for mass, point in [*((segment.mass, point) for point in masses), (segment.hand_mass, hand)]:
        m_b += mass * point.jacobian.T @ point.jacobian
        c_b += mass * point.jacobian.T @ point.jacobian_rate
        g_b -= mass * point.jacobian.T @ gravity
    coriolis = j_mu.T @ (m_b @ j_mu_rate + c_b @ j_mu)
    return Augmented(j_mu.T @ m_b @ j_mu, coriolis, j_mu.T @ g_b, tip.place, rotation, tip.jacobian @ j_mu)


def augmented_tendons(parameters: Numbers, q: Numbers) -> tuple[Numbers, Numbers]:
    """Lengths of the tendons (T,) and their moment arms (T, 2n) [m].

    Along each segment (l - c.u) S(|u|/2g), as far as it runs there, and minus its derivative.
    """
    segment = SpatialSegments(*parameters[:FIELDS])
    tendons = np.reshape(parameters[FIELDS:], (-1, OF_A_TENDON))
    places, per_span = tendons[:, :2], 0.25 / segment.spans**2
    length, arms = 0.0, []
    for k, u in enumerate(q.reshape(-1, 2)):
        share = np.clip(tendons[:, 2] - k, 0.0, 1.0)
        c1, c2, c3 = (stumpff_of(per_span * u @ u, m) for m in (1, 2, 3))
        straight = segment.length - places @ u
        length = length + share * straight * c1
        arms.append(share[:, None] * (places * c1 - per_span * (c3 - c2) * np.outer(straight, u)))
    return np.asarray(length), np.concatenate(arms, axis=1)


def _forces(parameters: Numbers, at: Augmented, q: Numbers, rate: Numbers, pull_on: Numbers) -> Numbers:
    """What accelerates at q'' = 0, (2n,), with `pull_on` what the tendons' pulls give."""
    segment = SpatialSegments(*parameters[:FIELDS])
    force = np.array([segment.force_x, segment.force_y, segment.force_z])
    stiffness = np.array([[segment.stiffness_yy, segment.stiffness_yz], [segment.stiffness_yz, segment.stiffness_zz]])
    damping = np.array([[segment.damping_yy, segment.damping_yz], [segment.damping_yz, segment.damping_zz]])
    passive = (q.reshape(-1, 2) @ stiffness + rate.reshape(-1, 2) @ damping).ravel()
    forces: Numbers = at.tip_jacobian.T @ force + pull_on - at.coriolis @ rate - at.gravity - passive
    return forces


def augmented_residual(
    parameters: Numbers, q: Numbers, rate: Numbers, acceleration: Numbers, pulls: Numbers
) -> Numbers:
    """M q'' + r (2n,) under the tendons' pulls (T,) [N]."""
    at = spatial_augmented(parameters, q, rate)
    pull_on = pulls @ augmented_tendons(parameters, q)[1]
    residual: Numbers = at.mass @ acceleration - _forces(parameters, at, q, rate, pull_on)
    return residual


def parameters_of(wrist: WristParameters, places: Numbers, n: int, force: Numbers) -> Numbers:
    """Parameters of a wrist with tendons at places (T, 2) [m] to the last disc and a force on the tip [N].

    They are those of `spatial_values`, by hand: n segments in series, with the stiffness along and across its axis.
    """
    axis = np.deg2rad(wrist.stiffness_axis_deg)
    along, across = np.array([np.cos(axis), np.sin(axis)]), np.array([-np.sin(axis), np.cos(axis)])
    stiffness = wrist.stiffness * (np.outer(along, along) + wrist.flexion_ratio * np.outer(across, across))
    segment = SpatialSegments(
        length=wrist.length / n, mass=wrist.mass / n, hand_mass=wrist.hand_mass, hand_offset=wrist.hand_offset,
        spans=(wrist.discs - 1) / n,
        stiffness_yy=n * stiffness[0, 0], stiffness_yz=n * stiffness[0, 1], stiffness_zz=n * stiffness[1, 1],
        damping_yy=n * wrist.damping, damping_yz=0.0, damping_zz=n * wrist.damping,
        gravity_x=wrist.gravity[0], gravity_y=wrist.gravity[1], gravity_z=wrist.gravity_flexion,
        force_x=force[0], force_y=force[1], force_z=force[2],
    )  # fmt: skip
    return np.concatenate([segment, np.column_stack([places, np.full(len(places), float(n))]).ravel()])


class Rubbing(NamedTuple):
    """Elastic tendons that rub: stiffness of each [N/m], friction, sheath [rad], the path of a bristle [m]."""

    stiffness: float
    friction: float
    sheath: float
    presliding: float


def spatial_motion(
    parameters: Numbers, n: int, held: Numbers, every: float, tendons: Rubbing | None = None
) -> NDArray[np.float64]:
    """Coordinates (K + 1, 2n) [rad] of n segments, straight and at rest first, every so many seconds, by SciPy's Radau.

    Parameters
    ----------
    held
        What is held over each interval (K, T): pulls [N], or of elastic tendons lengths reeled in [m].
    tendons
        Tendons between spools and wrist: one whose path is shorter by x pulls k max(l - x, 0) at its spool, and that
        times exp(-mu phi z) at the wrist, phi the angle that sheath and segments wrap it by. The bristle z follows x:
        dz/dt = (dx/dt - z |dx/dt|)/s.
    """
    runs = np.reshape(parameters[FIELDS:], (-1, OF_A_TENDON))[:, 2]
    count = len(runs)
    straight = runs * SpatialSegments(*parameters[:FIELDS]).length
    shares = np.clip(runs[:, None] - np.arange(n), 0.0, 1.0)

    def slope(_: float, state: Numbers, holds: Numbers) -> Numbers:
        q, rate, z = np.split(state, [2 * n, 4 * n])
        at, (lengths, arms) = spatial_augmented(parameters, q, rate), augmented_tendons(parameters, q)
        pulls, z_rate = holds, 0.0 * z
        if tendons is not None:
            wrapped = tendons.sheath + shares @ np.hypot(*q.reshape(-1, 2).T)
            stretch, speed = holds - (straight - lengths), arms @ rate
            pulls = tendons.stiffness * np.maximum(stretch, 0.0) * np.exp(-tendons.friction * wrapped * z)
            z_rate = (speed - z * np.abs(speed)) / tendons.presliding
        acceleration = np.linalg.solve(at.mass, _forces(parameters, at, q, rate, pulls @ arms))
        return np.concatenate([rate, acceleration, z_rate])

    states = [np.zeros(4 * n + count)]
    for holds in held:
        done = solve_ivp(slope, (0.0, every), states[-1], "Radau", args=(holds,), rtol=1e-6, atol=1e-8)
        states.append(done.y[:, -1])
    return np.array(states)[:, : 2 * n]
