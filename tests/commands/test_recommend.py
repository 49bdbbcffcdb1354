"""What `recommend` finds: presets scaled to a wrist, and a controller that holds on every simulated rig."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import wristctl
from tests.commands.small_recommendation import RIG, study_of
from wristctl.commands.kept_studies import gains_content, hw_run_fits, row_of, study_text
from wristctl.commands.recommend.answer import NEAR, RECOMMENDED, Recommended, _not_tuned
from wristctl.commands.recommend.command import _limit
from wristctl.commands.recommend.expected import FAMILY, SCALED, TOLERATED, TUNED, Candidate, spread
from wristctl.commands.recommend.figures import errors
from wristctl.commands.recommend.rehearsals import Rehearsal
from wristctl.commands.recommend.study_file import next_command, sections_of, takers_of
from wristctl.config.loop import Loop, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.cases import Measured, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.simulation.oscillation import FASTEST, oscillations, sustained
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.study_files.load import load_study
from wristctl.trial.rehearsed import Rehearsed
from wristctl.tuning.scaled_presets import dynamic_stiffness, scaled_to
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

WRIST = WristParameters()


def heavier(times: float) -> WristParameters:
    """A wrist of which every torque is so many times the default one's."""
    loads = ("mass", "hand_mass", "stiffness", "damping", "pretension", "tension_limit")
    return WRIST.model_copy(update={name: times * getattr(WRIST, name) for name in loads})


def test_the_dynamic_stiffness_is_the_torque_of_a_small_swing_to_its_angle() -> None:
    """At 15 rad/s, by the wrist's own motion under a sine of torque, without gravity and once it goes on."""
    wrist = WRIST.model_copy(update={"gravity": (0.0, 0.0)})
    hinge, torque = segments(wrist, 1), 1e-3

    def moves(t: float, state: np.ndarray) -> list[float]:
        at = terms(hinge, state[:1], state[1:])
        held = wrist.stiffness * state[0] + wrist.damping * state[1]
        return [state[1], (torque * math.sin(15.0 * t) - held) / float(at.mass[0, 0])]

    turn = 2.0 * math.pi / 15.0
    kept = solve_ivp(moves, (0.0, 12.0 * turn), (0.0, 0.0), rtol=1e-6, atol=1e-9, max_step=turn / 20.0)
    swing = np.abs(kept.y[0][kept.t > 11.0 * turn]).max()
    assert torque / swing == pytest.approx(dynamic_stiffness(wrist), rel=5e-3)


@settings(max_examples=20, deadline=None)
@given(times=st.floats(0.3, 3.0))
def test_where_all_torques_are_scaled_the_dynamic_stiffness_is_too_and_so_are_gains_of_torque(times: float) -> None:
    wrist = heavier(times)
    assert dynamic_stiffness(wrist) == pytest.approx(times * dynamic_stiffness(WRIST), rel=1e-12)
    for name, power in (("pid-ff", 1), ("ct-dob", 0)):
        law = controller(name)
        preset, gains = list(law.presets.items())[-1]
        assert scaled_to(wrist, law).presets[preset] == pytest.approx(
            {gain: value * times**power for gain, value in gains.items()}, rel=1e-9
        )
    kappa = [law.presets["default"]["kappa"] for law in (controller("nc"), scaled_to(wrist, controller("nc")))]
    assert kappa[1] == pytest.approx(kappa[0] / times, rel=1e-9), "of unit 1/(N m)"


@pytest.mark.parametrize("name", ["pid-ff", "smc-dob", "nc"])
def test_scaled_presets_move_a_wrist_of_scaled_torques_as_the_presets_moved_the_default_one(name: str) -> None:
    moved = []
    for wrist in (WRIST, heavier(2.0)):
        law = scaled_to(wrist, controller(name))
        preset = list(law.presets)[-1]
        followed = motion(Reference(), wrist, 1.5, 5e-3)
        loop = Loop(plant_segments=1, control_period=5e-3)
        gains = np.array([gains_of(law, preset)])
        done = rollout(law, gains, [followed], np.zeros(1, np.int64), loop, wrist, record=True, threads=1)
        moved.append(done.column("theta", 0))
    np.testing.assert_allclose(moved[1], moved[0], atol=2e-6)


