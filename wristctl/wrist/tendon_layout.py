"""Layout of tendons: where each runs through the discs, how far it goes, and what that allows.

Axes of the cross-section, as of the wrist at its base: tangent +x, ulnar +y, flexion +z. Angles are counted from ulnar
toward flexion. A tendon at c = (c_y, c_z) that is pulled bends the wrist toward c.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.directions import TENDONS

# Distances, relative to the largest radius, below which two places are one, and angles [rad] that are no gap.
_APART = 1e-6
_KEY = "wrist.tendons"


def _key(number: int) -> str:
    return f"{_KEY}.{number - 1}"


@dataclass(frozen=True)
class TendonPlace:
    """Place of one tendon, or of several alike that are pulled together.

    Parameters
    ----------
    angle
        Direction from the wrist's axis [rad], from ulnar toward flexion.
    radius
        Distance from the wrist's axis [m].
    ends_at
        Disc that the tendon ends at, counted from 1, the clamped one; None: the last.
    multiplicity
        Number of tendons alike at this place.
    """

    angle: float
    radius: float
    ends_at: int | None = None
    multiplicity: int = 1


@dataclass(frozen=True)
class TendonLayout:
    """Places of all tendons, in the order in which pulls, paths and moment arms have them.

    Raises UserError where two places are one, or where pulls cannot bend the wrist to both sides of its plane, or all
    around.
    """

    places: tuple[TendonPlace, ...]

    def __post_init__(self) -> None:
        for number, place in enumerate(self.places, 1):
            name, where, last = f"tendon {number}", _key(number), place.ends_at
            if not (math.isfinite(place.angle) and 0.0 <= place.radius < math.inf):
                raise UserError(f"{name} is nowhere: angle {place.angle:g} rad, radius {place.radius:g} m", where)
            if last is not None and last < 2:
                raise UserError(f"{name} ends at disc {last}, and disc 1 is clamped", where, "2 or a later disc")
            if place.multiplicity < 1:
                raise UserError(
                    f"{name} stands for {place.multiplicity} tendons", where, "a multiplicity of at least 1"
                )
        self._check_distinct()
        self._check_spanned()

    def _check_distinct(self) -> None:
        largest = max((place.radius for place in self.places), default=0.0)
        for j in range(len(self.places)):
            for i in range(j):
                distance = float(np.hypot(*(self.cross_section[i] - self.cross_section[j])))
                if distance <= _APART * largest and self.places[i].ends_at == self.places[j].ends_at:
                    what = f"tendons {i + 1} and {j + 1} are at one place"
                    raise UserError(what, _key(j + 1), "one place with a multiplicity of 2, or another angle")

    def _check_spanned(self) -> None:
        around = self._around
        if len(around) == 2 and self.planes == 1:
            return
        if len(around) < 3:
            what = f"{len(around)} tendons off the axis cannot bend a wrist in two planes"
            raise UserError(what, _KEY, "at least three, or two at 0 and 180 deg for one plane")
        gaps = np.diff([*around, around[0] + 2.0 * math.pi])
        widest = int(np.argmax(gaps))
        if gaps[widest] >= math.pi - _APART:
            toward = math.degrees(around[widest] + 0.5 * gaps[widest]) % 360.0
            what = f"no tendon pulls toward {toward:.0f} deg: there is none in {math.degrees(gaps[widest]):.0f} deg"
            raise UserError(what, _KEY, "gaps between neighbouring tendons below 180 deg")

    @property
    def _around(self) -> list[float]:
        """Angles [rad] from 0 to 2 pi of the tendons off the axis, sorted."""
        turn = 2.0 * math.pi
        return sorted(place.angle % turn for place in self.places if place.radius > 0.0)

    @property
    def planes(self) -> int:
        """Planes that the tendons bend the wrist in: 1 where all lie on the ulnar axis, else 2."""
        return 1 if not self.cross_section[:, 1].any() else 2

    @property
    def offset(self) -> float:
        """Largest distance of a tendon from the axis of bending toward ulnar or flexion [m]."""
        return float(np.abs(self.cross_section).max())

    @cached_property
    def cross_section(self) -> Array:
        """Places (T, 2) [m], toward ulnar and toward flexion."""
        angle, radius = np.array([(place.angle, place.radius) for place in self.places]).reshape(-1, 2).T
        unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        unit[np.abs(unit) < 1e-15] = 0.0  # the cosine of a right angle
        places: Array = radius[:, None] * unit
        return places

    @property
    def directions(self) -> Array:
        """Direction of each place from the axis (T,) [rad], from ulnar toward flexion."""
        return np.array([place.angle for place in self.places])

    @cached_property
    def multiplicity(self) -> NDArray[np.int64]:
        """Number of tendons alike at each place (T,)."""
        return np.array([place.multiplicity for place in self.places], np.int64)

    def shares(self, discs: int) -> Array:
        """Share of the wrist's length that each tendon spans (T,), of a wrist with so many discs.

        Raises UserError where a tendon ends beyond the last disc.
        """
        for number, place in enumerate(self.places, 1):
            if place.ends_at is not None and place.ends_at > discs:
                what = f"tendon {number} ends at disc {place.ends_at} of {discs}"
                raise UserError(what, _key(number), f"a disc from 2 to {discs}")
        last = [place.ends_at or discs for place in self.places]
        return (np.array(last, float) - 1.0) / (discs - 1.0)

    def ends(self, discs: int, segments: int) -> NDArray[np.int64]:
        """Segments that each tendon spans (T,), counted from the base, of a wrist cut into so many equal ones.

        Raises UserError where a tendon ends within a segment.
        """
        spanned = self.shares(discs) * segments
        whole = np.rint(spanned).astype(np.int64)
        for number, (count, exact) in enumerate(zip(whole, spanned, strict=True), 1):
            if abs(count - exact) > 1e-9:
                last = self.places[number - 1].ends_at
                what = f"tendon {number} ends at disc {last} of {discs}, within one of {segments} segments"
                raise UserError(what, _key(number), f"segments: {discs - 1}")
        return whole

    def moment_arms(self, bend: ArrayLike, length: float, discs: int) -> Array:
        """Moment arms (T, 2) [m] of one tendon at each place, of a wrist bent as one arc.

        Each is minus the derivative of the tendon's length by the bend: of s (l - c.u) S(|u|/2g) with S(x) = sin x / x,
        where s is the share of the wrist that the tendon spans and g the number of spans between discs. Times the
        tension it is the torque. At the straight pose it is s c.

        Parameters
        ----------
        bend
            Bend (2,) of the whole wrist toward ulnar and flexion [rad].
        length
            Length of the wrist's axis between its first and last disc [m].
        discs
            Number of discs.
        """
        u = np.asarray(bend, float)
        half = 0.5 / (discs - 1)
        y = half * float(np.hypot(*u))
        sinc = np.sinc(y / math.pi)
        # (sin y - y cos y) / y^3, whose subtraction leaves nothing near 0
        decline = (sinc - math.cos(y)) / y**2 if y > 0.02 else 1.0 / 3.0 - y * y / 30.0 + y**4 / 840.0
        squeeze = half * half * decline * (length - self.cross_section @ u)
        arms: Array = self.shares(discs)[:, None] * (self.cross_section * sinc + squeeze[:, None] * u)
        return arms

    @classmethod
    def of(cls, wrist: WristParameters) -> Self:
        """Layout of a wrist's parameters. Raises UserError, with the key of the place, as the class does."""
        radius = wrist.tendon_radius
        if isinstance(wrist.tendons, str):
            named = {"three": cls.three, "four": cls.four, "five": cls.five, "six": cls.six}
            return named[wrist.tendons](radius)
        layout = cls(
            tuple(
                TendonPlace(
                    angle=math.radians(place.angle_deg),
                    radius=radius if place.radius is None else place.radius,
                    ends_at=None if place.ends_at == wrist.discs else place.ends_at,
                    multiplicity=place.multiplicity,
                )
                for place in wrist.tendons
            )
        )
        layout.shares(wrist.discs)
        return layout

    @classmethod
    def pair_of_sides(cls, offset: float) -> Self:
        """The wrist in one plane: two tendons alike at +offset and two at -offset [m] from its neutral line."""
        return cls((TendonPlace(0.0, offset, multiplicity=2), TendonPlace(math.pi, offset, multiplicity=2)))

    @classmethod
    def around(cls, count: int, radius: float, first: float = 0.0) -> Self:
        """Tendons at equal angles from each other on a circle [m], the first at an angle [rad]."""
        return cls(tuple(TendonPlace(first + k * math.tau / count, radius) for k in range(count)))

    @classmethod
    def three(cls, radius: float, first: float = 0.0) -> Self:
        """Three tendons at 120 deg from each other on a circle [m], the first at an angle [rad]."""
        return cls.around(3, radius, first)

    @classmethod
    def six(cls, radius: float) -> Self:
        """Six tendons at 60 deg from each other on a circle [m], the first toward ulnar."""
        return cls.around(6, radius)

    @classmethod
    def four(cls, radius: float) -> Self:
        """Four tendons at 45 deg from both planes on a circle [m]: the paper's 1, 2, 4 and 5."""
        corners = (corner for corner in TENDONS.values() if any(corner))
        return cls(tuple(TendonPlace(math.atan2(flexion, ulnar), radius) for ulnar, flexion in corners))

    @classmethod
    def five(cls, radius: float) -> Self:
        """The paper's five tendons: four at 45 deg on a circle [m], and the third in the centre."""
        return cls(
            tuple(
                TendonPlace(math.atan2(flexion, ulnar), radius if ulnar else 0.0) for ulnar, flexion in TENDONS.values()
            )
        )


