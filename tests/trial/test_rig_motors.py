"""A rig's motors as homing moves them, and tendons at any places as homing expects them."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.arrays import Array
from wristctl.rig import Clock, Drive, Facts, Limits, Look, Sensor, Tendon, VirtualClock
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.rig_drive import RigTracking
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.rig_settings import wrist_of
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.trials import Trial
from wristctl.wrist.directions import OPPOSITE_AXES
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace


class Rig:
    """Two tendons in millimetres, which follow at once; the bend is what a test says."""

    def __init__(self, bend: float = 0.0, tension: float = 0.0, silence: float | None = None) -> None:
        self.facts = Facts(
            planes=1,
            tendons=[Tendon(0.0, 0.02), Tendon(180.0, 0.02)],
            limits=Limits(0.02, 0.1, 40.0),
            sensor=Sensor(50.0),
            drive=Drive(delay=0.01, lag=0.004),
            unit="mm",
            metres_per_unit=1e-3,
            silence=silence,
        )
        self.clock: Clock = VirtualClock(lambda begin, end: None)
        self.bend, self.tension = bend, tension
        self.sent: list[tuple[float, Array]] = []

    def connect(self) -> Array:
        return np.array([5.0, -3.0])

    def send(self, targets: Array) -> Array:
        self.sent.append((self.clock.now(), targets.copy()))
        return targets

    def look(self) -> Look:
        return Look([self.bend], math.floor(50.0 * self.clock.now()) / 50.0, [self.tension, 0.0])

    def stop(self) -> None:
        """It stands."""

    def close(self) -> None:
        """Nothing is open."""


def motors_of(rig: Rig) -> tuple[RigMotors, GuardedRig]:
    guarded = GuardedRig(rig, "my_rig.py:RIG")
    return RigMotors(guarded, settings_of(), guarded.connect()), guarded


STEP = settings_of().actuator.step_length


def test_steps_are_targets_in_the_rigs_unit_slowly_and_counted_from_where_home_was() -> None:
    rig = Rig()
    motors, _ = motors_of(rig)
    motors.jog([100, -40])
    times, targets = np.array([time for time, _ in rig.sent]), np.array([each for _, each in rig.sent])
    assert targets[-1] == pytest.approx([5.0 + 1e5 * STEP, -3.0 - 4e4 * STEP])
    assert (np.abs(np.diff(targets, axis=0)).max(axis=1) <= 1e-9 + 1e3 * 5e-3 * np.maximum(np.diff(times), 0.02)).all()
    assert rig.clock.now() >= 100 * STEP / 5e-3 + 0.01 + 5 * 0.004, "they have arrived"
    assert list(motors.read().position) == [100, -40]
    motors.home()
    assert list(motors.read().position) == [0, 0] and motors.targets == pytest.approx(targets[-1])
    motors.go_to([0, -20], 1)
    assert motors.targets - targets[-1] == pytest.approx([0.0, -2e4 * STEP])
    motors.left_at(targets[-1])
    assert list(motors.read().position) == [0, 0]


@pytest.mark.parametrize("silence", [0.02, 0.2, None])
def test_a_rig_that_stops_in_silence_hears_its_targets_while_it_is_waited_for(silence: float | None) -> None:
    rig = Rig(silence=silence)
    motors, _ = motors_of(rig)
    Patience(motors).wait(0.5)
    times = np.array([0.0, *(time for time, _ in rig.sent), rig.clock.now()])
    assert np.diff(times).max() <= 0.25 * (silence or 0.08) + 1e-9
    assert all(targets == pytest.approx([5.0, -3.0]) for _, targets in rig.sent)
    motors.jog([400, -40])
    assert np.diff([time for time, _ in rig.sent]).max() <= 0.25 * (silence or 0.08) + 1e-9, "while it moves too"
    assert motors.targets == pytest.approx([5.0 + 4e5 * STEP, -3.0 - 4e4 * STEP])


def test_a_reading_is_of_the_rigs_looks_and_in_its_words_where_there_is_none() -> None:
    rig = Rig(bend=0.2)
    motors, guarded = motors_of(rig)
    tracking = RigTracking(guarded)
    reading = Patience(motors).reading(tracking, 3)
    assert reading.theta == pytest.approx(0.2) and math.isnan(reading.size)
    tracking.zero = (0.15,)
    assert Patience(motors).reading(tracking, 3).theta == pytest.approx(0.05)
    rig.bend = math.nan
    with pytest.raises(SafetyStop, match=r"the bend could not be read \(look\(\) gives no number\)") as stop:
        Patience(motors).reading(tracking, 3)
    assert "check-rig" in str(stop.value.fix) and "marker" not in str(stop.value)
    rig.bend, rig.tension = 0.0, 41.0
    with pytest.raises(SafetyStop, match="tendon 1 pulls 41 N, beyond 40 N"):
        Patience(motors).reading(tracking, 3)


def expected(*degrees: float, planes: int = 2, radius: float = 0.02) -> ExpectedMoves:
    layout = TendonLayout(tuple(TendonPlace(math.radians(angle), radius) for angle in degrees))
    settings: Any = settings_of(planes=planes).model_copy(update={"rig": "mine.py:RIG"})
    return ExpectedMoves(settings, WRIST, "ulnar" if planes == 1 else "", layout)


def test_opposite_tendons_are_measured_one_after_the_other_and_others_alone() -> None:
    assert expected(225.0, 135.0, 315.0, 45.0).turns == OPPOSITE_AXES
    assert expected(0.0, 180.0, planes=1).turns == ((0, 1),)
    three = expected(0.0, 120.0, 240.0)
    assert sorted(axis for turn in three.turns for axis in turn) == [0, 1, 2]
    assert all(three.against(axis) != axis for axis in range(3))
    five = expected(0.0, 72.0, 144.0, 216.0, 288.0)
    assert sorted(axis for turn in five.turns for axis in turn) == [0, 1, 2, 3, 4]
    assert five.against(0) in (2, 3)


@pytest.mark.parametrize("planes", [1, 2])
def test_the_boards_tendons_by_their_places_are_expected_as_the_boards(planes: int) -> None:
    """Before two cameras; one sees the bend across by the marker's size too, a rig's own sensor does not."""
    settings: Any = settings_of(planes=planes)
    plane = "ulnar" if planes == 1 else ""
    board = ExpectedMoves(settings, WRIST, plane)
    placed = expected(225.0, 135.0, 315.0, 45.0, planes=planes, radius=WRIST.tendon_radius)
    assert placed.plus.tolist() == board.plus.tolist() and placed.lever == pytest.approx(board.lever)
    for axis in range(4):
        assert placed.toward(axis) == pytest.approx(board.toward(axis))
        for stiffness in (None, 5e3):
            assert placed.steps(stiffness, axis=axis) == pytest.approx(board.steps(stiffness, axis=axis), rel=1e-6)


@pytest.mark.parametrize(("axis", "toward", "like"), [(0, 0.0, None), (0, 120.0, 2), (2, 0.0, 1), (1, 245.0, 3)])
def test_a_rigs_target_that_bends_as_another_tendon_is_named_with_it(
    axis: int, toward: float, like: int | None
) -> None:
    three, bend = expected(0.0, 120.0, 240.0), 0.02 * np.exp(1j * math.radians(toward))
    moved = Bend(float(bend.real), float(bend.imag))
    if like is None:
        three.judge_side(axis, moved)
        return
    with pytest.raises(SafetyStop, match=rf"target {axis + 1} bends .* as tendon {like} would") as stop:
        three.judge_side(axis, moved)
    assert f"targets {axis + 1} and {like} exchanged" in str(stop.value.what) and "camera" not in str(stop.value)


def test_one_sensor_in_one_plane_tells_sides_of_any_number_of_tendons() -> None:
    """Tendons of one side are not told apart, and none is taken for another one."""
    three, unseen = expected(0.0, 120.0, 240.0, planes=1), math.nan
    for axis, side in ((0, 1.0), (1, -1.0), (2, -1.0)):
        three.judge_side(axis, Bend(side * 0.02, unseen))
        with pytest.raises(SafetyStop, match="to the other side than"):
            three.judge_side(axis, Bend(-side * 0.02, unseen))


class Scattering(Rig):
    """Its bend is so many degrees to one side, and in the next look to the other."""

    def __init__(self, scatter_deg: float) -> None:
        super().__init__()
        self._scatter = math.radians(scatter_deg)

    def look(self) -> Look:
        frame = math.floor(50.0 * self.clock.now() + 1e-6)
        return Look([self._scatter * (-1) ** frame], frame / 50.0)


@pytest.mark.parametrize(("scatter_deg", "refused"), [(0.19, False), (0.21, True)])
def test_a_sensor_that_scatters_is_refused_where_a_reading_errs_by_two_fifths_of_a_bend(
    scatter_deg: float, refused: bool
) -> None:
    """Readings are of one look here, and 0.5 deg is a bend."""
    guarded = GuardedRig(rig := Scattering(scatter_deg), "my_rig.py:RIG")
    settings: Any = settings_of(planes=1).model_copy(update={"rig": "my_rig.py:RIG"})
    assert (settings.homing.frames, settings.homing.bend_deg) == (1, 0.5)
    stand, log = RigStand(guarded), cast(Any, None)
    stand.open(settings, wrist_of(rig.facts, WRIST, "my_rig.py:RIG"), log)
    assert not rig.sent, "nothing is told to a rig that is not connected"
    with pytest.raises(SafetyStop) as stop:
        stand.ready(Trial(0, "ulnar", 0, 0.0, 0), None)
    assert ("unsteadily" in str(stop.value)) is refused
    stood = bool(np.ptp([targets for _, targets in rig.sent], axis=0).max() == 0.0)
    assert stood is refused, "nothing is moved by what cannot be seen"
