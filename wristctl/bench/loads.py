"""What hangs on the motors of the emulated bench: the wrist in both planes, or in the one that it faces."""

from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.faults import Edges
from wristctl.bench.motors import PERIOD, Hanging, SpoolState, Stepper, follow
from wristctl.board.messages import AXES
from wristctl.config.bench import BenchSettings, WeakenedPlant
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy
from wristctl.simulation.disturbances import acting_in_space
from wristctl.simulation.nonideal import faults_of, faults_of_sides, inner_of, nonideal_of, of_tendons, unmoved
from wristctl.simulation.worlds import drawn, facing, plant_of
from wristctl.wrist.dahl import NoInnerFriction
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, away_of, tendons_of
from wristctl.wrist.out_of_plane import IN_PLANE, across_of
from wristctl.wrist.plant import kernel_of, plant_in
from wristctl.wrist.tendon_layout import TendonLayout, wound_by
from wristctl.wrist.tendon_mechanics import PLAY, RealTendons, X


class Load:
    """A wrist with tendons on the first of the axes; it moves as the spools turn, in so many steps a period."""

    plane: str | None = None
    """Name of +y in the plane that it bends in; None: it bends in two."""

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy, planes: Literal[1, 2], wound: int,
        substeps: int = 1,
    ) -> None:  # fmt: skip
        self._wrist, self._segments, self.wound = wrist, settings.segments, wound
        self._own, self._carried = drawn(settings.plant, stream), 0.0
        self._model = plant_in(planes, settings.plant.model)
        self._follow = kernel_of(follow, self._model)
        self.coordinates = self._model.coordinates(settings.segments)
        self._state = np.zeros(2 * self.coordinates)
        self._hanging = Hanging(
            model=self._model,
            values=None,
            tendons=None,
            stiffness=settings.actuator.tendon_stiffness,
            axes=np.arange(wound),
            across=IN_PLANE,
            rubbing=(self._own.inner_friction, 1.0 / np.radians(self._own.inner_presliding_deg)),
            motor=None,
            substeps=substeps,
            coordinates=(0,) * self.coordinates,
            pulls=(0,) * wound,
        )

    def face(self, direction: str, spools: SpoolState) -> None:
        """Bend in this direction's plane from here on; where that is another plane, at rest at first as it is bent.

        In two planes nothing changes.
        """

    def carry(self, payload: float) -> None:
        """Hold so much [kg] in the hand from here on, beyond what the wrist was given with."""
        if payload != self._carried:
            self._carried = payload
            self._weigh()

    def follow(
        self, spools: SpoolState, stepper: Stepper, acting: tuple[Disturbances, Array], edges: Edges, first: int,
        begun: float, out: Array,
    ) -> int:  # fmt: skip
        """Advance by periods, the first of this number, into rows of `out`; how many edges have been used up.

        `acting` has the disturbances, and their times (T,) at the periods' beginnings [s]. Tendons break so long after
        `begun` [s].
        """
        settings, time = acting
        if self.plane is not None:
            settings = settings.model_copy(update={"toward_deg": 0.0})
        disturbed = acting_in_space(settings, time)
        if disturbed is None:
            disturbed = np.tile((0.0, 0.0, 0.0, 1.0), (len(out), 1))
        hanging = self._hanging._replace(motor=stepper)
        heard: int = self._follow(hanging, spools, self._state, disturbed, edges, first, begun, out)
        return heard

    def bend(self, coordinates: Array) -> Array:
        """Bend of the last disc at coordinates (..., q) [rad]: (...), or (..., 2) in two planes."""
        return self._model.angle(coordinates)

    def turned(self, ends: Array) -> float:
        """How far the last disc turns between two places (2, q) [rad]."""
        return float(np.linalg.norm(np.diff(self.bend(ends), axis=0)))

    def _weigh(self) -> WristParameters:
        """The wrist with what it carries now, whose values are the plant's from here on."""
        raise NotImplementedError

    def _laden(self) -> WeakenedPlant:
        """What is true of the wrist, with what it carries now."""
        return self._own.model_copy(update={"payload": self._own.payload + self._carried})


