"""What hangs on the motors of the emulated bench: the wrist in the plane that it faces, or in both planes."""

from typing import Literal, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.faults import Edges
from wristctl.bench.motors import PERIOD, Hanging, SpoolState, Stepper, follow
from wristctl.board.messages import AXES
from wristctl.config.bench import BenchSettings
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.seeds import Entropy
from wristctl.simulation.disturbances import acting, acting_in_space
from wristctl.simulation.nonideal import faults_of, inner_of, nonideal_of, of_tendons, unmoved
from wristctl.simulation.worlds import drawn, facing, plant_of
from wristctl.wrist.dahl import NoInnerFriction
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, away_of, tendons_of
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.plant import kernel_of, plant_in
from wristctl.wrist.tendon_layout import TendonLayout, wound_by
from wristctl.wrist.tendon_mechanics import PLAY, X


class Load(Protocol):
    """A wrist with its tendons; it moves as the spools turn."""

    coordinates: int
    plane: str | None
    """Name of +y in the plane that it bends in; None: it bends in two."""
    wound: int
    """Motors that wind a tendon, the first of the axes."""

    def face(self, direction: str, spools: SpoolState) -> None:
        """Bend in this direction's plane from here on; where that is another plane, at rest at first as it is bent."""

    def carry(self, payload: float) -> None:
        """Hold so much [kg] in the hand from here on, beyond what the wrist was given with."""

    def follow(
        self, spools: SpoolState, stepper: Stepper, acting: tuple[Disturbances, Array], edges: Edges, first: int,
        begun: float, out: Array,
    ) -> int:  # fmt: skip
        """Advance by periods, the first of this number, into rows of `out`; how many edges have been used up.

        `acting` has the disturbances, and their times (T,) at the periods' beginnings [s]. Tendons break so long after
        `begun` [s].
        """

    def bend(self, coordinates: Array) -> Array:
        """Bend of the last disc at coordinates (..., q) [rad]: (...), or (..., 2) in two planes."""

    def turned(self, ends: Array) -> float:
        """How far the last disc turns between two places (2, q) [rad]."""


class PlanarLoad:
    """The wrist in the plane that it faces, ulnar at first."""

    plane: str | None
    wound = AXES

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy, positive: Literal["right", "left"],
        spools: SpoolState,
    ) -> None:  # fmt: skip
        self._settings, self._wrist, self._positive = settings, wrist, positive
        self._drawn, self._carried = drawn(settings.plant, stream), 0.0
        self._model = plant_in(1, settings.plant.model)
        self.coordinates = self._model.coordinates(settings.segments)
        self._follow = kernel_of(follow, self._model)
        motors = settings.actuator
        self._nonideal = np.array(nonideal_of(settings.plant, motors, motors, PERIOD))
        self._state = np.zeros(2 * self.coordinates)
        self._axes = np.arange(AXES)
        self._tendons = unmoved(spools.reeled, np.zeros(3), np.zeros(AXES), self._state[: self.coordinates])
        self._face("ulnar", spools)

    def face(self, direction: str, spools: SpoolState) -> None:
        """As `Load.face`: the bend in the plane is across the other, the bend across is in it; so are bristles."""
        if DIRECTIONS[direction].plane == self.plane:
            return
        bent, _, bristle = self._away * spools.bent
        beside = float(self.bend(self._state[: self.coordinates]))
        inner = 0.0 if isinstance(self._inner, NoInnerFriction) else self._inner.state[: self.coordinates].mean()
        self._face(direction, spools, bent, bristle)
        spools.bent[:] = self._away * beside, 0.0, self._away * inner

    def carry(self, payload: float) -> None:
        """As `Load.carry`."""
        if payload != self._carried:
            self._carried = payload
            self._weigh()

    def follow(
        self, spools: SpoolState, stepper: Stepper, acting: tuple[Disturbances, Array], edges: Edges, first: int,
        begun: float, out: Array,
    ) -> int:  # fmt: skip
        """As `Load.follow`."""
        disturbed = _acting(*acting)
        if disturbed is None:
            disturbed = np.tile((0.0, 1.0), (len(out), 1))
        hanging = Hanging(
            self._model, self._values, self._settings.actuator.tendon_stiffness, self._nonideal, self._tendons,
            self._inner, stepper, self._sides, self._across,
            (self._drawn.inner_friction, 1.0 / np.radians(self._drawn.inner_presliding_deg)),
        )  # fmt: skip
        heard: int = self._follow(
            hanging, spools, self._state, disturbed, edges, first, begun, out, (0,) * self.coordinates
        )
        return heard

    def bend(self, coordinates: Array) -> Array:
        """Bending angles (...) [rad] of the last disc at coordinates (..., q)."""
        angles: Array = self._model.angle(coordinates)
        return angles

    def turned(self, ends: Array) -> float:
        """How far the last disc turns between two places (2, q) [rad]."""
        return abs(float(np.diff(self.bend(ends))[0]))

    def _face(self, direction: str, spools: SpoolState, bent: float = 0.0, bristle: float = 0.0) -> None:
        """Rest in a plane at a bend [rad], with so much of inner friction's bristles."""
        n = self.coordinates
        coordinates = np.full(n, bent) / self.bend(np.ones(n))
        self._state[:] = np.append(coordinates, np.zeros(n))
        self.plane = DIRECTIONS[direction].plane
        plant = self._weigh()
        self._sides = np.array([ACTIVE.index(tendon) for tendon in tendons_of(self.plane)])
        axes = self._sides[[0, 2, 1, 3]]  # as they are given: both sides' first, both sides' second
        tendon_states = of_tendons(self._tendons, AXES)[np.argsort(self._axes)][axes]
        path = np.append(plant.length - self._model.taut(plant, coordinates), np.abs(coordinates).sum())
        self._tendons = unmoved(spools.reeled[axes], path, np.zeros(AXES), coordinates)
        turned = of_tendons(self._tendons, AXES)
        turned[:, :X] = tendon_states[:, :X]
        turned[:, PLAY] += turned[:, X] - tendon_states[:, X]  # they pull as before
        self._inner = inner_of([self._drawn], coordinates[None], np.array([bristle]), lambda rows: rows[0])
        self._axes = axes

    def _weigh(self) -> WristParameters:
        """The wrist with what it carries now, in the plane that it faces and across it."""
        own = self._drawn.model_copy(update={"payload": self._drawn.payload + self._carried})
        direction, across = (
            next(each.name for each in DIRECTIONS.values() if (each.plane == self.plane) == within)
            for within in (True, False)
        )
        plant = plant_of(*facing(self._wrist, own, direction))
        away = away_of(DIRECTIONS[direction].plane, self._positive)
        self._across, self._away = across_of(plant_of(*facing(self._wrist, own, across)), away), away[-1]
        self._values = self._model.values(plant, self._settings.segments)
        return plant


