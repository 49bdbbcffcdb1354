"""Where the motors of a robot of one's own are believed to be: by what was sent, and by what they say themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import settings_of
from wristctl.arrays import Array
from wristctl.rig import Clock, Drive, Facts, Limits, Look, Reeled, Sensor, Tendon, VirtualClock
from wristctl.trial.guarded_rig import GuardedRig, RigStop
from wristctl.trial.rig_drive import RigDrive

DELAY, LAG, PERIOD, STEP = 3e-3, 16e-3, settings_of().control_period, settings_of().actuator.step_length


class SlowMotors:
    """Two motors [mm] that follow with a lag, no faster than `fastest` [mm/s], and are where they are `age` s later."""

    def __init__(self, fastest: float = np.inf, age: float | None = 0.0, off: float = 0.0, lag: float = LAG) -> None:
        self.facts = Facts(
            planes=1,
            tendons=[Tendon(0.0, 0.02), Tendon(180.0, 0.02)],
            limits=Limits(0.02, 0.1, 40.0),
            sensor=Sensor(50.0),
            drive=Drive(delay=DELAY, lag=LAG),
            unit="mm",
            metres_per_unit=1e-3,
        )
        self.clock: Clock = VirtualClock(self._advance, 1e-4)
        self._fastest, self._age, self._off, self._lag = fastest, age, off, lag
        self.at, self.past = np.array([5.0, -3.0]), [(0.0, np.array([5.0, -3.0]))]
        self._coming = [(0.0, self.at)]

    def _advance(self, begin: float, end: float) -> None:
        wanted = next(target for time, target in reversed(self._coming) if time <= begin + 1e-9) + self._off
        step = (wanted - self.at) * -np.expm1(-(end - begin) / self._lag)
        self.at = self.at + np.clip(step, -self._fastest * (end - begin), self._fastest * (end - begin))
        self.past.append((end, self.at))

    def connect(self) -> Array:
        return self.at

    def send(self, targets: Array) -> Array:
        self._coming.append((self.clock.now() + DELAY, targets.copy()))
        return targets

    def look(self) -> Look:
        if self._age is None:
            return Look([0.0], self.clock.now())
        due = max(0.0, self.clock.now() - self._age)
        time, at = min(self.past, key=lambda each: abs(each[0] - due))
        return Look([0.0], self.clock.now(), None, Reeled(at, time))

    def stop(self) -> None:
        """They stand."""

    def close(self) -> None:
        """Nothing is open."""


def moved(rig: Any, speed: float, ticks: int = 60) -> tuple[RigDrive, Array]:
    """Lead the motors to targets that move so fast [mm/s], then stand; how far off the truth reeled() was (T,) [mm]."""
    guarded = GuardedRig(rig, "my_rig.py:RIG")
    zero = guarded.connect()
    drive, errors = RigDrive(guarded, settings_of(), zero), []
    drive.begin()
    rate = np.array([speed, -speed]) * 1e-3 / STEP
    for tick in range(1, ticks):
        guarded.look()
        errors.append(drive.reeled() * STEP * 1e3 - (rig.at - zero))
        if tick < ticks // 2:
            drive.lead(rate * tick * PERIOD, rate)
        else:
            drive.stand()
        drive.go_on(1)
        rig.clock.wait_until(tick * PERIOD)
    return drive, np.array(errors)


@pytest.mark.parametrize("age", [0.0, 7e-3, 23e-3])
def test_motors_that_are_slower_than_believed_are_where_they_say(age: float) -> None:
    _, blind = moved(SlowMotors(fastest=20.0, age=None), 50.0)
    _, told = moved(SlowMotors(fastest=20.0, age=age), 50.0)
    # What they say is `age` old and at most a tick; meanwhile they are believed to go as fast as their targets.
    assert np.abs(blind).max() > 5.0
    assert np.abs(told).max() < (age + PERIOD) * 50.0


@pytest.mark.parametrize("age", [0.0, 4e-3, 23e-3])
@pytest.mark.parametrize("speed", [-40.0, 25.0])
def test_motors_that_follow_as_believed_are_told_alike_by_both(age: float, speed: float) -> None:
    _, blind = moved(SlowMotors(age=None), speed)
    _, told = moved(SlowMotors(age=age), speed)
    assert np.abs(blind).max() < 0.06 * abs(speed) * LAG, "as reckoned"
    assert np.abs(told - blind).max() < 0.1 * abs(speed) * LAG


def test_motors_that_stand_off_their_targets_by_friction_do_stand() -> None:
    drive, errors = moved(SlowMotors(off=0.05), 30.0)
    assert errors[-1] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert (drive.reeled() * STEP * 1e3 - (drive.targets - [5.0, -3.0])) == pytest.approx([0.05, 0.05], abs=1e-3)
    assert not drive.moving


def test_a_drive_goes_on_from_where_homing_has_left_its_motors() -> None:
    guarded = GuardedRig(SlowMotors(age=None), "my_rig.py:RIG")
    drive = RigDrive(guarded, settings_of(), guarded.connect())
    drive.jog([100, -40])
    drive.begin()
    assert drive.reeled() == pytest.approx([100.0, -40.0]) and not drive.moving and not drive.sent.any()
    drive.lead(np.array([110.0, -60.0]), np.zeros(2))
    assert drive.sent == pytest.approx([10.0 / PERIOD, -20.0 / PERIOD]) and drive.moving
    assert drive.targets == pytest.approx([5.0 + 1.1e5 * STEP, -3.0 - 6e4 * STEP])
    drive.home()
    drive.begin()
    assert drive.reeled() == pytest.approx([0.0, 0.0]) and drive.targets[0] == pytest.approx(5.0 + 1.1e5 * STEP)


class Says(SlowMotors):
    """It looks as a test says."""

    def __init__(self, looked: Any) -> None:
        super().__init__()
        self._looked = looked

    def look(self) -> Any:
        return self._looked


@pytest.mark.parametrize(
    "reeled", [Reeled([1.0], 0.0), Reeled([1.0, np.nan], 0.0), Reeled([1.0, 2.0], np.nan), 3.0, (1.0,)]
)
def test_motors_that_are_nowhere_stop_the_trial(reeled: Any) -> None:
    with pytest.raises(RigStop, match=r"look\(\)"):
        GuardedRig(Says(Look([0.0], 0.0, None, reeled)), "my_rig.py:RIG").look()


def test_a_look_says_of_tension_and_motors_what_it_has() -> None:
    for looked in (([0.1], 0.0), ([0.1], 0.0, None)):
        guarded = GuardedRig(Says(looked), "my_rig.py:RIG")
        assert guarded.look().bend == pytest.approx([0.1]) and guarded.reeled is None
    guarded = GuardedRig(Says(([0.1], 0.0, [3.0, 4.0], ([1.0, 2.0], 0.5))), "my_rig.py:RIG")
    guarded.look()
    assert guarded.reeled is not None and guarded.tension is not None
    assert guarded.reeled[0] == pytest.approx([1.0, 2.0]) and guarded.reeled[1] == 0.5
    assert guarded.tension == pytest.approx([3.0, 4.0])
