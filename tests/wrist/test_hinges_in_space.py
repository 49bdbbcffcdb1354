"""Universal joints between rigid links: their geometry, the planar hinges in any plane, conservation, and MuJoCo."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.wrist.turned_in_space import turned
from wristctl.arrays import Array
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of, square_like
from wristctl.wrist.hinges import HINGES, Hinges
from wristctl.wrist.integrator import step
from wristctl.wrist.plant import kernel_of, parameters_of
from wristctl.wrist.spatial.hinges_in_space import HINGES_IN_SPACE, SpatialHinges, hinged_equilibrium
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, spatial_bias
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import NoTendons

N = 2  # one kernel for all
PLACES = (
    TendonPlace(angle_deg=20.0),
    TendonPlace(angle_deg=120.0, radius=0.015, ends_at=3),
    TendonPlace(angle_deg=220.0),
    TendonPlace(angle_deg=290.0, radius=0.01),
)
WRIST = WristParameters(
    gravity=(-7.0, 3.0), gravity_flexion=4.0, flexion_ratio=1.7, stiffness_axis_deg=30.0, taper=3.0, tendons=PLACES
)
COUNT = len(SpatialHinges._fields)
_planar = tuple_of(Hinges)

# Up to where two discs' rims meet.
bends = st.lists(st.floats(-1.0, 1.0), min_size=2 * N, max_size=2 * N).map(np.array)
rates = st.lists(st.floats(-8.0, 8.0), min_size=2 * N, max_size=2 * N).map(np.array)
tensions = st.lists(st.floats(0.0, 60.0), min_size=4, max_size=4).map(np.array)


def values_of(wrist: WristParameters, force: Array | tuple[float, ...] = (0.0, 0.0, 0.0)) -> Array:
    """Parameters of N parts with a force on the tip [N]."""
    values = HINGES_IN_SPACE.values(wrist, N)
    values[SpatialHinges._fields.index("force_x") :][:3] = force
    return values


FORCE = (0.4, -1.1, 0.7)
VALUES = values_of(WRIST, FORCE)


def _terms(model: Any, parameters: Any, state: Any, out: Any, cut: Any, places: Any) -> None:
    rows, result, m, count = rows_of(state), rows_of(out), len(cut), len(places)
    wrist = parameters_of(model, rows_of(parameters), places)
    q, rate, acceleration = part(rows, 0, cut), part(rows, m, cut), part(rows, 2 * m, cut)
    r, arms = lanes_like(q), lanes_like(q)
    mass, by_q, by_rate = square_like(q), square_like(q), square_like(q)
    bent = bent_wrist(wrist, q, part(rows, 3 * m, places), mass)
    spatial_bias(wrist.segment, q, rate, bent.posture, bent.tangent, bent.torques.torque, r)
    spatial_jacobians(wrist.segment, q, rate, acceleration, bent, by_q, by_rate)
    lengths_along(wrist, q, part(result, 0, places))
    for t in range(count):
        moment_arms_of(wrist, q, t, arms)
        for i in range(m):
            result[count + m * t + i] = arms[i]
    first = count + m * count
    for i in range(m):
        result[first + i] = r[i]
        for j in range(m):
            result[first + i] = result[first + i] + mass[i, j] * acceleration[j]
            result[first + m + m * i + j] = mass[i, j]
            result[first + m + m * m + m * i + j] = by_q[i, j]
            result[first + m + 2 * m * m + m * i + j] = by_rate[i, j]


def _steps(model: Any, parameters: Any, state: Any, pulls: Any, h: float, cut: Any, places: Any) -> None:
    rows, m = rows_of(state), len(cut)
    wrist = parameters_of(model, rows_of(parameters), places)
    q, rate = part(rows, 0, cut), part(rows, m, cut)
    for k in range(pulls.shape[0]):
        spatial_step(wrist, q, rate, part(rows_of(pulls[k]), 0, places), NoTendons(), h + zero_like(q[0]))


@kernel
def _planar_steps(parameters: Any, state: Any, h: float, count: int, cut: Any) -> None:
    plant, rows, n = _planar(rows_of(parameters)), rows_of(state), len(cut)
    q, rate, pulls = part(rows, 0, cut), part(rows, n, cut), beyond(rows, 2 * n)
    for _ in range(count):
        step(plant, q, rate, (pulls[0], pulls[1]), NoTendons(), h + zero_like(pulls[0]))


def linearised(
    values: Array, q: Array, rate: Array, acceleration: Array, pulls: Array
) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Lengths (T,), moment arms (T, 2N), residual (2N,), mass, and the residual's derivatives by q and rate."""
    m, count = len(q), len(pulls)
    out = np.empty(count + m * count + m + 3 * m * m)
    state = np.concatenate([q, rate, acceleration, pulls])
    kernel_of(_terms, HINGES_IN_SPACE)(HINGES_IN_SPACE, values, state, out, (0,) * m, (0,) * count)
    lengths, arms, r, mass, by_q, by_rate = np.split(out, np.cumsum([count, m * count, m, m * m, m * m]))
    return lengths, arms.reshape(count, m), r, mass.reshape(m, m), by_q.reshape(m, m), by_rate.reshape(m, m)


