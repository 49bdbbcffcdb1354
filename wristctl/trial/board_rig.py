"""The motor board with its cameras, real or emulated, as a rig: targets are microsteps of its axes.

Trials of the board do not go by it: `BoardDrive` leads the axes by step rates, which follow a motion more closely than
targets that each end at rest. `--rig bench` does, so that what holds of any rig is tried on physics and pictures too.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.board_errors import BoardError, Faulted, NoAnswer, PortLost
from wristctl.board.board_errors import Refused as BoardRefused
from wristctl.board.driver import Board
from wristctl.board.messages import AXES, TOTAL_RATE, Target
from wristctl.board.messages import Fault as BoardFault
from wristctl.board.transport import Transport
from wristctl.config.bench import BenchSettings
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.rig import Drive, Facts, Fault, Limits, Look, Lost, Refused, Sensor, Tendon
from wristctl.simulation.spool_timing import timing_of
from wristctl.trial.motors_ready import halt, prepare
from wristctl.trial.rig_belief import pull_directions
from wristctl.trial.supervised_wait import Patience, medians
from wristctl.trial.testbeds import EmulatedTestbed, Testbed
from wristctl.trial.tracking import Tracking, bend_of
from wristctl.vision.view import View

# Seconds by which axes that go from target to target and rest at each are behind them.
_RAMPS = 4e-3


def facts_of(settings: HwRunSettings, wrist: WristParameters) -> Facts:
    """Facts of a board with four axes, by its settings."""
    motors, sensor, safety = settings.actuator, settings.sensor, settings.safety
    directions = np.rad2deg(pull_directions()) % 360.0
    return Facts(
        planes=settings.planes,
        tendons=[Tendon(angle, wrist.tendon_radius) for angle in directions.tolist()],
        unit="steps",
        metres_per_unit=motors.step_length,
        limits=Limits(safety.travel, motors.step_rate * motors.step_length, safety.motor_pull),
        drive=Drive(
            delay=timing_of(motors).delay, lag=_RAMPS, resolution=motors.step_length, stiffness=motors.tendon_stiffness
        ),
        sensor=Sensor(sensor.frame_rate, sensor.delay_frames / sensor.frame_rate, sensor.noise_deg),
        silence=safety.watchdog,
    )  # fmt: skip


class _Clock:
    """The transport's clock."""

    virtual = True

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def now(self) -> float:
        return self._transport.now()

    def wait_until(self, moment: float) -> None:
        if (ahead := moment - self._transport.now()) > 0.0:
            self._transport.wait(ahead)


class BoardRig:
    """A board behind a testbed's transport in virtual time, and the testbed's cameras.

    Raises the errors of a rig, and CameraError.
    """

    def __init__(self, testbed: Testbed, settings: HwRunSettings, wrist: WristParameters) -> None:
        self.facts = facts_of(settings, wrist)
        self.clock = _Clock(testbed.transport)
        self._testbed, self._settings, self._board = testbed, settings, Board(testbed.transport)
        self._seen: list[list[tuple[float, float]]] = [[] for _ in range(settings.planes)]
        self._news = [-math.inf] * settings.planes
        self._look: Look | None = None
        self._tracking: Tracking | None = None

    def connect(self) -> Array:
        """Switch the drives on where the axes stand; the cameras are set square to the wrist at rest."""
        with _as_of_a_rig():
            self._board.connect()
            self._tracking = self._testbed.tracking()
            patience, homing = Patience(self._board), self._settings.homing
            patience.stand_square(self._tracking, homing)
            seen = patience.sightings(self._tracking, 4 * homing.frames)
            if self._settings.planes == 2:  # what one camera sees of a bend depends on the other
                self._tracking.zero = medians(seen, 2)
            prepare(self._board, self._settings)
            self._board.home()
        return np.zeros(AXES)

    def send(self, targets: Array) -> Array:
        """Go to these positions [steps], at the board's ramps."""
        furthest = self.facts.limits.travel / self.facts.metres_per_unit
        if not (np.abs(targets) <= furthest).all():
            raise Refused(f"targets {targets} beyond +-{furthest:.0f} steps")
        one, two, four, five = (int(target) for target in np.rint(targets))
        rate = TOTAL_RATE // AXES
        with _as_of_a_rig():
            self._board.send(Target((one, two, four, five), (rate, rate, rate, rate)))
        return np.rint(targets)

    def look(self) -> Look:
        """The bend of each plane when the older of the cameras' newest usable pictures was taken.

        It is news once every camera has a picture that is. The bend of the newer one is taken between its last two.
        """
        assert self._tracking is not None
        for sighting in self._tracking.look():
            if math.isfinite(sighting.theta):
                newest = np.array([seen[-1][1] if seen else 0.0 for seen in self._seen])
                bend = bend_of(self._tracking, sighting, newest)
                self._seen[sighting.plane] = [*self._seen[sighting.plane][-1:], (sighting.time, bend)]
        newest_times = [seen[-1][0] if seen else -math.inf for seen in self._seen]
        time = min(newest_times)
        is_news = all(new > old for new, old in zip(newest_times, self._news, strict=True))
        if is_news and all(seen[0][0] <= time for seen in self._seen):
            bends = [float(np.interp(time, [at for at, _ in seen], [bend for _, bend in seen])) for seen in self._seen]
            self._look, self._news = Look(np.array(bends), time), newest_times
        return self._look or Look(np.full(len(self._seen), np.nan), self.clock.now())

    def stop(self) -> None:
        """Stop the axes, by a ramp or at once. Raises Lost where they cannot be seen to stand."""
        halted = halt(self._board, self._settings.safety.watchdog)
        if not halted.verified:
            raise Lost(halted.how)

    def close(self) -> None:
        """Release the drives, and give board and cameras back."""
        try:
            self._board.close()
        finally:
            self._testbed.close()


@contextmanager
def _as_of_a_rig() -> Iterator[None]:
    """Within the block the board's errors are those of a rig."""
    try:
        yield
    except (NoAnswer, PortLost) as error:
        raise Lost(str(error.what)) from error
    except BoardRefused as error:
        raise Refused(str(error.what)) from error
    except Faulted as error:
        names = "+".join(fault.name or "" for fault in BoardFault if fault in error.faults)
        raise Fault(names or "stopped") from error
    except BoardError as error:
        raise Fault(str(error.what)) from error


class BenchRig(BoardRig):
    """The emulated bench in two planes and in virtual time, as it comes: `hw-run --rig bench`."""

    facts = facts_of(HwRunSettings(planes=2), WristParameters())

    def __init__(self) -> None:
        settings, wrist = HwRunSettings(planes=2), WristParameters()
        bench = VirtualBench(BenchSettings(), wrist, 0, settings.markers, settings.markers_2)
        super().__init__(EmulatedTestbed(bench, settings, (View(), View()), None), settings, wrist)
