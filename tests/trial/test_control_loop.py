"""The loop's ticks on a board that does at once what it is told: when they come, and what is logged of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.trial.conftest import WRIST, settings_of
from tests.trial.rig import Marker, RigBoard
from wristctl.board.messages import Fault, Flag, State
from wristctl.control.table import controller
from wristctl.trial.control_loop import AtZero, ControlLoop
from wristctl.trial.drives import BoardDrive
from wristctl.trial.log import TrialLog
from wristctl.trial.motions import back
from wristctl.trial.safety import SafetyStop
from wristctl.trial.steering import Answer, Steering
from wristctl.trial.tick_timing import TickTiming
from wristctl.vision.marker import SightingVerdict

PERIOD = 5e-3
# Seconds until the board has obeyed a RATE: half a frame of USB, 26 bytes at 250,000 baud, and the firmware's work.
UNDERWAY = 0.5e-3 + 26 * 10 / 250_000 + 0.44e-3
SETTINGS = settings_of()


RigOf = Callable[..., Any]


class Rig:
    """A loop on a rig without physics; the marker shows what `angle` gives."""

    def __init__(
        self, folder: Path, angle: Callable[[], float] = lambda: 0.0, signs: Any = (1, 1, 1, 1), **settings: Any
    ) -> None:
        board: Any = RigBoard()
        marker: Any = Marker(board, angle)
        self.board, self.marker = board, marker
        self.timing, self.log, self.folder = TickTiming(PERIOD), TrialLog(folder, None, PERIOD), folder
        self.rows: list[dict[str, Any]] = []
        self.at_rest: list[dict[str, Any]] = []
        chosen = settings_of(**{"control_period": PERIOD, **settings})
        drive = BoardDrive(board, chosen, signs)
        self.loop = ControlLoop(AtZero(drive, marker, "ulnar"), chosen, WRIST, self.timing, self.log, self._shown)

    def _shown(self, row: dict[str, Any]) -> None:
        """A tick of a motion, or one behind it, in which no law is asked."""
        (self.at_rest if math.isnan(row["torque"]) else self.rows).append(row)

    def follow(self, motion: Any, trial: int = -1) -> None:
        self.loop.follow(motion, controller("feedforward"), (), trial)

    def table(self, name: str) -> pd.DataFrame:
        self.log.close()
        return pd.read_csv(self.folder / f"{name}.csv")


@pytest.fixture
def rig_of(tmp_path: Path) -> Iterator[RigOf]:
    """Makes rigs, and closes their logs."""
    made: list[Rig] = []

    def make(*given: Any, **settings: Any) -> Rig:
        made.append(Rig(tmp_path, *given, **settings))
        return made[-1]

    yield make
    for each in made:
        each.log.close()


def test_ticks_come_at_the_period_on_the_clock(rig_of: RigOf) -> None:
    rig = rig_of()
    assert rig.loop.next_tick == 100.0
    rig.follow(back(0.0, 0.2, 0.0, PERIOD))
    assert [row["clock"] for row in rig.rows] == pytest.approx(100.0 + PERIOD * np.arange(40))
    assert [row["time"] for row in rig.rows] == pytest.approx(PERIOD * np.arange(40))
    assert rig.loop.next_tick == pytest.approx(100.2 + PERIOD) and rig.timing.overruns == 0
    assert rig.timing.late == pytest.approx([0.0] * 41, abs=1e-9)


def test_behind_a_motion_ticks_go_on_without_a_rate_until_the_board_says_that_nothing_moves(rig_of: RigOf) -> None:
    rig = rig_of()
    turn, since = rig.board.post_turn, [math.inf]

    def ramps_down(rates: Any, life: float) -> Any:
        if any(rates):
            since[0], rig.board.flags = math.inf, Flag.MOVING
        else:
            since[0] = min(since[0], rig.board.transport.now())
            if rig.board.transport.now() > since[0] + 0.03:
                rig.board.flags = Flag(0)
        return turn(rates, life)

    rig.board.post_turn = ramps_down
    rig.follow(back(0.0, 0.1, 0.0, PERIOD), trial=3)
    assert [what[1] for what in rig.board.told[-9:]] == [(0.0,) * 4] * 9 != [what[1] for what in rig.board.told[-10:-1]]
    assert [row["trial"] for row in rig.at_rest] == [-1] * 9, "they belong to no trial"
    assert [row["clock"] for row in rig.at_rest] == pytest.approx(100.1 + PERIOD * np.arange(9))
    assert (
        len(rig.table("log")) == 20 and len(rig.table("between")) == 9 == rig.table("between")["tension_1"].isna().sum()
    )


def test_motors_that_do_not_come_to_rest_are_a_reason_to_stop(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.board.flags = Flag.MOVING
    with pytest.raises(SafetyStop, match=r"the motors do not stand 0\.5 s after a motion"):
        rig.follow(back(0.0, 0.1, 0.0, PERIOD))
    assert len(rig.at_rest) == pytest.approx(0.5 / PERIOD, abs=2)


def test_limits_hold_behind_a_motion_too(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.board.flags = Flag.MOVING
    rig.marker._angle = lambda: 0.0 if len(rig.at_rest) < 10 else math.nan
    with pytest.raises(SafetyStop, match="no usable marker angle"):
        rig.follow(back(0.0, 0.1, 0.0, PERIOD))


def test_a_second_motion_counts_its_own_time(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.follow(back(0.0, 0.1, 0.0, PERIOD))
    rig.follow(back(0.0, 0.1, 0.0, PERIOD), trial=0)
    assert rig.rows[20]["time"] == pytest.approx(0.0) and rig.rows[20]["clock"] == pytest.approx(100.1 + PERIOD)


def test_ticks_that_are_over_before_they_begin_are_skipped_and_counted(rig_of: RigOf) -> None:
    rig = rig_of()
    motion, held = back(0.02, 0.1, 0.1, PERIOD), [0]
    turn = rig.board.post_turn

    def slow(rates: Any, life: float) -> Any:
        held[0] += 1
        rig.board.transport.wait(0.016 if held[0] == 11 else 0.0)
        return turn(rates, life)

    rig.board.post_turn = slow
    rig.follow(motion)
    assert rig.timing.overruns == 2 and len(rig.rows) == 40 - 2 == len(rig.timing.late) - len(rig.at_rest)
    assert rig.rows[11]["late"] == pytest.approx(0.001) == rig.timing.late[11]
    assert rig.rows[11]["theta_ref"] == motion.theta_ref[13], "it goes on where the reference is by then"
    assert rig.rows[12]["late"] == pytest.approx(0.0, abs=1e-9)


def test_a_tick_that_is_too_late_is_a_reason_to_stop(rig_of: RigOf) -> None:
    rig = rig_of(safety={"late": 0.02, "stale": 1.0})
    turn = rig.board.post_turn

    def hangs(rates: Any, life: float) -> Any:
        rig.board.transport.wait(0.029 if len(rig.rows) == 5 else 0.0)
        return turn(rates, life)

    rig.board.post_turn = hangs
    with pytest.raises(SafetyStop, match="a tick came 24 ms late"):
        rig.follow(back(0.0, 0.2, 0.0, PERIOD))


def test_step_rates_live_for_two_and_a_half_periods_and_lapsed_ones_are_counted(rig_of: RigOf) -> None:
    for period, life in ((5e-3, 0.05), (0.02, 0.05), (0.03, 0.075)):
        rig = rig_of(control_period=period, safety={"late": 0.01}, sensor={"level": "camera", "frame_rate": 20.0})
        rig.follow(back(0.0, 2 * PERIOD, 0.0, PERIOD))
        assert set(rig.board.lives) == {life}
    turn = rig.board.post_turn

    def lapsing(*given: Any) -> Any:
        rig.board.lapses += len(rig.rows) in (8, 10, 12)
        return turn(*given)

    rig.board.post_turn = lapsing
    with pytest.raises(SafetyStop, match="step rates came too late"):
        rig.follow(back(0.0, 0.5, 0.0, PERIOD))
    assert len(rig.rows) == 13


def test_lateness_has_quantiles_and_none_without_ticks() -> None:
    timing = TickTiming(PERIOD, late=[0.004, 0.001, 0.002, 0.003, 0.0])
    assert (timing.jitter(0.0), timing.jitter(0.5), timing.jitter(1.0)) == (0.0, 0.002, 0.004)
    assert math.isnan(TickTiming(PERIOD).jitter(0.5))


def test_the_log_has_reference_and_error_of_the_tick(rig_of: RigOf) -> None:
    rig = rig_of()
    motion = back(0.02, 0.1, 0.1, PERIOD)
    rig.follow(motion, trial=4)
    for k in (0, 7, 39):
        row = rig.rows[k]
        assert row["trial"] == 4
        for name in ("theta_ref", "rate_ref", "acceleration_ref", "theta_desired"):
            assert row[name] == getattr(motion, name)[k]
        assert row["error"] == pytest.approx(row["theta"] - row["theta_ref"])
    (behind,) = rig.at_rest
    for name in ("theta_ref", "theta_desired"):
        assert behind[name] == getattr(motion, name)[-1], "it stays where the motion ends"
    assert behind["rate_ref"] == behind["acceleration_ref"] == 0.0
    assert behind["error"] == pytest.approx(behind["theta"] - behind["theta_ref"])
    assert len(rig.table("log")) == 40 and len(rig.table("between")) == 1


def test_a_frame_is_told_with_its_capture_in_the_row_that_used_it(rig_of: RigOf) -> None:
    angles = iter([0.01, math.nan, 0.02] + [0.0] * 40)
    rig = rig_of(lambda: next(angles))
    rig.marker.delay = 0.002
    rig.follow(back(0.0, 0.1, 0.0, PERIOD))
    rig.rows.clear()
    angles = iter([0.01, math.nan, 0.02] + [0.0] * 40)
    rig.follow(back(0.0, 0.05, 0.0, PERIOD), trial=0)
    first, second, third = rig.rows[:3]
    assert (first["theta_measured"], first["verdict"]) == (0.01, "ok")
    assert first["captured"] == pytest.approx(-0.002)
    assert math.isnan(second["theta_measured"]) and math.isnan(second["captured"]) and second["verdict"] == "no tip"
    assert third["captured"] == pytest.approx(2 * PERIOD - 0.002)
    frames = rig.table("frames")
    assert frames["number"].tolist() == list(range(21, 31)), "frames of trials alone are listed"
    assert (frames["used"] - frames["captured"]).tolist() == pytest.approx([0.002] * 10)
    assert frames["theta"].isna().tolist() == [False, True] + [False] * 8


def test_no_usable_angle_for_too_long_is_a_reason_to_stop_with_the_newest_verdict(rig_of: RigOf) -> None:
    rig = rig_of(lambda: math.nan, safety={"stale": 0.152})
    with pytest.raises(SafetyStop, match=r"no usable marker angle for 155 ms \(newest frame: no tip\)"):
        rig.follow(back(0.0, 0.5, 0.0, PERIOD))
    assert len(rig.rows) == 31
    blind: Any = rig_of()
    blind.marker.look = list  # it sees nothing
    with pytest.raises(SafetyStop, match="no picture has come"):
        blind.follow(back(0.0, 0.5, 0.0, PERIOD))


def let_rates_move_axes(rig: Any) -> None:
    """From 100 s on, each rate at once until the next."""
    turn, since = rig.board.post_turn, [100.0, np.zeros(4)]

    def turned(rates: Any, life: float) -> Any:
        now = rig.board.transport.now()
        rig.board.position += since[1] * (now - since[0])
        since[:] = now, np.rint(rates)
        return turn(rates, life)

    rig.board.post_turn = turned


@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (1, -1, -1, 1)], ids=str)
def test_spools_go_to_their_targets_whichever_way_their_motors_turn(rig_of: RigOf, signs: tuple[int, ...]) -> None:
    """Each tendon holds its pretension: taut, and stretched by it."""
    rig = rig_of(signs=signs)
    let_rates_move_axes(rig)
    rig.follow(back(0.0, 0.5, 0.0, PERIOD))
    actuator, last = SETTINGS.actuator, rig.rows[-1]
    steps = WRIST.pretension / actuator.tendon_stiffness / actuator.step_length
    for k, tendon in enumerate((1, 2, 4, 5)):
        assert last[f"tension_{tendon}"] == pytest.approx(WRIST.pretension)
        assert last[f"target_{tendon}"] == pytest.approx(steps)
        assert last[f"position_{tendon}"] == pytest.approx(steps, abs=1.0)
        assert rig.board.position[k] == pytest.approx(signs[k] * steps, abs=1.0)
        assert abs(last[f"sent_{tendon}"]) < 200.0
    assert rig.rows[0]["sent_1"] > 100.0, "positive reels in"


def test_positions_are_of_when_the_board_read_the_command_behind_half_a_usb_frame(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.follow(back(0.0, 0.1, 0.0, PERIOD))
    after = np.array([row["counted"] - before["time"] for before, row in pairwise(rig.rows)]) - UNDERWAY
    sent = [sum(abs(row[f"sent_{tendon}"]) for tendon in (1, 2, 4, 5)) for row in rig.rows[:-1]]
    assert after[0] == pytest.approx(0.0, abs=1e-9) and np.abs(after).max() < 1e-4
    busiest = int(np.argmax(sent[:-1]))
    assert after[1:] == pytest.approx(after[busiest + 1] / sent[busiest] * np.array(sent[:-1]), abs=1e-9)
    assert 3e-9 < after[busiest + 1] / sent[busiest] < 1e-8, "and its interrupts come first"


@pytest.mark.parametrize("lost", [set(), {5, 6, 11}], ids=["all answered", "some lost"])
def test_the_observer_is_told_what_the_spools_hold_in_the_middle_of_a_tick(
    rig_of: RigOf, monkeypatch: pytest.MonkeyPatch, lost: set[int]
) -> None:
    """In periods of 5 ms that is before the tick's own rate takes effect: the one before goes on until then.

    By an answer that came, whatever was lost before it.
    """
    told, predict = [], Steering.predict

    def heard(steering: Steering, reeled: np.ndarray) -> None:
        told.append(tuple(reeled))
        predict(steering, reeled)

    monkeypatch.setattr(Steering, "predict", heard)
    rig = rig_of()
    let_rates_move_axes(rig)
    rig.board.lost = lost
    rig.follow(back(0.0, 0.1, 0.0, PERIOD))
    wait = 0.5 * SETTINGS.actuator.update
    went_on = 1.5 * PERIOD - UNDERWAY - wait
    rows = rig.rows + rig.at_rest
    ticks = zip(rows[:-2], rows[1:-1], rows[2:], told[2:], strict=False)
    for earlier, before, after, sides in (each for number, each in enumerate(ticks, start=2) if number not in lost):
        one, two, four, five = (
            after[f"position_{k}"] + wait * earlier[f"sent_{k}"] + went_on * before[f"sent_{k}"] for k in (1, 2, 4, 5)
        )
        step = SETTINGS.actuator.step_length
        assert sides == pytest.approx((0.5 * step * (four + five), 0.5 * step * (one + two)), abs=1e-12)
    assert told[2][0] > 0.0 and rows[-1]["position_1"] > 5.0


def test_the_boards_state_and_all_its_faults_are_logged_by_name(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.follow(back(0.0, 0.02, 0.0, PERIOD))
    assert (rig.rows[-1]["state"], rig.rows[-1]["faults"]) == ("ENABLED", "")
    rig.board.faults = Fault.ESTOP_INPUT | Fault.LINK
    rig.follow(back(0.0, 0.02, 0.0, PERIOD))
    assert rig.rows[-1]["faults"] == "LINK+ESTOP_INPUT"
    rig.board.state = State.FAULT
    with pytest.raises(SafetyStop, match="the board is FAULT"):
        rig.follow(back(0.0, 0.02, 0.0, PERIOD))


def test_a_law_that_raises_stops_as_such(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.loop._steering.respond = lambda *_: 1 / 0
    with pytest.raises(SafetyStop, match="the controller failed: ZeroDivisionError"):
        rig.follow(back(0.0, 0.02, 0.0, PERIOD))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["torque_wanted", "torque", "share", "tension"])
def test_what_a_law_wants_is_never_sent_where_it_is_no_number(rig_of: RigOf, name: str, value: float) -> None:
    rig = rig_of()
    sound = Answer(np.array([0.5]), np.array([0.5]), 1.0, np.array([10.0, 10.0, 2.0, 2.0]))
    answer = sound._replace(**{name: value * np.ones_like(getattr(sound, name))})
    rig.loop._steering.respond = lambda *_: answer
    with pytest.raises(SafetyStop, match="torque is not a number"):
        rig.follow(back(0.0, 0.02, 0.0, PERIOD))
    assert not any(any(what[1]) for what in rig.board.told if what[0] == "turn")


def test_verdicts_are_told_as_they_are(rig_of: RigOf) -> None:
    rig = rig_of()
    rig.marker._verdict = SightingVerdict.JUMP
    rig.follow(back(0.0, 0.02, 0.0, PERIOD))
    assert {row["verdict"] for row in rig.rows} == {"jump"}
