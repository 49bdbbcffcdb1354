"""The answer of a search for gains: its figures are the search's, with units, and it hides nothing of the gains."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import ANY

import numpy as np
import pytest

from wristctl import load_study, tune
from wristctl.commands import choice_tables
from wristctl.commands.perform import perform, prepare
from wristctl.commands.progress import counting, no_event
from wristctl.commands.ranking_answer import condition_of_loop
from wristctl.commands.session import Done, Event, Unattended
from wristctl.commands.tune.answer import Beside, Start, answer_of, at_edge, beside_feedforward, starts_of
from wristctl.commands.tune.command import TUNE, Tuned
from wristctl.commands.tune.searches import others_of
from wristctl.config.compare import CompareSettings
from wristctl.config.tune import TuneSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller
from wristctl.simulation.cases import measure
from wristctl.tuning.margin import Stood
from wristctl.tuning.search import Finalist, Search, Tried, tuning_cases

STUDY = (
    "tune={controllers: [smc, pid], candidates: 2, iterations: 2, horizon: 0.3, loops: {fast: {plant_segments: 1}}, "
    "scenarios: [{loop: fast, reference: {kind: step, angle_deg: 20.0}}]}",
)


@pytest.fixture(scope="module")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> Tuned:
    """A search of a moment, in a run directory."""
    return tune(load_study(None, *STUDY), out=tmp_path_factory.mktemp("tuned"))


def _search(name: str, values: Sequence[float] = (), origin: str = "search") -> Search:
    table = controller(name).gains
    gains = dict(zip(table, values or [math.sqrt(gain.low * gain.high) for gain in table.values()], strict=True))
    finalist = Finalist(tuple(gains.values()), origin, -1.0, -1.0)
    return Search(name, gains, -1.0, 4, Tried(np.zeros((1, 1)), np.zeros((1, 1, len(gains)))), 1, (finalist,))


def _text(search: Search, lost: dict[str, int], elsewhere: dict[str, dict[str, int]] | None = None) -> str:
    name = search.controller
    others = {name: elsewhere or {}}
    answer = answer_of({name: search}, {name: Beside(1e-3, 2e-2, 8)}, {name: lost}, 8, "", others)
    assert answer is not None
    return "\n".join(answer.lines())


def test_figures_are_those_of_the_search_and_fit_a_screen(tuned: Tuned) -> None:
    assert tuned.answer is not None and tuned.answer.table is not None
    lines, best = list(tuned.summary), min(tuned.searches, key=lambda name: tuned.searches[name].objective)
    assert len(lines) <= 32 and all(len(line) <= 100 for line in lines if not line.startswith("wristctl "))
    for name, value in tuned.gains[best].items():
        assert f"{name} = {value:.4g} {controller(best).gains[name].unit}".rstrip() in " ".join(lines)
    assert tuned.answer.table.rows[0][0] == best
    assert {row[0]: row[1] for row in tuned.answer.table.rows} == {
        name: tuned.metrics[f"{name}_objective"] for name in tuned.searches
    }
    assert tuned.run is not None
    (simulate,) = (line for line in lines if line.startswith("wristctl "))
    assert shlex.split(simulate) == ["wristctl", "simulate", f"{tuned.run.path}/data/controllers/{best}.yaml"]
    for name, gains in tuned.gains.items():
        once = load_study(tuned.run.file(f"data/controllers/{name}.yaml")).simulate
        assert (once.controller, once.gains) == (name, gains), "to the last bit"


@pytest.mark.slow
def test_the_time_left_of_a_search_counts_the_choice_the_other_searches_and_what_is_tried_of_the_gains() -> None:
    """Where both controllers cost alike, the first leaves at least as much to do as it takes."""
    told: dict[str, tuple[int | None, float]] = {}

    def show(
        event: Event, task: str, total: int | None, unit: str, then: float = 0.0, after: float = 0.0
    ) -> AbstractContextManager[Done]:
        told[task] = total, then
        return counting(no_event, task, total, unit, lambda count: None)

    perform(prepare(TUNE, load_study(None, *STUDY), Path("none")), None, show, Unattended())
    steps = list(told)
    assert steps[:4] == ["tuning smc", "choosing gains of smc", "tuning pid", "choosing gains of pid"]
    (total, first), (_, last) = told["tuning smc"], told["tuning pid"]
    assert total == load_study(None, *STUDY).tune.iterations and first == pytest.approx(last * 2.0 + 1.0, rel=0.5)
    assert first > 1.0 + last > 1.0


def test_the_work_of_the_loops_that_gains_are_tried_on_besides_is_reckoned_by_their_segments_steps_and_noise() -> None:
    """On the default study's loops: the loop of the search is none of them, and a family has none."""
    study = load_study(None)
    others, loops = others_of(study), study.tune.loops
    searched = {scenario.loop for scenario in study.tune.scenarios}
    assert set(others) == set(loops) - searched and others
    (own,) = searched

    def with_loops(**changes: Any) -> dict[str, float]:
        changed = {name: loop.model_copy(update=changes) for name, loop in loops.items() if name not in searched}
        settings = study.tune.model_copy(update={"loops": {own: loops[own], **changed}})
        return others_of(study.model_copy(update={"tune": settings}))

    one, two = with_loops(plant_segments=1), with_loops(plant_segments=2)
    assert two == pytest.approx({name: 2.0 * work for name, work in one.items()})
    coarse = with_loops(plant_segments=1, control_period=2.0 * loops[own].control_period)
    fine = with_loops(plant_segments=1, control_period=loops[own].control_period)
    assert all(fine[name] > coarse[name] for name in fine)
    worlds = study.tune.worlds.model_copy(update={"family": "any"})
    assert others_of(study.model_copy(update={"tune": study.tune.model_copy(update={"worlds": worlds})})) == {}