def moved(values: Array, q: Array, rate: Array, pulls: Array, h: float = 1e-3) -> tuple[Array, Array]:
    """Coordinates and rates after a step under each row of pulls (K, T)."""
    state, m = np.concatenate([q, rate]), len(q)
    held = np.ascontiguousarray(pulls, float)
    kernel_of(_steps, HINGES_IN_SPACE)(HINGES_IN_SPACE, values, state, held, h, (0,) * m, (0,) * held.shape[1])
    return state[:m], state[m:]


def turns(q: Array) -> Rotation:
    """Of each joint: by |u| about e_x x u."""
    u = q.reshape(-1, 2)
    return Rotation.from_rotvec(np.column_stack([0.0 * u[:, 0], -u[:, 1], u[:, 0]]))


def discs(wrist: WristParameters, q: Array) -> tuple[Array, Array]:
    """Centres (N + 1, 3) and axes (N + 1, 3, 3), as columns, of the discs, link by link."""
    half, place, frame = 0.5 * wrist.length / N, [np.zeros(3)], [np.eye(3)]
    for turn in turns(q):
        joint = place[-1] + half * frame[-1][:, 0]
        frame.append(frame[-1] @ turn.as_matrix())
        place.append(joint + half * frame[-1][:, 0])
    return np.array(place), np.array(frame)


def holes_apart(wrist: WristParameters, q: Array) -> Array:
    """Lengths of the tendons from hole to hole, (T,)."""
    place, frame = discs(wrist, q)
    layout = TendonLayout.of(wrist)
    lengths = []
    for (y, z), last in zip(layout.cross_section, layout.ends(wrist.discs, N), strict=True):
        holes = (place + frame @ np.array([0.0, y, z]))[: last + 1]
        lengths.append(np.linalg.norm(np.diff(holes, axis=0), axis=1).sum())
    return np.array(lengths)


def points(wrist: WristParameters, q: Array) -> tuple[Array, Array]:
    """Masses and their places: the chords' middles, and the hand."""
    place, frame = discs(wrist, q)
    hand = place[-1] + wrist.hand_offset * frame[-1][:, 0]
    return np.append(np.full(N, wrist.mass / N), wrist.hand_mass), np.vstack([0.5 * (place[1:] + place[:-1]), hand])


def springs(wrist: WristParameters) -> list[Array]:
    """Stiffness of each joint by hand (2, 2): a geometric row whose compliances sum to the whole's, on oblique axes."""
    axis = np.deg2rad(wrist.stiffness_axis_deg)
    turn = np.array([[np.cos(axis), -np.sin(axis)], [np.sin(axis), np.cos(axis)]])
    whole = turn @ np.diag([wrist.stiffness, wrist.stiffness * wrist.flexion_ratio]) @ turn.T
    row = np.geomspace(wrist.taper, 1.0, N)
    return [share * (1.0 / row).sum() * whole for share in row]


def energy(wrist: WristParameters, q: Array, rate: Array, pulls: Array, force: tuple[float, ...] = FORCE) -> float:
    """Of motion, springs, gravity, the force on the tip and held pulls [J]."""
    h = 1e-5
    (mass, where), gravity = points(wrist, q), np.array([*wrist.gravity, wrist.gravity_flexion])
    weights = {1: 8.0 / 12.0, -1: -8.0 / 12.0, 2: -1.0 / 12.0, -2: 1.0 / 12.0}
    velocity = sum(w / h * points(wrist, q + s * h * rate)[1] for s, w in weights.items())
    moving = 0.5 * (mass * (np.asarray(velocity) ** 2).sum(axis=1)).sum()
    spring = sum(0.5 * u @ k @ u for u, k in zip(q.reshape(-1, 2), springs(wrist), strict=True))
    load = discs(wrist, q)[0][-1] @ np.array(force)
    return float(moving + spring - mass @ where @ gravity - load + pulls @ holes_apart(wrist, q))


