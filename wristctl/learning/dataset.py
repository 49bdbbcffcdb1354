"""Samples of tip positions and bends in P planes: of constant curvature (E1), of equilibria, or from earlier runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.learning import DataSettings
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.domain import OTHERS, Domain, arc_to
from wristctl.simulation.planes import Asked, planes_of
from wristctl.wrist.kinematics import arc_tip, chain_tip
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips, tip_bends
from wristctl.wrist.spatial.spatial_segments import SpatialSegments, own_values
from wristctl.wrist.spatial.spatial_statics import spatial_equilibria_at
from wristctl.wrist.statics import equilibria_at
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Samples that validation and test need at least: one sample has no spread to explain.
LEAST_SHARE = 2

# Why a sample is held out of training; KEPT is not.
KEPT, HELD_PAYLOAD, HELD_POSE = range(3)


@dataclass(frozen=True)
class Samples:
    """N samples and the region they fill."""

    tip: Array
    """(N, P + 1) the last disc's centre: along the straight wrist, toward ulnar, in two planes toward flexion [m]"""
    theta: Array
    """(N,) bending angle of the last disc [rad]; in two planes (N, 2) its bend toward ulnar and toward flexion"""
    arc_length: Array
    """(N,) length of the single arc that ends at the tip [m]"""
    domain: Domain
    others: Array
    """(N, K) inputs after the tip"""
    names: tuple[str, ...]
    """names of the columns of `others`, keys of OTHERS"""
    held_out: NDArray[np.int64]
    """(N,) KEPT, HELD_PAYLOAD or HELD_POSE"""
    segments: int
    """segments of the samples' wrist; 1: any"""
    recording: NDArray[np.int64] | None = None
    """(N,) which recording each was measured in; None where each was drawn by itself"""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return int(self.tip.shape[1]) - 1

    @property
    def size(self) -> Array:
        """Bending angle of the last disc, in two planes the size of its bend, (N,) [rad]."""
        return self.theta if self.planes == 1 else np.hypot(*self.theta.T)

    @property
    def inputs(self) -> Array:
        """(N, P + 1 + K)"""
        return np.hstack([self.tip, self.others])

    @property
    def targets(self) -> Array:
        """What a network learns of the inputs: the bends."""
        return self.theta

    @property
    def curvature_is_constant(self) -> bool:
        """Whether the single arc through each tip has the true angle, so that the whole domain is known."""
        return not self.names and bool(np.abs(arc_to(self.tip)[0] - self.theta).max() < 1e-9)

    def tips_alone(self) -> Samples:
        """Samples without the inputs after the tip."""
        domain = replace(self.domain, others=())
        return replace(self, others=self.others[:, :0], names=(), domain=domain)

    def arrays(self) -> dict[str, Array]:
        """The samples as named arrays; `from_arrays` reads them back without loss."""
        ends = np.array([self.domain.theta, self.domain.arc_length, *self.domain.others])
        inputs_by_name = {name: self.others[:, k] for k, name in enumerate(self.names)}
        more = {"held_out": self.held_out} if self.held_out.any() else {}
        more |= {} if self.recording is None else {"recording": self.recording}
        more |= {"reach": np.array(self.domain.reach)} if self.planes == 2 else {}
        arrays = {"tip": self.tip, "theta": self.theta, "arc_length": self.arc_length, "domain": ends}
        return arrays | inputs_by_name | more | {"segments": np.array(self.segments)}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Array]) -> Samples:
        """Samples from what `arrays` gave. Raises KeyError where an array is missing."""
        theta, arc_length, *rest = (tuple(ends) for ends in arrays["domain"].tolist())
        names = tuple(name for name in OTHERS if name in arrays)
        count = len(arrays["theta"])
        others = np.column_stack([arrays[name] for name in names]) if names else np.empty((count, 0))
        held_out = arrays.get("held_out", np.zeros(count)).astype(np.int64)
        domain = Domain(theta, arc_length, tuple(rest), tuple(arrays["reach"].tolist()) if "reach" in arrays else ())
        tip, lengths = arrays["tip"], arrays["arc_length"]
        whose = arrays["recording"].astype(np.int64) if "recording" in arrays else None
        return Samples(tip, arrays["theta"], lengths, domain, others, names, held_out, int(arrays["segments"]), whose)