def test_the_error_stands_beside_that_of_feedforward_on_the_same_cases(tuned: Tuned) -> None:
    for beside in tuned.errors.values():
        assert beside.cases == tuned.cases == 1 and 0.0 < beside.error < math.radians(20.0)
    assert len({beside.feedforward for beside in tuned.errors.values()}) == 1
    assert Beside(1e-3, 2e-2, 8).ratio == pytest.approx(20.0)


@pytest.mark.parametrize("lost", [0, 1, 3])
def test_where_some_cases_fail_the_error_is_the_geometric_mean_of_those_where_both_last(
    lost: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors = {"feedforward": [0.4, 0.1, 0.2], "pid": [0.01, 0.02, 0.04]}

    def measured(law: Controller, *given: Any) -> SimpleNamespace:
        failed = np.arange(3) < (lost if law.name == "pid" else 0)
        return SimpleNamespace(failed=failed[None], metrics={"rmse": np.array([errors[law.name]])})

    monkeypatch.setattr("wristctl.commands.tune.answer.measure", measured)
    whole = dict.fromkeys(controller("pid").gains, 1.0)
    (beside,) = beside_feedforward({"pid": whole}, [], WristParameters()).values()
    assert beside.cases == 3 - lost
    known = [math.prod(errors[name][lost:]) ** (1.0 / (3 - lost)) if lost < 3 else math.nan for name in errors]
    assert (beside.feedforward, beside.error) == pytest.approx(tuple(known), nan_ok=True)


@pytest.mark.parametrize("end", ["low", "high"])
def test_a_gain_at_either_end_of_its_box_is_named_and_one_well_within_is_not(end: str) -> None:
    table = controller("smc").gains
    middle = [math.sqrt(gain.low * gain.high) for gain in table.values()]
    last = list(table)[-1]
    found = _search("smc", [*middle[:-1], getattr(table[last], end)])
    assert [name for name, *_ in at_edge(found)] == [last] and at_edge(_search("smc")) == []
    inside = {"low": 1.2, "high": 1.0 / 1.2}[end] * getattr(table[last], end)
    assert at_edge(_search("smc", [*middle[:-1], inside])) == []
    assert [f"{last} =" in _text(found, {}), "No gain lies at the edge" in _text(found, {})] == [True, False]
    assert "No gain lies at the edge" in _text(_search("smc"), {})


NARROW = Stood(0.67, 1.0, 1.0, 0.6, 3.0)


@pytest.mark.parametrize(
    ("begin", "errors", "lost", "origin", "stood"),
    [
        ("Use {0}.", (1e-3, 2e-2), 0, "search", None),
        ("Keep the preset hardware of {0}: nothing better was found.", (1e-3, 2e-2), 0, "hardware", None),
        ("The best that was found has little margin: {0}.", (1e-3, 2e-2), 0, "search", NARROW),
        ("Nothing that holds was found: the best, {0}, swings in 3 of 8 cases.", (1e-3, 2e-2), 3, "hardware", None),
        ("Feedforward alone is as good as what was found, {0}.", (1e-2, 1.005e-2), 0, "search", None),
        ("Feedforward alone is better than what was found, {0}.", (2e-2, 1e-2), 0, "search", None),
    ],
)
def test_use_is_said_only_of_what_holds(
    begin: str, errors: tuple[float, float], lost: int, origin: str, stood: Stood | None
) -> None:
    middle = [math.sqrt(gain.low * gain.high) for gain in controller("smc").gains.values()]
    found = _search("smc", middle, origin)
    faults = {"limit cycle": lost} if lost else {}
    told = answer_of(
        {"smc": found},
        {"smc": Beside(errors[0], errors[1], 8)},
        {"smc": faults},
        8,
        "",
        {},
        None,
        {"smc": stood} if stood else {},
    )
    gains = ", ".join(
        f"{name} = {value:.4g} {controller('smc').gains[name].unit}" for name, value in found.gains.items()
    )
    assert told is not None and told.sentence.startswith(begin.format(f"smc with {gains}"))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "preset", "began"), [
    ("pid-ff", "hardware", True), ("pid-ff", "default", False), ("gvsc", "hardware", True),
])  # fmt: skip
def test_a_search_begins_with_the_last_preset_of_its_controller(name: str, preset: str, began: bool) -> None:
    search = _search(name)
    kept = Finalist(controller(name).values(controller(name).presets[preset]), preset, -0.5, -0.5)
    cases, _ = tuning_cases(load_study(None, "tune.scenarios=[{loop: exact, reference: {angle_deg: 10}}]"), None)
    told = starts_of({name: replace(search, finalists=(*search.finalists, kept))}, cases, WristParameters())
    assert (told[name].preset, told[name].began) == (preset, began)


