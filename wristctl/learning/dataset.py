"""Samples of tip positions and bending angles: of constant curvature (E1), of equilibria, or from earlier runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.domain import OTHERS, Domain
from wristctl.wrist.kinematics import arc_tip, chain_tip, exact_angle, exact_arc
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.statics import equilibria_at
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Samples that validation and test need at least: one sample has no spread to explain.
LEAST_SHARE = 2

# Why a sample is held out of training; KEPT is not.
KEPT, HELD_PAYLOAD, HELD_POSE = range(3)


@dataclass(frozen=True)
class Samples:
    """N samples and the region they fill."""

    tip: Array
    """(N, 2) x and y of the last disc's centre [m]"""
    theta: Array
    """(N,) bending angle of the last disc [rad]"""
    arc_length: Array
    """(N,) length of the single arc that ends at the tip [m]"""
    domain: Domain
    others: Array
    """(N, K) inputs after x and y"""
    names: tuple[str, ...]
    """names of the columns of `others`, keys of OTHERS"""
    held_out: NDArray[np.int64]
    """(N,) KEPT, HELD_PAYLOAD or HELD_POSE"""
    segments: int
    """segments of the samples' wrist; 1: any"""
    recording: NDArray[np.int64] | None = None
    """(N,) which recording each was measured in; None where each was drawn by itself"""

    @property
    def inputs(self) -> Array:
        """(N, 2 + K)"""
        return np.hstack([self.tip, self.others])

    @property
    def curvature_is_constant(self) -> bool:
        """Whether the single arc through each tip has the true angle, so that the whole domain is known."""
        return not self.names and bool(np.abs(exact_angle(self.tip) - self.theta).max() < 1e-9)

    def tips_alone(self) -> Samples:
        """Samples without the inputs after x and y."""
        domain = Domain(self.domain.theta, self.domain.arc_length)
        return replace(self, others=self.others[:, :0], names=(), domain=domain)

    def arrays(self) -> dict[str, Array]:
        """The samples as named arrays; `from_arrays` reads them back without loss."""
        ends = np.array([self.domain.theta, self.domain.arc_length, *self.domain.others])
        inputs_by_name = {name: self.others[:, k] for k, name in enumerate(self.names)}
        more = {"held_out": self.held_out} if self.held_out.any() else {}
        more |= {} if self.recording is None else {"recording": self.recording}
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
        domain = Domain(theta, arc_length, tuple(rest))
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


def draw_samples(settings: DataSettings, wrist: WristParameters, rng: np.random.Generator) -> Samples:
    """Samples of `pcc`: each segment's angle within its part of +-range_deg, the length in stretch * length."""
    n, bend = settings.segments, math.radians(wrist.range_deg)
    low, high = (ratio * wrist.length for ratio in settings.stretch)
    unit = unit_cube(settings.sampling, settings.drawn_samples, n + 1, rng)
    angles = (-bend + 2.0 * bend * unit[:, :n]) / n
    length = low + (high - low) * unit[:, n]
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


def _samples(
    tip: Array, theta: Array, domain: Domain | None = None, length: Array | None = None, segments: int = 1
) -> Samples:
    """Samples whose only inputs are x and y."""
    count, others = len(theta), np.empty((len(theta), 0))
    arc = exact_arc(tip)[1] if length is None else length
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

    What the tendons cannot hold within their limit, or what buckles, is left out. Raises UserError where that is
    more than half.
    """
    count, n = settings.drawn_samples, settings.segments
    unit = unit_cube(settings.sampling, count, 2, rng)
    theta = math.radians(wrist.range_deg) * (2.0 * unit[:, 0] - 1.0)
    low, high = settings.payload
    payload = low + (high - low) * unit[:, 1]
    tilts = np.radians([*settings.poses, *settings.held_out_poses])
    which = np.arange(count) % len(tilts)
    pose, hand = tilts[which], wrist.hand_mass * (1.0 + payload)

    batches = []
    for begin in range(0, count, BLOCK):
        some = slice(begin, begin + BLOCK)
        parameters = np.tile(segments(wrist, n), (len(theta[some]), 1))
        parameters[:, Segments._fields.index("hand_mass")] = hand[some]
        parameters[:, Segments._fields.index("gravity_x")] = -GRAVITY * np.cos(pose[some])
        parameters[:, Segments._fields.index("gravity_y")] = GRAVITY * np.sin(pose[some])
        batches.append(equilibria_at(parameters, n, theta[some], TENDONS_PER_SIDE * wrist.pretension))
        done(begin + len(parameters))
    bent, pulls, stable = (np.concatenate(parts) for parts in zip(*batches, strict=True))
    held = stable & (pulls.max(axis=1) <= TENDONS_PER_SIDE * wrist.tension_limit)
    if 2 * held.sum() < count:
        raise UserError(
            f"{count - held.sum()} of {count} equilibria buckle or need more than {wrist.tension_limit:g} N",
            where="gen-data.payload",
            fix="lower the payload or wrist.hand_mass, or leave out the upright pose",
        )
    first, last = settings.held_out_payload
    code = np.where((payload >= first) & (payload <= last), HELD_PAYLOAD, 0)
    code = np.where(which >= len(settings.poses), HELD_POSE, code)[held]
    tip = chain_tip(bent[held], wrist.length)
    others = np.column_stack([pose, hand])[held]
    inside = code != HELD_POSE
    domain = Domain.around(tip[inside], others[inside])
    return Samples(tip, theta[held], exact_arc(tip)[1], domain, others, tuple(OTHERS), code, n)