@settings(max_examples=25)
@given(q=bends, rate=rates, acceleration=rates, pulls=tensions)
@pytest.mark.slow
def test_tendons_run_from_hole_to_hole_and_jacobians_are_the_derivatives(
    q: Array, rate: Array, acceleration: Array, pulls: Array
) -> None:
    """Without springs and dampers, which hide what motion adds."""
    values, h = VALUES.copy(), 1e-5
    values[SpatialHinges._fields.index("stiffness_yy") : SpatialHinges._fields.index("gravity_x")] *= 1e-3
    acceleration = 5.0 * acceleration
    lengths, arms, _, mass, by_q, by_rate = linearised(values, q, rate, acceleration, pulls)
    np.testing.assert_allclose(lengths, holes_apart(WRIST, q), rtol=1e-12)
    np.testing.assert_allclose(HINGES_IN_SPACE.tips(WRIST, q[None])[0], discs(WRIST, q)[0][-1], atol=1e-15)
    assert (mass == mass.T).all() and np.linalg.eigvalsh(mass)[0] > 0.0
    for column in range(2 * N):
        nudge = h * np.eye(2 * N)[column]
        ahead, behind = (linearised(values, q + s * nudge, rate, acceleration, pulls) for s in (1.0, -1.0))
        np.testing.assert_allclose(-arms[:, column], (ahead[0] - behind[0]) / (2.0 * h), atol=1e-9)
        np.testing.assert_allclose(by_q[:, column], (ahead[2] - behind[2]) / (2.0 * h), rtol=1e-6, atol=1e-7)
        ahead, behind = (linearised(values, q, rate + s * nudge, acceleration, pulls) for s in (1.0, -1.0))
        np.testing.assert_allclose(by_rate[:, column], (ahead[2] - behind[2]) / (2.0 * h), rtol=1e-6, atol=1e-7)


@settings(max_examples=15)
@given(q=bends, rate=rates, pulls=tensions, by=st.sampled_from([0.5 * np.pi, np.pi, -1.1, 0.3]))
def test_turning_everything_about_the_tangent_turns_the_motion(q: Array, rate: Array, pulls: Array, by: float) -> None:
    """The ellipse of stiffness turns with it."""
    turn = np.array([[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]])
    held = np.tile(pulls, (100, 1))

    def aside(pairs: Array) -> Array:
        return (pairs.reshape(-1, 2) @ turn.T).reshape(pairs.shape)

    end, speed = moved(VALUES, q, rate, held)
    end_aside, speed_aside = moved(turned(SpatialHinges._fields, VALUES, by), aside(q), aside(rate), held)
    np.testing.assert_allclose(end_aside, aside(end), atol=1e-12)
    np.testing.assert_allclose(speed_aside, aside(speed), atol=1e-10)


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
@pytest.mark.parametrize("milliseconds", [40, 1000])
def test_in_one_plane_it_is_the_planar_hinges(plane: str, milliseconds: int) -> None:
    """Tendons 1 and 2 pull toward radial, 4 and 5 toward ulnar; turned about the tangent it is the other plane."""
    wrist = WristParameters(gravity=(-8.0, 3.0), taper=3.0)
    planar, spatial = HINGES.values(wrist, N), values_of(wrist)
    spatial, own = (
        (spatial, slice(0, None, 2))
        if plane == "ulnar"
        else (turned(SpatialHinges._fields, spatial, np.pi / 2.0), slice(1, None, 2))
    )
    pulls, start, rate = np.array([5.0, 31.0]), np.array([0.3, -0.5]), np.array([2.0, -4.0])
    state = np.concatenate([start, rate, pulls])
    _planar_steps(planar, state, 1e-3, milliseconds, (0,) * N)
    q, speed = np.zeros(2 * N), np.zeros(2 * N)
    q[own], speed[own] = start, rate
    bent, moving = moved(spatial, q, speed, np.tile(0.5 * pulls[[1, 1, 0, 0]], (milliseconds, 1)))
    across = slice(1 - own.start, None, 2)
    np.testing.assert_allclose(bent[own], state[:N], atol=1e-12)
    np.testing.assert_allclose(moving[own], state[N : 2 * N], atol=1e-11)
    np.testing.assert_allclose([bent[across], moving[across]], 0.0, atol=1e-13)
    assert np.abs(bent).max() > 0.2