@pytest.mark.parametrize(
    ("preset", "lost", "told"),
    [
        (Beside(3e-3, 2e-2, 8), {}, "3 times less than that of its best preset, hardware, 0.17 deg"),
        (Beside(1.02e-3, 2e-2, 8), {}, "hardly less than that of its best preset, hardware, 0.058 deg"),
        (Beside(5e-4, 2e-2, 8), {}, "2 times that of its best preset, hardware, 0.029 deg"),
        (Beside(5e-4, 2e-2, 8), {"limit cycle": 3}, "its best preset, hardware, swings in 3 of 8 cases"),
        (Beside(math.nan, math.nan, 0), {}, "its best preset, hardware, fails in each case"),
    ],
)
def test_what_a_search_gained_on_the_best_preset_is_told(preset: Beside, lost: dict[str, int], told: str) -> None:
    found = {"smc": _search("smc")}, {"smc": Beside(1e-3, 2e-2, 8)}, {"smc": dict[str, int]()}
    answer, begun = (
        answer_of(*found, 8, "", {}, starts={"smc": Start("hardware", preset, lost, began)}) for began in (False, True)
    )
    assert begun is not None and told.replace("hardware,", "hardware, with which the search began,") in begun.sentence
    without = answer_of(*found, 8, "", {})
    assert answer is not None and without is not None
    assert told in answer.sentence and "preset" not in without.sentence