@dataclass(frozen=True)
class Split:
    """Row numbers of the samples used for training, validation and test; disjoint and complete."""

    train: NDArray[np.int64]
    validation: NDArray[np.int64]
    test: NDArray[np.int64]
    recording: NDArray[np.int64] | None = None
    """(N,) which recording each sample is of, where whole ones were split"""


def asked_of(settings: DataSettings) -> Asked:
    """The motion by which planes of samples are found: a loop's toward ulnar, as a study file has it by default."""
    loop = settings.loop if settings.source == "transitions" else Loop()
    return Asked(loop.model_copy(update={"planes": settings.planes or loop.planes}), Reference())


def planes_of_samples(settings: DataSettings, wrist: WristParameters) -> int:
    """Planes that drawn samples bend in, found as those of a loop on this wrist. Raises UserError as `planes_of`."""
    try:
        return planes_of(wrist, [asked_of(settings)])
    except UserError as error:
        if error.where != "loop.planes":
            raise
        problem = "this wrist bends in two planes, and the samples in one"
        raise UserError(problem, "gen-data.planes", "planes: null, or 2") from error


def draw_samples(settings: DataSettings, wrist: WristParameters, rng: np.random.Generator) -> Samples:
    """Samples of `pcc`: each segment's angle within its part of +-range_deg, the length in stretch * length.

    In two planes each segment's bend is drawn uniformly in the disc of that size.
    """
    n, bend = settings.segments, math.radians(wrist.range_deg)
    planes = planes_of_samples(settings, wrist)
    low, high = (ratio * wrist.length for ratio in settings.stretch)
    unit = unit_cube(settings.sampling, settings.drawn_samples, planes * n + 1, rng)
    length = low + (high - low) * unit[:, -1]
    if planes == 2:
        q = _in_disc(unit[:, :-1], bend / n)
        tip, theta = length[:, None] * spatial_tips(q, 1.0), tip_bends(q)
        if n == 1:
            return _samples(tip, theta, Domain.disc(bend, (low, high)), length)
        return _samples(tip, theta, segments=n)
    angles = (-bend + 2.0 * bend * unit[:, :n]) / n
    theta = angles.sum(axis=1)
    if n == 1:
        return _samples(arc_tip(theta, length), theta, Domain((-bend, bend), (low, high)), length)
    return _samples(length[:, None] * chain_tip(angles, 1.0), theta, segments=n)


def split_samples(
    count: int,
    train_share: float,
    rng: np.random.Generator,
    held_out: NDArray[np.int64] | None = None,
    recording: NDArray[np.int64] | None = None,
) -> Split:
    """A random split: `train_share` for training, the rest halved into validation and test.

    Where samples are held out, those are the test, and the rest of the others is for validation. Where they were
    measured in recordings, whole recordings are split: samples of one are alike, and one that stands beside another in
    training is no test. Raises UserError where fewer than two samples, or no recording, would be left for either.
    """
    if recording is not None:
        return _split_recordings(recording, train_share, rng)
    held = np.flatnonzero(held_out) if held_out is not None else np.empty(0, np.int64)
    order = rng.permutation(count)
    order = order[~np.isin(order, held)]
    train = max(1, round(len(order) * train_share))
    validation = len(order) - train if len(held) else (count - train) // 2
    if validation < LEAST_SHARE:
        raise UserError(
            f"{count} samples with train_share {train_share:g} leave {validation} for validation",
            where="train.train_share",
            fix=f"draw more samples or lower the share: validation and test need {LEAST_SHARE} each",
        )
    test = held if len(held) else order[train + validation :]
    return Split(order[:train], order[train : train + validation], test)


