"""What single functions of the face do beyond the chain from data to audit."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.identification.benches import UPRIGHT, write_run
from wristctl import commands
from wristctl.commands.identify.command import Identified
from wristctl.comparison.combinations import count_rollouts


@pytest.mark.slow
def test_identified_parameters_reach_a_loop_from_memory(tmp_path: Path) -> None:
    run = write_run(tmp_path, 0, UPRIGHT, sides=("ulnar",))
    settings = (
        "identify={fix: {damping: 0.105, friction: 0.1, tendon_radius: 0.02}, condition_limit: 1e9, widest: 10.0}"
    )
    study = wristctl.load_study(None, settings, "simulate={horizon: 0.3, loop: {plant_segments: 1}}")
    memory = wristctl.identify(study, runs=run)
    kept = wristctl.identify(study, runs=[str(run.path)], out=tmp_path)
    assert isinstance(memory, Identified) and isinstance(kept, Identified)
    assert kept.run is not None and memory.run is None and memory.metrics == kept.metrics
    assert [each.run for each in kept.run.manifest.inputs] == [run.id] and kept.study.identify.runs == (run.id,)
    pd.testing.assert_frame_equal(memory.frame(), kept.frame())
    pd.testing.assert_frame_equal(kept.frame(), kept.run.data("parameters").fillna({"unit": ""}))
    assert memory.yaml == kept.run.file("data/identified.yaml").read_text()
    assert memory.values["stiffness"] == memory.metrics["stiffness"] and memory.values["friction"] == 0.1
    loops = [wristctl.simulate(study, from_identified=each) for each in (memory, kept, kept.run)]
    for loop in loops:
        np.testing.assert_equal(loop.metrics, loops[0].metrics)
    assert loops[0].metrics["rmse"] != wristctl.simulate(study).metrics["rmse"]


def test_an_audit_compares_in_memory_too_and_says_where_it_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    claim = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
    audited = wristctl.audit(wristctl.load_study(None, f"audit={{horizon: 0.02, claims: [{claim}]}}"))
    assert set(audited.comparisons) == {"exact", "sampled", "four-segments"} and not list(tmp_path.iterdir())
    (judged,) = audited.judgements
    lows = {loop: each.frame()["rmse"][1:].min() for loop, each in audited.comparisons.items()}
    assert {loop: found.low for loop, found in judged.found.items()} == lows
    assert audited.tables[-1].rows == [(loop, "in memory") for loop in audited.comparisons]


@pytest.mark.slow
def test_a_comparison_runs_as_many_rollouts_as_it_planned() -> None:
    axes = {
        "directions": "[ulnar, radial, flexion]",
        "loops": "{fast: {plant_segments: 1}, two: {plant_segments: 1, control_period: 2.0e-3}}",
        "references": "[{duration: 0.01}, {kind: step, angle_deg: 5.0}]",
        "inverses": "[none, exact]",
        "controllers": "[{controller: pid, gains: printed}, {controller: smc, gains: printed}, "
        "{controller: feedforward}]",
    }
    one = {
        "directions": "[radial]", "loops": "{fast: {plant_segments: 1}}", "references": "[{duration: 0.01}]",
        "inverses": "[none]", "controllers": "[{controller: feedforward}]",
    }  # fmt: skip
    for left_out in (*axes, ""):
        chosen = ", ".join(f"{name}: {one[name] if name == left_out else several}" for name, several in axes.items())
        study = wristctl.load_study(None, f"compare={{horizon: 0.02, {chosen}}}")
        assert len(wristctl.compare(study).rows) == count_rollouts(study.compare), left_out


@pytest.mark.slow
def test_no_study_knows_a_terminal() -> None:
    """Whoever is told or asked comes in as the session's operator; what is printed, the command line prints."""
    for file in Path(commands.__file__).parent.rglob("*.py"):
        tree = ast.parse(file.read_text())
        imported = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
        imported |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        called = {
            node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert not {name.split(".")[0] for name in imported} & {"typer", "rich", "click"}, file
        assert not called & {"print", "input"}, file
