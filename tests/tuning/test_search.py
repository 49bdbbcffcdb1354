"""The search: what it is judged by, determinism, progress, going on where it was cut short, and the last choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
import wristctl.tuning
from tests.values import changeable
from wristctl.arrays import Array
from wristctl.config.study import Study
from wristctl.config.tune import Objective
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import CONTROLLERS, controller, read_gains, write_gains
from wristctl.errors import UserError
from wristctl.seeds import stream
from wristctl.simulation.cases import Case, Measured, measure
from wristctl.simulation.closed_loop import repeat, scenario_of
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.oscillation import FASTEST, LIMIT_CYCLE
from wristctl.simulation.reference import motion
from wristctl.simulation.worlds import Draws
from wristctl.study_files.load import load_study
from wristctl.tuning.gain_space import GainSpace
from wristctl.tuning.objective import Judge, marks_of
from wristctl.tuning.search import (
    Search,
    Tried,
    check_loops,
    check_tunable,
    finalists,
    history,
    search,
    tried_of,
    tuning_cases,
)

SETTINGS = (
    "loops={one: {plant_segments: 1}}", "horizon=1.2", "candidates=8", "iterations=5",
    "scenarios=[{loop: one, reference: {duration: 0.15}}, {loop: one, reference: {kind: step}}]",
)  # fmt: skip
NOISY = (
    "loops={one: {plant_segments: 1, control_period: 5e-3, sensor: {level: camera}}}", "horizon=1.5", "candidates=8",
    "iterations=4", "scenarios=[{loop: one, reference: {duration: 0.4}}]", "repetitions=2", "worlds.validation=5",
)  # fmt: skip


def judges(study: Study) -> tuple[Judge, Judge | None]:
    searched, chosen = tuning_cases(study)
    made = [Judge(cases, study.wrist, study.tune.objective) if cases else None for cases in (searched, chosen)]
    assert made[0] is not None
    return made[0], made[1]


def found(*settings: str, seed: int = 0, name: str = "pid", base: tuple[str, ...] = SETTINGS, **more: object) -> Search:
    study = load_study([], [*base, *settings], "tune")
    return search(study, controller(name), lambda text: stream(seed, text), judges(study), **more)  # type: ignore[arg-type]


def test_the_first_search_starts_from_a_preset_and_the_others_from_the_middle_of_the_box() -> None:
    result = found("restarts=2", name="computed-torque")
    default = controller("computed-torque").presets["default"]
    middle = [np.sqrt(gain.low * gain.high) for gain in controller("computed-torque").gains.values()]
    np.testing.assert_allclose(result.tried.gains[0, 0], list(default.values()))
    np.testing.assert_allclose(result.tried.gains[5, 0], middle)
    assert result.tried.values.shape == (10, 8) and result.evaluations == 80
    assert result.best_so_far.shape == (2, 5) and (np.diff(result.best_so_far, axis=1) <= 0.0).all()
    assert result.best_so_far.min() < result.tried.values[5, 0]


@pytest.mark.parametrize("optimiser", ["pso", "differential-evolution", "random"])
@pytest.mark.slow
def test_the_same_seed_finds_the_same_gains_and_another_seed_others(optimiser: str) -> None:
    one, again, other = (found(f"optimiser={optimiser}", seed=seed) for seed in (3, 3, 4))
    assert one.gains == again.gains
    assert one.tried.values.tobytes() == again.tried.values.tobytes() != other.tried.values.tobytes()


@pytest.mark.slow
def test_a_search_that_was_cut_short_goes_on_to_the_same_bytes() -> None:
    """From its table, as it is written and read again; nothing that it had tried is run again."""
    whole = found("restarts=2")
    cut = Search(**(whole.__dict__ | {"tried": Tried(whole.tried.values[:7], whole.tried.gains[:7])}))
    rows = history(cut).iloc[:-3]  # the last iteration was not whole
    known = tried_of(rows, list(whole.gains))
    assert known.values.shape == (6, 8)
    wrong = Tried(known.values - 100.0, known.gains)
    assert found("restarts=2", known=known).tried.values.tobytes() == whole.tried.values.tobytes()
    assert found("restarts=2", known=wrong).tried.values.min() < -90.0
    other = Tried(known.values, known.gains + (np.arange(6) == 1)[:, None, None])
    with pytest.raises(UserError, match="tried other gains of pid in iteration 1"):
        found("restarts=2", known=other)


def test_what_is_chosen_is_the_best_on_noise_that_the_search_has_not_seen() -> None:
    result = found("finalists=4", base=NOISY, name="computed-torque")
    assert [each.origin for each in result.finalists].count("search") == 4
    assert {"search", "default"} == {each.origin for each in result.finalists}
    validated = [each.validated for each in result.finalists]
    assert validated == sorted(validated) and result.objective == validated[0]
    assert tuple(result.gains.values()) == result.finalists[0].gains
    study = load_study([], list(NOISY), "tune")
    searched, chosen = tuning_cases(study)
    assert (
        len(searched) == 2 and len(chosen) == 5 and not {each.stream for each in searched} & {c.stream for c in chosen}
    )
    table = finalists(result)
    assert table["validated"].tolist() == validated and list(table["w"]) == [each.gains[0] for each in result.finalists]


def test_gains_are_chosen_on_worlds_of_a_family_that_the_search_has_not_seen() -> None:
    drawn = ["families.f.draw={plant.stiffness: x0.5..2}", "families.f.references=[{duration: 0.2}]",
             "tune.worlds={family: f, draws: 5, validation: 6}"]  # fmt: skip
    searched, chosen = tuning_cases(load_study([], drawn))
    springs = [{case.loop.plant.stiffness for case in cases} for cases in (searched, chosen)]
    assert [len(each) for each in springs] == [5, 6] and not springs[0] & springs[1]
    assert len({case.stream for case in (*searched, *chosen)}) == 11


def made_up(loop_cells: tuple[int, ...], **metrics: list[float]) -> tuple[Judge, Measured]:
    """A judge whose yardstick's RMSE is 1 on each case, and what was measured of one gains on them."""
    study = load_study([], list(SETTINGS), "tune")
    case = tuning_cases(study)[0][0]
    cases = [Case(case.loop, case.motion, case.stream, cell) for cell in loop_cells]
    weights = {"steady_state": 0.0, "chattering": 0.0, "oscillation": 0.0} | {
        "worst": 0.0,
        "swinging": 0.0,
        "margin": 0.0,
    }
    judge = Judge(cases, study.wrist, Objective.model_validate(weights | {"rmse": 1.0}))
    known, rests = {name: np.ones((1, len(cases))) for name in (*METRICS, "sustained")}, np.array([True] * len(cases))
    judge._yardstick = Measured(known, np.zeros((1, len(cases)), bool), np.ones((1, len(cases))), rests)
    still = {"drift": np.zeros((1, len(cases))), "sustained": np.zeros((1, len(cases)))}
    values = still | {name: np.array([given]) for name, given in metrics.items()}
    return judge, Measured(values, np.zeros((1, len(cases)), bool), np.ones((1, len(cases))), rests)


