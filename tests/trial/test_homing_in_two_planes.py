"""Homing before two cameras: each tendon's direction, slack and sense, and what says that one is another's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trial.conftest import WRIST
from tests.trial.in_two_planes import bench_of, circling
from wristctl.board.driver import Board
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.homing import Zero, find_zero
from wristctl.trial.motors_ready import prepare
from wristctl.trial.rig_belief import layout_of_rig, pull_directions
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Patience, WoundAxes
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.vision.view import View
from wristctl.wrist.directions import ACTIVE

QUICK = {"move": 1e-4, "rest": 0.15, "frames": 5, "slack": 8e-4, "let_go": 1.0}
SLACK = (3e-4, 2e-4, 4e-4, 2.5e-4)


def homed(
    seed: int = 0, wrist: WristParameters = WRIST, friction: float = 0.0, pull: float = 6e-4, **motors: Any
) -> Zero:
    bench = {"motors": {"slack": SLACK, **motors}, "plant": {"inner_friction": friction}}
    settings = circling(homing=QUICK | {"pull": pull}, bench=bench)
    rig, layout = bench_of(settings, seed, wrist), layout_of_rig(settings, wrist)
    tracking = EmulatedTestbed(rig, settings, [View(), View()], None).tracking()
    board = Board(rig.transport)
    board.connect()
    patience = Patience(board)
    patience.stand_square(tracking, settings.homing)
    tracking.zero = patience.markers(tracking, 10)
    prepare(board, settings)
    motors_of_tendons = board if layout is None else WoundAxes(board, len(layout.places))
    return find_zero(motors_of_tendons, tracking, settings, wrist, "", layout=layout)


@pytest.mark.slow
def test_every_tendon_is_found_where_it_is_within_a_degree_and_a_half() -> None:
    """Its scatter over seeds is half a degree, with rotors that swing and without."""
    zero = homed(reversed=(False, True, False, False))
    off = np.angle(np.exp(1j * (np.array(zero.directions) - pull_directions())))
    assert np.degrees(np.abs(off)).max() < 1.5
    assert zero.signs == (1, -1, 1, 1)
    assert zero.slack == pytest.approx(SLACK, abs=5e-5)
    assert zero.steps_per_radian == pytest.approx([ExpectedMoves(circling(), WRIST, "").steps()] * 4, rel=0.1)
    assert len(zero.markers) == 2 and max(map(abs, zero.markers)) < math.radians(1.0)


@pytest.mark.slow
def test_three_tendons_at_drawn_places_are_found_there_and_exchanged_ones_named() -> None:
    """Also one whose motor turns the other way; the axis that winds none stays where it was."""
    places = (TendonPlace(angle_deg=80.0), TendonPlace(angle_deg=200.0, radius=0.017), TendonPlace(angle_deg=310.0))
    wrist = WristParameters(tendons=places)
    zero = homed(wrist=wrist, reversed=(False, True, False, False))
    assert zero.signs == (1, -1, 1) and zero.slack == pytest.approx(SLACK[:3], abs=5e-5)
    off = np.degrees(zero.directions) - [80.0, 200.0, 310.0]
    assert np.abs((off + 180.0) % 360.0 - 180.0).max() < 2.0
    assert zero.steps_per_radian[1] < 0.9 * min(zero.steps_per_radian[0], zero.steps_per_radian[2]), "a shorter lever"
    with pytest.raises(SafetyStop, match=r"axis 0 bends .* as tendon 3 would.*axes 0 and 2 exchanged"):
        homed(wrist=wrist, order=(2, 1, 0, 3))


@pytest.mark.slow
def test_tendons_of_a_soft_wrist_that_rests_off_straight_by_its_own_friction_are_found_where_they_are() -> None:
    """Its springs hold the hand up by little more than its weight: friction keeps it bent as far as homing bends it."""
    wrist = WristParameters(length=0.11, hand_mass=0.19, stiffness=0.3)
    off = np.array(homed(27, wrist, 0.0136).directions) - pull_directions()
    assert np.degrees(np.abs(np.angle(np.exp(1j * off)))).max() < 12.0


@pytest.mark.slow
def test_tendons_may_be_let_out_further_than_the_longest_slack_is() -> None:
    """They are let out by twice `homing.pull`; the board lets nothing unhomed go further than homing does."""
    zero = homed(pull=1.3e-3)
    assert zero.slack == pytest.approx(SLACK, abs=5e-5)


@pytest.mark.slow
def test_exchanged_motors_are_named_by_direction_alone() -> None:
    with pytest.raises(SafetyStop) as stopped:
        homed(order=(1, 0, 2, 3))
    said = stopped.value.what
    assert said.startswith("stopped: axis 0 bends the wrist toward 1")
    assert "tendon 1 is at 225 deg: as tendon 2 would" in said
    assert "likely motors of axes 0 and 1 exchanged, or tendons 1 and 2" in said


MOVES = ExpectedMoves(circling(), WRIST, "")


def bend(degrees: float, size: float = 0.02) -> Bend:
    return Bend(size * math.cos(math.radians(degrees)), size * math.sin(math.radians(degrees)))


@pytest.mark.parametrize("axis", range(4))
def test_a_bend_is_an_axis_own_within_the_stated_angle_and_another_tendons_beyond(axis: int) -> None:
    place = math.degrees(pull_directions()[axis])
    limit = circling().homing.direction_deg
    for off in (-limit + 0.5, 0.0, limit - 0.5):
        MOVES.judge_side(axis, bend(place + off))
    for off in (-limit - 0.5, limit + 0.5):
        with pytest.raises(SafetyStop, match="tendons that run through other holes"):
            MOVES.judge_side(axis, bend(place + off))
    for other, tendon in enumerate(ACTIVE):
        if other == axis:
            continue
        with pytest.raises(
            SafetyStop, match=rf"as tendon {tendon} would.*axes {axis} and {other} exchanged"
        ) as stopped:
            MOVES.judge_side(axis, bend(math.degrees(pull_directions()[other])))
        assert ("turns the wrong way" in stopped.value.what) == (other == 3 - axis)


@given(
    axis=st.integers(0, 3), rests=st.floats(0.0, 2.0), toward=st.floats(0.0, 360.0),
    share=st.floats(-0.98, 0.98), count=st.integers(3, 9),
)  # fmt: skip
def test_a_line_goes_where_bends_grow_wherever_the_wrist_rested_before(
    axis: int, rests: float, toward: float, share: float, count: int
) -> None:
    """So that friction which keeps a wrist bent is not taken for a tendon in another hole, nor hides one that is."""
    reeled, place = [10 + 4 * move for move in range(count)], math.degrees(pull_directions()[axis])
    rest, limit = bend(toward, math.radians(rests)), circling().homing.direction_deg
    off = share * limit

    def line(angle: float) -> float:
        bends = [bend(angle, 0.002 * steps) for steps in reeled]
        bends = [Bend(rest.theta + each.theta, rest.away + each.away) for each in bends]
        return MOVES.judge_line(axis, bends[-1].since(rest), reeled, bends)

    found = line(place + off)
    assert math.cos(found - math.radians(place + off)) == pytest.approx(1.0, abs=1e-9)
    with pytest.raises(SafetyStop, match=rf"tendon {ACTIVE[axis]} is at"):
        line(place + math.copysign(limit + 1.0, off))


def test_oblique_springs_turn_where_a_tendon_bends_the_wrist() -> None:
    """One that is twice as stiff across 30 deg pulls the wrist further toward 30 deg than it lies."""
    oblique = ExpectedMoves(circling(), WristParameters(stiffness_axis_deg=30.0, flexion_ratio=2.0), "")
    toward = [math.degrees(oblique.place(axis)) for axis in range(4)]
    assert 31.0 < toward[3] < 40.0 and toward[0] == pytest.approx(toward[3] - 180.0, abs=1e-6)
    assert toward[1] > 150.0 and toward[2] == pytest.approx(toward[1] - 180.0, abs=1e-6)


def test_a_slackened_wrist_that_moves_names_the_tendons_by_its_direction() -> None:
    with pytest.raises(SafetyStop, match=r"tendon 1 is shorter than it was.*axis 3 \(tendon 5\) turns the wrong way"):
        MOVES.judge_slackened(bend(45.0))
    with pytest.raises(SafetyStop, match=r"pull against each other.*likely tendon 2 \(axis 1\)"):
        MOVES.judge_cocontraction(bend(135.0))
    MOVES.judge_slackened(bend(45.0, 0.004))
    MOVES.judge_cocontraction(bend(-45.0, 0.004))


def test_a_small_move_is_as_large_as_the_model_says() -> None:
    reeled, place = 30, math.degrees(pull_directions()[2])
    meant = reeled / MOVES.steps()
    MOVES.judge_small_move(2, reeled, bend(place, meant))
    with pytest.raises(SafetyStop, match=r"axis 2 \(tendon 4\) bends the wrist by .* instead of"):
        MOVES.judge_small_move(2, reeled, bend(place, 0.3 * meant))
    with pytest.raises(SafetyStop, match="axes 2 and 0 exchanged"):
        MOVES.judge_small_move(2, reeled, bend(math.degrees(pull_directions()[0]), meant))
    with pytest.raises(SafetyStop, match="times what the model says"):
        MOVES.judge_small_move(2, reeled, bend(place, 1.6 * meant))


def test_a_small_move_is_judged_by_tendons_as_soft_as_homing_has_measured_them() -> None:
    """A stiff wrist on tendons of 5 kN/m bends by half of what it does on those of 20 kN/m that are believed."""
    stiff = ExpectedMoves(circling(), WRIST.model_copy(update={"stiffness": 4.0}), "")
    told = stiff.tendon_stiffness([stiff.steps(5e3)] * 4)
    reeled, place = 30, math.degrees(pull_directions()[2])
    meant = reeled / stiff.steps(5e3)
    stiff.judge_small_move(2, reeled, bend(place, meant), told)
    for bent, stiffness in ((meant, None), (0.3 * meant, told)):
        with pytest.raises(SafetyStop, match="instead of"):
            stiff.judge_small_move(2, reeled, bend(place, bent), stiffness)
    with pytest.raises(SafetyStop, match="times what the model says"):
        stiff.judge_small_move(2, reeled, bend(place, 2.5 * meant), told)