def test_of_two_hundred_and_one_rigs_four_stay_below_the_spread_and_four_are_above_it() -> None:
    """Another one is then within it with a probability of 192/202."""
    assert spread(np.arange(201.0)[::-1]) == (4.0, 100.0, 196.0)


@pytest.fixture(scope="module")
def reported() -> list[tuple[str, int]]:
    """What the recommendation was at, and its count, at each step of its progress."""
    return []


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory, reported: list[tuple[str, int]]) -> Recommended:
    def watch(what: str, count: int, *_: object) -> None:
        reported.append((what, count))

    return wristctl.recommend(study_of(), out=tmp_path_factory.mktemp("recommend"), progress=watch)


@pytest.mark.slow
def test_a_search_counts_by_its_rigs_those_twice_by_which_gains_are_chosen(
    found: Recommended, reported: list[tuple[str, int]]
) -> None:
    """An iteration on two rigs and a choice on two for each of two controllers: 2, 6, 8 and 12 of 12."""
    shares = [count for what, count in reported if what == "tuning"]
    assert shares == sorted(shares) and shares[-1] == 100
    assert {17, 50, 67} <= set(shares) and max(share for share in shares if share < 67) == 50


@pytest.mark.slow
def test_what_is_recommended_is_best_of_what_holds_on_every_rig(found: Recommended) -> None:
    ranked, best = found.ranking, found.best
    assert best is not None and best.controller in ("pid-ff", "ct-dob")
    first = found.best_row
    assert first is not None and found.candidates[first] == best and ranked.standing.lost[first].low <= TOLERATED
    assert ranked.means[first].value <= NEAR * min(mean.value for mean in ranked.means)
    medians = [np.median(row.rmse) for row in ranked.rows]
    assert found.metrics["rmse"] == pytest.approx(medians[first], rel=0.2) and medians[first] < medians[-1]
    assert found.metrics["rmse_low"] <= found.metrics["rmse"] <= found.metrics["rmse_high"]
    assert [limit.value for limit in found.motions] == [0.5, 1.0] and found.payloads[0].rigs == 12


def test_its_gains_are_a_study_file_for_simulate_and_hw_run(found: Recommended) -> None:
    assert found.run is not None and found.best is not None
    file = found.run.file(RECOMMENDED)
    written = yaml.safe_load(file.read_text())
    study = wristctl.load_study(file)
    assert study.simulate.controller == found.best.controller == study.hw_run.rows[0].controller
    assert study.simulate.gains == study.hw_run.rows[0].gains == written["simulate"]["gains"]
    assert written["simulate"]["gains"] == pytest.approx(found.best.gains, rel=1e-5)


def test_the_gains_of_every_row_are_a_file_that_the_readme_names(found: Recommended) -> None:
    assert found.run is not None
    readme = found.run.file("README.md").read_text()
    for candidate in found.candidates:
        assert candidate.file in readme
        study = wristctl.load_study(found.run.file(candidate.file))
        rows: list[Any] = [study.simulate, *study.hw_run.rows, *study.compare.rows]
        for row in rows:
            assert (row.controller, row.gains) == (candidate.controller, pytest.approx(candidate.gains, rel=1e-5))
    ranked = wristctl.load_study(found.run.file(RECOMMENDED)).compare.rows
    assert found.best is not None and ranked[0].controller == found.best.controller
    assert sorted(row.controller for row in ranked) == sorted(one.controller for one in found.candidates)
    assert all(f"{name} = {value:.3g}" in readme for one in found.candidates for name, value in one.gains.items())
    assert "data/controllers/" in " ".join(found.answer.lines())


