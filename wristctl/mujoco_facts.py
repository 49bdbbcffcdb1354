"""What a MuJoCo model says of its tendons: found by a small pull of each, without gravity, on the model alone.

A pull T of a tendon at the place p (its lever toward each plane) bends the robot by b, K b = T p, and takes r = p b of
every tendon. So the places are those that explain by how much all tendons became shorter in all pulls, and the
stiffness K the one that explains the bends. Inertia is that of the parts beyond the last joint and before it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.errors import UserError, meant
from wristctl.rig import Drive, Facts, Limits, Sensor, Tendon

Values = NDArray[np.float64]

# Bend that a pull makes [rad], and shares of a tendon's largest tension that it takes: the least, and the most.
_BEND, _LEAST, _MOST = math.radians(2.0), 1e-3, 0.5
# Newton's method: iterations, displacement for a slope, the largest step, and the one from which a robot stands [rad].
_TRIES, _APART, _STRIDE, _STILL = 60, 1e-6, 0.05, 1e-7
# Share of the integration step that is stable beside stiff tendons.
_STABLE = 0.5
# Singular value of the places, over the largest, below which all of them lie in one plane.
_FLAT = 0.05
# Bend that tendons reel for where a wrist's range is not given [deg].
_RANGE_DEG = 50.0


class Axes(NamedTuple):
    """A site whose turning is the robot's bend, and the axes in which it is told."""

    site: int
    body: int
    turned: Values
    """Of the straight robot's site (3, 3)."""
    rows: Values
    """Along the straight robot, toward ulnar and toward flexion (3, 3)."""
    base: Values
    """Where the first joint turns (3,) [m]."""

    @classmethod
    def of(cls, model: Any, bend: str, along: ArrayLike, toward: ArrayLike, where: str) -> Self:
        """By the site's name and two directions. UserError where they are none."""
        names = [model.site(number).name for number in range(model.nsite)]
        if bend not in names:
            raise UserError(f"the model has no site {bend!r}", f"{where}: bend", meant(bend, names))
        first, second = np.array(along, float), np.array(toward, float)
        if first.shape != (3,) or second.shape != (3,) or not np.linalg.norm(np.cross(first, second)) > 0.1:
            fix = "two directions at a right angle, as along=(0, 0, 1), toward=(1, 0, 0)"
            raise UserError("along and toward are no two directions", f"{where}: along, toward", fix)
        first = first / np.linalg.norm(first)
        second = second - (second @ first) * first
        second = second / np.linalg.norm(second)
        site = names.index(bend)
        body, data = int(model.site_bodyid[site]), mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        joints = _joints_before(model, body)
        if not joints:
            raise UserError(f"no joint moves the site {bend!r}", f"{where}: bend", "a site beyond the joints")
        rows = np.stack([first, second, np.cross(first, second)])
        return cls(site, body, data.site_xmat[site].reshape(3, 3).copy(), rows, data.xanchor[joints[0]].copy())

    def bend(self, data: Any) -> Values:
        """Bend of the site toward ulnar and flexion (2,) [rad]: the angle by which its axis has left the straight
        one, in the direction in which it has."""
        ahead = self.rows @ data.site_xmat[self.site].reshape(3, 3) @ self.turned.T @ self.rows[0]
        aside = math.hypot(ahead[1], ahead[2])
        bend: Values = ahead[1:] * (math.atan2(aside, ahead[0]) / aside if aside > 0.0 else 1.0)
        return bend

    def tip(self, data: Any) -> Values:
        """Place of the site from the first joint (3,) [m]: along, ulnar, flexion."""
        tip: Values = self.rows @ (data.site_xpos[self.site] - self.base)
        return tip


def _joints_before(model: Any, body: int) -> list[int]:
    """Joints that move a body, from the base on."""
    joints: list[int] = []
    while body:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        joints = [*range(first, first + count), *joints]
        body = int(model.body_parentid[body])
    return joints


