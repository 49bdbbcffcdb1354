"""Margins of gains: what is changed of a loop, how much gains stand of it, and what it costs them in a search."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Plant, Sensor, TrueSensor
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.seeds import stream
from wristctl.simulation.cases import Case
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.study_files.load import load_study
from wristctl.tuning.margin import CHANGES, LADDERS, Change, OwnLoop, Stood, changed_law
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import judges_of, own_loop, search, tuning_cases

WRIST = WristParameters()
IDEAL = ("loops={four: {}}", "horizon=2.5", "scenarios=[{loop: four, reference: {duration: 0.4}}]")
# Gains of pid-ff of which the first are the better ones on that loop, and stand neither more torque nor a later one.
FRAGILE, SOUND = (1830.0, 0.84, 0.455), (300.0, 0.5, 0.455)


def _torques(
    law: Controller, gains: Sequence[float] | np.ndarray[Any, Any], loop: Loop | None = None
) -> np.ndarray[Any, Any]:
    """The torque that a controller gives over a step, of a loop without limits."""
    followed = motion(Reference(kind="step", angle_deg=10.0), WRIST, 0.05, 1e-3)
    loop = loop or Loop(plant_segments=1, limits=False)
    done = rollout(law, np.array([gains]), [followed], np.zeros(1, np.int64), loop, WRIST, record=True)
    return done.column("torque_wanted", 0)


def test_a_factor_of_the_torque_is_one_of_all_gains_of_a_pid() -> None:
    gains = np.array([2.0, 5.0, 0.1])
    changed = _torques(changed_law(controller("pid")), [*gains, 1.5, 0.0])
    np.testing.assert_allclose(changed, _torques(controller("pid"), 1.5 * gains), rtol=1e-9)


def _follows(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    memory[0] = memory[0] + gains.K * now.theta_ref
    return memory[0]


def _follows_both(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    for p in range(len(torque)):
        memory[p][0] = memory[p][0] + gains.K * now[p].theta_ref
        torque[p] = memory[p][0]


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("plain", [False, True])
def test_a_late_torque_is_the_same_some_periods_later_whatever_law_gives_it(plain: bool, planes: int) -> None:
    """Of a law that knows the reference alone, and remembers: compiled or plain Python, of a plane or of both."""
    gain, law = controller("pid").gains["Kp"], _follows if planes == 1 else _follows_both
    own = Controller("follows", law, "", {"K": gain}, {}, memory=1, plain=plain, planes=planes)
    before, late = _torques(own, [0.1]), _torques(changed_law(own), [0.1, 2.0, 3.0])
    assert np.array_equal(late[3:], 2.0 * before[:-3]) and not late[:3].any() and before[0] > 0.0


def test_a_change_of_the_world_comes_on_top_of_what_is_true_of_it() -> None:
    loop = Loop(sensor=Sensor(level="camera"), plant=Plant(stiffness_scale=0.8, sensor=TrueSensor(delay_frames="x1.5")))
    case = Case(loop, motion(Reference(), WRIST, 1.0, 1e-3), (0,), 0)
    own = OwnLoop([case], WRIST, controller("feedforward"))
    (late,), (soft,) = own._cases_under(Change("late", 2)), own._cases_under(Change("springs", 0.6))
    assert late.loop.plant.sensor.of(loop.sensor).delay_frames == 5.0
    assert soft.loop.plant.stiffness_scale == pytest.approx(0.48)
    assert loop.plant.stiffness_scale == late.loop.plant.stiffness_scale == 0.8


def test_gains_stand_up_to_the_last_change_before_the_first_that_they_lose(monkeypatch: pytest.MonkeyPatch) -> None:
    flat = [change for ladder in LADDERS for change in ladder]
    assert {ladder[0] for ladder in LADDERS} == set(CHANGES), "each begins with what must be stood"
    lost = {Change("torque", 0.33), Change("torque", 1.5), Change("late", 3), Change("springs", 0.25)}
    own = OwnLoop([], WRIST, controller("feedforward"))
    answers = np.array([[[change in lost, False] for change in flat]])
    monkeypatch.setattr(own, "lost", lambda law, gains, changes: answers)
    stood = own.stood(controller("pid"), np.ones(3))
    assert stood == Stood(0.5, 1.0, 2.0, 0.4, 3.0) and not stood.enough


def test_what_gains_lose_of_the_changed_loops_costs_the_root_of_its_share() -> None:
    """Measured by a loop that a stiff controller makes swing with more torque, or a period later."""
    study = load_study([], [*IDEAL, "objective.margin=0.7"], "tune")
    cases, law, gains = tuning_cases(study)[0], controller("pid-ff"), np.array([FRAGILE, SOUND])
    judge = Judge(cases, study.wrist, study.tune.objective)
    nominal = Judge(cases, study.wrist, study.tune.objective.model_copy(update={"margin": 0.0}))
    lost = judge.own_loop.lost(law, gains)[:, :, 0]
    named = [[change for change, gone in zip(CHANGES, row, strict=True) if gone] for row in lost]
    assert named == [[Change("torque", 1.5), Change("late", 1)], []]
    assert nominal(law, gains)[0] < nominal(law, gains)[1], "without a margin the fragile gains are the better ones"
    costs = 0.7 * np.sqrt(lost.mean(axis=1))
    np.testing.assert_allclose(judge(law, gains), nominal(law, gains) + costs, rtol=1e-12)
    assert np.argmin(judge.choice(law, gains)) == np.argmin(judge.beside(law, gains, np.inf)) == 1


def test_only_gains_that_would_be_the_best_are_tried_on_changed_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study([], list(IDEAL), "tune")
    judge, tried = judges_of(study)[0], list[int]()
    lost = np.array([0.0, 0.25, 0.0, 0.0])

    def looked(law: Controller, gains: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        tried.extend(gains[:, 0].astype(int))
        return lost[gains[:, 0].astype(int)][:, None, None]

    values = np.array([0.0, -2.0, -1.8, -1.0])
    monkeypatch.setattr(judge.own_loop, "lost", looked)
    monkeypatch.setattr(judge, "value", lambda measured: values[measured].copy())
    monkeypatch.setattr("wristctl.tuning.objective.measure", lambda law, gains, *_, **__: gains[:, 0].astype(int))
    candidates, law = np.arange(4.0)[:, None], controller("pid")
    for judged in (judge.choice, partial(judge.beside, best=np.inf)):
        np.testing.assert_allclose(judged(law, candidates), [0.0, -1.5, -1.8, -1.0])
        assert tried == [1, 2, 3, 0], "those that are likely to be next are tried with it"
        tried.clear()
    np.testing.assert_allclose(judge.beside(law, candidates, -1.7), [0.0, -1.5, -1.8, -1.0])
    assert tried == [1, 2]


@pytest.mark.slow
def test_a_search_finds_gains_that_stand_the_changes_where_one_without_margin_does_not() -> None:
    small = [*IDEAL, "candidates=12", "iterations=12", "finalists=8"]
    enough = {}
    for weight in (0.0, 1.0):
        study = load_study([], [*small, f"objective.margin={weight}"], "tune")
        judges, law = judges_of(study), controller("pid-ff")
        found = search(study, law, lambda text: stream(0, text), judges)
        enough[weight] = judges[0].own_loop.stood(law, np.array(law.values(found.gains))).enough
    assert enough == {0.0: False, 1.0: True}


@pytest.mark.slow
def test_margins_are_judged_in_two_planes_on_the_familys_own_loop() -> None:
    """Its motions, and nothing of what is drawn of the world: gains are lost there where they swing in either plane."""
    study = load_study(
        [],
        [
            "families.f.draw={plant.stiffness: x0.3..3, reference.angle_deg: 10..20}",
            "families.f.loop={planes: 2}",
            "families.f.horizon=2.5",
            "families.f.references=[{kind: minimum-jerk, duration: 0.4}]",
            "tune.worlds={family: f, draws: 2}",
        ],
    )
    own, law = own_loop(study, []), controller("pid-ff")
    loops = {case.loop.model_dump_json() for case in own._cases}
    assert own.count == 4 and len(loops) == 1 and {case.motion.planes for case in own._cases} == {2}
    assert (
        own._cases[0].loop.plant == Plant() and len({case.motion.tip_desired[-1].tobytes() for case in own._cases}) == 4
    )
    lost = own.lost(law, np.array([FRAGILE, gains_of(law, "default")])).all(axis=2)
    assert lost.tolist() == [[False, True, True, False, False], [False] * 5]
