"""What a wrist does otherwise than its motors: told when, by which limit, and with the likeliest cause first."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST, settings_of
from wristctl.board.messages import State
from wristctl.control.response import Estimate
from wristctl.trial.blind_model import BlindModel
from wristctl.trial.likely_causes import reversals
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.watch import Tick, Watch
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.wrist.directions import ACTIVE

PERIOD, FRAME = 5e-3, 3
SETTINGS = settings_of()
LIMITS = SETTINGS.safety
PER_RADIAN = 2.0 * SETTINGS.markers.distance / WRIST.length
"""Share of the marker's size for a radian of bend across, turned round."""

Course = Callable[[float], float]


def still(time: float) -> float:
    """Nothing."""
    return 0.0


def watched(
    theta: Course = still, away: Course = still, load: Course = still, seconds: float = 1.0, position: Course = still,
    plane: str = "ulnar", **changes: Any,
) -> tuple[Watch, float]:  # fmt: skip
    """A wrist whose spools are said to stand here [steps] and whose marker shows this; when it was stopped."""
    settings = settings_of(**changes)
    watch = Watch(settings, WRIST, plane, TickTiming(PERIOD))
    held, taut = WRIST.pretension / settings.actuator.tendon_stiffness, np.zeros(4)
    for tick in range(round(seconds / PERIOD)):
        time = tick * PERIOD
        if tick % FRAME == 0:
            size = math.exp(-away(time) / PER_RADIAN) * 0.9
            seen = Sighting(
                time, tick, theta(time), SightingVerdict.OK, np.zeros((2, 4, 2)), size, stands=1.0, grey=1.0
            )
            watch.saw(seen, time, time)
        estimate = Estimate(0.0, 0.0, load(time))
        now = Tick(time, 0.0, estimate, np.full(4, position(time)), taut, State.ENABLED, 0, 0)
        watch.see(now, time)
        watch.judge(now)
        watch.predict(np.array([held, held]))
    return watch, time


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_fast_wrist_is_predicted_alike_at_any_period_of_its_ticks(side: float) -> None:
    """Spools reel in evenly for 0.2 s; at 10 ms the angle is within half a degree of that at 1 ms."""
    arm, speed = WRIST.tendon_offset, side * 200.0
    angles = []
    for period in (1e-3, 5e-3, 10e-3):
        blind = BlindModel(WRIST, SETTINGS.actuator, LIMITS.softest, period, ("ulnar",))
        held = WRIST.pretension / SETTINGS.actuator.tendon_stiffness
        for tick in range(1, round(0.2 / period) + 1):
            reeled = arm * math.radians(speed) * tick * period
            blind.predict(np.array([held + reeled, held - reeled]))
        angles.append(math.degrees(blind.angles(0.2)[0, 0]))
    assert abs(angles[0]) > 20.0 and angles == pytest.approx([angles[0]] * 3, abs=0.5)


def stopped(**given: Any) -> tuple[str, float]:
    """What stopped it, and how long after 0.5 s."""
    times: list[float] = []
    load = given.pop("load", still)

    def noted(time: float) -> float:
        times.append(time)
        return float(load(time))

    with pytest.raises(SafetyStop) as error:
        watched(load=noted, **given)
    assert error.value.exit_code == 5
    return str(error.value.what), times[-1] - 0.5


def after(value: float, at: float = 0.5, until: float = math.inf) -> Course:
    return lambda time: value if at - 1e-9 <= time < until else 0.0


def slowly(value: float) -> Course:
    """From 0.5 s on, in steps that no frame jumps by."""
    return lambda time: value * min(1.0, max(0.0, (time - 0.5) / 0.2))