def test_the_best_preset_is_that_of_a_search_that_found_better(tuned: Tuned) -> None:
    """On the cases that gains were chosen by it errs as it does when it is tried there by itself."""
    found = _search("smc")
    finalists = [Finalist((1.0,), name, -1.0, value) for name, value in (("a", -0.8), ("b", -0.9))]
    better = replace(found, finalists=(*found.finalists, finalists[1], finalists[0]))
    assert found.best_preset is None and better.best_preset == finalists[1]
    assert replace(found, finalists=(finalists[1], *found.finalists)).best_preset is None, "the preset itself"
    for name, start in tuned.starts.items():
        preset = tuned.searches[name].best_preset
        assert preset is not None and (start.preset, start.beside.feedforward) == (preset.origin, ANY)
        law = controller(name)
        searched, chosen = tuning_cases(tuned.study, None)
        again = measure(law, np.array([preset.gains]), chosen or searched, tuned.study.wrist, ["rmse"])
        if again.failed.any():
            assert start.beside.cases < tuned.cases
        else:
            mean = np.exp(np.log(again.metrics["rmse"][0]).mean())
            assert start.beside.error == pytest.approx(mean, rel=1e-9)


def test_gains_at_the_edge_of_the_box_are_no_optimum_however_good() -> None:
    table = controller("smc").gains
    found = _search("smc", [table["P1"].low, math.sqrt(table["P2"].low * table["P2"].high), table["P3"].high])
    sentence = _text(found, {}).partition("Its error")[0]
    assert sentence.startswith("No optimum was found: the best is smc") and "Use" not in sentence
    assert "P1 and P3 lie at the edge of the box" in " ".join(sentence.split())


def test_a_controller_that_swings_is_passed_over_and_ties_are_named() -> None:
    searches = {name: _search(name) for name in ("smc", "pid", "lqi", "adrc")}
    objectives = {"smc": -2.0, "pid": -1.001, "lqi": -1.0, "adrc": -0.9}
    searches = {name: replace(search, objective=objectives[name]) for name, search in searches.items()}
    lost = {name: {"limit cycle": 3} if name == "smc" else {} for name in searches}
    told = answer_of(searches, dict.fromkeys(searches, Beside(1e-3, 2e-2, 8)), lost, 8, "", {})
    assert told is not None and told.sentence.startswith("Use pid with ")
    assert told.sentence.endswith(
        "lqi ties with it: equal within 1 %. smc has the least objective, but swings in 3 of 8 cases."
    )


def test_a_preset_that_nothing_beats_is_named() -> None:
    assert "hardware" in _text(_search("smc", origin="hardware"), {})
    assert "preset" not in _text(_search("smc"), {})
    shipped = list(controller("ct-dob").presets["hardware"].values())
    came_upon = [value * (1.0 + 1e-12) for value in shipped]
    assert _text(_search("ct-dob", came_upon), {}).startswith("Keep the preset hardware of ct-dob with w = 35 rad/s")
    assert _text(_search("ct-dob", [1.01 * shipped[0], *shipped[1:]]), {}).startswith("Use ct-dob")


def test_what_the_gains_do_wrong_is_told_with_the_number_of_cases() -> None:
    text = " ".join(_text(_search("smc"), {"limit cycle": 3, "failed": 2}).split())
    assert "swings in 3 of 8 cases" in text and "fails in 2 of 8 cases" in text
    assert " of 8 cases" not in _text(_search("smc"), {})


def test_the_loops_that_it_was_not_tuned_on_are_told_by_what_the_gains_do_there() -> None:
    text = " ".join(_text(_search("smc"), {}, {"camera": {"limit cycle": 2}, "exact": {}, "sampled": {}}).split())
    assert "other loops: smc holds on exact and sampled, swings on camera. Do not use gains on a loop" in text
    assert "other loops" not in _text(_search("smc"), {})
    sound = _text(_search("smc"), {}, {"camera": {}, "exact": {}})
    assert "holds on camera and exact" in sound and "Do not use gains" not in sound
    wrong = {name: {"failed": 1} for name in ("exact", "sampled", "four-segments")} | {"camera": {"limit cycle": 2}}
    text = " ".join(_text(_search("smc"), {}, wrong).split())
    assert "smc fails on exact, sampled and four-segments, swings on camera." in text and text.count("fails on") == 1