def weighed(judge: Judge, **weights: float) -> Judge:
    judge._weights = judge._weights.model_copy(update=weights)
    return judge


def test_the_objective_is_in_decades_beside_the_yardstick_and_no_better_than_its_floor() -> None:
    judge, measured = made_up((0, 1), rmse=[0.1, 0.01])
    floor = METRICS["rmse"].floor
    expected = np.log10((np.array([0.1, 0.01]) + floor) / (1.0 + floor)).mean()
    assert judge.value(measured)[0] == pytest.approx(expected)
    nothing = replace(measured, metrics={"rmse": np.zeros((1, 2))})
    assert judge.value(nothing)[0] == pytest.approx(np.log10(floor / (1.0 + floor)))


def test_the_worst_cell_counts_beside_the_mean_and_a_cell_is_the_mean_of_its_repetitions() -> None:
    judge, measured = made_up((0, 0, 1, 1), rmse=[1e-2, 1.0, 0.1, 0.1])
    mean = judge.value(measured)[0]
    values = np.log10((np.array([1e-2, 1.0, 0.1, 0.1]) + METRICS["rmse"].floor) / (1.0 + METRICS["rmse"].floor))
    worst = max(values[:2].mean(), values[2:].mean())
    assert weighed(judge, worst=0.5).value(measured)[0] == pytest.approx(mean + 0.5 * worst)