def test_a_search_that_ends_where_it_began_is_no_row_of_its_own(found: Recommended) -> None:
    for name in {one.controller for one in found.candidates}:
        gains = [list(one.gains.values()) for one in found.candidates if one.controller == name]
        assert not any(np.allclose(one, other, rtol=1e-6) for one, other in pairwise(gains))
    feedforward = found.candidates[-1]
    untuned = replace(found, candidates=[Candidate("pid-ff", SCALED, {"Kp": 1.0}), feedforward])
    preset = Candidate("ct-dob", SCALED, {"Kp": 1.0})
    both = [preset, preset._replace(origin=TUNED), *untuned.candidates]
    for candidates, names in ((untuned.candidates, "pid-ff and ct-dob"), (both, "pid-ff")):
        said = _not_tuned(replace(untuned, candidates=candidates))
        assert "(1 x 4 candidates)" in said and said.endswith(f" for {names}.")
    assert not _not_tuned(replace(untuned, candidates=[one._replace(origin=TUNED) for one in both]))


def test_limits_are_those_of_the_gains_by_their_names() -> None:
    """Whatever their order, which a preset has of its own: with two exchanged every rig would swing."""
    study = study_of()
    law = scaled_to(WRIST, controller("pid-ff"))
    assert list(law.presets["hardware"]) != list(law.gains)
    one = Candidate("pid-ff", "scaled preset", dict(law.presets["hardware"]))
    other = one._replace(gains=dict(zip(law.gains, law.values(one.gains), strict=True)))
    family = study.recommend.family(20.0)
    assert _limit(study, one, 0.5, family) == _limit(study, other, 0.5, family)


def test_a_cross_of_the_figure_is_a_rig_that_a_controller_loses(found: Recommended) -> None:
    """Of two rows one swings on three rigs and fails on a fourth, which has no error and stands at the right edge."""
    rows = list(found.ranking.rows)
    rmse, swings = rows[0].rmse.copy(), np.zeros(8, bool)
    rmse[0], swings[1:4] = np.inf, True
    rows = [rows[0]._replace(rmse=rmse, swings=swings), *(row._replace(swings=np.zeros(8, bool)) for row in rows[1:])]
    (axes,) = errors(replace(found, ranking=replace(found.ranking, rows=rows))).axes
    crosses = np.concatenate([line.get_xdata() for line in axes.get_lines() if line.get_marker() == "x"])
    dots = np.concatenate([line.get_xdata() for line in axes.get_lines() if line.get_marker() == "."])
    assert len(crosses) == 4 and len(dots) == 8 * len(rows) - 4
    assert sorted(crosses)[:3] == pytest.approx(sorted(np.degrees(rmse[1:4]))) and crosses.max() > dots.max()
    assert "cross: swings or chatters there; at the right edge: fails" in axes.get_xlabel()


def test_its_answer_fits_a_screen_and_names_gains_error_and_limits(found: Recommended) -> None:
    lines = found.answer.lines()
    assert len(lines) <= 32 and all(len(line) <= 100 for line in lines if not line.startswith("wristctl "))
    text = " ".join(lines)
    assert found.best is not None and all(f"{name} = {value:.3g}" for name, value in found.best.gains.items())
    assert f"{math.degrees(found.metrics['rmse']):.2g} deg" in text
    assert all(candidate.label in text for candidate in found.candidates)
    assert "deg on 8 simulated rigs)" in text and "So few rigs prove little: 40 or more with recommend.tests." in text
    many = replace(found.ranking, scores=np.repeat(found.ranking.scores, 25, axis=1))
    enough = " ".join(replace(found, ranking=many).answer.lines())
    assert "deg on 95 % of 200 simulated rigs)" in enough and "prove little" not in enough


@pytest.mark.slow
def test_the_same_seed_recommends_the_same_and_another_draws_other_rigs(found: Recommended) -> None:
    again = wristctl.recommend(study_of())
    assert again.metrics == found.metrics and again.best == found.best
    other = wristctl.recommend(study_of("seed=1"))
    assert other.metrics["rmse"] != found.metrics["rmse"]


