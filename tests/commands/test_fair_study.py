"""The study of all laws: one answer, whoever computes it, however often it is stopped, and named faults."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.documented import DOCS, script_of_docs
from wristctl.commands import progress
from wristctl.commands.study.units import Studied, StudyPlace
from wristctl.comparison import world_ranking as judge_unit
from wristctl.comparison.bootstrap import plain
from wristctl.config.controller_row import Row
from wristctl.config.families import Worlds
from wristctl.config.study import Study
from wristctl.control import shipped_gains
from wristctl.errors import UserError
from wristctl.records import Run, list_runs
from wristctl.simulation import cases
from wristctl.work import worker as unit

SMALL = """
seed: 3
families:
  rig:
    about: a rig in small
    loop: {plant_segments: 1, control_period: 5.0e-3, sensor: {level: camera}}
    draw: {plant.stiffness: x0.6..1.3, plant.sensor.noise_deg: 0.03..0.1, reference.angle_deg: -40..40}
    references: [{duration: 0.3}, {kind: sine, frequency: 1.0}]
    horizon: 1.0
study:
  controllers: [pd-ff, pid-ff]
  presets: [{controller: feedforward}]
  objective: {margin: 0.0}  # in so short a search all that keeps one is the preset
  terms: {feedback: [feedforward/default, pd-ff/tuned], an integral: [pd-ff/tuned, pid-ff/tuned]}
  variants:
    RMSE alone: {objective: {steady_state: 0.0, worst: 0.0, margin: 0.0}}
    random: {optimiser: random}
    random again: {optimiser: random, beside: random}
  budgets:
    small: {candidates: 4, iterations: 2, finalists: 2, tunings: 2, draws: 2, validation: 2, worlds: 10, noises: 2}