def test_cases_that_swing_cost_the_root_of_their_share() -> None:
    for swing, cost in ((0.99 * LIMIT_CYCLE, 0.0), (1.01 * LIMIT_CYCLE, 0.5), (np.nan, 0.0)):
        judge, measured = made_up((0, 1, 2, 3), rmse=[0.1] * 4, oscillation=[0.0, swing, 0.0, 0.0])
        still = weighed(judge, swinging=0.0).value(measured)[0]
        assert weighed(judge, swinging=1.0).value(measured)[0] == pytest.approx(still + cost)
        moving = replace(measured, rests=np.array([True, False, True, True]))
        assert judge.value(moving)[0] == pytest.approx(still)


def test_cases_that_swing_in_motion_cost_alike_beyond_twice_what_feedforward_shows_there() -> None:
    for swing, open_loop, cost in ((1.01, 0.0, 0.5), (0.99, 0.0, 0.0), (2.9, 1.0, 0.0), (3.1, 1.0, 0.5)):
        swings = [0.0, swing * LIMIT_CYCLE, 0.0, 0.0]
        judge, measured = made_up((0, 1, 2, 3), rmse=[0.1] * 4, oscillation=[0.0] * 4, sustained=swings)
        judge._yardstick.metrics["sustained"] = np.full((1, 4), open_loop * LIMIT_CYCLE)
        still = weighed(judge, swinging=0.0).value(measured)[0]
        moving = replace(measured, rests=np.zeros(4, bool))
        assert weighed(judge, swinging=1.0).value(moving)[0] == pytest.approx(still + cost)
        assert judge.value(measured)[0] == pytest.approx(still), "at rest that is another metric"


@pytest.mark.parametrize("times", [0, 1, 4])
def test_cases_that_chatter_cost_as_those_that_swing(times: int) -> None:
    """On a moving reference too; a case that does both costs once."""
    rates = np.where(np.arange(4) >= 4 - times, 1.01, 0.99) * FASTEST
    judge, measured = made_up((0, 1, 2, 3), rmse=[0.1] * 4, oscillation=[0.0] * 4, chattering=[*(232.0 * rates)])
    still, slams = judge.value(measured)[0], replace(measured, tension_range=58.0, rests=np.zeros(4, bool))
    judge = weighed(judge, swinging=1.0)
    assert judge.value(slams)[0] == pytest.approx(still + np.sqrt(times / 4.0))
    both = {"oscillation": 2.0 * LIMIT_CYCLE * (rates > FASTEST)[None]}
    swings = replace(slams, metrics=slams.metrics | both, rests=np.ones(4, bool))
    assert judge.value(swings)[0] == judge.value(slams)[0]


def test_what_gains_do_on_the_cases_is_counted_by_mark() -> None:
    """A law that chatters on a long wrist, on all of three cases; on a shorter one it does nothing of the kind."""
    settings = ["loops={one: {}}", "horizon=2.5", "scenarios=[{loop: one, reference: {duration: 0.5}},"
                " {loop: one, reference: {angle_deg: -20}}, {loop: one, reference: {kind: step}}]"]  # fmt: skip
    law = controller("super-twisting")
    gains = np.array(law.values(law.presets["default"]))
    for length, marks in ((0.08, {}), (0.12, {"chatters": 3})):
        study = load_study([], [*settings, f"wrist.length={length}"], "tune")
        assert marks_of(law, gains, tuning_cases(study)[0], study.wrist) == marks