def test_energy_stays_without_damping_as_the_third_power_of_the_step() -> None:
    values = VALUES.copy()
    first = SpatialHinges._fields.index("damping_yy")
    values[first : first + 3] = 0.0
    q, rate, pulls = np.array([0.4, -0.2, 0.1, 0.3]), np.array([3.0, 5.0, -2.0, 4.0]), np.array([12.0, 3.0, 8.0, 20.0])
    begin, drift = energy(WRIST, q, rate, pulls), []
    for h in (1e-4, 5e-5):
        bent, moving = moved(values, q, rate, np.tile(pulls, (round(0.1 / h), 1)), h)
        assert np.abs(bent - q).max() > 0.05
        drift.append(abs(energy(WRIST, bent, moving, pulls) - begin))
    assert drift[1] < 2e-5 and drift[0] / drift[1] == pytest.approx(8.0, rel=0.1), drift
    bent, moving = moved(VALUES, q, rate, np.tile(pulls, (100, 1)))
    assert energy(WRIST, bent, moving, pulls) < begin - 0.1


def mujocos_chain(wrist: WristParameters) -> str:
    """MuJoCo's XML: links on ball joints, the hand on the last, tendons through holes, and the parts' masses, free.

    Links have no mass but what MuJoCo asks for. Where the masses are, the coordinates say.
    """
    layout, half = TendonLayout.of(wrist), 0.5 * wrist.length / N
    places, ends = layout.cross_section, layout.ends(wrist.discs, N)

    def holes(k: int, x: float) -> str:
        here = "".join(
            f'<site name="hole{t}_{k}" pos="{x!r} {float(y)!r} {float(z)!r}"/>' for t, (y, z) in enumerate(places)
        )
        return here + f'<site name="disc{k}" pos="{x!r} 0 0"/>'

    links, close = "", ""
    for k in range(1, N + 1):
        mass, at = (wrist.hand_mass, half + wrist.hand_offset) if k == N else (1e-9, half)
        inertia = f'<inertial mass="{mass!r}" pos="{at!r} 0 0" diaginertia="1e-12 1e-12 1e-12"/>'
        links += f'<body pos="{half if k == 1 else 2.0 * half!r} 0 0"><joint type="ball"/>{inertia}{holes(k, half)}'
        close += "</body>"
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    inertia = f'<inertial mass="{wrist.mass / N!r}" pos="0 0 0" diaginertia="1e-12 1e-12 1e-12"/>'
    through = ["".join(f'<site site="hole{t}_{k}"/>' for k in range(last + 1)) for t, last in enumerate(ends)]
    tendons = "".join(f'<spatial name="{t}">{run}</spatial>' for t, run in enumerate(through))
    motors = "".join(f'<motor tendon="{t}" gear="-1"/>' for t in range(len(through)))
    gravity = " ".join(map(repr, (*wrist.gravity, wrist.gravity_flexion)))
    return (
        f'<mujoco><option gravity="{gravity}"/><worldbody>{holes(0, 0.0)}{links}{close}'
        f"{N * f'<body>{slides}{inertia}</body>'}</worldbody><tendon>{tendons}</tendon>"
        f"<actuator>{motors}</actuator></mujoco>"
    )


