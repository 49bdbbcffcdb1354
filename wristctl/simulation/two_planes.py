"""A closed loop in two planes: a controller's law once for each plane, and pulls by one allocation for both."""

from dataclasses import dataclass

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.control.law import REFERENCE, Controller, signals_of
from wristctl.errors import UserError
from wristctl.simulation.bend_paths import BEND_PATHS
from wristctl.simulation.spatial_kernel import (
    SPATIAL_RECORDED,
    SpatialCourse,
    SpatialScratch,
    SpatialSetup,
    SpatialState,
    SpatialValues,
    run_spatial,
)
from wristctl.simulation.worlds import bending_limit
from wristctl.wrist.allocation import allocated
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON, spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

# Time between samples of references and records [s].
SAMPLE = 1e-3
# Share of a wanted torque below which it was out of the tendons' reach.
_FULL = 1.0 - 1e-9


@dataclass(frozen=True)
class BendCourse:
    """What a wrist in two planes did, over T samples; planes in the order ulnar, flexion. nan after it has failed."""

    time: Array
    """(T,) [s]"""
    bend: Array
    """Bend of the last disc (T, 2) [rad]."""
    rate: Array
    """(T, 2) [rad/s]"""
    bend_ref: Array
    """(T, 2) [rad]"""
    torque_wanted: Array
    """What the laws want (T, 2) [N m]."""
    torque: Array
    """What the pulls give by the controller's model (T, 2) [N m]."""
    share: Array
    """Share of the wanted torque that the tendons could give (T,)."""
    pulls: Array
    """(T, places of tendons) [N]"""
    coordinates: Array
    """Bends of the plant's segments (T, 2n) [rad]."""
    tip: Array
    """(T, 3) [m]: along the base, toward ulnar, toward flexion."""
    tip_desired: Array
    """Tip of one arc that is bent as wanted (T, 3) [m]."""

    @property
    def failed(self) -> bool:
        """Whether the wrist left its range."""
        return bool(np.isnan(self.bend).any())

    def metrics(self) -> dict[str, float]:
        """Errors by plane and as one norm [rad], of the tip [mm], and of the pulls; by name."""
        error = self.bend - self.bend_ref
        off = np.hypot(error[:, 0], error[:, 1])
        apart = np.linalg.norm(self.tip - self.tip_desired, axis=1)
        changes = np.abs(np.diff(self.pulls, axis=0)).sum()
        return {
            "rmse_ulnar": float(np.sqrt(np.mean(error[:, 0] ** 2))),
            "rmse_flexion": float(np.sqrt(np.mean(error[:, 1] ** 2))),
            "rmse": float(np.sqrt(np.mean(off**2))),
            "largest_error": float(off.max()),
            "tip_rmse": float(1e3 * np.sqrt(np.mean(apart**2))),
            "peak_pull": float(self.pulls.max()),
            "chattering": float(changes / (self.time[-1] - self.time[0])),
            "saturation": float(np.mean(self.share < _FULL)),
        }


def bend_path(name: str, size_deg: float, turn: float, horizon: float, toward_deg: float = 0.0) -> Array:
    """Bends of a named path with two derivatives, (2, 3, T), sampled every millisecond.

    Parameters
    ----------
    name
        One of `wristctl.simulation.bend_paths.BEND_PATHS`.
    size_deg
        Largest bend [deg].
    turn
        Time of a turn [s].
    horizon
        Time of the last sample [s].
    toward_deg
        Angle by which the path is turned, from ulnar toward flexion [deg].

    Raises UserError for another name, or times that are not positive.
    """
    if name not in BEND_PATHS:
        raise UserError(f"no bend path '{name}'", "reference", f"one of {', '.join(BEND_PATHS)}")
    if not (turn > 0.0 and horizon >= SAMPLE):
        raise UserError(f"a turn of {turn:g} s over {horizon:g} s is no motion", "horizon", "positive times")
    time: Array = SAMPLE * np.arange(round(horizon / SAMPLE) + 1.0)
    path = BEND_PATHS[name](time, np.deg2rad(size_deg), turn)
    c, s = np.cos(np.deg2rad(toward_deg)), np.sin(np.deg2rad(toward_deg))
    turned: Array = np.einsum("ij,jkt->ikt", np.array([[c, -s], [s, c]]), path)
    return turned