def test_loops_are_told_with_the_condition_that_compare_ranks_them_under() -> None:
    loops, wrist = TuneSettings().loops | CompareSettings().loops, WristParameters()
    conditions = {name: condition_of_loop(loop, wrist) for name, loop in loops.items()}
    named = {row[0] for row in choice_tables.conditions().rows}
    assert set(conditions.values()) <= named and conditions["exact"] == "ideal" and conditions["sampled"] == "sampled"
    assert conditions["camera"] == "motors + camera"
    search = _search("smc")
    marks: dict[str, dict[str, dict[str, int]]] = {"smc": {"sampled": {}, "exact": {}}}
    told = answer_of({"smc": search}, {"smc": Beside(1e-3, 2e-2, 8)}, {"smc": {}}, 8, "", marks, conditions=conditions)
    assert told is not None and "smc holds on sampled and exact (ideal)" in " ".join(" ".join(told.lines()).split())


def test_the_margin_is_told_with_its_loop_and_what_is_less_than_it_should_be_is_named(tuned: Tuned) -> None:
    """Of every controller there is a row of how much it stands."""
    answer = tuned.answer
    assert answer is not None and tuned.run is not None
    text = " ".join(" ".join(answer.lines()).split())
    for name, stood in tuned.stood.items():
        assert f"{name} {stood.words}" in text.partition("Margin on the loop fast")[2]
    assert tuned.run.data("margins")["controller"].tolist() == list(tuned.stood)
    wide, narrow = Stood(0.5, 2.0, 2.0, 0.4, 1.4), Stood(0.67, 1.0, 1.0, 0.6, 3.0)
    assert wide.enough and wide.words == "torque x 0.5 to x 2, springs x 0.4 to x 1.4, 2 frames later"
    searches = {name: _search(name) for name in ("smc", "pid")}
    known = dict.fromkeys(searches, Beside(1e-3, 2e-2, 8)), {name: dict[str, int]() for name in searches}
    for given, named in (({"smc": wide, "pid": narrow}, True), ({"smc": wide, "pid": wide}, False)):
        told = answer_of(searches, *known, 8, "", {}, None, given)
        assert told is not None and ("1 frame later: pid." in " ".join(told.lines())) == named


@pytest.mark.slow
def test_a_search_tries_its_gains_on_the_loops_that_no_scenario_is_on() -> None:
    """A rate that is seen late makes swing what is calm where it is seen at once. By default a rig is searched on."""
    loops = "{fast: {plant_segments: 1, control_period: 1.0e-3}, slow: {plant_segments: 1, control_period: 0.1}}"
    done = tune(load_study(None, *STUDY, f"tune.loops={loops}", "tune.controllers=[pid]", "tune.horizon=2.5"))
    assert done.elsewhere["pid"].keys() == {"slow"} and done.elsewhere["pid"]["slow"]
    assert done.answer is not None and "on slow" in "\n".join(done.answer.lines())
    default = load_study(None).tune
    assert {scenario.loop for scenario in default.scenarios} == {"camera"}
    assert default.loops["camera"].actuator.level == "tendon" and default.loops["camera"].sensor.level == "camera"
    named = load_study(None, "tune.loops={mine: {plant_segments: 1}}").tune
    assert [scenario.loop for scenario in named.scenarios] == ["mine", "mine"]


@pytest.mark.parametrize(("beside", "use"), [(Beside(1e-3, 2e-2, 8), True), (Beside(2e-2, 1e-3, 8), False),
                                             (Beside(math.nan, math.nan, 0), False)])  # fmt: skip
def test_gains_that_are_worse_than_feedforward_or_always_fail_are_not_to_be_used(beside: Beside, use: bool) -> None:
    answer = answer_of({"smc": _search("smc")}, {"smc": beside}, {"smc": {}}, 8, "", {"smc": {}})
    assert answer is not None and answer.sentence.startswith("Use smc with") == use