def test_a_wrist_that_does_as_its_motors_do_goes_on_and_the_greatest_is_kept() -> None:
    near = 0.9 * math.radians(LIMITS.across_deg)
    watch, _ = watched(away=after(near), load=after(-0.9 * LIMITS.load), theta=slowly(0.9 * math.radians(3.5)))
    assert watch.most["across"] == pytest.approx(near, rel=1e-6)
    assert watch.most["load"] == pytest.approx(0.9 * LIMITS.load)
    assert math.degrees(watch.most["apart"]) == pytest.approx(0.9 * 3.5, abs=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_limit_stops_once_it_is_exceeded_for_so_long(sign: float) -> None:
    said, late = stopped(load=after(sign * 1.01 * LIMITS.load))
    assert "a load of 1.62 N m, beyond 1.6 N m" in said and late == pytest.approx(LIMITS.odd_for, abs=2 * PERIOD)
    said, late = stopped(away=after(sign * math.radians(1.05 * LIMITS.across_deg)))
    assert "bends 1.1 deg across its plane, beyond 1 deg" in said and late < LIMITS.odd_for + 5 * PERIOD
    said, _ = stopped(theta=slowly(sign * math.radians(1.2 * LIMITS.follow_deg)))
    assert "deg from where they should have it, beyond 3.5 deg" in said


@pytest.mark.parametrize(
    ("plane", "load", "away", "lost"),
    [("ulnar", 1.0, 1.0, 0), ("ulnar", 1.0, -1.0, 1), ("ulnar", -1.0, -1.0, 3),
     ("flexion", 1.0, 1.0, 2), ("flexion", -1.0, 1.0, 3), ("flexion", -1.0, -1.0, 1)],
)  # fmt: skip
def test_a_load_with_a_bend_across_names_the_tendon_opposite(plane: str, load: float, away: float, lost: int) -> None:
    """Ulnar to the right of the first picture, flexion behind it; of the second radial is behind."""
    said, _ = stopped(load=after(load), away=after(away * math.radians(1.05)), plane=plane)
    assert f"likely the tendon of axis {lost} (tendon {ACTIVE[lost]}) is off its pulley" in said


def test_what_is_over_sooner_does_not_stop() -> None:
    brief = {"at": 0.5, "until": 0.5 + LIMITS.odd_for - 2 * PERIOD}
    watched(load=after(1.01 * LIMITS.load, **brief))
    short: Course = lambda time: after(1.01 * LIMITS.load, **brief)(time) + after(1.7, 0.58, 0.62)(time)  # noqa: E731
    watched(load=short)


@pytest.mark.parametrize("times", [2.0, 3.0])
def test_what_is_well_beyond_a_limit_stops_so_many_times_sooner(times: float) -> None:
    _, late = stopped(load=after(times * LIMITS.load))
    assert late == pytest.approx(LIMITS.odd_for / times, abs=1.5 * PERIOD)


def test_another_limit_kept_does_not_forgive_one_that_is_not() -> None:
    """Frames without a size, or a load that is well, say nothing of the bend across."""
    said, _ = stopped(away=after(math.radians(1.3)), load=after(-0.1))
    assert "across its plane" in said


def test_a_jump_between_two_frames_stops_at_once() -> None:
    said, late = stopped(theta=after(math.radians(2.2)))
    assert "jumps by 2.2 deg off its motors" in said and late <= FRAME * PERIOD
    assert "likely the tip's marker has slipped" in said
    watched(theta=after(math.radians(1.9)))


def test_a_jump_between_frames_of_a_slow_camera_is_one_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "FRAME", 10)
    said, _ = stopped(theta=after(math.radians(2.2)))
    assert "jumps by 2.2 deg off its motors" in said


@pytest.mark.parametrize(("off", "beyond"), [((1.6, -1.6), True), ((1.3, 1.3), False), ((0.0, 2.1), True)])
def test_jumps_before_two_cameras_count_together_though_each_looks_at_another_time(
    off: tuple[float, float], beyond: bool
) -> None:
    watch, held = Watch(settings_of(planes=2), WRIST, "", TickTiming(PERIOD)), np.full(4, 1e-4)
    for tick in range(140):
        time, camera = tick * PERIOD, tick % 2
        bend = math.radians(off[camera]) if time >= 0.5 else 0.0
        verdict, corners = SightingVerdict.OK, np.zeros((2, 4, 2))
        watch.saw(Sighting(time, tick, bend, verdict, corners, 0.9, stands=1.0, grey=1.0, plane=camera), time, time)
        estimate = Estimate(np.zeros(2), np.zeros(2), np.zeros(2))
        now = Tick(time, 0.0, estimate, np.zeros(4), np.zeros(4), State.ENABLED, 0, 0)
        values = watch.see(now, time)
        watch.predict(held)
        if values["jump"] > math.radians(2.0):
            break
    assert (time < 0.53) == beyond and (not beyond or values["jump"] == pytest.approx(math.radians(math.hypot(*off))))


@pytest.mark.parametrize(("frequency", "until", "swings"), [(2.0, 3.0, True), (0.8, 3.0, False), (2.0, 0.9, False)])
def test_a_loop_that_has_swung_for_the_last_second_is_named_first(frequency: float, until: float, swings: bool) -> None:
    """Stopped at 2 s."""
    swing: Course = lambda time: 200.0 * math.sin(2.0 * math.pi * frequency * min(time, until))  # noqa: E731
    said, _ = stopped(load=after(3.0, at=2.0), position=swing, seconds=3.0)
    assert ("likely the loop swings" in said) is swings


def test_what_the_marker_shows_of_a_wrist_at_rest_is_no_bend_across() -> None:
    watched(away=lambda time: math.radians(5.0))


