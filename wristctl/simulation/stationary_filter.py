"""The stationary Kalman filter behind a camera: its gain, and the error that it expects of itself."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array, distinct
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.observer import knowing_in_lanes, known_of_sides, propagate
from wristctl.simulation.simulated_drives import SIDES, at_rest
from wristctl.simulation.worlds import World
from wristctl.wrist.directions import in_plane
from wristctl.wrist.pcc import PCC
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE


@kernel
def _propagate_row(known: Any, state: Any, counts: Any, h: float) -> None:
    x = rows_of(state)
    propagate(knowing_in_lanes(known), x, part(rows_of(counts), 0, known.pulls), h)


# Doublings at most, and a change of a correlation that is none.
_DOUBLINGS, _ALIKE = 20, 1e-14


class Belief(NamedTuple):
    """Facts that an observer goes by; the period [s] is of control."""

    sensor: Sensor
    actuator: Actuator
    wrist: WristParameters
    period: float


def beliefs_of(world: World, layout: TendonLayout | None) -> list[Belief]:
    """Beliefs of each plane's observer in a world: of one plane, or of two with tendons at the places of a layout."""
    sensor, actuator, period = world.loop.sensor, world.loop.actuator, world.loop.control_period
    if layout is None:
        return [Belief(sensor, actuator, world.wrist, period)]
    facing = [in_plane(world.wrist, plane) for plane in ("ulnar", "flexion")]
    return [Belief(sensor, actuator, as_pairs(wrist, layout, axis), period) for axis, wrist in enumerate(facing)]


def as_pairs(wrist: WristParameters, layout: TendonLayout, axis: int) -> WristParameters:
    """The wrist in one plane whose four tendons stiffen it as those of the layout do, on held spools."""
    square = float(layout.multiplicity @ layout.cross_section[:, axis] ** 2) / TENDONS_PER_SIDE
    return wrist.model_copy(update={"tendon_radius": float(np.sqrt(square))})


class _GoesBy(NamedTuple):
    """All of a belief that its gain depends on."""

    actuator: Actuator
    wrist: WristParameters
    period: float
    ticks: int
    """From frame to frame."""
    noise_deg: float
    torque_noise: float
    load_drift: float


class _Stationary(NamedTuple):
    """Stationary filter of each belief: gain (B, 3), covariance behind a frame; transition and noise of a tick,
    (B, 3, 3)."""

    gain: Array
    covariance: Array
    tick: Array
    noise: Array


@lru_cache(maxsize=64)
def _stationary(filters: tuple[_GoesBy, ...]) -> _Stationary:
    models, which = distinct([basis[:3] for basis in filters])
    tick = np.array([_linearised(*model) for model in models])[which]
    numbers = np.array([basis[2:] for basis in filters])
    period, ticks, noise_deg, torque_noise, load_drift = numbers.T
    unknown = tick[:, 1, 2]  # rate gained in one period per unit of torque
    noise = np.zeros_like(tick)
    noise[:, 1, 1], noise[:, 2, 2] = unknown**2 * torque_noise**2 / period, load_drift**2 * period
    frame, between = np.broadcast_to(np.eye(3), tick.shape), np.zeros_like(tick)
    for age in range(int(ticks.max())):
        due = (age < ticks)[:, None, None]
        frame = np.where(due, tick @ frame, frame)
        between = np.where(due, tick @ between @ _transposed(tick) + noise, between)
    variance = np.maximum(np.deg2rad(noise_deg) ** 2, 1e-12)
    covariance = _predicted(frame, between, variance)
    gain = covariance[:, :, 0] / (covariance[:, 0, 0] + variance)[:, None]
    return _Stationary(gain, covariance - gain[:, :, None] * covariance[:, :1], tick, noise)


@lru_cache(maxsize=256)
def _linearised(actuator: Actuator, wrist: WristParameters, period: float) -> Array:
    """The transition (3, 3) of the prediction over a period [s], where the wrist is straight."""
    known = known_of_sides(wrist, actuator)
    pulls = np.array(SIDES) * wrist.pretension
    delivered = at_rest(known.drive, pulls, wrist.length, PCC.taut(wrist, np.zeros(1)))[[0, 2]]
    small = 1e-6
    states = small * np.eye(4, 3)
    for state in states:
        _propagate_row(known, state, delivered, period)
    transition: Array = (states[:3] - states[3]).T / small
    transition.setflags(write=False)
    return transition


def _predicted(frame: Array, between: Array, variance: Array) -> Array:
    """The covariances (B, 3, 3) before a frame that frames one after another lead to, of transitions and noise from
    frame to frame (B, 3, 3), each frame the first entry's reading with a variance (B,).

    Of P = F (P - P c c^T P/(c^T P c + R)) F^T + Q by doubling (Anderson, Int. J. Control 28 (1978) 295): step k has
    seen 2^k frames.
    """
    onward, information, covariance = _transposed(frame), np.zeros_like(between), between
    information[:, 0, 0] = 1.0 / variance
    still = np.ones((len(between), 1, 1), bool)
    for _ in range(_DOUBLINGS):
        shrunk = np.linalg.solve(np.eye(3) + information @ covariance, np.concatenate([onward, information], axis=2))
        grown = covariance + _transposed(onward) @ covariance @ shrunk[:, :, :3]
        information = information + onward @ shrunk[:, :, 3:] @ _transposed(onward)
        onward = onward @ shrunk[:, :, :3]
        deviation = np.sqrt(np.diagonal(grown, axis1=1, axis2=2))
        change = np.abs(grown - covariance)
        covariance = np.where(still, grown, covariance)  # each ends by itself, whatever stands beside it
        still &= (change > _ALIKE * deviation[:, None] * deviation[:, :, None]).any(axis=(1, 2), keepdims=True)
        if not still.any():
            break
    return covariance


def _transposed(matrices: Array) -> Array:
    return np.swapaxes(matrices, 1, 2)


def _ticks_of_a_frame(sensor: Sensor, period: float) -> int:
    return max(1, round(1.0 / (sensor.frame_rate * period)))


def stationary_gains(beliefs: Sequence[Belief]) -> Array:
    """The Kalman gains (B, 3) for one frame after another."""
    filters, which = distinct([_goes_by(belief) for belief in beliefs])
    gains: Array = _stationary(filters).gain[which]
    return gains


def _goes_by(belief: Belief) -> _GoesBy:
    sensor, actuator, wrist, period = belief
    ticks = _ticks_of_a_frame(sensor, period)
    return _GoesBy(actuator, wrist, period, ticks, sensor.noise_deg, sensor.torque_noise, sensor.load_drift)


def expected_error(belief: Belief) -> float:
    """Standard deviation [rad] of what a law sees less the true angle, by the observer's own covariance.

    That is behind a frame and the prediction from it, on average over the ticks for which it is the last to have
    arrived. Frames that are lost, and all that differs from what is believed, come on top.
    """
    covariance, tick, noise = (matrices[0] for matrices in _stationary((_goes_by(belief),))[1:])
    sensor, period = belief.sensor, belief.period
    late, ticks = round(sensor.delay_frames / (sensor.frame_rate * period)), _ticks_of_a_frame(sensor, period)
    variances = []
    for age in range(late + ticks):
        if age >= late:
            variances.append(covariance[0, 0])
        covariance = tick @ covariance @ tick.T + noise
    return float(np.sqrt(np.mean(variances)))