def reach_of_bends(wrist: WristParameters, layout: TendonLayout, directions: int = 72) -> Array:
    """The largest bend (directions + 1, 2) [rad] that tendons within their limits hold at rest, all around.

    Of the wrist as one segment, to half a degree, up to its range; the last direction is the first again.
    """
    around = np.linspace(0.0, 2.0 * np.pi, directions + 1)
    sizes = np.deg2rad(np.arange(0.0, wrist.range_deg + 0.25, 0.5))
    bends = sizes[:, None, None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
    at_rest = spatial_terms(spatial_values(wrist, layout, 1), bends, 0.0 * bends)
    torque = at_rest.bias + wrist.stiffness * np.array([1.0, wrist.flexion_ratio]) * bends
    limits = wrist.pretension * layout.multiplicity, wrist.tension_limit * layout.multiplicity
    arms = at_rest.moment_arms.reshape(-1, len(layout.places), 2)
    held = ~allocated(arms, torque.reshape(-1, 2), *limits).saturated.reshape(len(sizes), -1)
    last = np.cumprod(held, axis=0).sum(axis=0) - 1
    reach: Array = bends[last.clip(0), np.arange(directions + 1)]
    return reach


def simulate_two_planes(
    law: Controller,
    gains: Array,
    references: Array,
    wrist: WristParameters | None = None,
    layout: TendonLayout | None = None,
    n: int = 4,
    control_period: float = SAMPLE,
    substeps: int = 1,
    force: Array | None = None,
) -> BendCourse:
    """Follow a bend path from the straight wrist at rest; the bend is measured as it is, tendons pull as commanded.

    Parameters
    ----------
    law, gains
        A controller that compiles and its gains (g,), the same for both planes.
    references
        Bends with two derivatives, (2, 3, T), as `bend_path` makes them.
    layout
        Places of the tendons; None: as `wrist.tendons` has them.
    n
        Segments that the plant is cut into. The law knows one.
    control_period
        Of the law [s]: a millisecond or a whole part of one.
    substeps
        Integration steps in a control period.
    force
        Force on the tip (3,) or (3, T) [N], along the base, toward ulnar, toward flexion; the laws do not know it.

    Raises UserError for a path beyond the wrist's range, a law in plain Python, or another control period.
    """
    wrist = wrist or WristParameters()
    layout = layout or TendonLayout.of(wrist)
    ticks = round(SAMPLE / control_period)
    _check(law, references, wrist, abs(ticks * control_period - SAMPLE) < 1e-9 and ticks > 0)
    samples, count, m = references.shape[2], len(layout.places), 2 * n
    acting = np.zeros((4, samples))
    acting[3] = 1.0
    if force is not None:
        acting[:3] = np.reshape(force, (3, -1))
    facing_flexion = wrist.model_copy(
        update={
            "stiffness": wrist.stiffness * wrist.flexion_ratio,
            "gravity": (wrist.gravity[0], wrist.gravity_flexion),
        }
    )
    pulls = layout.multiplicity[None, :] * np.array([[wrist.pretension], [wrist.tension_limit]])
    setup = SpatialSetup(
        law.compiled(1), (0,) * m, (0,) * (OF_A_TENDON * count), (0,) * count, (0, 0), control_period, substeps, ticks,
        law.preview,
    )  # fmt: skip
    values = SpatialValues(
        plant=spatial_values(wrist, layout, n)[None],
        believed=spatial_values(wrist, layout, 1)[None],
        model_y=segments(wrist, 1)[None],
        model_z=segments(facing_flexion, 1)[None],
        gains=np.array(gains, float).reshape(1, -1),
        limits=np.append(pulls.ravel(), bending_limit(wrist))[None],
    )
    memory, columns = max(1, law.memory), len(SPATIAL_RECORDED)
    record = np.empty((1, samples, columns + count + m))
    state = SpatialState(np.zeros((1, 2 * m)), np.zeros((1, memory)), np.zeros((1, memory)), np.ones((1, 1)), record)
    rows = signals_of(law.preview)
    scratch = SpatialScratch(np.zeros(rows), np.zeros(rows), np.zeros(len(REFERENCE)), np.zeros(len(REFERENCE)))
    course = SpatialCourse(np.ascontiguousarray(references, float), acting)
    run_spatial(setup, course, values, state, scratch, 0, samples)
    kept = record[0]
    coordinates, wanted = kept[:, columns + count :], references[:, 0].T
    return BendCourse(
        time=SAMPLE * np.arange(float(samples)),
        bend=kept[:, 0:2],
        rate=kept[:, 2:4],
        bend_ref=wanted,
        torque_wanted=kept[:, 4:6],
        torque=kept[:, 6:8],
        share=kept[:, 8],
        pulls=kept[:, columns : columns + count],
        coordinates=coordinates,
        tip=spatial_tips(coordinates, wrist.length),
        tip_desired=spatial_tips(wanted, wrist.length),
    )


def _check(law: Controller, references: Array, wrist: WristParameters, is_whole: bool) -> None:
    if law.plain:
        raise UserError(
            f"{law.name} is plain Python, which no loop in two planes runs", "controller", "one that compiles"
        )
    if not is_whole:
        raise UserError("the control period is no whole part of a millisecond", "loop.control_period", "0.001")
    most = float(np.rad2deg(np.hypot(references[0, 0], references[1, 0]).max()))
    if most > wrist.range_deg:
        raise UserError(
            f"a bend of {most:.3g} deg is beyond the wrist's range of {wrist.range_deg:g} deg",
            "reference.angle_deg",
            "ask for less, or widen wrist.range_deg",
        )