def _split_recordings(recording: NDArray[np.int64], train_share: float, rng: np.random.Generator) -> Split:
    recordings = rng.permutation(np.unique(recording))
    if len(recordings) < 3:
        raise UserError(
            f"{len(recordings)} recording{'s' * (len(recordings) != 1)}: training, choosing and testing need one each",
            where="train.data",
            fix="measure more, or train with split: sample, which tests by neighbours of what it was trained on",
        )
    train = min(max(1, round(len(recordings) * train_share)), len(recordings) - 2)
    validation = train + max(1, (len(recordings) - train) // 2)
    parts = recordings[:train], recordings[train:validation], recordings[validation:]
    rows = tuple(np.flatnonzero(np.isin(recording, part)) for part in parts)
    if min(map(len, rows)) < LEAST_SHARE:
        raise UserError("a recording with a single sample", "train.data", "leave it out")
    return Split(rows[0], rows[1], rows[2], recording)


def unit_cube(sampling: str, count: int, dimensions: int, rng: np.random.Generator) -> Array:
    """`count` points (count, dimensions) in the unit cube."""
    if sampling == "uniform":
        return rng.random((count, dimensions))
    from scipy.stats import qmc

    if sampling == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(d=dimensions, rng=rng).random(count))
    # A Sobol sequence is balanced in powers of two: draw the next larger one and keep its beginning.
    return np.asarray(qmc.Sobol(d=dimensions, rng=rng).random_base2(math.ceil(math.log2(count)))[:count])


def _in_disc(unit: Array, radius: float) -> Array:
    """Points (N, 2 n) uniformly in n discs, of points in the unit cube of that shape."""
    around = 2.0 * np.pi * unit[:, 1::2]
    place = np.stack([np.cos(around), np.sin(around)], axis=-1)
    points: Array = (radius * np.sqrt(unit[:, ::2])[..., None] * place).reshape(len(unit), -1)
    return points


def _samples(
    tip: Array, theta: Array, domain: Domain | None = None, length: Array | None = None, segments: int = 1
) -> Samples:
    """Samples whose only inputs are the tip."""
    count, others = len(theta), np.empty((len(theta), 0))
    arc = arc_to(tip)[1] if length is None else length
    return Samples(
        tip, theta, arc, domain or Domain.around(tip, others), others, (), np.zeros(count, np.int64), segments
    )


# [m/s^2]
GRAVITY = 9.81

# Equilibria that are searched together: a bound on memory.
BLOCK = 20_000


