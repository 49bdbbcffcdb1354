"""The search: objective, determinism, progress."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wristctl.tuning
from tests.values import changeable
from wristctl.config.control import Objective
from wristctl.config.errors import UserError
from wristctl.config.load import load_study
from wristctl.control.table import CONTROLLERS, controller
from wristctl.simulation.closed_loop import repeat, scenario_of
from wristctl.simulation.draws import Draws
from wristctl.simulation.reference import motion
from wristctl.tuning.gains_file import read_gains, write_gains
from wristctl.tuning.search import Evaluator, Search, check_loops, check_tunable, history, objective, search
from wristctl.tuning.space import GainSpace

SETTINGS = (
    "loops={one: {plant_segments: 1}}", "horizon=1.0", "candidates=8", "iterations=5",
    "scenarios=[{loop: one, reference: {duration: 0.5}}, {loop: one, reference: {kind: step}}]",
)  # fmt: skip


def found(*settings: str, seed: int = 0, name: str = "pid") -> Search:
    study = load_study([], [*SETTINGS, *settings], "tune")
    return search(study, controller(name), np.random.default_rng(seed))


def test_search_starts_in_the_middle_of_the_box_and_improves_on_it() -> None:
    result = found()
    middle = [np.sqrt(gain.low * gain.high) for gain in controller("pid").gains.values()]
    np.testing.assert_allclose(result.tried[0, 0], middle)
    assert result.objective < result.values[0, 0] and result.evaluations == 40
    assert (np.diff(result.best_so_far) <= 0.0).all() and result.best_so_far[-1] == result.objective


@pytest.mark.parametrize("optimiser", ["pso", "differential-evolution", "random"])
def test_the_same_seed_finds_the_same_gains_and_another_seed_others(optimiser: str) -> None:
    one, again, other = (found(f"optimiser={optimiser}", seed=seed) for seed in (3, 3, 4))
    assert one.gains == again.gains != other.gains
    assert one.values.tobytes() == again.values.tobytes()


def test_objective_is_the_weighted_mean_over_scenarios() -> None:
    gains = np.array([[30.0, 10.0, 0.5], [100.0, 10.0, 1.0]])
    rmse, settling = (
        Evaluator(load_study([], [*SETTINGS, f"objective={{{weights}, chattering: 0}}"], "tune"), controller("pid"))
        for weights in ("rmse: 1, settling: 0", "rmse: 0, settling: 1")
    )
    both = load_study([], [*SETTINGS, "objective={rmse: 2, settling: 3, chattering: 0}"], "tune")
    np.testing.assert_allclose(
        Evaluator(both, controller("pid"))(gains), 2 * rmse(gains) + 3 * settling(gains), rtol=1e-13
    )


def test_what_diverges_has_an_infinite_objective() -> None:
    study = load_study([], [*SETTINGS, "loops={one: {plant_segments: 1, limits: false}}"], "tune")
    values = Evaluator(study, controller("computed-torque"))(np.array([[900.0, 9.0], [50.0, 1.0]]))
    assert np.isinf(values[0]) and np.isfinite(values[1])


def test_progress_sees_the_search_after_every_iteration() -> None:
    seen: list[int] = []
    study = load_study([], list(SETTINGS), "tune")
    search(study, controller("smc"), np.random.default_rng(0), progress=lambda s: seen.append(len(s.values)))
    assert seen == [1, 2, 3, 4, 5]


def test_history_lists_every_candidate() -> None:
    result = found()
    table = history(result)
    assert len(table) == 40 and table["objective"].min() == result.objective
    assert set(result.gains) <= set(table.columns)


def test_every_controllers_search_box_spans_six_decades() -> None:
    for chosen in CONTROLLERS.values():
        if chosen.gains:
            np.testing.assert_allclose(GainSpace.of(chosen.gains).decades, 6.0)


def test_gains_read_back_exactly(tmp_path: Path) -> None:
    gains = {"pid": {"Kp": 1 / 3, "Ki": 1e-300, "Kd": 2.0**0.5}}
    write_gains(tmp_path / "gains.json", gains)
    assert read_gains(tmp_path / "gains.json") == gains


def test_every_weight_counts_and_what_never_settles_counts_the_whole_horizon() -> None:
    metrics = {
        "rmse": np.array([0.1, 0.2, 0.3]),
        "settling": np.array([1.0, np.nan, 2.0]),
        "chattering": np.array([50.0, 60.0, 70.0]),
        "saturation": np.array([0.5, 0.25, 0.0]),
        "iae": np.array([4.0, np.nan, 6.0]),
    }
    failed = np.array([False, False, True])
    for weights, expected in (
        ({"rmse": 2.0, "settling": 0.0, "chattering": 0.0}, [0.2, 0.4]),
        ({"rmse": 0.0, "settling": 3.0, "chattering": 0.0}, [3.0, 15.0]),
        ({"rmse": 0.0, "settling": 0.0, "chattering": 0.1}, [5.0, 6.0]),
        ({"rmse": 0.0, "settling": 0.0, "chattering": 0.0, "saturation": 8.0}, [4.0, 2.0]),
        ({"rmse": 1.0, "settling": 0.0, "chattering": 0.0, "iae": 1.0}, [4.1, np.inf]),
    ):
        found = objective(metrics, failed, Objective.model_validate(weights), 5.0)
        np.testing.assert_allclose(found, [*expected, np.inf], rtol=1e-14)


MIXED = (
    "loops={still: {plant_segments: 1}, drawn: {plant_segments: 1, plant: {stiffness_spread: 0.4}}}", "horizon=0.4",
    "scenarios=[{loop: drawn, reference: {duration: 0.2}}, {loop: still, reference: {kind: step}},"
    " {loop: drawn, reference: {kind: step, angle_deg: 10}}]", "repetitions=3",
)  # fmt: skip


@pytest.mark.parametrize("metric", ["rmse", "tip_rmse_mm"])
def test_the_objective_is_the_mean_over_scenarios_of_the_mean_over_their_repetitions(metric: str) -> None:
    """Each as a closed loop by itself, with the noise and plants that tuning draws."""
    others = ", ".join(f"{name}: 0" for name in ("rmse", "settling", "chattering") if name != metric)
    study = load_study([], [*MIXED, f"objective={{{metric}: 2.0, {others}}}"], "tune")
    law, gains = controller("pid"), np.array([[30.0, 10.0, 0.5], [100.0, 10.0, 1.0], [3.0, 1.0, 0.1]])
    wanted = np.zeros(3)
    for scenario in study.tune.scenarios:
        loop, which = study.tune.loops[scenario.loop], np.zeros(3, np.int64)
        followed, name = motion(scenario.reference, study.wrist, 0.4, 1e-3), scenario_of(scenario.reference, "ulnar")
        done = repeat(law, gains, [followed], which, loop, study.wrist, [name], Draws(study.seed, "tuning"), 3)
        counts = {len(each.failed) for each in done}
        assert counts == ({3} if scenario.loop == "drawn" else {1})
        wanted += [2.0 * each.metrics[metric].mean() / 3.0 for each in done]
    np.testing.assert_allclose(Evaluator(study, law)(gains), wanted, rtol=1e-9)


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
    assert result.controller == "pid" and result.values.shape == (5, 8) and result.tried.shape == (5, 8, 3)
    at = np.unravel_index(result.values.argmin(), result.values.shape)
    assert [result.gains[name] for name in ("Kp", "Ki", "Kd")] == result.tried[at].tolist()
    assert list(result.gains) == list(controller("pid").gains)
    course = Search("pid", {}, 2.0, 6, np.array([[5.0, 4.0], [6.0, 3.5], [2.0, 9.0], [8.0, 8.0]]), np.zeros((4, 2, 0)))
    assert course.best_so_far.tolist() == [4.0, 3.5, 2.0, 2.0]


def test_each_line_of_the_history_is_a_candidate_of_its_iteration() -> None:
    result = found()
    lines = history(result).to_dict("records")
    assert [(line["iteration"], line["candidate"]) for line in lines] == list(np.ndindex(5, 8))
    for line, at in zip(lines, np.ndindex(5, 8), strict=True):
        assert line["objective"] == result.values[at]
        assert [line[name] for name in ("Kp", "Ki", "Kd")] == result.tried[at].tolist()


def test_what_a_search_hands_out_cannot_be_changed() -> None:
    assert changeable(wristctl.tuning) == []


@pytest.mark.parametrize("text", ["[]", "{", '{"pid": 3}', '{"pid": {"Kp": "high"}}'])
def test_another_file_is_no_file_of_tuned_gains(tmp_path: Path, text: str) -> None:
    (tmp_path / "gains.json").write_text(text)
    with pytest.raises(UserError, match="not a file of tuned gains"):
        read_gains(tmp_path / "gains.json")
