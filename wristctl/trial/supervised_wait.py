"""Waiting beside a wrist at rest: nothing moves meanwhile, and what goes wrong ends the wait at once."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.driver import Board, Cells
from wristctl.board.messages import AXES, State, Status
from wristctl.config.hw_run import Homing
from wristctl.trial.camera_pace import CameraPaces
from wristctl.trial.resting import judge_turn
from wristctl.trial.rig_belief import RigBelief
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tracking import Tracking, bend_of
from wristctl.trial.watch import Watch
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.marker import Sighting

# What to do about an oblique camera, by the plane that it looks at.
OBLIQUE_FIX = tuple(
    f"set the camera square, or calibrate it: wristctl hw calibrate camera, then {option}"
    for option in ("--optics", "--optics-2")
)

# A moment of waiting: comes back soon, to be called again, and raises what ends the wait.
Meanwhile = Callable[[], None]

# Seconds between two looks at a board that waits, and signs of life to it.
_PULSE = 0.02
# Seconds between two looks at a wrist that stands.
_LOOK = 0.05
# Seconds within which the marker must be read.
_READING = 2.0


class WoundAxes:
    """The first so many axes of a board as motors: those that wind a tendon. The others stand."""

    def __init__(self, board: Board, count: int) -> None:
        self._board, self._count, self.transport = board, count, board.transport
        self.ping, self.faulted, self.see_restart, self.home = board.ping, board.faulted, board.see_restart, board.home

    @property
    def cells(self) -> Cells | None:
        """As the board has them."""
        return self._board.cells

    def read(self) -> Any:
        """The board's status, with the positions of these axes."""
        return self._of_these(self._board.read())

    def jog(self, positions: Sequence[int]) -> Any:
        """As `Board.jog`, of these axes."""
        return self._of_these(self._board.jog(self._all(positions)))

    def go_to(self, positions: Sequence[int], rate: int) -> Any:
        """As `Board.go_to`, of these axes."""
        return self._of_these(self._board.go_to(self._all(positions), rate))

    def _of_these(self, status: Any) -> Any:
        return status._replace(position=status.position[: self._count])

    def _all(self, positions: Sequence[int]) -> list[int]:
        return [*positions, *[0] * (AXES - self._count)]


Motors = Board | WoundAxes | RigMotors
"""Motors that homing moves step by step: a board's, or a rig's."""


class Reading(NamedTuple):
    """The marker of a wrist that stands."""

    theta: float
    """Angle of the marker [rad]."""
    size: float
    """Over the base's; nan where it is not measured."""
    beside: float = math.nan
    """Bend in the second plane [rad], of a rig with two cameras; `theta` is then that in the first."""


def medians(sightings: Sequence[Sighting], cameras: int) -> tuple[float, ...]:
    """Median marker angle [rad] of each camera's usable sightings."""
    return tuple(float(np.median([s.theta for s in sightings if s.plane == plane])) for plane in range(cameras))