class SpatialLoad(Load):
    """The wrist in both planes.

    UserError for a plant that it cannot be, more tendons than axes, and a fault of a tendon that it has not.
    """

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy, spools: SpoolState, substeps: int = 1
    ) -> None:
        super().__init__(settings, wrist, stream, 2, len(TendonLayout.of(_wound(wrist)).places), substeps)
        motors, alike, q = settings.actuator, np.ones(self.wound), self._state[: self.coordinates]
        tendons = RealTendons(
            stiffness=motors.tendon_stiffness * alike,
            nonideal=np.array(nonideal_of(self._own, motors, motors, PERIOD / substeps)),
            faults=faults_of(motors, motors, alike, "bench.actuator").ravel(),
            state=unmoved(spools.reeled[: self.wound], np.zeros(2 * self.wound), np.zeros(self.wound), q),
            inner=inner_of([self._own], q[None], np.zeros(1), lambda rows: rows[0], 2),
            pulls=self._hanging.pulls,
            path=(0,) * (2 * self.wound),
        )
        self._hanging = self._hanging._replace(tendons=tendons)
        self._weigh()

    def _weigh(self) -> WristParameters:
        plant = _wound(plant_of(self._wrist, self._laden()))
        self._hanging = self._hanging._replace(values=self._model.values(plant, self._segments))
        return plant


class PlanarLoad(Load):
    """The wrist in the plane that it faces, ulnar at first."""

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, stream: Entropy, spools: SpoolState,
        positive: Literal["right", "left"],
    ) -> None:  # fmt: skip
        super().__init__(settings, wrist, stream, 1, AXES)
        motors, q, self._positive = settings.actuator, self._state[: self.coordinates], positive
        nonideal = nonideal_of(self._own, motors, motors, PERIOD, alike=1)
        tendons = RealTendons(
            stiffness=np.full(AXES, motors.tendon_stiffness),
            nonideal=np.array(nonideal),
            faults=faults_of_sides(nonideal, AXES).ravel(),
            state=unmoved(spools.reeled, np.zeros(3), np.zeros(AXES), q),
            inner=NoInnerFriction(),
            pulls=self._hanging.pulls,
            path=(0,) * 3,
        )
        self._hanging = self._hanging._replace(tendons=tendons)
        self._face("ulnar", spools)

    def face(self, direction: str, spools: SpoolState) -> None:
        """As `Load.face`: the bend in the plane is across the other, the bend across is in it; so are bristles."""
        if DIRECTIONS[direction].plane == self.plane:
            return
        bent, _, bristle = self._away * spools.bent
        n, friction = self.coordinates, self._hanging.tendons.inner
        beside = float(self.bend(self._state[:n]))
        inner = 0.0 if isinstance(friction, NoInnerFriction) else friction.state[:n].mean()
        self._face(direction, spools, bent, bristle)
        spools.bent[:] = self._away * beside, 0.0, self._away * inner

    def _face(self, direction: str, spools: SpoolState, bent: float = 0.0, bristle: float = 0.0) -> None:
        """Rest in a plane at a bend [rad], with so much of inner friction's bristles."""
        n, (axes_before, tendons) = self.coordinates, (self._hanging.axes, self._hanging.tendons)
        coordinates = np.full(n, bent) / self.bend(np.ones(n))
        self._state[:] = np.append(coordinates, np.zeros(n))
        self.plane = DIRECTIONS[direction].plane
        plant = self._weigh()
        sides = np.array([ACTIVE.index(tendon) for tendon in tendons_of(self.plane)])
        axes = sides[[0, 2, 1, 3]]  # as they are given: both sides' first, both sides' second
        before = of_tendons(tendons.state, AXES)[np.argsort(axes_before)][axes]
        path = np.append(plant.length - self._model.taut(plant, coordinates), np.abs(coordinates).sum())
        state = unmoved(spools.reeled[axes], path, np.zeros(AXES), coordinates)
        turned = of_tendons(state, AXES)
        turned[:, :X] = before[:, :X]
        turned[:, PLAY] += turned[:, X] - before[:, X]  # they pull as before
        inner = inner_of([self._own], coordinates[None], np.array([bristle]), lambda rows: rows[0])
        self._hanging = self._hanging._replace(axes=axes, tendons=tendons._replace(state=state, inner=inner))

    def _weigh(self) -> WristParameters:
        plane = self.plane or "ulnar"
        other = "flexion" if plane == "ulnar" else "ulnar"
        own, beside = (plant_of(*facing(self._wrist, self._laden(), seen)) for seen in (plane, other))
        away = away_of(plane, self._positive)
        self._away = away[-1]
        self._hanging = self._hanging._replace(
            values=self._model.values(own, self._segments), across=across_of(beside, away)
        )
        return own


def _wound(wrist: WristParameters) -> WristParameters:
    """The wrist with the tendons alone that the axes wind, in their order. UserError where there are more of them."""
    if wound_by(wrist, AXES) is None:
        return wrist.model_copy(update={"tendons": "four"})
    if isinstance(wrist.tendons, str):
        return wrist
    return wrist.model_copy(update={"tendons": tuple(place for place in wrist.tendons if place.radius != 0.0)})
