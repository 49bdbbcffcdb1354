"""Homing on tendons that are just lines: what it finds is what they are, and what it does is small and undone."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import FrozenInstanceError
from functools import partial
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trial.conftest import WRIST, settings_of
from tests.trial.rig import Marker, RigBoard
from wristctl.board.messages import JOG_RATE, Status
from wristctl.config.hw_run import Homing
from wristctl.config.plant import Actuator
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.homing import Zero, find_zero, slacken
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.zero_checks import HomedWrist
from wristctl.wrist.directions import ACTIVE, away_of

SPOOLS = spools_of(Actuator(level="tendon"))
SLACK, PER_RADIAN = np.array([31, 52, 17, 44]), np.array([1900.0, 2000.0, 2100.0, 1950.0])
"""Steps reeled in until taut, and then for one radian."""
START, GLUED = np.array([5, -6, 7, -8]), 0.07


class Wrist:
    """Bends linearly with what is reeled in beyond the taut point; `signs` say how motors are wired."""

    def __init__(self, signs: tuple[int, ...] = (1, 1, 1, 1), plane: str = "ulnar", **changes: Any) -> None:
        self.board, self.signs, self.plane = RigBoard(START.tolist()), np.array(signs), plane
        self.sides = np.where(on_plus_side(plane), 1.0, -1.0)
        self.gain = 1.0 / PER_RADIAN
        self.bends: list[float] = []
        for name, value in changes.items():
            setattr(self, name, value)
        self.tracking: Any = Marker(self.board, self.angle)

    def angle(self) -> float:
        taut = np.maximum(0.0, self.signs * (self.board.position - START) - SLACK)
        bend = float((self.sides * taut * self.gain).sum())
        self.bends.append(bend)
        return GLUED + bend

    def homed(self, known: tuple[int, ...] | None = None, **settings: Any) -> Zero:
        board: Any = self.board
        homing = {"frames": 1, "rest": 0.0, **settings}
        return find_zero(board, self.tracking, settings_of(homing=homing), WRIST, self.plane, known)


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (-1, 1, -1, -1)], ids=str)
def test_taut_points_steps_per_radian_senses_and_the_glued_on_angle_are_found(
    plane: str, signs: tuple[int, ...]
) -> None:
    wrist = Wrist(signs, plane)
    zero = wrist.homed()
    assert zero.signs == signs
    assert zero.slack == pytest.approx(SLACK * SPOOLS.step, abs=1e-9)
    assert zero.steps_per_radian == pytest.approx(PER_RADIAN, rel=1e-9)
    assert zero.markers[0] == pytest.approx(GLUED)
    assert zero.friction == pytest.approx([0.0] * 4, abs=1e-9)
    assert zero.plain() == {
        "signs": zero.signs, "steps_per_radian": zero.steps_per_radian, "marker": zero.markers[0], "slack": zero.slack,
        "friction": zero.friction,
    }  # fmt: skip
    with pytest.raises(FrozenInstanceError):
        zero.markers = ()  # type: ignore[misc]
    assert wrist.board.told[-1] == ("home", (0, 0, 0, 0))
    assert wrist.board.position == pytest.approx(START + signs * SLACK), "every tendon just taut is zero"


def test_known_senses_are_not_tried_the_other_way_round() -> None:
    assert Wrist((1, -1, 1, 1)).homed((1, -1, 1, 1)).signs == (1, -1, 1, 1)
    with pytest.raises(
        SafetyStop, match=r"axis 1 \(tendon 2\) does not bend the wrist within 2 mm.*hw-run.calibration"
    ):
        Wrist((1, -1, 1, 1)).homed((1, 1, 1, 1))


def test_the_wrist_is_never_bent_much_and_one_tendon_moves_at_a_time() -> None:
    wrist = Wrist()
    wrist.homed()
    assert np.abs(np.degrees(wrist.bends)).max() < 5.0
    jogs = np.array([where for what, where in wrist.board.told[:-1] if what == "jog"])
    changed = (np.diff(jogs, axis=0) != 0).sum(axis=1)
    slackened = np.flatnonzero(changed > 1)
    assert len(slackened) == 2, "all let go at once before they are measured, and all are taken up at the end"
    pull = round(Homing().pull / SPOOLS.step)
    assert (jogs[slackened[0] + 1] == START - 2 * pull).all()
    assert (jogs - START).min() == -2 * pull


def test_moves_are_as_small_as_the_settings_say() -> None:
    wrist = Wrist()
    wrist.homed()
    jogs = np.array([where for what, where in wrist.board.told[:-1] if what == "jog"])
    move = round(Homing().move / SPOOLS.step)
    looked = jogs[: np.flatnonzero(jogs[:, 0] == START[0])[0], 0] - START[0]
    assert looked.tolist() == [2 * move * (k + 1) for k in range(len(looked))]
    assert looked[-2] < SLACK[0] + 10 < looked[-1] + 10, "it stops at the first bend"


def test_a_wrist_that_straightens_at_once_is_not_waited_for() -> None:
    """Each of eight letting goes may take `let_go` at most."""
    quick, patient = Wrist(), Wrist()
    quick.homed(let_go=1.0)
    patient.homed(let_go=100.0)
    assert patient.board.transport.now() == quick.board.transport.now()


def test_slack_within_the_longest_is_found_and_beyond_it_is_not() -> None:
    longest = (SLACK.max() + 30) * SPOOLS.step
    assert Wrist().homed(slack=longest).signs == (1, 1, 1, 1)
    with pytest.raises(SafetyStop, match=r"axis 1 \(tendon 2\)"):
        Wrist().homed(slack=0.8 * SLACK.max() * SPOOLS.step)


def test_a_tendon_on_the_other_side_than_it_should_be_stops_homing() -> None:
    wrist = Wrist()
    wrist.sides = np.array([-1.0, 1.0, 1.0, 1.0])
    with pytest.raises(SafetyStop, match="axis 1 bends the wrist to the other side than tendon 2 should"):
        wrist.homed()


def test_a_bend_beyond_ten_degrees_stops_homing_with_that_tendon_slack() -> None:
    wrist = Wrist(gain=1.0 / np.array([900.0, 20.0, 900.0, 900.0]))
    with pytest.raises(SafetyStop, match=r"axis 1 bent the wrist by \d\d\.\d deg while homing"):
        wrist.homed()
    assert wrist.board.position[1] < START[1]


def test_a_bend_of_just_under_ten_degrees_does_not() -> None:
    """One move beyond the taut point bends that far."""
    pull = Homing().pull / SPOOLS.step + 2 * Homing().move / SPOOLS.step
    steepest = math.radians(9.0) / (pull + 1)
    assert Wrist(gain=np.full(4, steepest)).homed(steps_tolerance=1.0).steps_per_radian == pytest.approx(
        [1.0 / steepest] * 4
    )


def test_a_tendon_that_slips_while_it_is_measured_stops_homing() -> None:
    wrist = Wrist()
    bend = wrist.angle

    def slipping() -> float:
        measured = (np.abs(wrist.board.position - START) > 1).all()
        return GLUED if measured else bend()

    wrist.tracking = Marker(wrist.board, slipping)
    with pytest.raises(SafetyStop, match="tendon 1 pulls differently each time"):
        wrist.homed()


def test_doubtful_steps_are_measured_once_more_before_they_are_refused() -> None:
    """A tendon that gives by chance while it is measured first, and is well then; and one that is wrong both times."""
    wrist = Wrist()
    measured: list[int] = []

    def angle() -> float:
        reeled = int(wrist.signs[0] * (wrist.board.position[0] - START[0]) - SLACK[0])
        if measured and measured[-1] > 20 > reeled:
            measured.append(0)  # let go again
        elif reeled > 0:
            measured.append(reeled)
        first = 0 not in measured
        return Wrist.angle(wrist) * (0.5 if first and reeled > 20 else 1.0)

    wrist.tracking = Marker(wrist.board, angle)
    zero = wrist.homed()
    assert zero.steps_per_radian[0] == pytest.approx(PER_RADIAN[0], rel=0.01)


def test_slackened_tendons_are_paid_out_by_the_pull_each_in_its_sense() -> None:
    board: Any = RigBoard((1, 2, 3, 4))
    assert slacken(board, SPOOLS, Homing(pull=1e-3), (1, -1, 1, -1)) == (1, 2, 3, 4)
    steps = round(1e-3 / SPOOLS.step)
    assert board.told == [("go to", (-steps, steps, -steps, steps), JOG_RATE)]


class Slackened(RigBoard):
    """Goes where it is told."""

    def go_to(self, positions: Sequence[int], rate: int) -> Status:
        self.position[:] = positions
        return super().go_to(positions, rate)


@pytest.mark.parametrize(("short", "refused"), [(0, False), (20, False), (75, True), (120, True)])
def test_a_tendon_that_is_still_taut_where_all_are_slackened_is_found(short: int, refused: bool) -> None:
    """It lets the wrist move when all are let out by another 0.6 mm."""
    board: Any = Slackened()
    signs = (1, -1, 1, 1)
    wrist = Wrist(signs, board=board)

    def angle() -> float:
        reeled = wrist.signs * board.position + np.array([0, 0, short, 0])
        return GLUED + float((wrist.sides * np.maximum(0.0, reeled) / PER_RADIAN).sum())

    tracking: Any = Marker(board, angle)
    settings = settings_of(homing={"frames": 1, "rest": 0.0})
    zero = Zero(signs, tuple(PER_RADIAN), (GLUED,), (0.0,) * 4)
    slacken(board, SPOOLS, settings.homing, signs)
    if not refused:
        HomedWrist(board, tracking, settings, WRIST, "ulnar", zero).check_zero()
        return
    with pytest.raises(SafetyStop, match=r"a slackened wrist still moved by .* when it was slackened further"):
        HomedWrist(board, tracking, settings, WRIST, "ulnar", zero).check_zero()


def checked(plane: str, axis: int, true_steps: Callable[[float], float]) -> None:
    """Check the zero of a wrist of which one axis makes `true_steps` where it was told so many."""
    board: Any = Slackened()
    signs, sides = (1, -1, 1, -1), np.where(on_plus_side(plane), 1.0, -1.0)
    settings = settings_of(homing={"frames": 1, "rest": 0.0})
    per_radian = ExpectedMoves(settings, WRIST, plane).steps()

    def angle() -> float:
        reeled = np.array(signs) * board.position
        reeled[axis] = true_steps(reeled[axis])
        return GLUED + float((sides * np.maximum(0.0, reeled)).sum() / per_radian)

    zero, tracking = Zero(signs, (per_radian,) * 4, (GLUED,), (0.0,) * 4), Marker(board, angle)
    slacken(board, SPOOLS, settings.homing, signs)
    HomedWrist(board, cast(Any, tracking), settings, WRIST, plane, zero).check_zero()


@settings(max_examples=60, deadline=None)
@given(
    axis=st.integers(0, 3), plane=st.sampled_from(["ulnar", "flexion"]), scale=st.sampled_from([0.5, 1.9, 2.0]),
    stood=st.floats(-150.0, 150.0),
)  # fmt: skip
def test_a_drive_that_falls_to_other_microsteps_is_found_wherever_its_spool_stood_then(
    axis: int, plane: str, scale: float, stood: float
) -> None:
    """Its zero is then off by (1 - scale) times as much, which at one place makes a bend as large as it should be."""
    with pytest.raises(SafetyStop):
        checked(plane, axis, lambda told: stood + scale * (told - stood))


def test_wrong_steps_whose_bend_is_as_large_as_it_should_be_are_told_by_what_it_grows_by() -> None:
    reeled = round(1.2 * Homing().pull / SPOOLS.step)
    with pytest.raises(SafetyStop, match=r"axis 2 \(tendon 4\) takes \d+ steps for one radian, 0.50 times") as stopped:
        checked("ulnar", 2, lambda told: reeled + 2.0 * (told - reeled))
    assert "microsteps" in stopped.value.what


@pytest.mark.parametrize(("lost", "found"), [(0.0, False), (0.15, False), (-0.15, False), (0.31, True), (-0.31, True)])
def test_steps_that_were_lost_are_found_from_a_third_of_a_millimetre_on(lost: float, found: bool) -> None:
    off = 1e-3 * lost / SPOOLS.step
    for axis in range(4):
        if found:
            with pytest.raises(SafetyStop):
                checked("flexion", axis, lambda told: told - off)
        else:
            checked("flexion", axis, lambda told: told - off)


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (-1, 1, -1, 1)], ids=str)
@pytest.mark.parametrize(
    ("short", "refused"),
    [((0, 0, 0, 0), False), ((70, 0, 0, 70), True), ((0, 70, 70, 0), True), ((70, 70, 70, 70), True),
     ((45, 0, 0, 45), False), ((30, 30, 30, 30), False)],
)  # fmt: skip
def test_tendons_that_pull_against_each_other_bend_a_wrist_whose_one_side_is_let_out(
    plane: str, signs: tuple[int, ...], short: tuple[int, ...], refused: bool
) -> None:
    """By steps that nobody counted; pulls that balance bend nothing before, and afterwards all are slack or stop."""
    board: Any = Slackened()
    sides = np.where(on_plus_side(plane), 1.0, -1.0)

    def angle() -> float:
        return GLUED + float(
            (sides * np.maximum(0.0, np.array(signs) * board.position + np.array(short))).sum() / 1950.0
        )

    tracking: Any = Marker(board, angle)
    settings = settings_of(homing={"frames": 1, "rest": 0.0})
    zero = Zero(signs, tuple(PER_RADIAN), (GLUED,), (0.0,) * 4)
    assert angle() == pytest.approx(GLUED)
    if refused:
        with pytest.raises(SafetyStop, match="tendons pull against each other") as stopped:
            HomedWrist(board, tracking, settings, WRIST, plane, zero).check_cocontraction()
        assert stopped.value.exit_code == 5
    else:
        HomedWrist(board, tracking, settings, WRIST, plane, zero).check_cocontraction()
    slack = round(settings.homing.pull / SPOOLS.step)
    assert board.position.tolist() == [-slack * sign for sign in signs]


@pytest.mark.parametrize("share", [0.95, 1.05, -0.95, -1.05])
def test_a_slack_wrist_that_rests_further_off_than_its_slack_lets_it_is_refused(share: float) -> None:
    """Rigid tendons that are let out by `homing.pull` let it bend so far; it is slack then, refused or not."""
    board: Any = Slackened()
    rig: Any = settings_of(homing={"frames": 1, "rest": 0.0})
    held = rig.homing.pull / (ExpectedMoves(rig, WRIST, "ulnar").steps(math.inf) * SPOOLS.step)
    marker: Any = Marker(board, lambda: GLUED + share * held)
    marker.zero = (GLUED,)
    homed = HomedWrist(board, marker, rig, WRIST, "ulnar", Zero((1, -1, 1, 1), tuple(PER_RADIAN), (GLUED,), (0.0,) * 4))
    if abs(share) < 1.0:
        homed.check_straight("my_rig.py:RIG")
    else:
        off = math.degrees(abs(share) * held)
        with pytest.raises(SafetyStop, match=rf"rests {off:.1f} deg off where it was straight") as stopped:
            homed.check_straight("my_rig.py:RIG")
        assert stopped.value.where == "my_rig.py:RIG"
    slack = round(rig.homing.pull / SPOOLS.step)
    assert board.position.tolist() == [-slack, slack, -slack, -slack]


@pytest.mark.parametrize("plane", ["ulnar", "flexion"])
def test_what_a_slackened_wrist_moves_away_from_is_named_and_what_it_moves_to(plane: str) -> None:
    expected = ExpectedMoves(settings_of(), WRIST, plane)
    diagonal = {1: 5, 5: 1, 2: 4, 4: 2}
    for axis, tendon in enumerate(ACTIVE):
        toward = 0.02 if on_plus_side(plane)[axis] else -0.02
        away = 0.02 * away_of(plane, settings_of().markers.positive)[axis]
        with pytest.raises(SafetyStop) as stopped:
            expected.judge_slackened(Bend(toward, away))
        assert f"tendon {diagonal[tendon]} is shorter than it was" in stopped.value.what
        assert f"axis {axis} (tendon {tendon}) turns the wrong way" in stopped.value.what
    expected.judge_slackened(Bend(0.004, 0.003))
    expected.judge_slackened(Bend(-0.005, math.nan))


class StaysBent(Wrist):
    """Tendons do not stretch; let go, the wrist stays where it is, up to `stays` [rad] from straight."""

    stays, bend, slack = math.radians(2.0), 0.0, SLACK + 60

    def angle(self) -> float:
        """By the play operator: friction holds within `stays`, tendons pull beyond."""
        reach = (self.signs * (self.board.position - START) - self.slack) * self.gain
        self.bend = float(np.clip(self.bend, -self.stays, self.stays))
        low, high = reach[self.sides > 0.0].max(), -reach[self.sides < 0.0].max()
        self.bend = float(np.clip(self.bend, low, high))
        self.bends.append(self.bend)
        return GLUED + self.bend


@settings(max_examples=30, deadline=None)
@given(
    stays=st.floats(0.0, 2.0), first=st.floats(-1.0, 1.0), plane=st.sampled_from(["ulnar", "flexion"]),
    signs=st.sampled_from([(1, 1, 1, 1), (-1, 1, 1, -1)]),
)  # fmt: skip
@pytest.mark.slow
def test_a_wrist_that_stays_bent_by_its_own_friction_is_homed(
    stays: float, first: float, plane: str, signs: tuple[int, ...]
) -> None:
    """Zero lies where the wrist may rest, and there every tendon is just taut; it stands askew at first too."""
    wrist = StaysBent(signs, plane, stays=math.radians(stays), bend=math.radians(first * stays))
    zero = wrist.homed(slack=5e-3)
    assert zero.signs == signs
    askew = zero.markers[0] - GLUED
    assert abs(askew) <= math.radians(stays) + 1e-9
    assert zero.slack == pytest.approx((wrist.slack + wrist.sides * askew / wrist.gain) * SPOOLS.step, abs=SPOOLS.step)
    assert zero.steps_per_radian == pytest.approx(PER_RADIAN, rel=0.02)


@settings(max_examples=20, deadline=None)
@given(stays=st.floats(0.0, 1.0), first=st.floats(-1.0, 1.0), plane=st.sampled_from(["ulnar", "flexion"]))
@pytest.mark.slow
def test_a_wrist_that_stays_bent_passes_its_checks_and_a_dead_motor_does_not(
    stays: float, first: float, plane: str
) -> None:
    """Whichever way it was bent at first."""
    wrist = StaysBent(plane=plane, stays=math.radians(stays), bend=math.radians(first * stays), board=Slackened())
    rig, at = settings_of(homing={"frames": 1, "rest": 0.0}), np.array(START)
    board: Any = wrist.board
    held = wrist.angle

    def angle(dead: int | None = None) -> float:
        moved = np.array(board.position, float)
        if dead is not None:
            moved[dead] = -200.0
        board.position, there = moved + at + wrist.slack, board.position
        bend = held()
        board.position = there
        return bend

    slack = round(Homing().pull / SPOOLS.step)
    board.position[:] = -slack
    zero = Zero((1,) * 4, tuple(PER_RADIAN), (GLUED,), (0.0,) * 4)
    marker: Any = Marker(board, angle)
    straight = HomedWrist(board, marker, rig, WRIST, plane, zero).check_zero()
    assert straight == pytest.approx((GLUED,), abs=math.radians(0.05))
    furthest = min(min(where) for _, where, _ in board.told)
    assert furthest == -2 * slack, "a motor that is wired the other way round reels in what is let out"
    for dead in range(4):
        board.position[:] = -slack
        with pytest.raises(SafetyStop, match=rf"axis {dead} .* bends the wrist by"):
            marker = Marker(board, partial(angle, dead))
            HomedWrist(board, marker, rig, WRIST, plane, zero).check_zero()


def test_a_wrist_that_stays_bent_may_hold_its_tendons_longer() -> None:
    """By what its own friction stretches a tendon, both ways."""
    expected, homing, stays = ExpectedMoves(settings_of(), WRIST, "ulnar"), Homing(), math.radians(1.0)
    softest = settings_of().safety.softest
    stretch = 2.0 * WRIST.stiffness * stays / (WRIST.tendon_offset * softest)
    for friction, refused in ((homing.sticks + 0.5 * stretch, False), (homing.sticks + 1.1 * stretch, True)):
        if refused:
            with pytest.raises(SafetyStop, match="tendon 1 sticks"):
                expected.judge_friction(0, friction, stays)
        else:
            expected.judge_friction(0, friction, stays)
    with pytest.raises(SafetyStop, match="tendon 1 sticks"):
        expected.judge_friction(0, homing.sticks + 0.5 * stretch, 0.0)


@pytest.mark.parametrize(("share", "refused"), [(0.83, True), (0.87, False), (1.3, False), (1.45, True)])
def test_steps_per_radian_are_the_models_but_for_what_soft_tendons_add(share: float, refused: bool) -> None:
    """2 c/s and the stretch: 15 % less, or as much more of what the softest tendons make of it."""
    steps = ExpectedMoves(settings_of(), WRIST, "ulnar").steps()
    assert steps == pytest.approx(2.0 * WRIST.tendon_offset / SPOOLS.step, rel=0.06)
    wrist = Wrist(gain=np.full(4, 1.0 / (share * steps)))
    if not refused:
        assert wrist.homed().steps_per_radian == pytest.approx([share * steps] * 4)
        return
    with pytest.raises(SafetyStop, match=rf"{share:.2f} times what the model says .* wrong pulley or microsteps"):
        wrist.homed()


def test_tendons_that_were_taut_before_are_refused() -> None:
    wrist = Wrist()
    wrist.board.position[:] = START + SLACK + np.array([20, 20, 20, 20])
    with pytest.raises(SafetyStop, match=r"tendon 1 was taut by 0\.27 mm when homing began"):
        wrist.homed()


def test_a_tendon_that_sticks_is_refused() -> None:
    """Paid out, it lets go by 30 steps later."""
    wrist, furthest = Wrist(), np.zeros(4)

    def angle() -> float:
        taut = np.maximum(0.0, wrist.board.position - START - SLACK)
        furthest[:] = np.clip(furthest, taut, taut + 30.0) * (taut > 0.0)
        return GLUED + float((wrist.sides * furthest * wrist.gain).sum())

    wrist.tracking = Marker(wrist.board, angle)
    with pytest.raises(SafetyStop, match=r"tendon 1 sticks: 0\.44 mm between reeling in and letting go"):
        wrist.homed()


def test_a_wrist_that_stays_bent_may_take_more_and_fewer_steps_but_never_twice_or_half_as_many() -> None:
    """Emulated rigs with inner friction to 0.02 N m take 0.84 to 1.65 times the steps of the model."""
    expected, stays = ExpectedMoves(settings_of(), WRIST, "ulnar"), math.radians(0.5)
    model = expected.steps()
    for ratio, still, rubbing in ((1.0, True, True), (0.84, False, True), (1.65, False, True), (1.95, False, False),
                                  (0.55, False, False)):  # fmt: skip
        assert expected.has_steps(0, ratio * model) == expected.has_steps(0, ratio * model, 0.1 * stays) == still
        assert expected.has_steps(0, ratio * model, stays) == rubbing
        if not still:
            with pytest.raises(SafetyStop, match="steps for one radian"):
                expected.judge_steps(2, ratio * model)
        if rubbing:
            expected.judge_steps(2, ratio * model, stays)


@pytest.mark.parametrize(("plane", "held"), [("ulnar", 1.0), ("", 0.0)])
def test_a_wrist_that_stays_bent_may_begin_with_a_tendon_that_much_tighter(plane: str, held: float) -> None:
    """Friction stretches it, and where one plane alone is seen may hold the wrist as far across that."""
    rig, homing, stays = settings_of(planes=1 if plane else 2), Homing(), math.radians(2.0)
    expected = ExpectedMoves(rig, WRIST, plane)
    stretch = WRIST.stiffness * stays / (WRIST.tendon_offset * rig.safety.softest)
    further = held * WRIST.tendon_offset * stays
    expected.judge_slack(1, -homing.taut - 0.5 * stretch - further, stays)
    for slack, stood in ((-homing.taut - 0.5 * stretch, 0.0), (-homing.taut - 1.1 * stretch - further, stays)):
        with pytest.raises(SafetyStop, match="was taut by"):
            expected.judge_slack(1, slack, stood)


def test_friction_inside_is_named_of_a_wrist_that_stays_bent_and_of_no_other() -> None:
    expected, rubs = (
        ExpectedMoves(settings_of(), WRIST, "ulnar"),
        "friction inside the wrist, which stays bent by 1.9 deg",
    )
    for stays, named in ((math.radians(1.9), True), (math.radians(0.1), False)):
        with pytest.raises(SafetyStop, match=r"times what the model says .* or microsteps") as steps:
            expected.judge_steps(2, 1.95 * expected.steps(), stays)
        with pytest.raises(SafetyStop, match="tendon 2 was taut by") as slack:
            expected.judge_slack(1, -2e-3, stays)
        assert all((rubs in stop.value.what) == named for stop in (steps, slack))