@dataclass(frozen=True)
class Spooled:
    """Actuators that pull tendons as a motor with a spool does: each reels in a length of an elastic tendon.

    An actuator that takes a length is one already; what it would push is left out. One that takes a force makes that of
    a tendon of the stated stiffness.
    """

    actuators: tuple[int, ...]
    tendons: tuple[int, ...]
    gain: Values
    """Tension for a unit of control (T,) [N]."""
    zero: Values
    """Control (T,) at which an actuator pulls with nothing where the tendon has no length and no rate."""
    by_length: Values
    """Tension that the actuator makes by itself of the tendon's length (T,) [N/m]."""
    stiffness: float
    """Of the softest tendon [N/m]."""
    stiff: Values
    """Of each (T,) [N/m]."""
    low: Values
    """Least control (T,)."""
    high: Values
    """Greatest control (T,)."""
    tension: float
    """Largest of every tendon [N]."""
    straight: Values
    """Lengths of the tendons of the straight robot (T,) [m]."""
    alone: bool
    """Whether the actuators never push, so that a control holds for any length."""

    @classmethod
    def of(cls, model: Any, names: Sequence[str], stiffness: float, tension: float | None, where: str) -> Self:
        """All actuators that pull a tendon, or those of these names. UserError for any other."""
        known = [model.actuator(number).name for number in range(model.nu)]
        for name in names:
            if name not in known:
                raise UserError(f"the model has no actuator {name!r}", f"{where}: actuators", meant(name, known))
        on_tendons = model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON
        chosen = [known.index(name) for name in names] or np.flatnonzero(on_tendons).tolist()
        off = [known[number] for number in chosen if not on_tendons[number]]
        if off or not chosen:
            what = f"actuator {off[0]!r} pulls no tendon" if off else "no actuator of the model pulls a tendon"
            fix = '<motor tendon="..."/>, <position tendon="..."/> or <general tendon="..."/> for each tendon'
            raise UserError(what, f"{where}: actuators", fix)
        fixed = model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED
        plain = model.actuator_biastype != mujoco.mjtBias.mjBIAS_MUSCLE
        for number in chosen:
            state = model.actuator_dyntype[number] != mujoco.mjtDyn.mjDYN_NONE
            if state or not fixed[number] or not plain[number] or not model.actuator_gainprm[number, 0]:
                fix = "a motor or position actuator; a delay and a lag are those of drive=Drive(...)"
                raise UserError(f"actuator {known[number]!r} is no motor of a spool", f"{where}: actuators", fix)
        gear = model.actuator_gear[chosen, 0].copy()
        bias = np.where(
            (model.actuator_biastype[chosen] == mujoco.mjtBias.mjBIAS_AFFINE)[:, None],
            model.actuator_biasprm[chosen, :3], 0.0,
        )  # fmt: skip
        gain = -gear * model.actuator_gainprm[chosen, 0]
        by_length = -gear * gear * bias[:, 1]
        if (by_length < 0.0).any():
            raise UserError("an actuator pushes the more, the longer its tendon", f"{where}: actuators", "see biasprm")
        limited = model.actuator_ctrllimited[chosen].astype(bool)
        low, high = (np.where(limited, model.actuator_ctrlrange[chosen, k], (-np.inf, np.inf)[k]) for k in range(2))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        tendons = tuple(int(number) for number in model.actuator_trnid[chosen, 0])
        bears = cls._bears(model, chosen, gear, gain, by_length, low, high)
        if tension is None and not np.isfinite(bears).all():
            fix = "tension=60.0 for each, or a forcerange in the model"
            raise UserError("the model does not say how much its tendons bear", f"{where}: tension", fix)
        stiff = np.where(by_length > 0.0, by_length, stiffness)
        return cls(
            tuple(chosen), tendons, gain, gear * bias[:, 0] / gain, by_length, float(stiff.min()), stiff, low, high,
            float(min(bears.min(), math.inf if tension is None else tension)), data.ten_length[list(tendons)].copy(),
            bool((by_length > 0.0).all() and cls._never_push(model, chosen, gear)),
        )  # fmt: skip

    @staticmethod
    def _never_push(model: Any, chosen: list[int], gear: Values) -> bool:
        ranges = -gear[:, None] * model.actuator_forcerange[chosen]
        return bool((model.actuator_forcelimited[chosen].astype(bool) & (ranges.min(axis=1) >= 0.0)).all())

    @staticmethod
    def _bears(
        model: Any, chosen: list[int], gear: Values, gain: Values, by_length: Values, low: Values, high: Values
    ) -> Values:
        """Largest tension of each tendon by the model's ranges (T,) [N]; inf where they say none."""
        ranges = -gear[:, None] * model.actuator_forcerange[chosen]
        by_force = np.where(model.actuator_forcelimited[chosen].astype(bool), ranges.max(axis=1), np.inf)
        by_control = np.where(by_length > 0.0, np.inf, np.maximum(gain * low, gain * high))
        return np.minimum(by_force, by_control)

    def reel(self, data: Any, reeled: Values) -> None:
        """Set the controls for spools that have reeled in so much of each tendon (T,) [m] since it was taut."""
        if self.alone:
            control = self.zero + self.stiff * (reeled - self.straight) / self.gain
            data.ctrl[list(self.actuators)] = np.clip(control, self.low, self.high)
            return
        length = data.ten_length[list(self.tendons)]
        taut = self.stiff * np.maximum(0.0, reeled - (self.straight - length))
        self.pull(data, np.minimum(taut, self.tension))

    def pull(self, data: Any, tension: Values) -> None:
        """Set the controls for tensions (T,) [N] of tendons of these lengths."""
        length = data.ten_length[list(self.tendons)]
        control = self.zero + (tension - self.by_length * length) / self.gain
        data.ctrl[list(self.actuators)] = np.clip(control, self.low, self.high)

    def pulls(self, data: Any) -> Values:
        """Tensions that the actuators make (T,) [N]."""
        length = data.ten_length[list(self.tendons)]
        tension: Values = self.gain * (data.ctrl[list(self.actuators)] - self.zero) + self.by_length * length
        return tension


