"""A live reference: what is refused and never followed, limits that hold whatever comes, silence, and the record."""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records.formats import write_table
from wristctl.simulation.live_reference import LimitedReference, LiveLimits, followed_bends, recorded
from wristctl.simulation.planes import motion_in
from wristctl.trial.live_datagrams import ENDING, FOLLOWING, HOLDING, HOME, LISTEN, WAITING, LiveReference

PERIOD, RATE, SMOOTHING = 0.01, math.radians(60.0), 0.05
WRIST = WristParameters()


class Stand:
    """A live reference at a free port with a clock of the test's, and a sender at 50 Hz."""

    def __init__(self, horizon: float = 4.0, planes: int = 1, plane: str = "ulnar", **given: Any) -> None:
        self.reference = Reference.model_validate({"kind": "live", "listen": "127.0.0.1:0", **given})
        self.time = 100.0
        self.live = LiveReference(self.reference, WRIST, planes, plane, horizon, PERIOD, clock=lambda: self.time)
        host, port = self.live.address.split(":")
        self._to = host, int(port)
        self.sender, self.other = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self.course = np.zeros_like(self.live.course)

    def send(self, content: Any, sender: socket.socket | None = None) -> None:
        data = content if isinstance(content, bytes) else json.dumps(content).encode()
        (sender or self.sender).sendto(data, self._to)

    def follow(self, send: Callable[[float], None]) -> None:
        """All samples; `send` is called before each with the time since the first."""
        for sample in range(len(self.course)):
            self.time = 100.0 + sample * PERIOD
            if sample == 0:
                self.live.fill(self.course, 0)
                continue
            send(sample * PERIOD)
            self.live.fill(self.course, sample)

    def close(self) -> None:
        self.live.close()
        self.sender.close()
        self.other.close()


@pytest.fixture
def stand() -> Iterator[Callable[..., Stand]]:
    made: list[Stand] = []

    def make(**given: Any) -> Stand:
        made.append(Stand(**given))
        return made[-1]

    yield make
    for each in made:
        each.close()


def each_20_ms(time: float) -> bool:
    return round(time / PERIOD) % 2 == 0


def within_limits(course: np.ndarray, most: float, period: float = PERIOD) -> None:
    """Rate, acceleration and range hold, and each step is the move that they say."""
    bend, rate, acceleration = course.transpose(2, 0, 1)
    assert np.hypot.reduce(rate, axis=1).max() <= RATE * (1.0 + 1e-9)
    assert np.hypot.reduce(acceleration, axis=1).max() <= RATE / SMOOTHING * 1.01
    assert np.hypot.reduce(bend, axis=1).max() <= most * (1.0 + 1e-9)
    np.testing.assert_allclose(np.diff(bend, axis=0), 0.5 * period * (rate[1:] + rate[:-1]), atol=1e-4)
    np.testing.assert_allclose(np.diff(rate, axis=0), period * acceleration[1:], atol=1e-9)


def test_a_minute_with_lost_datagrams_and_gaps_of_100_ms_is_followed_within_the_limits(
    stand: Callable[..., Stand],
) -> None:
    """5 % are lost one by one, and each second five in a row; the reference never stops for it."""
    rig, rng, lost = stand(horizon=60.0, planes=2), np.random.default_rng(1), 0

    def send(time: float) -> None:
        nonlocal lost
        if not each_20_ms(time):
            return
        if rng.random() < 0.05 or time % 1.0 < 0.1:
            lost += 1
            return
        turn = 2.0 * math.pi * 0.3 * time
        rig.send({"bend": [20.0 * math.sin(turn), 15.0 * math.sin(0.7 * turn)], "t": time, "seq": round(50 * time)})

    rig.follow(send)
    assert lost > 300 and not [kind for kind in rig.live.bends.counts if kind != "followed"]
    after = rig.live.states.index(FOLLOWING)
    assert rig.live.states[after:-10] == [FOLLOWING] * (6000 - after - 10)
    within_limits(rig.course, math.radians(25.1))
    assert np.abs(rig.course[:, 0, 0]).max() == pytest.approx(math.radians(20.0), rel=0.03)


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("period", [1e-3, 10e-3])
def test_whatever_is_wanted_the_followed_reference_keeps_its_limits(planes: int, period: float) -> None:
    """Wanted bends anywhere in the range, at any moment, with stops between."""
    reference, rng = Reference(kind="live"), np.random.default_rng(planes)
    limits = LiveLimits.of(reference, WRIST, period)
    followed, rows, wanted = LimitedReference(limits, planes, period), [], np.zeros(planes)
    for _ in range(4000):
        if rng.random() < 0.05:
            turn = rng.uniform(0.0, 2.0 * math.pi)
            wanted = limits.range * (np.array([math.cos(turn), math.sin(turn)])[:planes])
        followed.brake() if rng.random() < 0.1 else followed.toward(wanted)
        rows.append(np.stack([followed.bend, followed.rate, followed.acceleration], axis=1))
    within_limits(np.array(rows), math.radians(40.0), period)