class Reduced:
    """MuJoCo's equations of motion, M v' + bias = force, along the coordinates q: v = G(q) rate."""

    def __init__(self, wrist: WristParameters, force: tuple[float, ...]) -> None:
        mujoco = pytest.importorskip("mujoco", reason="the extra `dev` has it")
        self.wrist, self.force, self.mujoco = wrist, np.array(force), mujoco
        self.model = mujoco.MjModel.from_xml_string(mujocos_chain(wrist))
        self.data = mujoco.MjData(self.model)
        self.stiffness = np.zeros((2 * N, 2 * N))
        for k, spring in enumerate(springs(wrist)):
            self.stiffness[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = spring

    def place(self, q: Array) -> Array:
        """Put the chain where q has it, the masses too, and return G."""
        turned_by = turns(q)
        self.data.qpos[: 4 * N] = turned_by.as_quat(scalar_first=True).ravel()
        self.data.qpos[4 * N :] = points(self.wrist, q)[1][:-1].ravel()
        self.mujoco.mj_fwdPosition(self.model, self.data)
        g = np.zeros((6 * N, 2 * N))
        for k, rho in enumerate(turned_by.as_rotvec()):
            size = np.linalg.norm(rho)
            w = np.array([[0.0, -rho[2], rho[1]], [rho[2], 0.0, -rho[0]], [-rho[1], rho[0], 0.0]])
            second = (1.0 - np.sinc(size / np.pi)) / size**2 if size > 1e-4 else 1.0 / 6.0
            own = np.eye(3) - 0.5 * np.sinc(0.5 * size / np.pi) ** 2 * w + second * w @ w  # in the link's own axes
            g[3 * k : 3 * k + 3, 2 * k : 2 * k + 2] = own @ np.array([[0.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
        by_speed = [self.jacobian(f"disc{k}") @ g for k in range(N + 1)]
        for k, (near, far) in enumerate(pairwise(by_speed)):
            g[3 * (N + k) : 3 * (N + k) + 3] = 0.5 * (near + far)
        return g

    def jacobian(self, site: str) -> Array:
        """Derivatives of a site's place by MuJoCo's speeds, (3, 6N)."""
        found = np.zeros((3, self.model.nv))
        self.mujoco.mj_jacSite(self.model, self.data, found, None, self.model.site(site).id)
        return found

    def acceleration(self, q: Array, rate: Array, pulls: Array) -> Array:
        """q'' under the tendons' pulls [N]."""
        h = 1e-5
        swept = (self.place(q + h * rate) - self.place(q - h * rate)) @ rate / (2.0 * h)
        g = self.place(q)
        self.data.qvel[:], self.data.ctrl[:] = g @ rate, pulls
        self.mujoco.mj_forward(self.model, self.data)
        mass = np.zeros((self.model.nv, self.model.nv))
        self.mujoco.mj_fullM(self.model, self.data, mass)
        force = self.jacobian(f"disc{N}").T @ self.force + self.data.qfrc_actuator - self.data.qfrc_bias - mass @ swept
        passive = self.stiffness @ q + N * self.wrist.damping * rate
        found: Array = np.linalg.solve(g.T @ mass @ g, g.T @ force - passive)
        return found


def test_a_long_time_ends_at_the_equilibrium() -> None:
    pulls = np.array([20.0, 6.0, 2.0, 14.0])
    rest = hinged_equilibrium(WRIST, N, pulls)
    bends, speed = moved(values_of(WRIST), np.zeros(2 * N), np.zeros(2 * N), np.tile(pulls, (8000, 1)))
    assert np.abs(rest).min() > 0.05
    np.testing.assert_allclose(bends, rest, atol=1e-9)
    np.testing.assert_allclose(speed, 0.0, atol=1e-8)


def test_a_wrist_that_is_too_heavy_has_no_equilibrium() -> None:
    heavy = WRIST.model_copy(update={"gravity": (-9.81, 0.0), "hand_mass": 5.0})
    with pytest.raises(UserError, match="buckles: no stable equilibrium under pulls of 5 N at most"):
        HINGES_IN_SPACE.rest(heavy, N, (5.0, 5.0))


def pulled(time: Array | float) -> Array:
    """Pulls (T,) or (K, T) [N] that bend to one side, back and around within a second."""
    turn = 2.0 * np.pi * np.asarray(time)[..., None]
    return 2.0 + 40.0 * np.sin(0.5 * turn + np.array([0.0, 2.0, 3.5, 5.0])) ** 2


@pytest.mark.slow
def test_mujocos_chain_bends_alike_under_the_same_pulls() -> None:
    """A second under pulls that change, with oblique and uneven springs, gravity and a force aside."""
    chain, times = Reduced(WRIST, FORCE), np.arange(0.05, 1.01, 0.05)

    def slope(time: float, state: Array) -> Array:
        return np.concatenate([state[2 * N :], chain.acceleration(state[: 2 * N], state[2 * N :], pulled(time))])

    begin = np.zeros(4 * N)
    exact = solve_ivp(slope, (0.0, 1.0), begin, "Radau", times, rtol=1e-6, atol=1e-8).y[: 2 * N].T
    own, h = [(begin[: 2 * N], begin[2 * N :])], 1e-3
    for first, last in pairwise([0.0, *times]):
        middles = np.arange(first + 0.5 * h, last, h)
        own.append(moved(VALUES, *own[-1], pulled(middles), h))
    bent = np.array([q for q, _ in own[1:]])
    assert np.ptp(bent, axis=0).min() > 0.1
    np.testing.assert_allclose(bent, exact, atol=3e-5)