def test_a_marker_without_a_size_is_not_judged_across() -> None:
    watch, _ = watched(away=lambda time: math.nan)
    assert watch.most["across"] == 0.0


def blind(softest: float, plus: float, minus: float) -> np.ndarray:
    model = BlindModel(WRIST, SETTINGS.actuator, softest, PERIOD, ("ulnar",))
    for _ in range(400):
        model.predict(np.array([plus, minus]))
    return model.angles(399 * PERIOD)[:, 0]


def test_softer_tendons_bend_the_wrist_less_and_the_two_models_say_how_much() -> None:
    """At rest a spool's lead over the straight path is shared by tendon and spring."""
    stiff, soft = blind(5e3, 3e-3, -3e-3)
    c, stiffness = (
        WRIST.tendon_offset,
        WRIST.stiffness
        - 9.81 * (WRIST.mass * WRIST.length / 12.0 + WRIST.hand_mass * (WRIST.length / 3.0 + WRIST.hand_offset)),
    )
    for angle, k in ((stiff, SETTINGS.actuator.tendon_stiffness), (soft, 5e3)):
        shared = 2.0 * k * c * 3e-3 / (stiffness + 2.0 * k * c * c)  # the - side is slack
        assert angle == pytest.approx(shared, rel=0.03)
    assert 0.0 < soft < stiff
    same = blind(50e3, 3e-3, -3e-3)
    assert same[0] == same[1], "tendons are never taken for stiffer than believed"


def test_what_a_declared_load_stretches_lies_between_the_models_as_what_nothing_loads() -> None:
    """A wrist that stands upright leans further with a load, most on soft tendons; one that hangs less far."""
    hanging = WRIST.model_copy(update={"gravity": (9.81, 0.0)})
    for wrist, further in ((WRIST, 1.0), (hanging, -1.0)):
        loaded = wrist.model_copy(update={"hand_mass": wrist.hand_mass + 0.5})
        one, two, both = (
            BlindModel(each, SETTINGS.actuator, 5e3, PERIOD, ("ulnar",), payload=payload)
            for each, payload in ((wrist, 0.0), (loaded, 0.0), (wrist, 0.5))
        )
        for model in (one, two, both):
            for _ in range(400):
                model.predict(np.array([8e-3, -8e-3]))
        alone, carrying, angles = (model.angles(399 * PERIOD)[:, 0] for model in (one, two, both))
        assert angles == pytest.approx([*alone, *carrying])
        assert (further * (carrying - alone) > math.radians(0.5)).all()


@pytest.mark.parametrize("declared", [True, False])
def test_a_wrist_that_leans_under_its_declared_load_is_not_off_its_motors(declared: bool) -> None:
    watch = Watch(settings_of(payload=0.5 if declared else 0.0), WRIST, "ulnar", TickTiming(PERIOD))
    loaded = BlindModel(WRIST, SETTINGS.actuator, LIMITS.softest, PERIOD, ("ulnar",), payload=0.5)
    for _ in range(400):
        for model in (watch, loaded):
            model.predict(np.array([8e-3, -8e-3]))
    now = 399 * PERIOD
    angle = float(loaded.angles(now).max())
    seen = Sighting(now, 0, angle, SightingVerdict.OK, np.zeros((2, 4, 2)), 0.9, stands=1.0, grey=1.0)
    apart = watch.saw(seen, now, now).apart
    assert apart == 0.0 if declared else apart > math.radians(0.5)


def test_between_two_ticks_the_model_is_between_its_angles() -> None:
    model = BlindModel(WRIST, SETTINGS.actuator, 5e3, PERIOD, ("ulnar",))
    for _ in range(20):
        model.predict(np.array([2e-3, -2e-3]))
    before, after_ = model.angles(10 * PERIOD), model.angles(11 * PERIOD)
    assert (before < after_).all()
    assert model.angles(10.25 * PERIOD) == pytest.approx(0.75 * before + 0.25 * after_)
    assert (model.angles(99.0) == model.angles(20 * PERIOD)).all(), "not beyond the present tick"


@pytest.mark.parametrize(("frequency", "size", "found"), [(0.5, 300, 1), (2.0, 300, 4), (4.0, 21, 6), (4.0, 19, 0)])
def test_a_spool_turns_back_where_it_goes_forty_steps_each_way(frequency: float, size: int, found: int) -> None:
    """Counted over a second; the slack tendons' spools stand still."""
    time = np.arange(0.0, 1.0, 5e-3)
    courses = np.zeros((len(time), 4))
    courses[:, 2] = np.rint(size * np.sin(2.0 * np.pi * frequency * time))
    assert reversals(courses) == found and reversals(-courses) == found
    assert reversals(np.cumsum(np.abs(courses), axis=0)) == 0, "it goes on and on"
