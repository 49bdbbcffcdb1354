"""Which parameters count as identified, and what is said and offered where they do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.benches import KNOWN, LEVEL, START, TENDONS, UPRIGHT
from wristctl.config.identify import IdentifySettings
from wristctl.errors import UserError
from wristctl.identification import identifiability
from wristctl.identification.fit import Fit, Linearisation, fit, linearise
from wristctl.identification.forward import Supposed
from wristctl.identification.identifiability import (
    ADDITIONS,
    FINER,
    Addition,
    additions,
    budget,
    not_identified,
    refuse,
    widest,
    width_text,
)  # fmt: skip
from wristctl.identification.intervals import Knowledge, knowledge
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import UNKNOWNS

TIME = 0.005 * np.arange(400.0)
HALF = {
    "stiffness": 0.1,
    "damping": 0.1,
    "tendon_stiffness": 0.1,
    "friction": 0.05,
    "sheath_friction": 0.05,
    "presliding": 2.0,
    "delay": 1e-3,
    "tendon_radius": 0.1,
}
"""Half widths with which everything is identified."""


def trial(wrist: object = KNOWN, run: str = "a") -> MeasuredTrial:
    """Spools that swing slowly to one side and back."""
    moved = 2e-3 * np.sin(np.pi * TIME / TIME[-1])
    reeled = np.stack([moved, moved, -moved, -moved], axis=1) + 2e-4
    frames = TIME[10:-10:4]
    return MeasuredTrial("", run, "ulnar", wrist, TIME, reeled, frames, np.zeros(len(frames)), 0.0)  # type: ignore[arg-type]


def at(
    half: Mapping[str, float] | None = None, moved: Mapping[str, float] | None = None, condition: float = 10.0
) -> dict[str, float]:
    """What is not identified of a fit at its start, but `moved` coordinates, known to half widths HALF but these."""
    problem = Problem([trial()], START, IdentifySettings(), TENDONS)
    x = problem.begin()
    for name, value in (moved or {}).items():
        x[problem.free.index(name)] = value
    deviation = np.zeros(len(x))
    deviation[: len(problem.free)] = np.array([(HALF | dict(half or {}))[name] for name in problem.free]) / 1.959964
    fitted = Fit(problem, x, 1e-3, [np.zeros(95)], [np.zeros((95, len(x)))], 1)
    return not_identified(fitted, Knowledge(deviation, np.eye(len(x)), condition, 0.0, 95.0, np.zeros(len(x))))


def test_an_interval_may_be_a_quarter_of_the_value_wide_to_either_side() -> None:
    settings = IdentifySettings()
    assert widest("stiffness", settings) == pytest.approx(np.log(1.25)) == widest("tendon_radius", settings)
    assert widest("friction", settings) == pytest.approx(0.1) and widest("delay", settings) == pytest.approx(5e-3)
    double = IdentifySettings(widest=0.5)
    assert widest("damping", double) == pytest.approx(np.log(1.5)) and widest("delay", double) == pytest.approx(0.01)


def test_what_is_known_too_badly_is_named_with_its_half_width() -> None:
    assert at() == {}
    for name, limit in (("stiffness", np.log(1.25)), ("friction", 0.1), ("delay", 5e-3)):
        assert at({name: 1.001 * limit}) == pytest.approx({name: 1.001 * limit}, rel=1e-5)
        assert at({name: 0.999 * limit}) == {}
    assert (
        list(at(condition=1001.0)) == [name for name in UNKNOWNS if name != "flexion_ratio"]
        and at(condition=999.0) == {}
    )


def test_a_value_at_the_edge_of_the_search_is_not_found_but_no_friction_is_friction() -> None:
    for name in ("stiffness", "delay", "tendon_radius"):
        for edge in UNKNOWNS[name].bounds():
            assert list(at(moved={name: edge})) == [name]
            assert at(moved={name: 0.999 * edge}) == {}
    assert at(moved={"friction": 0.0}) == {}


def test_half_widths_are_told_in_per_cent_or_their_own_unit() -> None:
    assert width_text("stiffness", np.log(1.123)) == "12 %" and width_text("damping", np.log(1.0456)) == "4.6 %"
    assert width_text("stiffness", np.log(3.456)) == "246 %" and width_text("stiffness", np.log(10.9)) == "990 %"
    assert width_text("stiffness", np.log(2.5)) == "150 %" and width_text("stiffness", np.log(1.05)) == "5 %"
    assert width_text("stiffness", np.log(11.1)) == "over 1000 %" == width_text("stiffness", 1e9)
    assert width_text("delay", 0.0123) == "12 ms" and width_text("friction", 0.123) == "0.12"


@pytest.mark.parametrize("what", ADDITIONS)
def test_what_is_offered_is_what_is_said(what: str) -> None:
    move, load = ADDITIONS[what]
    moved, loaded = move(trial()), load(trial())
    early = np.flatnonzero(TIME[-1] / 3.0 > TIME)
    if "three times as fast" in what:
        np.testing.assert_allclose(moved.reeled[early], trial().reeled[3 * early], atol=1e-12)
        assert (moved.reeled[-200:] == trial().reeled[-1]).all(), "then at rest"
    else:
        np.testing.assert_array_equal(moved.reeled, trial().reeled)
    across = 9.81 * np.sqrt(0.5)
    gravity = (0.0, pytest.approx(across, abs=0.005)) if "another pose" in what else KNOWN.gravity
    assert loaded.wrist.gravity == gravity and ("6.94" in what) == ("another pose" in what)
    more = 0.2 if "0.2 kg more" in what else 0.0
    assert loaded.wrist.hand_mass == pytest.approx(KNOWN.hand_mass + more)
    assert ("known mass" in what) == (more > 0.0)


def offer(what: str, enough: bool, **half: float) -> Addition:
    return Addition(what, HALF | half, enough)


def test_the_first_offer_that_is_enough_is_advised_and_else_more_of_the_best() -> None:
    def advised(*offered: Addition) -> UserError:
        with pytest.raises(UserError) as caught:
            refuse({"delay": 0.02, "friction": 0.3}, list(offered), 1234.5, START)
        return caught.value

    told = advised(offer("A", False), offer("B", True, delay=0.001), offer("C", True))
    assert "identify delay, friction; condition number 1.23e+03" in str(told) and told.exit_code == 3
    assert "add B;" in told.fix and "fix.delay=0" in told.fix
    worse, better = offer("A", False, stiffness=0.9, delay=1e-3), offer("B", False, stiffness=0.2, delay=0.016)
    assert "add repetitions of B;" in advised(worse, better).fix, "0.016 s is 0.8 of the delay's own scale"
    assert "add repetitions of A;" in advised(worse, offer("B", False, stiffness=0.2, delay=0.02)).fix
    refuse({}, [], 1e9, START)


BELIEVED = {
    "mass of the hand": "hand_mass", "distance of the hand's centre of mass": "hand_offset",
    "length of the wrist": "length", "mass of the wrist": "mass",
}  # fmt: skip
HELD = {name: START[name] for name in UNKNOWNS if name not in ("stiffness", "delay")} | {"friction": 0.0}
QUICK = {"fix": HELD, "segments": 1, "step": 5e-3, "clock_error": 0.0}


def simulated(wrist: object, truth: dict[str, float]) -> MeasuredTrial:
    """A trial that shows what the model expects at `truth`."""
    blank = trial(wrist)
    problem = Problem([blank], START | truth, IdentifySettings.model_validate(QUICK), TENDONS)
    course = problem.simulate(blank, [problem.candidate(blank, problem.begin())])[0]
    noise = 2e-4 * np.random.default_rng(0).standard_normal(len(blank.captured))
    return replace(blank, angle=blank.shown(course, truth["delay"]) + noise)


@pytest.mark.slow
def test_a_fit_moves_as_the_budget_says_where_what_is_believed_is_wrong() -> None:
    """The trials fitted again with 1 % more, or on a base that leans by 1 deg."""
    truth = {"stiffness": 0.9 * START["stiffness"], "delay": 0.02}
    trials = [simulated(LEVEL, truth), replace(simulated(UPRIGHT, truth), run="b")]
    settings = IdentifySettings.model_validate(QUICK)
    fitted = fit(Problem(trials, START, settings, TENDONS))
    assert fitted.values["stiffness"] == pytest.approx(truth["stiffness"], rel=0.03)
    moved = budget(fitted, knowledge(fitted))
    leaves = {f"1 % more {what}": leaf for what, leaf in BELIEVED.items()} | {"a base that leans by 1 deg": "gravity"}
    assert set(moved) == {*leaves, FINER}
    for name, leaf in leaves.items():
        changed = []
        for each in trials:
            along, across = each.wrist.gravity
            c, s = np.cos(np.radians(1.0)), np.sin(np.radians(1.0))
            leaning = along * c + across * s, across * c - along * s
            new = leaning if leaf == "gravity" else 1.01 * getattr(each.wrist, leaf)
            changed.append(replace(each, wrist=each.wrist.model_copy(update={leaf: new})))
        again = fit(Problem(changed, START, settings, TENDONS))
        for at_, free in enumerate(fitted.problem.free):
            step = again.x[at_] - fitted.x[at_]
            assert moved[name][free] == pytest.approx(step, rel=0.2, abs=2e-4), (name, free)
    again = fit(Problem(trials, START, settings.model_copy(update={"segments": 8}), TENDONS))
    step, sd = again.x[0] - fitted.x[0], float(knowledge(fitted).deviation[0])
    assert abs(moved[FINER]["stiffness"] - step) < 0.1 * sd, "a search may end so far beside, where a tendon jumps"
    assert 1e-4 < abs(moved[FINER]["stiffness"]) < 0.1 * sd


def test_added_trials_are_reckoned_at_the_start_of_what_is_not_known() -> None:
    """The same widths whatever value a parameter took that the trials do not tell."""
    settings = IdentifySettings.model_validate(QUICK)
    problem = Problem([simulated(LEVEL, {"stiffness": START["stiffness"], "delay": 0.0})], START, settings, TENDONS)
    here = fit(problem)
    x = here.x.copy()
    x[problem.free.index("stiffness")] += 1.0
    here = replace(here, noise=1e-3)
    one, other = (additions(each, {"stiffness": 1.0, "delay": 1.0}) for each in (here, replace(here, x=x)))
    assert [each.what for each in one] == list(ADDITIONS)
    for a, b in zip(one, other, strict=True):
        assert a.half_widths == pytest.approx(dict(b.half_widths), rel=1e-3)
        assert a.enough == all(half <= widest(name, settings) for name, half in a.half_widths.items())
    noisier = additions(replace(here, noise=2e-3), {"stiffness": 1.0, "delay": 1.0})
    for a, b in zip(one, noisier, strict=True):
        assert a.half_widths["delay"] < b.half_widths["delay"] <= 2.001 * a.half_widths["delay"]


def test_an_added_trial_bends_as_before_under_its_own_load(monkeypatch: pytest.MonkeyPatch) -> None:
    """One side's spools reel in what holds the load, the other's move as they did."""
    reckoned: list[Sequence[MeasuredTrial]] = []

    def spy(problem: Problem, x: np.ndarray) -> Linearisation:
        reckoned.append(problem.trials)
        return linearise(problem, x)

    settings = IdentifySettings.model_validate(QUICK)
    own = simulated(UPRIGHT, {"stiffness": START["stiffness"], "delay": 0.0})
    problem = Problem([own], START, settings, TENDONS)
    found = replace(fit(problem), noise=1e-3)
    monkeypatch.setattr(identifiability, "linearise", spy)
    assert [each.what for each in additions(found, {})] == list(ADDITIONS)

    def course(trial: MeasuredTrial) -> np.ndarray:
        wrist = trial.wrist.model_copy(update={"stiffness": found.values["stiffness"]})
        supposed = Supposed(wrist, TENDONS)
        bent: np.ndarray = problem.simulate(trial, [supposed])[0]
        return bent

    for (what, (move, load)), (first, added) in zip(ADDITIONS.items(), reckoned, strict=True):
        assert first is own and added.run == "a again"
        moved = move(own)
        more = added.reeled - moved.reeled
        assert more.min() >= 0.0 and (np.minimum(more[:, 0], more[:, 2]) == 0.0).all()
        np.testing.assert_array_equal(more[:, ::2], more[:, 1::2])
        assert added.wrist == load(moved).wrist
        if "another pose" in what:
            wanted, sagged = course(moved), course(replace(added, reeled=moved.reeled))
            sag = np.abs(sagged - wanted)
            assert sag.max() > 0.01 and np.abs(course(added) - wanted).mean() < 0.1 * sag.mean()


def test_an_addition_is_enough_where_it_identifies_every_parameter() -> None:
    settings = IdentifySettings.model_validate(QUICK)
    fitted = fit(Problem([simulated(LEVEL, {"stiffness": START["stiffness"], "delay": 0.0})], START, settings, TENDONS))
    mixed = 0
    for noise in np.geomspace(1e-4, 1.0, 13):
        for each in additions(replace(fitted, noise=float(noise)), {}):
            told = [half <= widest(name, settings) for name, half in each.half_widths.items()]
            assert each.enough == all(told)
            mixed += any(told) and not all(told)
    assert mixed > 0