def test_where_every_controller_chatters_nothing_is_recommended() -> None:
    """The paper's PID at a period of 50 ms, which its preset and what so short a search finds do not stand."""
    done = wristctl.recommend(study_of("recommend.controllers=[pid]", "recommend.loop.control_period=5e-2"))
    assert done.best is None and done.fault is not None and done.fault.exit_code == 3
    *of_pid, feedforward = [share.times for share in done.ranking.standing.lost]
    assert set(of_pid) == {8} and feedforward == 0 and not done.motions
    assert done.marks and len(done.answer.lines()) <= 32
    assert {row[2] for row in done.tables[0].rows} == {one.file for one in done.candidates}


def test_a_recommendation_is_for_the_ticks_of_a_trial_unless_a_study_says_otherwise() -> None:
    study = wristctl.load_study(None)
    assert study.recommend.loop.control_period == study.hw_run.control_period


def measured_on(cases: list[Any], name: str, gains: dict[str, float]) -> Any:
    law = controller(name)
    return measure(law, np.array([list(law.values(gains))]), cases, WRIST, ["rmse", "oscillation", "sustained"])


def test_swings_are_seen_while_the_reference_moves_beside_those_without_feedback() -> None:
    """A disturbance observer that is faster than the camera swings on a sine; feedforward never does beside itself."""
    study = wristctl.load_study(None)
    family = study.recommend.family(20.0)
    slow = Reference(kind="two-sided-sine", frequency=0.5, angle_deg=20.0)
    family = family.model_copy(update={"draw": {}, "references": (slow,), "horizon": 4.0})
    cases = drawn_cases(family, FAMILY, "test", 0, 1, WRIST)
    open_loop = measured_on(cases, "feedforward", {})
    assert not open_loop.swings_beside(open_loop).any() and open_loop.largest_swing(open_loop) == 0.0
    calm = measured_on(cases, "ct-dob", {"w": 15.0, "zeta": 1.0, "wo": 10.0})
    wild = measured_on(cases, "ct-dob", {"w": 120.0, "zeta": 0.3, "wo": 1000.0})
    assert not calm.swings_beside(open_loop).any()
    assert wild.swings_beside(open_loop).all() and wild.largest_swing(open_loop) > math.radians(0.5)


def test_the_size_of_a_swing_is_of_what_swings_and_not_of_what_chatters_or_kinks() -> None:
    """Of five cases one chatters at rest and one swings there; in motion two have kinks, and one swings on and on."""

    def measured(oscillation: list[float], sustained: list[float], chattering: float = 0.0) -> Measured:
        slams = [chattering, *[0.0] * 4]
        rows = {"oscillation": oscillation, "sustained": sustained, "chattering": slams, "drift": [0.0] * 5}
        arrays = {name: np.array([values]) for name, values in rows.items()}
        rests = np.array([True, True, False, False, False])
        return Measured(arrays, np.zeros((1, 5), bool), np.ones((1, 5)), rests, WRIST.tension_range)

    slams = 4.0 * WRIST.tension_range * 2.0 * FASTEST
    own = measured([1e-5, 3e-3, 9e-2, 9e-3, 6e-3], [1e-5, 2e-3, 1e-3, 7e-3, 5e-3], slams)
    open_loop = measured([0.0, 0.0, 5e-3, 5e-3, 1e-3], [0.0, 0.0, 1e-4, 3e-3, 5e-4])
    assert own.swings_beside(open_loop).tolist() == [[True, True, False, False, True]]
    assert own.largest_swing(open_loop) == 5e-3, "7e-3 rad are less than twice what feedforward shows there"
    chatters = measured([1e-5, 0.0, 0.0, 0.0, 0.0], [1e-5, 0.0, 0.0, 0.0, 0.0], slams)
    assert chatters.swings_beside(open_loop).any() and chatters.largest_swing(open_loop) == 0.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_swing_that_goes_on_has_its_amplitude_and_a_kink_that_is_over_has_almost_none(sign: float) -> None:
    """On a sine to both sides: a faster one of 1 deg all the time, and one that dies out in a tenth of a period."""
    time = np.arange(0.0, 5.0, 5e-3)
    wanted = sign * 0.3 * np.sin(2.0 * np.pi * 0.5 * time)
    fast = math.radians(1.0) * np.sin(2.0 * np.pi * 6.0 * time)
    kink = fast * np.exp(-((time + 0.5) % 1.0) / 0.05)
    theta, which = np.array([wanted + fast, wanted + kink]), np.zeros(2, np.int64)
    on, over = np.degrees(sustained(theta, wanted[None], which, 5e-3))
    assert on == pytest.approx(1.0, rel=0.15) and over < 0.05
    assert np.degrees(oscillations(theta, wanted[None], which, 5e-3))[1] > 5.0 * over