"""

pytestmark = pytest.mark.painted


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fair") / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def study(file: Path) -> Study:
    return wristctl.load_study(file)


@pytest.fixture(scope="module")
def done(study: Study, file: Path) -> Studied:
    return wristctl.study(study, out=file.parent / "whole")


def run_of(found: Studied) -> Run:
    assert found.run is not None
    return found.run


@pytest.mark.slow
def test_its_answer_names_the_controller_what_each_term_buys_and_heads_the_run(done: Studied) -> None:
    text = (run_of(done).path / "README.md").read_text()
    result = text[text.index("## Result") :]
    assert max(map(len, done.summary)) <= 100 and len(done.summary) <= 32
    first = done.rankings["rig"].labels[done.rankings["rig"].standing.groups[0][0]]
    assert first in done.summary[0] and done.summary[0] in result and result.count(done.summary[0]) == 1
    assert str(done).startswith(done.summary[0]), "the terminal begins with it too"
    (integral,) = [line for line in done.summary if line.startswith("an integral ")]
    (value,) = [one for one in done.terms if one.term == "an integral"]
    assert integral.split()[-1] == ("undecided" if value.times.is_one else plain(value.times.value))
    words = " ".join(done.summary)
    assert all(shift.variant in words for shift in done.shifts) and len(done.shifts) == 3
    for name in ("laws", "answer", "performance-profile", "ratio-to-feedforward", "terms"):
        assert (run_of(done).path / "figures" / f"{name}.png").is_file()
    assert "figures/laws.png" in result


def test_feedback_is_worth_what_the_worlds_say(done: Studied) -> None:
    found = done.rankings["rig"]
    errors = {label: [tuning.rmse for tuning in rows] for label, rows in zip(found.labels, found.tunings, strict=True)}
    (feedback,) = [each for each in done.terms if each.term == "feedback"]
    assert list(map(len, errors.values())) == [2, 2, 1]
    ratios = [errors["feedforward/default"][0] / tuning for tuning in errors["pd-ff/tuned"]]
    assert feedback.times.value == pytest.approx(np.exp(np.mean(np.log(ratios))))
    assert feedback.times.low < min(np.exp(np.mean(np.log(ratios), axis=1))), "two tunings tell little"


def test_every_tuning_has_worlds_of_its_own_and_the_median_is_published(done: Studied, study: Study) -> None:
    """Of two the worse one; its figures are those of its gains, wherever they are asked for again."""
    found, path = done.rankings["rig"], run_of(done).path
    table = pd.read_csv(path / "data" / "tunings-rig.csv", comment="#")
    assert list(table.columns[:3]) == ["row", "tuning", "published"]
    published = json.loads((path / "data" / "gains-rig.json").read_text())
    for law in study.study.laws:
        searches = [done.searches[StudyPlace("", "rig", f"{law}/tuned", law, number)] for number in range(2)]
        assert searches[0].tried.gains.shape == searches[1].tried.gains.shape
        assert not np.array_equal(searches[0].tried.values, searches[1].tried.values)
        lines = table[table["row"] == f"{law}/tuned"]
        worse = int(np.argmax(lines["rmse"]))
        assert list(lines["published"]) == [number == worse for number in range(2)]
        assert published[law] == searches[worse].gains
        compared = study.compare.model_copy(
            update={"rows": (Row(controller=law, gains=published[law]),), "worlds": Worlds(family="rig", draws=10)}
        )
        (again,) = judge_unit.rank(study.model_copy(update={"compare": compared}))
        row = found.labels.index(f"{law}/tuned")
        first_noise = found.rows[row].measured.metrics["rmse"].reshape(10, 2, 2)[:, :, 0]
        assert np.array_equal(again.rows[0].measured.metrics["rmse"].reshape(10, 2), first_noise)


def test_what_is_shipped_of_it_is_the_median_tuning_with_its_figures_and_run(done: Studied, study: Study) -> None:
    run, ranking = run_of(done), done.rankings["rig"]
    kept = {"elsewhere": {"run": "of another run"}}
    shipped = script_of_docs("published_gains").with_run(kept, run)
    assert shipped["elsewhere"] == kept["elsewhere"] and shipped["rig"]["run"] == run.id
    published = json.loads((run.path / "data" / "gains-rig.json").read_text())
    assert {name: row["gains"] for name, row in shipped["rig"]["controllers"].items()} == published
    assert shipped["rig"]["family_sha256"] == study.families["rig"].settings_hash()
    assert shipped["rig"]["drive"] is None, "torques as commanded"
    for name, row in shipped["rig"]["controllers"].items():
        place = ranking.labels.index(f"{name}/tuned")
        assert row["rmse"] == pytest.approx(np.exp(np.log(ranking.scores[place]).mean()))
        assert row["rmse"] == pytest.approx(max(row["tunings"]), rel=1e-9), "of two the worse one is in the middle"
        assert row["rmse_low"] is row["rmse_high"] is None, "two tunings tell no interval"
        assert row["reliable"] == (place not in ranking.standing.unusable)


def test_how_often_a_controller_is_first_is_data(done: Studied) -> None:
    ranking, table = done.rankings["rig"], run_of(done).data("firsts").set_index("row")
    for label, line in table.iterrows():
        firsts = ranking.firsts[ranking.labels.index(str(label))]
        assert tuple(line[["first_in_halves", "first_in_tunings", "tunings"]]) == firsts and line["halves"] == 50
    assert table["first_in_halves"].sum() == 50 and table["first_in_tunings"].sum() == 2, "one is first in every half"


@pytest.mark.slow
def test_a_comparison_of_what_a_study_ships_has_its_figures_to_the_last_bit(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On its held-out worlds, of every controller in every world, and the mean and the lost worlds that are shipped."""
    budgets = {"small": study.study.budgets["small"].model_copy(update={"noises": 1, "tunings": 3})}
    found = wristctl.study(
        study.model_copy(update={"study": study.study.model_copy(update={"budgets": budgets, "variants": {}})}),
        out=tmp_path,
    )
    shipped = script_of_docs("published_gains").with_run({}, run_of(found))
    monkeypatch.setattr(shipped_gains, "_shipped", lambda: shipped)
    rows = [Row(controller=law, gains="tuned:worlds") for law in study.study.laws]
    asked = study.compare.model_copy(update={"rows": rows, "worlds": Worlds(family="rig", draws=10)})
    compared = wristctl.compare(study.model_copy(update={"compare": asked}), out=tmp_path)
    (again,) = compared.rankings
    for law in study.study.laws:
        row, before = again.labels.index(f"{law}/tuned:rig"), found.rankings["rig"].labels.index(f"{law}/tuned")
        assert np.array_equal(again.scores[row], found.rankings["rig"].scores[before])
        assert again.means[row].value == shipped["rig"]["controllers"][law]["rmse"]
        assert again.standing.lost[row].times == shipped["rig"]["controllers"][law]["lost"]
    monkeypatch.syspath_prepend(DOCS)
    page, run = script_of_docs("study"), compared.run
    assert run is not None
    ((name, shown),) = page.rankings_of(run).items()
    assert name == "rig" and {line["row"] for line in shown} >= {f"{law}/tuned" for law in study.study.laws}
    scores = page.scores_of(run, name)
    for line in shown:
        assert line["rmse"] == pytest.approx(np.exp(np.log(scores[line["row"]]).mean()))
    one, other = (f"{law}/tuned" for law in study.study.laws[:2])
    (term,) = page.terms_of(run, {"a term": (one, other)})
    times = again.times_better(again.labels.index(f"{other}:rig"), again.labels.index(f"{one}:rig"))
    assert (term["times"], term["low"], term["high"]) == pytest.approx(times[:3], rel=0.01)


