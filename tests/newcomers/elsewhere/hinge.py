"""A plain hinge as a plant: a rigid rod that turns about the base, with the wrist's spring, damper, masses and tendons.

(m L^2/3 + m_h (L + h)^2) q'' + D q' + K q = c (pull_plus - pull_minus) + gravity + F L cos q; tendons run beside the
rod at +-c and are L -+ c q long. Explicit Runge-Kutta of fourth order, pulls at each stage: nothing here is stiff.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import bessel
from wristctl.lanes.named_tuples import replacing
from wristctl.wrist.kinematics import Planar
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.tendon_mechanics import pulls_along

Array = NDArray[np.float64]


class Rod(NamedTuple):
    """Parameters, SI units; `falling` is the sum of mass times distance from the hinge."""

    length: Any
    inertia: Any
    falling: Any
    gravity_x: Any
    gravity_y: Any
    stiffness: Any
    damping: Any
    offset: Any
    force: Any


_loaded = replacing("stiffness", "force")


def values(wrist: WristParameters, n: int) -> Array:
    """The wrist as a rod; it has no segments."""
    reach = wrist.length + wrist.hand_offset
    return np.array(
        Rod(
            length=wrist.length,
            inertia=wrist.mass * wrist.length**2 / 3.0 + wrist.hand_mass * reach**2,
            falling=0.5 * wrist.mass * wrist.length + wrist.hand_mass * reach,
            gravity_x=wrist.gravity[0],
            gravity_y=wrist.gravity[1],
            stiffness=wrist.stiffness,
            damping=wrist.damping,
            offset=wrist.tendon_offset,
            force=0.0,
        )
    )


@compiled
def _direction(q: Any) -> Any:
    e0, e1, _, _ = bessel(q)
    return e0 - q * q * e1, q * e0  # cos q, sin q


@compiled
def _path(rod: Any, q: Any) -> Any:
    return rod.offset * q, -rod.offset * q, abs(q)


@compiled
def _travel(rod: Any, q: Any) -> Any:
    return _path(rod, q[0])


@compiled
def _acceleration(rod: Any, q: Any, rate: Any, given: Any, tendons: Any) -> Any:
    plus, minus = pulls_along(tendons, given, _path(rod, q))
    torque = rod.offset * (plus - minus)
    cosine, sine = _direction(q)
    weight = rod.falling * (rod.gravity_y * cosine - rod.gravity_x * sine) + rod.force * rod.length * cosine
    return (torque + weight - rod.stiffness * q - rod.damping * rate) / rod.inertia


@compiled
def _advance(rod: Any, q: Any, rate: Any, given: Any, tendons: Any, h: Any) -> Any:
    x, v = q[0], rate[0]
    a1 = _acceleration(rod, x, v, given, tendons)
    v2 = v + 0.5 * h * a1
    a2 = _acceleration(rod, x + 0.5 * h * v, v2, given, tendons)
    v3 = v + 0.5 * h * a2
    a3 = _acceleration(rod, x + 0.5 * h * v2, v3, given, tendons)
    v4 = v + h * a3
    a4 = _acceleration(rod, x + h * v3, v4, given, tendons)
    q[0] = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
    rate[0] = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return q[0] - (x + h * v2), rate[0] - (v + h * a2)  # the midpoint rule's, of second order


@compiled
def _bend_of(rod: Any, q: Any, rate: Any, bend: Any, speed: Any) -> None:
    bend[0], speed[0] = q[0], rate[0]


@compiled
def _within(rod: Any, q: Any) -> Any:
    return abs(q[0]) < math.pi


@compiled
def _disturbed(rod: Any, force: Any, scale: Any) -> Any:
    return _loaded(rod, (scale * rod.stiffness, force[1] + rod.force))


def _tips(wrist: WristParameters, q: Array) -> Array:
    return wrist.length * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=-1)


def _taut(wrist: WristParameters, q: Array) -> Array:
    return wrist.length + wrist.tendon_offset * np.array([-q[0], q[0]])


def _backbone(wrist: WristParameters, q: Array, at: Array) -> tuple[Planar, Planar]:
    along = np.exp(1j * q[0])
    return at * along, np.full(len(at), along)


HINGE = PlantModel(
    name="hinge",
    parameters=Rod,
    coordinates=lambda n: 1,
    values=values,
    advance=_advance,
    bend_of=_bend_of,
    travel=_travel,
    within=_within,
    disturbed=_disturbed,
    angle=lambda q: q[..., 0],
    tips=_tips,
    taut=_taut,
    backbone=_backbone,
)