def off_both_sides(wrist: WristParameters) -> int | None:
    """Number of the first tendon that is on neither side of one plane; None of `four`, `five` and their like.

    A side is two tendons alike, in either plane: motions toward ulnar and toward flexion are of the same wrist. Raises
    UserError for places that are no layout.
    """
    if wrist.tendons == "four":
        return None
    layout, corner = TendonLayout.of(wrist), wrist.tendon_offset
    expected = TendonLayout.four(wrist.tendon_radius).cross_section
    for number, (c, place) in enumerate(zip(layout.cross_section, layout.places, strict=True), 1):
        at_corner = np.hypot(*(expected - c).T).min() <= _APART * corner
        if place.radius > 0.0 and not (at_corner and place.multiplicity == 1 and place.ends_at is None):
            return number
    return None


def wound_by(wrist: WristParameters, axes: int) -> TendonLayout | None:
    """Tendons off the axis, in their order, where each is wound by one of so many motors; None: the paper's 1, 2, 4, 5.

    Raises UserError where there are more of them than motors, where one ends inside the wrist, or where they bend it in
    one plane alone.
    """
    layout, four = TendonLayout.of(wrist), TendonLayout.four(wrist.tendon_radius)
    around = tuple(place for place in layout.places if place.radius > 0.0)
    if len(around) == len(four.places) and all(place.multiplicity == 1 and place.ends_at is None for place in around):
        off = np.hypot(*(TendonLayout(around).cross_section - four.cross_section).T)
        if off.max() <= _APART * wrist.tendon_offset:
            return None
    wound = sum(place.multiplicity for place in around)
    key = _KEY if isinstance(wrist.tendons, str) else f"{_KEY}.0"
    if wound > axes:
        problem = f"the motor board has {axes} axes, and this wrist {wound} tendons off its axis"
        raise UserError(problem, key, "a rig of your own takes more (hw-run.rig)")
    if wound > len(around):
        raise UserError("two tendons at one place are wound by two motors", key, "a place for each tendon")
    if any(place.ends_at is not None for place in around):
        raise UserError("the trials know no tendon that ends inside the wrist", key, "leave ends_at out")
    if layout.planes == 1:
        raise UserError("these tendons bend the wrist in one plane", key, "`tendons: four`, or a rig of your own")
    return TendonLayout(around)


def key_of_tendon(wrist: WristParameters, number: int) -> str:
    """Key of a tendon's place; that of all where they have a name."""
    return _KEY if isinstance(wrist.tendons, str) else _key(number)