def test_a_variant_is_held_against_the_one_that_it_names(done: Studied) -> None:
    """The same search twice finds the same gains: nothing turns round, and no RMSE changes."""
    table = pd.read_csv(run_of(done).path / "data" / "sensitivity.csv", comment="#").set_index("variant")
    assert list(table.loc["random again beside random", ["tau", "reversed", "ratio"]]) == [1.0, 0, 1.0]
    assert table.loc["random", "ratio"] != 1.0, "another search finds other gains"


@pytest.mark.slow
def test_a_study_killed_and_resumed_by_other_processes_has_the_same_hash(
    done: Studied, study: Study, file: Path, tmp_path: Path
) -> None:
    command = [sys.executable, "-m", "wristctl", "study", str(file), "--out", str(tmp_path), "-q"]
    root = str(Path(wristctl.__file__).parents[1])
    child = subprocess.Popen(command, env={**os.environ, "PYTHONPATH": root}, stdout=subprocess.DEVNULL)
    begun = time.monotonic()
    while len(list(tmp_path.glob("*/units/*.npz"))) < 2:
        assert child.poll() is None and time.monotonic() - begun < 120.0
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    child.wait()
    (stopped,) = list_runs(tmp_path)
    kept = {each.name: each.read_bytes() for each in (stopped.path / "units").glob("*.npz")}
    assert stopped.state == "crashed" and kept
    again = wristctl.study(study, resume=stopped.path, executor="processes:2", out=tmp_path)
    assert run_of(again).result_hash == run_of(done).result_hash
    units = {each.name: each.read_bytes() for each in (run_of(again).path / "units").glob("*.npz")}
    assert kept.items() <= units.items()
    noted = run_of(again).manifest.units
    assert noted is not None and noted.run == stopped.id and noted.computed_again >= 1
    assert noted.taken_over + noted.computed_again == len(kept)
    assert [each.role for each in run_of(again).manifest.inputs] == ["resume"]