def test_a_wanted_bend_that_stands_still_is_reached_and_not_passed() -> None:
    limits = LiveLimits.of(Reference(kind="live"), WRIST, PERIOD)
    followed, bends = LimitedReference(limits, 1, PERIOD), []
    for _ in range(150):
        followed.toward(np.radians([30.0]))
        bends.append(math.degrees(followed.bend[0]))
    assert bends[-1] == pytest.approx(30.0, abs=1e-3) and max(bends) < 30.001
    assert all(later >= earlier - 1e-9 for earlier, later in pairwise(bends))


def test_when_the_sender_dies_the_reference_stands_within_half_a_second_then_goes_home(
    stand: Callable[..., Stand],
) -> None:
    rig = stand(horizon=5.0)
    died = 1.5

    def send(time: float) -> None:
        if time <= died and each_20_ms(time):
            rig.send({"bend": 20.0 * time})

    rig.follow(send)
    time = PERIOD * np.arange(len(rig.course))
    bend, rate = np.degrees(rig.course[:, 0, 0]), np.degrees(rig.course[:, 0, 1])
    assert rate[round(died / PERIOD)] == pytest.approx(20.0, abs=0.5)
    held = (time > died + 0.3) & (time < died + 1.2)
    assert not rate[held].any() and np.ptp(bend[held]) == 0.0 and bend[held][0] > 27.0
    assert bend[-1] == pytest.approx(0.0, abs=0.01) and rate[time > died + 1.2].min() >= -60.0 * (1 + 1e-9)
    assert {HOLDING, HOME, ENDING} < set(rig.live.states) and rig.live.states[0] == WAITING
    within_limits(rig.course, math.radians(40.0))