_acting = acting


class SpatialLoad:
    """The wrist in both planes, in so many steps of integration a period.

    UserError for what no wrist in two planes has.
    """

    plane: str | None = None

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy, spools: SpoolState, substeps: int = 1
    ) -> None:
        self.wound = len(TendonLayout.of(_wound(wrist)).places)
        check_tendons(settings, self.wound)
        own, motors = drawn(settings.plant, stream), settings.actuator
        self._wrist, self._own, self._segments, self._carried = wrist, own, settings.segments, 0.0
        self._model, alike = plant_in(2, settings.plant.model), np.ones(self.wound)
        self.coordinates = self._model.coordinates(settings.segments)
        at_rest = np.zeros(self.coordinates)
        from wristctl.bench.spatial_motors import SpatialHanging, follow_in_space

        self._follow = kernel_of(follow_in_space, self._model)
        self._hanging = SpatialHanging(
            model=self._model,
            values=self._weighed(),
            stiffness=motors.tendon_stiffness,
            stiffnesses=motors.tendon_stiffness * alike,
            nonideal=np.array(nonideal_of(own, motors, motors, PERIOD / substeps)),
            faults=faults_of(motors, motors, alike).ravel(),
            tendons=unmoved(spools.reeled[: self.wound], np.zeros(2 * self.wound), np.zeros(self.wound), at_rest),
            inner=inner_of([own], at_rest[None], np.zeros(1), lambda rows: rows[0], 2),
            motor=None,
            substeps=substeps,
            coordinates=(0,) * self.coordinates,
            pulls=(0,) * self.wound,
        )
        self._state = np.zeros(2 * self.coordinates)

    def face(self, direction: str, spools: SpoolState) -> None:
        """Nothing: it bends in both planes."""

    def carry(self, payload: float) -> None:
        """As `Load.carry`."""
        if payload != self._carried:
            self._carried = payload
            self._hanging = self._hanging._replace(values=self._weighed())

    def _weighed(self) -> Array:
        own = self._own.model_copy(update={"payload": self._own.payload + self._carried})
        return self._model.values(_wound(plant_of(self._wrist, own)), self._segments)

    def follow(
        self, spools: SpoolState, stepper: Stepper, acting: tuple[Disturbances, Array], edges: Edges, first: int,
        begun: float, out: Array,
    ) -> int:  # fmt: skip
        """As `Load.follow`."""
        disturbed = acting_in_space(*acting)
        if disturbed is None:
            disturbed = np.tile((0.0, 0.0, 0.0, 1.0), (len(out), 1))
        hanging = self._hanging._replace(motor=stepper)
        heard: int = self._follow(hanging, spools, self._state, disturbed, edges, first, begun, out)
        return heard

    def bend(self, coordinates: Array) -> Array:
        """Bends (..., 2) [rad] of the last disc at coordinates (..., q)."""
        return self._model.angle(coordinates)

    def turned(self, ends: Array) -> float:
        """How far the last disc turns between two places (2, q) [rad], in either plane or between."""
        return float(np.hypot(*np.diff(self.bend(ends), axis=0)[0]))


def _wound(wrist: WristParameters) -> WristParameters:
    """The wrist with the tendons alone that the axes wind, in their order. UserError where there are more of them."""
    if wound_by(wrist, AXES) is None:
        return wrist.model_copy(update={"tendons": "four"})
    if isinstance(wrist.tendons, str):
        return wrist
    return wrist.model_copy(update={"tendons": tuple(place for place in wrist.tendons if place.radius != 0.0)})


def check_tendons(settings: BenchSettings, tendons: int) -> None:
    """UserError for a fault of a tendon that a bench has not."""
    motors = settings.actuator
    for key, tendon, verb in (
        ("broken_tendon", motors.broken_tendon, "break"),
        ("slipping_tendon", motors.slipping_tendon, "slip"),
    ):
        if tendon > tendons:
            raise UserError(f"tendon {tendon} of {tendons} cannot {verb}", f"bench.actuator.{key}", f"1 to {tendons}")