@pytest.mark.slow
def test_what_a_resumed_study_keeps_says_nothing_of_the_time_that_is_left(
    done: Studied, study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All units are there but the one that is tried again."""
    fresh: dict[str, set[int]] = {}
    fields = progress.Count.fields

    def noted(count: progress.Count) -> dict[str, object]:
        fresh.setdefault(count.what, set()).add(count.count - count.kept)
        return fields(count)

    monkeypatch.setattr(progress.Count, "fields", noted)
    wristctl.study(study, resume=run_of(done).path, out=tmp_path)
    total = {name: max(numbers) for name, numbers in fresh.items()}
    events = [json.loads(line) for line in (run_of(done).path / "events.jsonl").read_text().splitlines()]
    sizes = {one["what"]: one["total"] for one in events if one["event"] == "progress"}
    assert 0 < total["tuning"] < sizes["tuning"] / 2


@pytest.mark.slow
def test_whoever_resumes_with_other_code_is_told_once_that_all_is_computed_anew(
    done: Studied, study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(unit, "code_digest", lambda: "other")
    again = wristctl.study(study, resume=run_of(done).path, out=tmp_path)
    assert caplog.text.count(f"{run_of(done).id} was made by other code: none of its units can be kept") == 1
    assert run_of(again).result_hash == run_of(done).result_hash


@pytest.mark.slow
def test_in_memory_it_finds_the_same(done: Studied, study: Study) -> None:
    assert wristctl.study(study).frame().equals(done.frame())


@pytest.mark.slow
def test_a_unit_that_fails_is_named_and_its_row_left_out(
    done: Studied, study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = cases.measure

    def failing(law: Any, *given: Any, **named: Any) -> Any:
        if law.name == "pd-ff":
            raise ArithmeticError("no number")
        return known(law, *given, **named)

    monkeypatch.setattr(judge_unit, "measure", failing)
    found = wristctl.study(study)
    assert found.fault is not None and found.fault.exit_code == 3
    assert "pd-ff on worlds 0 to 9 of rig" in str(found.fault) and "ArithmeticError: no number" in str(found.fault)
    rows = {row.label: row for row in found.rankings["rig"].rows}
    assert set(rows) == {"pid-ff/tuned", "feedforward/default"}
    before = {row.label: row for row in done.rankings["rig"].rows}
    assert np.array_equal(rows["pid-ff/tuned"].rmse, before["pid-ff/tuned"].rmse)


def test_a_row_of_a_study_chatters_where_the_middle_of_its_noises_does_on_any_motion(study: Study) -> None:
    """Of the stored metrics alone: three worlds, the wrist's motions, three noises each."""
    (unit,) = judge_unit.judge_units(study, "rig", "pd-ff", {"Kp": 4.0, "Kd": 0.2}, 3, 3)
    pieces = judge_unit.judged(unit.spec)
    still = {"oscillation": 0.0 * pieces["rmse"], "drift": 0.0 * pieces["rmse"], "chattering": 0.0 * pieces["rmse"]}
    slams = {"chattering": still["chattering"].copy()}
    slams["chattering"][1, -1, :2] = slams["chattering"][2, 0, 0] = 4.0 * 58.0 * 26.0
    row = judge_unit.row_of("one", [pieces | still | slams], 58.0)
    assert row.swings.tolist() == [False, True, False] and (row.measured.chatter > 0.0).sum() == 3
    assert not judge_unit.row_of("one", [pieces | still | slams], 65.0).swings.any(), "a wider range is crossed less"
    coarse = {"drift": still["drift"].copy()}
    coarse["drift"][2, 0, 1] = 0.05
    row = judge_unit.row_of("one", [pieces | still | coarse], 58.0)
    assert row.swings.tolist() == [False, False, True], "a number that depends on the step with one noise is none"


def test_a_row_swings_where_it_does_in_motion_by_more_than_feedforward_may(study: Study) -> None:
    """Of the stored metrics alone: three worlds with a motion that rests and one that does not, three noises each."""
    (unit,) = judge_unit.judge_units(study, "rig", "pd-ff", {"Kp": 4.0, "Kd": 0.2}, 3, 3)
    pieces = judge_unit.judged(unit.spec)
    rests = np.zeros(pieces["rmse"].shape, bool)
    rests[:, 0] = True
    calm = pieces | dict.fromkeys(("oscillation", "drift", "chattering", "sustained"), 0.0 * pieces["rmse"])
    calm |= {"rests": rests}
    own, open_loop = calm["sustained"].copy(), calm["sustained"].copy()
    own[0, 1, :2] = own[1, 0] = own[2, 1] = np.deg2rad(0.5)
    open_loop[2, 1] = np.deg2rad(0.3)
    swinging = calm | {"sustained": own}
    row = judge_unit.row_of("one", [swinging], 58.0, open_loop=[calm | {"sustained": open_loop}])
    assert row.swings.tolist() == [True, False, False], "at rest that is another metric; twice feedforward's is allowed"
    assert not judge_unit.row_of("one", [swinging], 58.0).swings.any()
    assert judge_unit.row_of("one", [swinging], 58.0, open_loop=[calm]).swings.tolist() == [True, False, True]


def test_ranges_of_worlds_put_together_are_the_whole(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    gains = {"Kp": 4.0, "Kd": 0.2}
    (whole,) = judge_unit.judge_units(study, "rig", "pd-ff", gains, 10, 2)
    (single,) = judge_unit.judge_units(study, "rig", "pd-ff", gains, 10, 1)
    monkeypatch.setattr(judge_unit, "_ROLLOUTS", 12)
    parts = judge_unit.judge_units(study, "rig", "pd-ff", gains, 10, 2)
    assert [each.spec["worlds"] for each in parts] == [3, 3, 3, 1]
    rows = [
        judge_unit.row_of("one", [judge_unit.judged(each.spec) for each in units], 58.0) for units in ([whole], parts)
    ]
    assert np.array_equal(rows[0].rmse, rows[1].rmse) and np.array_equal(rows[0].swings, rows[1].swings)
    first = judge_unit.row_of("one", [judge_unit.judged(whole.spec)], 58.0, noises=1)
    assert np.array_equal(first.rmse, judge_unit.row_of("one", [judge_unit.judged(single.spec)], 58.0).rmse), (
        "noise 0 is the same, alone or not"
    )
    assert not np.array_equal(first.rmse, rows[0].rmse)
    pieces = judge_unit.judged(whole.spec)
    for motion in range(pieces["rmse"].shape[1]):
        alone = judge_unit.row_of("one", [pieces], 58.0, [motion])
        assert alone.rmse == pytest.approx(np.exp(np.log(pieces["rmse"][:, motion]).mean(axis=1)))
        assert alone.measured.failed.shape == (1, 20)


@pytest.mark.parametrize(
    "override, told",
    [
        ("study.families=[rigs]", r"unknown family of worlds 'rigs' - .*: study.families - fix: did you mean 'rig'"),
        ("study.controllers=[pd-ff, feedforward]", r"feedforward has no gains to tune - study.controllers.1"),
        ("study.controllers=[pd-ff, pd-ff]", r"pd-ff is named twice"),
        ("study.budget=ful", r"unknown budget 'ful' - .*: study.budget - fix: one of small"),
        ("study.presets=[{controller: smc, gains: tuned}]", r"no tuned gains of smc - study.presets.0"),
        (
            "study.terms={x: [pd-ff/tuned, pid-ff/tunes]}",
            r"'pid-ff/tunes' is not in the study - .*: study.terms.x - fix: did"),
        ("study.variants={x: {optimiser: psoo}}", r"unknown optimiser 'psoo'.*did you mean 'pso'"),
        ("study.variants={x: {beside: y}, z: {}}", r"x beside 'y': one of RMSE alone, random, random again, z - "),
        ("study.variants={x: {beside: x}}", r"x beside 'x': one of RMSE alone, random, random again - "),
        ("study.budgets.small.candidates=2", r"at least 3 candidates, not 2 - .*: study.budgets.small.candidates -"),
    ],
)  # fmt: skip
def test_what_cannot_be_studied_is_named_before_anything_is_computed(file: Path, override: str, told: str) -> None:
    with pytest.raises(UserError, match=told) as raised:
        wristctl.study(wristctl.load_study(file, override))
    assert raised.value.exit_code == 2


def test_without_families_it_says_where_there_are_some() -> None:
    with pytest.raises(UserError, match=r"no families of worlds - study.families - fix: include some"):
        wristctl.study(wristctl.load_study())


def test_the_committed_study_can_be_run_and_has_the_size_it_is_said_to_have() -> None:
    study = wristctl.load_study(Path(wristctl.__file__).parents[1] / "experiments" / "fair_study.yaml")
    full = study.study.budgets["full"]
    assert len(study.study.laws) >= 16 and full.tunings >= 5 and study.study.budgets["small"].tunings >= 2
    smooth = [family for name, family in study.families.items() if name != "steps"]
    for budget in study.study.budgets.values():
        assert min(budget.draws * len(family.references) for family in smooth) >= 50, "fewer do not tell gains apart"
    assert full.worlds * len(study.study.families) == 1250
    assert {"pd-ff", "pid-ff", "pid-dob", "smc-dob"} <= set(study.study.laws), "the ladder"