def test_what_swings_on_a_moving_reference_is_marked_where_feedforward_swings_less(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At rest only what is left at the end counts."""
    swings = [0.0, 1.5 * LIMIT_CYCLE, 1.5 * LIMIT_CYCLE]
    small = [0.0, 0.0, 0.0]
    _, found = made_up(
        (0, 1, 2), oscillation=[0.0, 0.0, 2.0 * LIMIT_CYCLE], sustained=swings, steady_state=small, rmse=small
    )
    cases: Any = [SimpleNamespace(motion=SimpleNamespace(bend_ref=np.ones((2, 1))))] * 3
    moving, law = replace(found, rests=np.array([True, False, True])), controller("pd-ff")
    for measured, open_loop, marks in ((moving, 0.0, 2), (moving, 1.0, 1), (found, 0.0, 1)):
        still = replace(measured, metrics={"sustained": np.full((1, 3), open_loop * LIMIT_CYCLE)})
        given = {law.name: measured, "feedforward": still}
        monkeypatch.setattr("wristctl.tuning.objective.measure", lambda law, *of, given=given: given[law.name])
        assert marks_of(law, np.zeros(2), cases, WristParameters()) == {"limit cycle": marks}


def test_what_hardly_moves_stops_short_at_rest_and_on_a_motion_that_never_rests() -> None:
    settings = ["loops={one: {}}", "horizon=2.5", "scenarios=[{loop: one, reference: {duration: 0.5}},"
                " {loop: one, reference: {kind: sine, angle_deg: -20}}]"]  # fmt: skip
    study, law = load_study([], settings, "tune"), controller("pid")
    cases = tuning_cases(study)[0]
    for gains, marks in (((1e-3, 0.0, 0.0), {"stops short": 2}), ((20.0, 50.0, 1.0), {})):
        assert marks_of(law, np.array(gains), cases, study.wrist) == marks


@pytest.mark.slow
def test_a_search_tells_of_which_controllers_the_best_gains_chatter_and_how_often(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    judged = []

    def counted(law: Controller, gains: Array, cases: Sequence[Case], wrist: WristParameters) -> dict[str, int]:
        judged.append((law.name, dict(zip(law.gains, gains.tolist(), strict=True)), len(cases)))
        return {"limit cycle": 1, "chatters": 2} if law.name == "pd-ff" else {}

    for module in ("wristctl.tuning.objective", "wristctl.commands.tune.answer"):
        monkeypatch.setattr(f"{module}.marks_of", counted)
    small = ["tune.controllers=[pid-ff, pd-ff]", "tune.iterations=1", "tune.candidates=2"]
    done = wristctl.tune(load_study([], [*small, *(f"tune.{each}" for each in SETTINGS[:1] + SETTINGS[3:])]))
    assert done.lost == {"pid-ff": {}, "pd-ff": {"limit cycle": 1, "chatters": 2}}
    assert judged[:2] == [(name, done.gains[name], 2) for name in ("pid-ff", "pd-ff")], "the best gains on all cases"
    presets = [(name, controller(name).presets[start.preset], 2) for name, start in done.starts.items()]
    assert judged[2:] == presets, "then the best preset, where a search found other gains"
    columns = done.tables[0].columns
    fates = {row[0]: row[list(columns).index("fate")] for row in done.tables[0].rows}
    assert fates == {"pid-ff": "", "pd-ff": "limit cycle in 1 of 2 cases, chatters in 2 of 2 cases"}
    assert len(done.marks) == 1 and "pd-ff" in done.marks[0] and "chatters" in done.marks[0]


def test_a_failure_costs_more_than_anything_and_the_more_the_earlier_it_is() -> None:
    judge, measured = made_up((0, 1), rmse=[0.1, np.nan])
    ends = [
        judge.value(replace(measured, failed=np.array([[False, True]]), lasted=np.array([[1.0, lasted]])))[0]
        for lasted in (1.0, 0.5, 0.0)
    ]
    bad, poor = made_up((0, 1), rmse=[0.1, 500.0])
    assert bad.value(poor)[0] < ends[0] < ends[1] < ends[2]


def test_what_never_settles_counts_the_whole_horizon() -> None:
    judge, measured = made_up((0, 1), rmse=[1.0, 1.0], settling=[0.4, np.nan])
    judge = weighed(judge, rmse=0.0)
    judge._weights = Objective.model_validate(judge._weights.model_dump() | {"settling": 1.0})
    floor = METRICS["settling"].floor
    expected = np.log10((np.array([0.4, 1.2]) + floor) / (1.0 + floor)).mean()
    assert judge.value(measured)[0] == pytest.approx(expected)


def test_what_diverges_is_worse_than_what_does_not() -> None:
    study = load_study([], [*SETTINGS, "loops={one: {plant_segments: 1, limits: false}}"], "tune")
    values = judges(study)[0](controller("computed-torque"), np.array([[900.0, 9.0], [50.0, 1.0]]))
    assert values[0] > 2.0 > 0.0 > values[1]


def test_only_what_would_be_the_best_is_measured_anew_and_the_most_promising_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One of these is good by its step alone: the next best is the best, and the others need no such care."""
    at_default, sound = np.array([0.5, -1.0, -2.0, -3.0, 0.1]), np.array([0.4, -1.1, -1.9, 1.0, 0.2])
    anew = list[list[int]]()

    def measured(law: Controller, gains: Array, *_: object, converge: bool = True) -> Array:
        which = gains[:, 0].astype(int)
        if converge:
            anew.append(which.tolist())
        return (sound if converge else at_default)[which]

    judge, _ = made_up((0,), rmse=[0.1])
    monkeypatch.setattr("wristctl.tuning.objective.measure", measured)
    monkeypatch.setattr(judge, "value", np.array)
    candidates = np.arange(5.0)[:, None]
    assert judge.beside(controller("pid"), candidates, 0.0).tolist() == [0.5, -1.0, -1.9, 1.0, 0.1]
    assert anew == [[3], [2]]
    assert judge.beside(controller("pid"), candidates, -3.0).tolist() == at_default.tolist() and len(anew) == 2
    assert judge.beside(controller("pid"), candidates[3:4], np.inf).tolist() == [1.0] and anew[2:] == [[3]]


def test_feedforward_is_nothing_beside_itself() -> None:
    study = load_study([], [*NOISY, "objective.swinging=0", "objective.margin=0"], "tune")
    assert judges(study)[0](controller("feedforward"), np.zeros((2, 0))) == pytest.approx(np.zeros(2), abs=1e-12)


def test_where_the_yardstick_fails_others_are_measured_by_what_it_has_elsewhere() -> None:
    judge, measured = made_up((0, 1, 2), rmse=[0.1, 0.1, 0.1])
    judge._yardstick.metrics["rmse"][0] = [1.0, np.nan, 3.0]
    floor = METRICS["rmse"].floor
    known = np.array([1.0, 2.0, 3.0]) + floor
    assert judge.value(measured)[0] == pytest.approx(np.log10((0.1 + floor) / known).mean())


def test_progress_sees_the_search_after_every_iteration() -> None:
    seen: list[int] = []
    found(name="smc", progress=lambda s: seen.append(len(s.tried.values)))
    assert seen == [1, 2, 3, 4, 5]


def test_history_lists_every_candidate() -> None:
    result = found()
    table = history(result)
    assert len(table) == 40 and table["objective"].min() == result.best_so_far.min()
    assert set(result.gains) <= set(table.columns)


def test_every_controllers_search_box_spans_six_decades() -> None:
    for chosen in CONTROLLERS.values():
        if chosen.gains:
            orders = [chosen.name == "fopi" and name == "lambda" for name in chosen.gains]  # of an integral: below 2
            np.testing.assert_allclose(GainSpace.of(chosen.gains).decades[~np.array(orders)], 6.0)


def test_gains_read_back_exactly(tmp_path: Path) -> None:
    gains = {"pid": {"Kp": 1 / 3, "Ki": 1e-300, "Kd": 2.0**0.5}}
    write_gains(tmp_path / "gains.json", gains)
    assert read_gains(tmp_path / "gains.json") == gains


MIXED = (
    "loops={still: {plant_segments: 1}, drawn: {plant_segments: 1, plant: {stiffness_spread: 0.4}}}", "horizon=0.4",
    "scenarios=[{loop: drawn, reference: {duration: 0.2}}, {loop: still, reference: {kind: step}},"
    " {loop: drawn, reference: {kind: step, angle_deg: 10}}]", "repetitions=3",
)  # fmt: skip


@pytest.mark.parametrize("metric", ["rmse", "tip_rmse_mm", "oscillation"])
def test_each_case_is_a_closed_loop_by_itself(metric: str) -> None:
    """With the noise and plants that tuning draws, of each gains beside any others."""
    study = load_study([], [*MIXED, "horizon=1.6"], "tune")
    law, gains = controller("pid"), np.array([[30.0, 10.0, 0.5], [100.0, 10.0, 1.0], [3.0, 1.0, 0.1]])
    cases, _ = tuning_cases(study)
    assert [case.cell for case in cases] == [0, 0, 0, 1, 2, 2, 2]
    own = measure(law, gains, cases, study.wrist, [metric]).metrics[metric]
    at = 0
    for scenario in study.tune.scenarios:
        loop, which = study.tune.loops[scenario.loop], np.zeros(3, np.int64)
        followed, name = motion(scenario.reference, study.wrist, 1.6, 1e-3), scenario_of(scenario.reference, "ulnar")
        done = repeat(law, gains, [followed], which, loop, study.wrist, [name], Draws(study.seed, "tuning"), 3)
        times = len(done[0].failed)
        assert times == (3 if scenario.loop == "drawn" else 1)
        np.testing.assert_allclose(own[:, at : at + times], [each.metrics[metric] for each in done], 1e-9, 1e-14)
        at += times


def test_a_scenario_on_a_loop_that_is_not_there_is_named_by_its_number() -> None:
    settings = load_study([], list(MIXED), "tune").tune
    check_loops(settings)
    lost = settings.model_copy(update={"loops": {"drawn": settings.loops["drawn"]}})
    with pytest.raises(UserError, match="unknown loop 'still'") as caught:
        check_loops(lost)
    assert caught.value.where == "scenarios.1.loop"


def test_a_controller_without_gains_is_not_tuned() -> None:
    check_tunable(controller("pid"))
    with pytest.raises(UserError, match="feedforward has no gains to tune"):
        check_tunable(controller("feedforward"))


def test_what_was_found_is_the_least_value_with_its_own_gains() -> None:
    result = found()
    at = np.unravel_index(result.tried.values.argmin(), result.tried.values.shape)
    assert result.controller == "pid" and result.tried.gains.shape == (5, 8, 3)
    assert [result.gains[name] for name in ("Kp", "Ki", "Kd")] == result.tried.gains[at].tolist()
    assert list(result.gains) == list(controller("pid").gains)
    values = np.array([[5.0, 4.0], [6.0, 3.5], [2.0, 9.0], [8.0, 8.0], [7.0, 6.0]])
    course = Search("pid", {}, 2.0, 6, Tried(values, np.zeros((5, 2, 0))), 2)
    np.testing.assert_array_equal(course.best_so_far, [[4.0, 3.5, 2.0], [8.0, 6.0, np.nan]])


def test_each_line_of_the_history_is_a_candidate_of_its_iteration() -> None:
    result = found("restarts=2")
    lines = history(result).to_dict("records")
    places = [(restart, iteration, candidate) for restart, iteration, candidate in np.ndindex(2, 5, 8)]
    assert [(line["restart"], line["iteration"], line["candidate"]) for line in lines] == places
    for line, (restart, iteration, candidate) in zip(lines, places, strict=True):
        at = 5 * restart + iteration, candidate
        assert line["objective"] == result.tried.values[at]
        assert [line[name] for name in ("Kp", "Ki", "Kd")] == result.tried.gains[at].tolist()


def test_what_a_search_hands_out_cannot_be_changed() -> None:
    assert changeable(wristctl.tuning) == []


@pytest.mark.parametrize("text", ["[]", "{", '{"pid": 3}', '{"pid": {"Kp": "high"}}'])
def test_another_file_is_no_file_of_tuned_gains(tmp_path: Path, text: str) -> None:
    (tmp_path / "gains.json").write_text(text)
    with pytest.raises(UserError, match="not a file of tuned gains"):
        read_gains(tmp_path / "gains.json")