def draw_equilibria(
    settings: DataSettings, wrist: WristParameters, rng: np.random.Generator, done: Callable[[int], object] = int
) -> Samples:
    """Stable equilibria with the angle in +-range_deg, poses in turn, payloads in their range; `done` gets their count.

    In two planes bends are drawn uniformly in the disc of that size, and poses are tilts toward each of `rolls`. What
    the tendons cannot hold within their limit, or what buckles, is left out. Raises UserError where that is more than
    half.
    """
    count, n, planes = settings.drawn_samples, settings.segments, planes_of_samples(settings, wrist)
    unit, bend = unit_cube(settings.sampling, count, planes + 1, rng), math.radians(wrist.range_deg)
    theta = bend * (2.0 * unit[:, 0] - 1.0) if planes == 1 else _in_disc(unit[:, :-1], bend)
    low, high = settings.payload
    payload = low + (high - low) * unit[:, -1]
    tilts = np.radians([*settings.poses, *settings.held_out_poses])
    which = np.arange(count) % len(tilts)
    pose, hand = tilts[which], wrist.hand_mass * (1.0 + payload)
    own = attitude(wrist)[1]
    rolls = np.radians(settings.rolls) if settings.rolls else np.array([own])
    roll = rolls[np.arange(count) // len(tilts) % len(rolls)]

    batches = []
    for begin in range(0, count, BLOCK):
        some = slice(begin, begin + BLOCK)
        draw = _equilibria if planes == 1 else _equilibria_in_space
        batches.append(draw(wrist, n, theta[some], pose[some], roll[some], hand[some]))
        done(begin + len(theta[some]))
    tip, tension, stable = (np.concatenate(parts) for parts in zip(*batches, strict=True))
    held = stable & (tension <= wrist.tension_limit)
    if 2 * held.sum() < count:
        raise UserError(
            f"{count - held.sum()} of {count} equilibria buckle or need more than {wrist.tension_limit:g} N",
            where="gen-data.payload",
            fix="lower the payload or wrist.hand_mass, or leave out the upright pose",
        )
    first, last = settings.held_out_payload
    code = np.where((payload >= first) & (payload <= last), HELD_PAYLOAD, 0)
    code = np.where(which >= len(settings.poses), HELD_POSE, code)[held]
    tip, theta = tip[held], theta[held]
    columns = {"pose": pose, "roll": roll, "hand_mass": hand}
    names = tuple(name for name in OTHERS if planes == 2 or name != "roll")
    others = np.column_stack([columns[name] for name in names])[held]
    inside = code != HELD_POSE
    domain = Domain.around(tip[inside], others[inside])
    if planes == 2:  # the whole range of payloads, whose ends no draw meets: the bare hand is inside
        ends = (wrist.hand_mass * (1.0 + low), wrist.hand_mass * (1.0 + high))
        domain = replace(domain, others=(*domain.others[:-1], ends))
    return Samples(tip, theta, arc_to(tip)[1], domain, others, names, code, n)


def _equilibria(
    wrist: WristParameters, n: int, theta: Array, pose: Array, roll: Array, hand: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Tips (B, 2) [m], the largest tension of a tendon (B,) [N] and whether it is stable (B,), in one plane."""
    parameters = np.tile(segments(wrist, n), (len(theta), 1))
    parameters[:, Segments._fields.index("hand_mass")] = hand
    parameters[:, Segments._fields.index("gravity_x")] = -GRAVITY * np.cos(pose)
    parameters[:, Segments._fields.index("gravity_y")] = GRAVITY * np.sin(pose)
    bent, pulls, stable = equilibria_at(parameters, n, theta, TENDONS_PER_SIDE * wrist.pretension)
    return chain_tip(bent, wrist.length), pulls.max(axis=1) / TENDONS_PER_SIDE, stable


def _equilibria_in_space(
    wrist: WristParameters, n: int, bends: Array, pose: Array, roll: Array, hand: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Tips (B, 3) [m], the largest tension of a tendon (B,) [N] and whether it is stable (B,), in two planes."""
    layout = TendonLayout.of(wrist)
    parameters = np.tile(own_values(wrist, n), (len(bends), 1))
    parameters[:, SpatialSegments._fields.index("hand_mass")] = hand
    for axis, gravity in zip("xyz", _gravity(pose, roll), strict=True):
        parameters[:, SpatialSegments._fields.index(f"gravity_{axis}")] = gravity
    arms: Array = layout.shares(wrist.discs)[:, None] * layout.cross_section
    least = wrist.pretension * layout.multiplicity.astype(np.float64)
    q, pulls, _, stable = spatial_equilibria_at(parameters, n, bends, arms, least)
    return spatial_tips(q, wrist.length), (pulls / layout.multiplicity).max(axis=1), stable


def _gravity(pose: Array, roll: Array) -> tuple[Array, Array, Array]:
    """Gravity along the base's tangent, toward ulnar and toward flexion (B,) [m/s^2]."""
    across = GRAVITY * np.sin(pose)
    return -GRAVITY * np.cos(pose), across * np.cos(roll), across * np.sin(roll)


def attitude(wrist: WristParameters) -> tuple[float, float]:
    """Tilt of the wrist's base from upright, and its direction within +-90 deg from ulnar toward flexion [rad].

    A tilt to the other side is negative.
    """
    along, ulnar = wrist.gravity
    flexion = wrist.gravity_flexion
    if flexion == 0.0:
        return math.atan2(ulnar, -along), 0.0
    roll = math.atan2(flexion, ulnar)
    beyond = abs(roll) > 0.5 * math.pi
    pose = math.atan2(math.hypot(ulnar, flexion) * (-1.0 if beyond else 1.0), -along)
    return pose, roll - math.copysign(math.pi, roll) if beyond else roll
