"""Strokes of spools that hold a wrist without friction along a line of bends, in one plane or in two."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.planes import Asked, why_two
from wristctl.simulation.simulated_drives import SIDES
from wristctl.simulation.spool_driven import SpooledWrist
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.directions import toward_words
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.co_contraction import least_pulls
from wristctl.wrist.spatial.spatial_kinematics import tip_bends
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import own_values
from wristctl.wrist.spatial.spatial_statics import at_rest_along, spatial_equilibria_at
from wristctl.wrist.statics import FROM_ABOVE, FROM_BELOW, HeldTendons, at_rest_with, equilibria_at
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Step between two angles at which the statics are solved [rad]; chords between them are 1e-10 m off.
_FINE = math.radians(0.05)


class FrictionCase(NamedTuple):
    """Friction of a wrist's tendons: coefficient, the sheath's angle [rad], the path in which it turns round [m]."""

    friction: float
    sheath: float
    presliding: float


@dataclass(frozen=True)
class Strokes:
    """Spools and pulls that hold a wrist without friction at angles (G,) [rad]; of a place all its tendons together.

    In two planes angles are bends along a line toward a direction.
    """

    wrist: WristParameters
    settings: HysteresisSettings
    angle: Array
    theta: Array
    """Coordinates (G, q) [rad]: in one plane the segments' angles."""
    reeled: Array
    """(G, places) [m]"""
    pulls: Array
    """(G, places) [N]"""

    @property
    def winch(self) -> bool:
        """Whether pulls are held instead of spools."""
        return self.settings.drive == "tensions"

    @property
    def planes(self) -> int:
        """Planes that it bends in."""
        return len(self.theta[0]) // self.settings.segments

    @property
    def toward(self) -> Array:
        """Direction of the bends (P,)."""
        return np.ones(1) if self.planes == 1 else direction_of(self.settings)

    @property
    def layout(self) -> TendonLayout:
        """Places of tendons: in one plane both sides."""
        one_plane = self.planes == 1
        return TendonLayout.pair_of_sides(self.wrist.tendon_offset) if one_plane else TendonLayout.of(self.wrist)

    @property
    def arms(self) -> Array:
        """Moment arm of a tendon of each place along the line, on the straight wrist (places,) [m]."""
        arms: Array = self.layout.cross_section[:, : self.planes] @ self.toward
        return arms

    def given(self, angle: Array) -> Array:
        """Input of all places at angles (...): spools [m], or pulls of winches [N]; (places, ...)."""
        course = self.pulls if self.winch else self.reeled
        return np.stack([np.interp(angle, self.angle, place) for place in course.T])

    def told(self, angle: Array) -> Array:
        """Input of all places at angles (T, L), as `spooled` takes it: (T, places, L)."""
        return np.moveaxis(self.given(angle), 0, 1)

    def theta_at(self, angle: Array) -> Array:
        """Coordinates at angles (...), (..., q)."""
        return np.stack([np.interp(angle, self.angle, column) for column in self.theta.T], axis=-1)

    def lane(self, tendons: FrictionCase, begin: float) -> SpooledWrist:
        """A wrist that rests at this angle [rad] at first."""
        at, actuator = self.theta_at(np.array(begin)), self.settings.actuator(*tendons)
        return SpooledWrist(self.wrist, actuator, at, self.winch, planes=self.planes)

    def along(self, bends: Array) -> Array:
        """Bend along the line [rad], of bends of each plane (..., P)."""
        return bends[..., 0] if self.planes == 1 else bends @ self.toward

    def exact(self, tendons: Sequence[FrictionCase], angle: Array) -> Array:
        """Angles at rest from below and from above (B, 2) [rad] where without friction they are `angle` (B,)."""
        friction, sheath, _ = np.array(tendons, float).T
        given, guess, n = self.given(angle).T, self.theta_at(angle), self.settings.segments
        stiffness = 0.0 if self.winch else self.settings.tendon_stiffness
        if self.planes == 1:
            values = np.tile(segments(self.wrist, n), (len(angle), 1))
            held = HeldTendons(given, np.array([TENDONS_PER_SIDE * stiffness]), friction, sheath)
            ends = [at_rest_with(values, held, z, guess).sum(axis=1) for z in (FROM_BELOW, FROM_ABOVE)]
        else:
            held = HeldTendons(given, stiffness * self.layout.multiplicity.astype(float), friction, sheath)
            way = np.tile(self.toward, n) * np.ones_like(guess)
            rests = [at_rest_along(self.wrist, n, held, side * way, guess) for side in (1.0, -1.0)]
            ends = [self.along(tip_bends(rest)) for rest in rests]
        return np.stack(ends, axis=1)