BAD: dict[str, tuple[Any, ...]] = {
    "malformed": (
        b"", b"20", b"[1, 2]", b"{", b"\xff\xfe{}", b"[" * 1000, {"bent": 3.0}, {"bend": "3"}, {"bend": True},
        {"bend": None}, {"bend": []}, {"bend": [1.0, 2.0, 3.0]}, {"bend": 3.0, "seq": 1.5}, {"bend": 3.0, "t": "now"},
        {"bend": 3.0, "more": "x" * 2000},
    ),
    "not finite": (b'{"bend": NaN}', b'{"bend": [1, -Infinity]}', b'{"bend": 1e999}', b'{"bend": 3, "t": NaN}',
                   b'{"bend": 1' + b"0" * 400 + b"}"),
    "out of range": ({"bend": 40.1}, {"bend": -179.0}),
    "jump": ({"bend": 30.0}, {"bend": -20.0}),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_what_is_refused_is_counted_and_leaves_the_reference_as_it_was_bit_for_bit(
    stand: Callable[..., Stand], kind: str
) -> None:
    def followed(bad: tuple[Any, ...]) -> Stand:
        rig = stand(horizon=1.0)

        def send(time: float) -> None:
            for each in bad if time > 0.02 and not each_20_ms(time) else ():
                rig.send(each)
                bad_ones.append(each)
            if each_20_ms(time):
                rig.send({"bend": 10.0 * math.sin(3.0 * time)})

        bad_ones: list[Any] = []
        rig.follow(send)
        assert rig.live.bends.counts[kind] == len(bad_ones)
        return rig

    sound = followed(())
    for each in BAD[kind]:
        np.testing.assert_array_equal(followed((each,)).course, sound.course)
    assert np.degrees(sound.course[-1, 0, 0]) > 1.0


def test_what_is_old_or_of_another_sender_is_refused_until_there_is_silence(stand: Callable[..., Stand]) -> None:
    rig = stand(horizon=2.0)
    late = {
        0.10: {"bend": 1.0, "seq": 7, "t": 5.0}, 0.12: {"bend": 9.0, "seq": 7}, 0.14: {"bend": 9.0, "seq": 6},
        0.16: {"bend": 9.0, "seq": 9, "t": 4.9}, 0.18: {"bend": 2.0, "seq": 10, "t": 5.0},
        0.80: {"bend": 3.0, "seq": 1, "t": 0.0},
    }  # fmt: skip

    def send(time: float) -> None:
        if (content := late.get(round(time, 2))) is not None:
            rig.send(content)
        if round(time, 2) in (0.11, 0.19):
            rig.send({"bend": 9.0}, rig.other)

    rig.follow(send)
    assert rig.live.bends.counts == {"followed": 3, "old": 3, "other sender": 2}
    assert math.degrees(float(rig.live.bends.wanted[0])) == pytest.approx(3.0)  # type: ignore[index]


def test_a_jump_is_followed_once_the_next_datagram_confirms_it(stand: Callable[..., Stand]) -> None:
    rig = stand(horizon=1.0)

    def send(time: float) -> None:
        if each_20_ms(time):
            rig.send({"bend": 30.0 if time > 0.5 or time == 0.3 else 0.0})

    rig.follow(send)
    assert rig.live.bends.counts["jump"] == 2
    bend = np.degrees(rig.course[:, 0, 0])
    assert not bend[:50].any() and bend[-12] > 15.0
    within_limits(rig.course, math.radians(40.0))


def test_a_pair_has_the_bend_of_a_loop_in_one_plane_and_one_number_none_of_two(stand: Callable[..., Stand]) -> None:
    for plane, wanted in (("ulnar", 5.0), ("flexion", -3.0)):
        rig = stand(horizon=1.0, plane=plane)
        rig.follow(lambda time, rig=rig: rig.send({"bend": [5.0, -3.0]}))  # type: ignore[misc]
        assert math.degrees(rig.course[-1, 0, 0]) == pytest.approx(wanted, abs=0.01)
    rig = stand(horizon=0.5, planes=2)
    rig.follow(lambda time: rig.send({"bend": 5.0}))
    assert not rig.course.any() and rig.live.bends.counts["malformed"] == 49


def test_what_was_sent_before_the_motion_begins_is_passed_over(stand: Callable[..., Stand]) -> None:
    rig = stand(horizon=0.5)
    rig.send({"bend": 10.0})
    rig.follow(lambda time: None)
    assert not rig.course.any() and rig.live.states[:-10] == [WAITING] * 40


def test_a_late_loop_misses_samples_and_no_limit(stand: Callable[..., Stand]) -> None:
    rig = stand(horizon=1.0)
    for sample in (0, 1, 2, 3, 9, 10, 40, 99):
        rig.time = 100.0 + sample * PERIOD
        rig.live.fill(rig.course, sample)
        rig.send({"bend": 12.0})
    assert rig.live.filled == 100 and rig.course[-1, 0, 0] > math.radians(1.0)
    within_limits(rig.course, math.radians(40.0))


@pytest.mark.parametrize("planes", [1, 2])
def test_the_record_is_the_reference_that_was_followed_bit_for_bit(
    stand: Callable[..., Stand], tmp_path: Path, planes: int
) -> None:
    rig = stand(horizon=1.0, planes=planes)

    def send(time: float) -> None:
        bend = 12.0 * math.sin(4.0 * time)
        rig.send({"bend": bend if planes == 1 else [bend, 7.0]})

    rig.follow(send)
    file = tmp_path / "reference.csv"
    write_table(file, rig.live.record()[0])
    again = recorded(rig.reference, file)
    motion = motion_in(planes, again, "ulnar", WRIST, 1.0, PERIOD)
    np.testing.assert_array_equal(motion.angles.rows.reshape(planes, 3, -1), rig.course.transpose(1, 2, 0))
    longer, finer = (
        followed_bends(again, planes, np.arange(0.0, end, step)) for end, step in ((2.0, 0.01), (1.0, 1e-3))
    )
    assert (longer[:, 0, 100:] == longer[:, :1, 99]).all() and not longer[:, 1:, 100:].any()
    np.testing.assert_allclose(np.gradient(finer[:, 0], 1e-3, axis=1)[:, 5:980], finer[:, 1, 5:980], atol=0.02)


def test_records_that_are_none_are_refused_with_their_line(stand: Callable[..., Stand], tmp_path: Path) -> None:
    rig, file = stand(horizon=0.5), tmp_path / "reference.csv"
    rig.follow(lambda time: None)
    write_table(file, rig.live.record()[0])
    lines = file.read_text().splitlines()
    again, time = recorded(rig.reference, file), PERIOD * np.arange(10, dtype=np.float64)
    for changed, message in (
        ([*lines[:6], lines[6].replace("0.05,0.0", "0.05,nan"), *lines[7:]], r"no number - .*reference.csv:7"),
        ([*lines[:6], *lines[7:]], r"one period apart - .*reference.csv:7"),
        (["time,bend", "0.0,1.0"], "no record of a live reference in one plane"),
        (lines[:1], "without samples"),
    ):
        file.write_text("\n".join(changed) + "\n")
        with pytest.raises(UserError, match=message):
            followed_bends(again, 1, time)
    with pytest.raises(UserError, match="in two planes"):
        followed_bends(again, 2, time)


def test_it_listens_to_this_computer_alone_unless_a_setting_asks_for_more(stand: Callable[..., Stand]) -> None:
    assert LISTEN.startswith("127.0.0.1:")
    rig = stand()
    with pytest.raises(UserError, match=f"cannot listen at {rig.live.address}") as taken:
        stand(listen=rig.live.address)
    assert "another HOST:PORT" in str(taken.value)
    assert stand(listen="0.0.0.0:0").live.address.startswith("0.0.0.0:")
    for listen in ("5005", "localhost", "127.0.0.1:port"):
        with pytest.raises(ValueError, match="listen"):
            Reference.model_validate({"kind": "live", "listen": listen})
    with pytest.raises(ValueError, match="listens to nobody"):
        Reference(kind="sine", listen="127.0.0.1:5005")


def test_limits_that_are_none_are_refused_with_their_key() -> None:
    for key, value in (("rate_deg", 0.0), ("smoothing", 0.01), ("jump_deg", -1.0), ("hold", -0.1)):
        with pytest.raises(UserError) as refused:
            LiveLimits.of(Reference.model_validate({"kind": "live", key: value}), WRIST, PERIOD)
        assert refused.value.where == f"reference.{key}"


def test_trials_follow_a_live_reference_once_and_by_the_wall_clock() -> None:
    live = {"reference": {"kind": "live"}}
    settings = HwRunSettings.model_validate({**live, "real_time": True})
    assert settings.directions == ("ulnar",) and settings.push.force == 0.0
    with pytest.raises(ValueError, match="virtual time"):
        HwRunSettings.model_validate(live)
    with pytest.raises(ValueError, match="in one trial, and these settings have 2"):
        HwRunSettings.model_validate({**live, "real_time": True, "repetitions": 2})
    replayed = HwRunSettings.model_validate({"reference": {"kind": "live", "file": "reference.csv"}, "repetitions": 2})
    assert len(replayed.directions) == 4
