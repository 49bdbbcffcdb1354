"""The search for the paper's best case: what it calls close, and the stopped clocks that it must not call so."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.comparison import best_case
from wristctl.comparison.best_case import GUARD_DEG, closest, follows, search
from wristctl.comparison.paper import FACTOR, T2
from wristctl.comparison.unknowns_sampling import Courses, courses, readings
from wristctl.config.controller_row import Row
from wristctl.config.loop import Loop, Reference
from wristctl.config.unknowns_box import Box, PaperSetting, Unstated
from wristctl.config.wrist import WristParameters

WRIST = WristParameters()
PRINTED, EXCHANGED = Row(controller="smc", gains="printed"), Row(controller="smc", gains="exchanged")
LOOP = Loop(plant_segments=1)


def setting(wrist: WristParameters, loop: Loop = LOOP) -> PaperSetting:
    return PaperSetting(wrist, loop, Reference(duration=1.0), 4.0, "ideal", {})


def test_the_factor_is_that_of_the_worst_of_three_numbers_either_way() -> None:
    printed = T2["pid"]
    time = np.arange(6000) * 1e-3
    for scale in (0.25, 1.0, 4.0):
        theta = np.where(time <= printed.settling, 0.4, 0.5 + scale * printed.steady_state)
        wanted = np.where(time <= printed.settling, 0.4, 0.5)
        factor, numbers, _ = closest(
            Courses(theta[None], wanted[None], np.zeros(1), np.array([6.0]), 1e-3, np.ones(1, bool)), "pid", "strict"
        )
        rmse = scale * printed.steady_state * math.sqrt(0.5)
        expected = max(max(scale, 1 / scale), max(rmse / printed.rmse, printed.rmse / rmse))
        assert numbers[0] == pytest.approx([rmse, printed.settling, scale * printed.steady_state], rel=1e-3)
        assert factor[0] == pytest.approx(expected, rel=1e-3)


def test_what_has_just_settled_when_time_is_up_has_not_settled() -> None:
    time = np.arange(6000) * 1e-3
    for last, counts in ((5.0, True), (5.5, False)):
        theta = np.where(time <= last, 0.4, 0.5)
        of = Courses(theta[None], np.full((1, 6000), 0.5), np.zeros(1), np.array([6.0]), 1e-3, np.ones(1, bool))
        assert np.isfinite(closest(of, "gvsc", "usual")[0][0]) == counts
        theta[-1] = np.nan
        assert np.isinf(closest(of._replace(theta=theta[None]), "gvsc", "usual")[0][0])


def test_neighbours_lie_to_both_sides_of_a_setting_by_up_to_5_percent(monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[PaperSetting] = []

    def closest_to(settings: list[PaperSetting], *_: object) -> tuple[np.ndarray, None, None]:
        moved.extend(settings)
        return np.array([1.0, 2.0, 1.5, np.inf]), None, None

    monkeypatch.setattr(best_case, "courses", lambda row, settings: settings)
    monkeypatch.setattr(best_case, "closest", closest_to)
    box, begin = Box(unknowns={"wrist.length": Unstated(draw=(0.05, 0.12))}), setting(WRIST)
    share = best_case._near(box, WRIST, PRINTED, "strict", begin, np.random.default_rng(0))
    assert share == np.mean(np.array([1.0, 2.0, 1.5, np.inf]) < FACTOR)
    for name in ("length", "stiffness", "damping"):
        ratios = np.array([getattr(near.wrist, name) / getattr(WRIST, name) for near in moved])
        assert 0.95 <= ratios.min() < 0.96 and 1.04 < ratios.max() <= 1.05
    durations = np.array([near.reference.duration for near in moved])
    assert 0.95 <= durations.min() < 0.96 and 1.04 < durations.max() <= 1.05


def sagging() -> PaperSetting:
    """A wrist that hangs across with tendons too weak to move it, its hand as heavy as 30 deg of sag asks for."""
    masses = np.linspace(0.05, 0.6, 64)
    weak = {"tension_limit": 9.001, "pretension": 9.0, "gravity": (0.0, 9.81), "range_deg": 80.0}
    wrists = [WRIST.model_copy(update={**weak, "hand_mass": float(mass)}) for mass in masses]
    settings = [setting(each) for each in wrists]
    error = readings(courses(PRINTED, settings, [each.reference for each in settings]))["steady_state"]
    return settings[int(np.nanargmin(error))]


def test_a_stopped_clock_is_rejected() -> None:
    """It rests at 30 deg, as asked, and at 30 deg where 15 or -30 are asked."""
    clock = sagging()
    own = courses(PRINTED, [clock], [clock.reference])
    assert readings(own)["steady_state"][0] < math.radians(1.5)
    assert 30.0 not in GUARD_DEG and min(GUARD_DEG) == -30.0
    honest = setting(WRIST)
    assert follows(EXCHANGED, [honest, honest]).all()
    assert follows(PRINTED, [clock, clock]).tolist() == [False, False]


def test_a_search_that_finds_only_stopped_clocks_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were they what the paper printed they would be perfect: they are counted, and none is the best."""
    clock = sagging()
    numbers = readings(courses(PRINTED, [clock], [clock.reference]))
    told = T2["smc"]._replace(**{name: float(numbers[name][0]) for name in ("rmse", "steady_state")}, settling=1.2)
    monkeypatch.setitem(T2, "smc", told._replace(settling=float(np.nan_to_num(numbers["settling"][0], nan=1.2))))
    mass = clock.wrist.hand_mass
    own = Box(
        unknowns={
            "wrist.hand_mass": Unstated(draw=f"{0.99 * mass}..{1.01 * mass}"),
            "reference.duration": Unstated(draw="0.99..1.01"),
        },
        horizon=4.0,
    )
    shares: list[float] = []
    found = search(
        own, clock.wrist, PRINTED, "usual", (1, 1e-3), 0, generations=3, candidates=8, progress=shares.append
    )
    assert shares == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert found.setting is None and math.isinf(found.factor) and found.rollouts == 24
    assert found.stopped_clocks > 0


@pytest.mark.slow
def test_a_search_comes_closer_and_is_its_seed() -> None:
    own = Box(
        unknowns={
            "reference.duration": Unstated(draw="0.5..3"),
            "wrist.tension_limit": Unstated(draw="20..200 log"),
            "horizon": Unstated(draw="3..4"),
        },
        horizon=4.0,
    )
    first = search(own, WRIST, EXCHANGED, "strict", (1, 1e-3), 0, generations=1, candidates=8)
    later, again = (search(own, WRIST, EXCHANGED, "strict", (1, 1e-3), 0, generations=5, candidates=8) for _ in "ab")
    assert later.factor < first.factor and later.factor == again.factor < 1.6
    assert later.setting is not None and later.setting.loop.plant_segments == 1
    rerun = courses(EXCHANGED, [later.setting], [later.setting.reference])
    assert closest(rerun, "smc", "strict")[0][0] == pytest.approx(later.factor, rel=1e-6)
    ratios = np.array(later.ours) / np.array(T2["smc"])
    assert later.factor == pytest.approx(float(np.exp(np.abs(np.log(ratios)).max())))
    assert 0.0 <= later.near <= 1.0