class Patience:
    """Waits beside a board that is to stay as it stands when this is made: its link is kept alive, its status judged.

    Whoever waits hears of a fault, a restart or a step within 0.1 s: Faulted, Restarted, NoAnswer, PortLost or
    SafetyStop. `judge` is shown every status too, and may raise.
    """

    def __init__(self, board: Motors, judge: Callable[[Status], None] = lambda status: None) -> None:
        self._board, self._judge = board, judge
        self._stood = board.read()
        self.pace = CameraPaces()
        """Pace of the pictures looked at here, by camera."""

    def pulse(self, longest: float = _PULSE) -> None:
        """Wait for a moment of at most `longest` seconds: the `Meanwhile` of whoever asks a person."""
        status = self._board.read()
        self._see(status)
        if self._board.cells is not None:
            self._board.cells.judge()
        self._judge(status)
        self._board.ping()
        self._board.transport.wait(min(longest, _PULSE))

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        end = self._board.transport.now() + seconds
        while (left := end - self._board.transport.now()) > 0.0:
            self.pulse(left)

    def reading(self, tracking: Tracking, frames: int) -> Reading:
        """Medians of the next usable frames. Raises SafetyStop where none come."""
        usable = self.sightings(tracking, frames)
        if len(tracking.zero) == 1:
            theta, size = np.median([(sighting.theta, sighting.size) for sighting in usable], axis=0)
            return Reading(float(theta), float(size))
        planes = [[sighting for sighting in usable if sighting.plane == plane] for plane in range(2)]
        seen = [float(np.median([sighting.theta for sighting in sightings])) for sightings in planes]
        bends = [
            float(np.median([tracking.bend(sighting, seen[1 - plane]) for sighting in sightings]))
            for plane, sightings in enumerate(planes)
        ]
        if not all(map(math.isfinite, bends)):
            raise SafetyStop("what the cameras see is no bend of the wrist", fix="see both cameras and their markers")
        return Reading(bends[0], math.nan, bends[1])

    def markers(self, tracking: Tracking, frames: int) -> tuple[float, ...]:
        """Median marker angle [rad] of each camera's next usable frames, as it is seen. Raises SafetyStop."""
        return medians(self.sightings(tracking, frames), len(tracking.zero))

    def sightings(self, tracking: Tracking, frames: int) -> list[Sighting]:
        """The next usable frames, so many of each camera at least. Raises SafetyStop where none come."""
        usable: list[Sighting] = []
        counts, pace = [0] * len(tracking.zero), tracking.pace or self.pace
        longest = _READING + frames * tracking.apart
        pace.expect(len(counts))
        tracking.look()
        began = self._board.transport.now()
        while min(counts) < frames:
            self.pulse()
            for sighting in tracking.look():
                pace.add(sighting)
                if sighting.time >= began and math.isfinite(sighting.theta):
                    usable.append(sighting)
                    counts[sighting.plane] += 1
            if self._board.transport.now() - began > longest:
                why, fix = pace.missing(self._board.transport.now(), longest)
                what = "the marker's angle" if tracking.pace is None else "the bend"
                raise SafetyStop(f"{what} could not be read ({why})", "homing", fix)
        return usable

    def stand_square(self, tracking: Tracking, homing: Homing) -> tuple[CameraPose | None, ...]:
        """Fit each camera's pose to a wrist at rest; None for a calibrated camera.

        Raises SafetyStop where one is too oblique for that, a marker is turned, or where no markers can be read.
        """
        usable, poses = self.sightings(tracking, 4 * homing.frames), list[CameraPose | None]()
        for plane in range(len(tracking.zero)):
            own = [sighting for sighting in usable if sighting.plane == plane]
            judge_turn(
                [sighting.theta for sighting in own], f" of camera {plane + 1}" if len(tracking.zero) > 1 else ""
            )
            poses.append(pose := tracking.stand_square(own))
            if pose is not None and pose.oblique > math.radians(homing.oblique_deg):
                which = "the camera" if len(tracking.zero) == 1 else f"camera {plane + 1}"
                problem = (
                    f"{which} looks {math.degrees(pose.oblique):.0f} deg off square at the bending plane, beyond "
                    f"{homing.oblique_deg:g} deg"
                )
                raise SafetyStop(problem, "homing", OBLIQUE_FIX[plane])
        return tuple(poses)

    def _see(self, status: Status) -> None:
        stood = self._stood
        if status.state != stood.state:
            if status.state == State.FAULT:
                raise self._board.faulted(status)
            self._board.see_restart()
            raise SafetyStop(f"the board is {status.state.name}, not {stood.state.name}", fix="home again")
        if status.state == State.ENABLED and status.position != stood.position:
            steps = [now - before for now, before in zip(status.position, stood.position, strict=True)]
            problem = f"the motors moved by {steps} steps while they were to stand"
            raise SafetyStop(problem, fix="report it, with the log: this is a bug")


class InSight:
    """Judges a standing wrist by its marker, for as long as that is seen without a gap.

    After a gap a hand has covered the marker, or moved it: until it is read anew, what it shows is no evidence.
    """

    def __init__(
        self, tracking: Tracking, watch: Watch, stale: float, belief: RigBelief, now: Callable[[], float], signs: Array
    ) -> None:
        self._tracking, self._watch, self._stale = tracking, watch, stale
        self._belief, self._now, self._signs = belief, now, signs
        self._seen = self._looked = now()
        self._bend = np.zeros(len(belief.planes))

    def __call__(self, status: Status) -> None:
        """Raises SafetyStop where the wrist is bent, or its tendons are pulled, beyond the limits."""
        now = self._now()
        if now - self._looked < _LOOK:
            return
        self._looked, looked = now, self._tracking.look()
        if now - self._seen > self._stale:
            return
        reeled = self._signs * np.array(status.position, float)
        for sighting in looked:
            if math.isfinite(sighting.theta):
                self._seen = sighting.time
                self._bend[sighting.plane] = bend_of(self._tracking, sighting, self._bend)
                self._watch.standing(self._bend, reeled, self._belief.taut(self._bend)[0], now)