class Pulled(NamedTuple):
    """What the pulls have found."""

    places: Values
    """Lever of each tendon toward ulnar and flexion (T, 2) [m]."""
    planes: int
    stiffness: Values
    """(2, 2) [N m/rad]."""
    damping: float
    """[N m s/rad]."""
    length: float
    mass: float
    hand_mass: float
    hand_offset: float
    gravity: Values
    """Along, ulnar, flexion (3,) [m/s^2]."""
    step: float
    """Integration step that is stable with these tendons [s]."""


def pulled(model: Any, spools: Spooled, axes: Axes, where: str) -> Pulled:
    """Pull each tendon by itself. UserError where one does not bend the robot."""
    gravity = axes.rows @ model.opt.gravity
    shipped, flags, count = model.opt.gravity.copy(), model.opt.disableflags, len(spools.tendons)
    model.opt.gravity[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    try:
        data = mujoco.MjData(model)
        rest = _balanced(model, data, spools, np.zeros(count))
        straight, unpulled = data.ten_length[list(spools.tendons)].copy(), spools.pulls(data)
        bends, shorter, moved, tensions = [], [], [], []
        for number in range(count):
            tension = _LEAST * spools.tension
            while True:
                bent = _balanced(model, data, spools, tension * np.eye(count)[number])
                size = math.hypot(*axes.bend(data))
                if size >= _BEND or tension >= _MOST * spools.tension:
                    break
                tension = min(_MOST * spools.tension, tension * min(10.0, max(1.5, 1.2 * _BEND / max(size, 1e-6))))
            if size < 0.1 * _BEND:
                name = model.actuator(spools.actuators[number]).name
                what = f"a pull of {tension:.3g} N by {name!r} bends the robot by {math.degrees(size):.2g} deg"
                raise UserError(what, f"{where}: actuators", "name those that bend it, or see the site of bend")
            bends.append(axes.bend(data).copy())
            shorter.append(straight - data.ten_length[list(spools.tendons)])
            difference = np.zeros(model.nv)
            mujoco.mj_differentiatePos(model, difference, 1.0, rest, bent)
            moved.append(difference)
            tensions.append(spools.pulls(data) - unpulled)
    except ValueError as error:
        fix = "springs that hold the robot, and actuators that bend it by degrees"
        raise UserError(str(error), where, fix) from error
    finally:
        model.opt.gravity[:], model.opt.disableflags = shipped, flags
    b, r = np.array(bends), np.array(shorter)
    flat = float(np.linalg.svd(b, compute_uv=False)[1]) < _FLAT * float(np.linalg.norm(b))
    if flat:
        b = b * [1.0, 0.0]
    places = np.linalg.lstsq(b, r, rcond=1e-6)[0].T
    stiffness = np.linalg.lstsq(b, np.array(tensions) @ places, rcond=1e-6)[0]
    shape = np.linalg.lstsq(b, np.array(moved), rcond=1e-6)[0]
    damping = shape @ (model.dof_damping[:, None] * shape.T)
    joints = _joints_before(model, axes.body)
    first = int(model.jnt_bodyid[joints[0]])
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    hand = float(model.body_subtreemass[axes.body])
    centre = axes.rows[0] @ (data.subtree_com[axes.body] - data.site_xpos[axes.site])
    anchors = [data.xanchor[joint] for joint in joints]
    gaps = [float(np.linalg.norm(anchor - anchors[0])) for anchor in anchors]
    half = 0.5 * min((gap for gap in gaps if gap > 1e-6), default=0.0)
    return Pulled(
        places, 1 if flat else 2, 0.5 * (stiffness + stiffness.T), float(np.trace(damping)) / (1 if flat else 2),
        half + float(np.linalg.norm(axes.tip(data))), float(model.body_subtreemass[first]) - hand, hand,
        max(0.0, float(centre)), gravity, _stable_step(model, spools),
    )  # fmt: skip


def _balanced(model: Any, data: Any, spools: Spooled, tension: Values) -> Values:
    """Positions at which the robot stands still under these tensions (T,) [N], by Newton's method.

    Moves the data there. Raises ValueError where it finds none.
    """
    mujoco.mj_resetData(model, data)

    def acceleration(at: Values) -> Values:
        data.qpos[:] = at
        mujoco.mj_fwdPosition(model, data)
        spools.pull(data, tension)
        mujoco.mj_forward(model, data)
        found: Values = data.qacc.copy()
        return found

    def moved(at: Values, by: ArrayLike) -> Values:
        there = at.copy()
        mujoco.mj_integratePos(model, there, by, 1.0)
        return there

    at: Values = data.qpos.copy()
    for _ in range(_TRIES):
        here = acceleration(at)
        slopes = [(acceleration(moved(at, by)) - here) / _APART for by in _APART * np.eye(model.nv)]
        by = np.linalg.lstsq(np.array(slopes).T, -here, rcond=1e-12)[0]
        at = moved(at, by * min(1.0, _STRIDE / max(float(np.abs(by).max()), 1e-12)))
        if np.abs(by).max() < _STILL:
            acceleration(at)
            return at
    raise ValueError("the robot has no rest under a small pull")


def _stable_step(model: Any, spools: Spooled) -> float:
    """The model's step, or a finer one where its tendons are too stiff for it [s]."""
    data, count = mujoco.MjData(model), len(spools.tendons)
    levers = np.zeros((count, model.nv))
    mujoco.mj_forward(model, data)
    spools.pull(data, np.zeros(count))
    mujoco.mj_forward(model, data)
    slack = data.qfrc_actuator.copy()
    for number in range(count):
        pull = np.eye(count)[number] * min(1.0, spools.tension)
        spools.pull(data, pull)
        mujoco.mj_forward(model, data)
        levers[number] = (data.qfrc_actuator - slack) / pull[number]
    inertia = np.zeros((model.nv, model.nv))
    for row, unit in zip(inertia, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    squared = np.linalg.eigvals(np.linalg.solve(inertia, levers.T @ (spools.stiff[:, None] * levers))).real.max()
    return float(min(model.opt.timestep, _STABLE * 2.0 / math.sqrt(max(squared, 1e-12))))


def said_of(
    found: Pulled, spools: Spooled, drive: Drive, sensor: Sensor, limits: Limits, tendons: Sequence[Tendon] | None,
    wrist: Mapping[str, Any] | None, slack: float,
) -> Facts:  # fmt: skip
    """The facts of a rig that was pulled; what is stated goes before what was found."""
    places = found.places[:, : found.planes]
    if tendons is None:
        tendons = [
            Tendon(round(math.degrees(math.atan2(*[*place, 0.0][1::-1])), 2) % 360.0, round(math.hypot(*place), 6))
            for place in places.tolist()
        ]
    if not math.isfinite(limits.travel):
        furthest = max(tendon.radius for tendon in tendons) * math.radians((wrist or {}).get("range_deg", _RANGE_DEG))
        limits = replace(limits, travel=round(1.2 * furthest + spools.tension / spools.stiffness + slack + 5e-3, 4))
    ratio, axis, stiffness = 1.0, 0.0, float(found.stiffness[0, 0])
    if found.planes == 2:
        (low, high), vectors = np.linalg.eigh(found.stiffness)
        axis = math.degrees(math.atan2(vectors[1, 0], vectors[0, 0]))
        stiffness, ratio = float(low), float(high / low)
    known: dict[str, Any] = {
        "length": found.length, "mass": max(found.mass, 1e-4), "hand_mass": found.hand_mass,
        "hand_offset": found.hand_offset, "stiffness": stiffness, "damping": found.damping,
        "gravity": tuple(found.gravity[:2].tolist()), "gravity_flexion": float(found.gravity[2]),
    }  # fmt: skip
    if ratio > 1.02:
        known |= {"flexion_ratio": ratio, "stiffness_axis_deg": (axis + 90.0) % 180.0 - 90.0}
    known = {key: value if isinstance(value, tuple) else float(f"{value:.6g}") for key, value in known.items()}
    return Facts(
        planes=found.planes, tendons=tuple(tendons), limits=limits, sensor=sensor,
        drive=replace(drive, stiffness=spools.stiffness if (spools.by_length > 0.0).all() else drive.stiffness),
        wrist={**known, **(wrist or {})},
    )  # fmt: skip
