"""Rollouts that a command announces, limits and shows as progress: all that a learning controller repeats count."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import wristctl
from wristctl.commands.compare import command as compare
from wristctl.commands.inputs import Inputs
from wristctl.commands.recommend.command import plan as recommend_plan
from wristctl.commands.simulate import command as simulate
from wristctl.commands.study.command import plan as study_plan
from wristctl.commands.tune import command as tune
from wristctl.comparison.combinations import compare as compare_motions
from wristctl.comparison.world_ranking import judge_units, rank
from wristctl.config.study import Study
from wristctl.control.ilc import ILC
from wristctl.tuning.search import search_unit

FAMILY = """
families:
  brief:
    loop: {plant_segments: 1}
    draw: {reference.angle_deg: 10..20}
    references: [{kind: minimum-jerk, duration: 0.1}]
    horizon: 0.2
"""
TIMES = ILC.learning


@pytest.fixture
def family(tmp_path: Path) -> Path:
    file = tmp_path / "brief.yaml"
    file.write_text(FAMILY)
    return file


def of(law: str, *settings: str, file: Path | None = None) -> Study:
    return wristctl.load_study(file, *(setting.replace("LAW", law) for setting in settings))


def test_a_learning_controller_has_eight_times_the_rollouts_of_another(family: Path) -> None:
    row, in_worlds = "compare.controllers=[{controller: LAW, gains: default}]", "worlds.family=brief"
    counted = [
        (
            simulate.size(of(law, "simulate.controller=LAW")).rollouts,
            tune.size(of(law, "tune.controllers=[LAW]")).rollouts,
            tune.size(of(law, "tune.controllers=[LAW]", f"tune.{in_worlds}", file=family)).rollouts,
            compare.size(of(law, row)).rollouts,
            compare.size(of(law, row, f"compare.{in_worlds}", file=family)).rollouts,
            search_unit(of(law, f"tune.{in_worlds}", file=family), law).size,
            sum(unit.size for unit in judge_units(of(law, file=family), "brief", law, {}, 30, 1)),
        )
        for law in ("pid-ff", "ilc")
    ]
    assert [more / fewer for fewer, more in zip(*counted, strict=True)] == [TIMES] * len(counted[0])


def test_a_unit_of_a_learning_controller_has_fewer_worlds() -> None:
    study = wristctl.load_study("experiments/scenarios/camera.yaml")
    fewer, more = (len(judge_units(study, "camera", law, {}, 20_000, 1)) for law in ("pid-ff", "ilc"))
    assert TIMES * (fewer - 1) < more <= TIMES * fewer + 1


def test_plans_count_all_repetitions(family: Path) -> None:
    told = tune.planned_search(of("ilc", "tune.controllers=[LAW, pid-ff]"), Inputs())
    assert re.match(r"(\d+) rollouts .* 8 times as many for ilc", told)
    study = "study.controllers=[LAW]", "study.families=[brief]"
    plans = [study_plan(of(law, *study, file=family), Inputs()) for law in ("pid-ff", "ilc")]
    (found, tested), (found_by_ilc, tested_by_ilc) = (
        [int(count) for count in re.findall(r"(\d+)(?: rollouts)? of (?:searches|tests)", plan)] for plan in plans
    )
    feedforward = wristctl.load_study(family).study.budgets["small"].worlds
    assert found_by_ilc == TIMES * found and tested_by_ilc - feedforward == TIMES * (tested - feedforward)
    rigs = [recommend_plan(of(law, "recommend.controllers=[LAW]"), Inputs()) for law in ("pid-ff", "ilc")]
    few, many = (int(re.findall(r"about (\d+) rollouts", plan)[0]) for plan in rigs)
    assert many == TIMES * few


@pytest.mark.slow
def test_progress_gives_a_learning_controller_the_share_of_its_rollouts(family: Path) -> None:
    """In worlds with feedforward, which joins; on motions without."""
    rows = "controllers=[{controller: pid-ff, gains: default}, {controller: ilc, gains: default}]"
    brief = "loops={one: {plant_segments: 1}}", "references=[{kind: minimum-jerk, duration: 0.1}]", "horizon=0.2"
    in_worlds, on_motions = list[float](), list[float]()
    worlds = f"compare.{rows}", "compare.worlds.family=brief", "compare.worlds.draws=8"
    rank(wristctl.load_study(family, *worlds), progress=in_worlds.append)
    motions = [f"compare.{setting}" for setting in (rows, *brief, "inverses=[none]")]
    compare_motions(wristctl.load_study(None, *motions), progress=on_motions.append)
    for shares, after_pid in ((in_worlds, 1.0 / (TIMES + 2.0)), (on_motions, 1.0 / (TIMES + 1.0))):
        assert shares == sorted(shares) and shares[-1] <= 1.0 + 1e-9
        assert any(share == pytest.approx(after_pid) for share in shares)