OWN = """
from wristctl.control.law import Controller, Gain
from wristctl.control.model import inverse_dynamics
def law(now, wrist, gains, memory):
    forward = inverse_dynamics(wrist, now.theta_ref, now.rate_ref, now.acceleration_ref)
    return forward - gains.k * (now.theta - now.theta_ref) - gains.d * (now.rate - now.rate_ref)
GAINS = {"k": Gain("N m/rad", "spring", 0.1, 4.0), "d": Gain("N m s/rad", "damper", 1e-2, 0.08)}
MINE = Controller("mine", law, "", GAINS, {"soft": {"k": 2.0, "d": 0.05}})
"""


@pytest.mark.slow
def test_a_controller_of_ones_own_is_recommended_by_the_runs_copy_of_it(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    place = f"{tmp_path / 'own.py'}:MINE"
    done = wristctl.recommend(study_of(f"recommend.controllers=[{place}]"), out=tmp_path)
    assert done.run is not None and done.best is not None and done.best.controller == "mine"
    assert "own.py:MINE" in done.run.file("config.yaml").read_text()
    copy = done.run.path / "code" / "own" / "own.py"
    for file in (done.best.file, RECOMMENDED):
        again = wristctl.load_study(done.run.file(file), trust_code=True)
        assert again.hw_run.rows[0].controller == again.simulate.controller and copy.read_text() == OWN
        assert Path(again.simulate.controller.rpartition(":")[0]).resolve() == copy.resolve()
    assert not wristctl.simulate(again).failed


@pytest.mark.slow
def test_where_no_feedback_is_better_than_none_that_is_the_reason_and_not_that_all_swing() -> None:
    """The same rows in three other orders: feedforward alone first, nothing ranked, and feedforward in a tie."""
    found = done = wristctl.recommend(study_of("recommend.controllers=[pid-ff]"))
    ranked = replace(done.ranking, standing=done.ranking.standing._replace(groups=[[len(done.candidates) - 1], [0]]))
    behind = replace(found, ranking=ranked)
    assert behind.best is None and behind.fault is not None and "feedforward" in behind.fault.what
    nothing = replace(found, ranking=replace(ranked, standing=ranked.standing._replace(groups=[])))
    assert nothing.best is None and nothing.fault is not None and "swings" in nothing.fault.what
    tied = replace(ranked, standing=ranked.standing._replace(groups=[[len(done.candidates) - 1, 0]]))
    assert replace(found, ranking=tied).best == done.candidates[0]


def lost_on(found: Recommended, lost: dict[int, int]) -> dict[str, Any]:
    """Standing and rows of which these swing on so many of the eight rigs, the first ones, and the others on none."""
    rows = [row._replace(swings=np.arange(8) < lost.get(k, 0)) for k, row in enumerate(found.ranking.rows)]
    counts = [one._replace(times=lost.get(row, 0)) for row, one in enumerate(found.ranking.standing.lost)]
    return {"rows": rows, "standing": found.ranking.standing._replace(lost=counts)}


def test_of_what_no_test_tells_apart_the_one_is_taken_that_has_the_fewest_gains(
    found: Recommended, monkeypatch: pytest.MonkeyPatch
) -> None:
    alike = [mean._replace(value=1.0) for mean in found.ranking.means]
    monkeypatch.setattr(type(found.ranking), "means", alike)
    rows = [row for row, one in enumerate(found.candidates) if one.gains]
    few, many = rows[0], rows[-1]
    rest = {row: found.candidates[row]._replace(gains=dict.fromkeys("abcdef"[: 2 + row], 1.0)) for row in rows}
    candidates = [rest.get(row, one) for row, one in enumerate(found.candidates)]

    def taken(lost: dict[int, int]) -> int | None:
        of = lost_on(found, lost)
        of["standing"] = of["standing"]._replace(groups=[[many, few, len(candidates) - 1]])
        return replace(found, candidates=candidates, ranking=replace(found.ranking, **of)).best_row

    assert taken({}) == few and taken({few: 5}) == many and taken({few: 5, many: 5}) == few
    assert taken({few: 4}) == few, "four of eight lost rigs more are one chance in 16: nothing is shown"


@pytest.mark.parametrize(("times", "kept"), [(1.2, False), (1.3, True)])
def test_of_what_errs_hardly_more_the_one_is_taken_that_is_lost_on_fewer_rigs(
    found: Recommended, monkeypatch: pytest.MonkeyPatch, times: float, kept: bool
) -> None:
    """Two candidates that a test tells apart and feedforward; the better one is lost on five rigs, or none is."""
    ranked = found.ranking
    least, more, open_loop = 0, 1, len(found.candidates) - 1
    errors = {least: 1.0, more: times}
    means = [mean._replace(value=errors.get(row, 9.0)) for row, mean in enumerate(ranked.means)]
    monkeypatch.setattr(type(ranked), "means", means)

    def told(lost: int, *groups: list[int]) -> Recommended:
        of = lost_on(found, {least: lost})
        of["standing"] = of["standing"]._replace(groups=[*groups])
        return replace(found, ranking=replace(ranked, **of))

    alone, tied = told(0, [least], [more], [open_loop]), told(0, [least, more], [open_loop])
    assert alone.best_row == least and tied.best_row in (least, more)
    every, none = (" ".join(each.answer.lines()) for each in (alone, tied))
    assert "tell its error from that of every other" in every and "do not tell its error" not in every
    assert "do not tell its error" in none and "of every other" not in none
    safer = told(5, [least], [more], [open_loop])
    assert safer.best_row == (least if kept else more)
    assert ("unstable on more rigs" in " ".join(safer.answer.lines())) != kept
    if not kept:
        run = Rehearsed("ok", 0.01, 0.0)
        worse = {least: Rehearsal({1.0: run._replace(rmse=0.1)}), more: Rehearsal({1.0: run})}
        other = replace(told(0, [least], [more], [open_loop]), rehearsals=worse)
        assert other.best_row == more and "does worse when rehearsed" in " ".join(other.answer.lines())
    behind = told(5, [least], [open_loop], [more])
    assert behind.best_row == least, "what errs more than feedforward alone is no choice"


def test_a_rig_of_which_one_thing_is_stated_keeps_its_motors_tendons_camera_and_period() -> None:
    rig = Study().recommend.loop
    assert rig.actuator.level == "tendon" and rig.sensor.level == "camera"
    for setting in ("sensor.delay_frames=3", "actuator.friction=0.3", "plant_segments=2", "control_period=1.0e-2"):
        loop = wristctl.load_study(None, f"recommend.loop.{setting}").recommend.loop
        section, _, leaf = setting.partition("=")[0].rpartition(".")
        changed = getattr(loop, section) if section else loop
        assert getattr(changed, leaf) == float(setting.partition("=")[2])
        default = {leaf: getattr(getattr(rig, section) if section else rig, leaf)}
        mended = changed.model_copy(update=default)
        assert (loop.model_copy(update={section: mended}) if section else mended) == rig, "nothing else"


BEST = Candidate("pid-ff", "tuned", {"Kp": 3.0, "Ki": 1.23456789, "Kd": 0.2})


def test_only_commands_that_can_have_the_wrist_are_named_for_its_files() -> None:
    assert takers_of(study_of(RIG)) == "simulate, compare and hw-run"
    three, six = (study_of(RIG, f"wrist.tendons={tendons}") for tendons in ("three", "six"))
    assert takers_of(three) == "simulate, compare and hw-run" and takers_of(six) == "simulate and compare"
    assert next_command(three, (), "f.yaml") == "wristctl hw-run f.yaml"
    assert next_command(six, (), "f.yaml") == "wristctl simulate f.yaml", "a board has four axes"


def test_the_next_command_is_of_the_wrist_and_not_of_the_recommendation() -> None:
    """Which the file has whole; what was set of the trial is not in it."""
    typed = (
        "my wrist.yaml",
        "--set",
        "recommend.draws=2",
        "--set",
        "wrist.length=0.1",
        "--set",
        "hw-run.repetitions=2",
    )
    told = next_command(study_of(RIG), typed, RECOMMENDED)
    assert told == f"wristctl hw-run 'my wrist.yaml' --set hw-run.repetitions=2 {RECOMMENDED}"
    assert next_command(study_of(), (), "f.yaml") == "wristctl simulate f.yaml", "hw-run has no ideal motors"


OTHER = Candidate("ct-dob", "scaled preset", {"w": 30.0, "zeta": 0.6, "wo": 300.0})


@pytest.mark.parametrize("reach, asked, largest", [(45.0, 30.0, 40.0), (12.0, 12.0, 12.0)])
def test_its_file_has_the_wrist_and_the_rig_for_simulate_compare_and_hw_run(
    tmp_path: Path, reach: float, asked: float, largest: float
) -> None:
    made_for = study_of(RIG, "wrist.length=0.11")
    rows = [row_of(one.controller, one.gains, 6) for one in (BEST, OTHER)]
    written = study_text("best", gains_content(made_for, rows, **sections_of(made_for, reach)))
    (tmp_path / "best.yaml").write_text(written)
    (tmp_path / "before.yaml").write_text("wrist: {length: 0.2, stiffness: 9}\nsimulate: {controller: smc}\n")
    read = load_study([tmp_path / "before.yaml", tmp_path / "best.yaml"])
    rig = made_for.recommend.loop
    for loop in (read.simulate.loop, read.hw_run.loop, *read.compare.loops.values()):
        assert (loop.actuator, loop.sensor, loop.control_period) == (rig.actuator, rig.sensor, 1e-2)
    assert read.wrist == made_for.wrist, "whole, so that no file before it shows through"
    assert read.hw_run.reference.end_deg == read.simulate.reference.end_deg == asked
    assert max(abs(move.end_deg) for move in read.compare.references) == largest
    assert len(set(map(str, read.compare.references))) == len(Study().compare.references)
    (row,) = read.hw_run.rows
    assert [one.controller for one in read.compare.rows] == ["pid-ff", "ct-dob"]
    assert row.gains == read.simulate.gains == read.compare.rows[0].gains == pytest.approx(BEST.gains, rel=1e-5)


@pytest.mark.parametrize("loop", ["control_period=1.0e-3", "sensor.level=ideal", "actuator.level=lagged"])
def test_a_rig_that_hw_run_cannot_have_is_left_out_of_its_section(tmp_path: Path, loop: str) -> None:
    other = study_of(RIG, f"recommend.loop.{loop}")
    assert [hw_run_fits(study, study.recommend.loop) for study in (study_of(RIG), other)] == [True, False]
    content = gains_content(other, [row_of(BEST.controller, BEST.gains)], **sections_of(other, 45.0))
    (tmp_path / "best.yaml").write_text(study_text("best", content))
    read = wristctl.load_study(tmp_path / "best.yaml")
    assert read.hw_run.actuator == Study().hw_run.actuator and read.hw_run.rows[0].controller == "pid-ff"
    assert read.simulate.loop.actuator == other.recommend.loop.actuator