def direction_of(settings: HysteresisSettings) -> Array:
    """Direction of bends in two planes (2,), toward ulnar and toward flexion."""
    angle = math.radians(settings.toward_deg)
    return np.array([math.cos(angle), math.sin(angle)])


def loop_of(settings: HysteresisSettings) -> Loop:
    """A loop with the stiffness of wrist and tendons that the settings ask for."""
    tendons = {"level": "tendon", "tendon_stiffness": settings.tendon_stiffness}
    asked = {"stiffness": settings.stiffness, "stiffness_over_deg": settings.stiffness_over_deg}
    return Loop.model_validate({"actuator": tendons, **asked})


def why_in_two_planes(wrist: WristParameters, settings: HysteresisSettings) -> str:
    """Why a wrist on its spools bends in two planes, in words; empty where it stays in one.

    Raises UserError for places of tendons that are no layout.
    """
    if settings.toward_deg:
        return f"its bends go {toward_words(settings.toward_deg)}"
    return why_two(wrist, [Asked(Loop(), Reference(kind="step"), "ulnar")])


def strokes(wrist: WristParameters, settings: HysteresisSettings) -> Strokes:
    """Strokes over all angles of all ranges. Raises UserError where the wrist cannot be held there."""
    ends = np.radians(settings.ranges_deg)
    angle = np.linspace(ends.min(), ends.max(), 1 + math.ceil(float(np.ptp(ends)) / _FINE))
    if math.degrees(float(np.abs(angle).max())) > wrist.range_deg:
        problem = f"a loop goes beyond the wrist's range, {wrist.range_deg:g} deg"
        raise UserError(problem, "hysteresis.ranges_deg", "smaller ranges")
    if why_in_two_planes(wrist, settings):
        theta, reeled, pulls = held_in_space(wrist, settings, angle[:, None] * direction_of(settings))
        return Strokes(wrist, settings, angle, theta, reeled, pulls)
    values = np.tile(segments(wrist, settings.segments), (len(angle), 1))
    least = least_pulls(wrist, loop_of(settings), None)
    theta, pulls, stable = equilibria_at(values, settings.segments, angle, float(least[0]))
    lengths = terms(values, theta, 0.0 * theta).tendon_lengths.sum(axis=1)
    _check_held(wrist, settings, stable, pulls / np.array(SIDES))
    reeled = pulls / (np.array(SIDES) * settings.tendon_stiffness) + wrist.length - lengths
    return Strokes(wrist, settings, angle, theta, reeled, pulls)


def held_in_space(wrist: WristParameters, settings: HysteresisSettings, bends: Array) -> tuple[Array, Array, Array]:
    """What holds a wrist without friction at bends (G, 2) [rad], with the least sum of pulls.

    Returns its coordinates (G, q) [rad], and of each place of tendons what it has reeled in [m] and the pull of all its
    tendons [N], (G, places). Raises UserError where the wrist cannot be held there.
    """
    layout = TendonLayout.of(wrist)
    alike, least = layout.multiplicity.astype(float), least_pulls(wrist, loop_of(settings), layout)
    arms = spatial_terms(own_values(wrist, 1), bends, 0.0 * bends).moment_arms.reshape(len(bends), -1, 2)
    values = np.tile(own_values(wrist, settings.segments), (len(bends), 1))
    theta, pulls, found, stable = spatial_equilibria_at(values, settings.segments, bends, arms, least)
    if not found.all():
        raise UserError("no rest was found on held tendons in two planes", "wrist", "a smaller bend, or more pull")
    _check_held(wrist, settings, stable, pulls / alike)
    straight, lengths = _lengths(values[:1], 0.0 * theta[:1]), _lengths(values, theta)
    return theta, pulls / (alike * settings.tendon_stiffness) + straight - lengths, pulls


def _check_held(
    wrist: WristParameters, settings: HysteresisSettings, stable: NDArray[np.bool_], tensions: Array
) -> None:
    """UserError where the wrist buckles on held pulls, or a tendon's tension [N] is above the limit."""
    if settings.drive == "tensions" and not stable.all():
        raise UserError("the wrist buckles on held pulls", "hysteresis.drive", "drive: spools, or a lighter hand")
    most = float(tensions.max())
    if most > wrist.tension_limit:
        problem = f"it takes {most:.3g} N a tendon, above wrist.tension_limit ({wrist.tension_limit:g} N)"
        raise UserError(problem, "hysteresis.ranges_deg", "smaller ranges")


def _lengths(values: Array, q: Array) -> Array:
    lengths: Array = spatial_terms(values, q, 0.0 * q).lengths
    return lengths
