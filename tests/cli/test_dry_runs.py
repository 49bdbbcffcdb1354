"""What is tried without being done: the study, the plan, and the refusal of whatever the command would refuse."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.conftest import Call


@pytest.mark.parametrize("command", ["simulate", "analyse", "tune", "compare"])
def test_a_dry_run_writes_nothing(call: Call, tmp_path: Path, command: str) -> None:
    code, out, _ = call(command, "--dry-run", *(("--set", "inverses=[none]") if command == "compare" else ()))
    assert code == 0 and f"a run of {command} under" in out and not list(tmp_path.iterdir())


TIPS = "{kind: tip-path, inverse: closed-form, tips: [[0.12, 0.0], [0.078, 0.014]]}"
FAMILY = ("--set", f"families.f={{references: [{{}}, {TIPS}]}}")
DRAWN = ("--set", "families.f={draw: {reference.angle_deg: 10..60}}")
LONG = ("--set", "wrist.length=0.12", "--set")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("simulate", *LONG, f"reference={TIPS}"), "simulate.reference.tips - fix"),
        (("analyse", *LONG, f"simulate.reference={TIPS}"), "simulate.reference.tips - fix"),
        (("tune", *LONG, f"scenarios=[{{}}, {{reference: {TIPS}}}]"), "tune.scenarios.1.reference.tips - fix"),
        (("compare", *LONG, f"references=[{{}}, {TIPS}]"), "compare.references.1.tips - fix"),
        (("hw-run", *LONG, f"reference={TIPS}"), "hw-run.reference.tips - fix"),
        (("tune", *LONG, "worlds.family=f", *FAMILY), "families.f.references.1.tips - fix"),
        (("compare", *LONG, "worlds.family=f", *FAMILY), "families.f.references.1.tips - fix"),
        (("compare", *LONG, "tuning={worlds: {family: f}}", *FAMILY), "families.f.references.1.tips - fix"),
        (("tune", "--set", "worlds.family=f", *DRAWN), "families.f.references.0.angle_deg - fix"),
        (("simulate", "--set", "reference.angle_deg=170"), "simulate.reference.angle_deg - fix: ask for less"),
        (("simulate", "--set", "reference={tip: [0.09, 0.2], inverse: closed-form}"), "simulate.reference.tip - fix"),
        (("simulate", "--set", "reference.inverse=network"), "simulate.reference.inverse - fix: --network RUN"),
        (("simulate", "--gains", "exchangd"), "did you mean 'exchanged'?"),
        (("simulate", "--set", "gains={P1: -3, P2: 2, P3: 1}"), "simulate.gains.P1 - fix: a gain is not negative"),
        (("simulate", "--set", "wrist.stiffness=1e-12"), "wrist.stiffness - fix: is that meant? go on with --force"),
        (("analyse", "--set", "simulate.reference.inverse=network"), "simulate.reference.inverse - fix: --network"),
        (("tune", "--set", "controllers=[smc, smc]"), "tune.controllers - fix: name each once"),
        (("tune", "--set", "scenarios=[{reference: {angle_deg: 170}}]"), "tune.scenarios.0.reference.angle_deg"),
        (("tune", "--set", "scenarios=[{reference: {inverse: network}}]"), "--network RUN"),
        (("compare", "--set", "references=[{angle_deg: 170}]"), "compare.references.0.angle_deg - fix"),
        (("compare", "--set", "inverses=[network]"), "--network RUN"),
        (("hw-run", "--set", "reference.angle_deg=170"), "hw-run.reference.angle_deg - fix: ask for less"),
        (("hw-run", "--set", "reference.inverse=network"), "hw-run.reference.inverse - fix: --network RUN"),
        (("hw-run", "--set", "push.force=1e6"), "hw-run.push.force - fix: is that meant? go on with --force"),
        (("hw-run", "--reference", "dart-thrower", "--set", "reference.angle_deg=70"), "a bend of 70 deg is beyond"),
        (("hw-run", "--reference", "circle", "--set", "planes=1"), "the rig in one"),
        (("train", "--set", "hidden=[]"), "[] is too few: at least 1"),
    ],
)
def test_a_dry_run_refuses_what_the_command_would(
    call: Call, tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    code, _, err = call(*arguments, "--dry-run")
    assert code == 2 and said in err and "Traceback" not in err and not list(tmp_path.iterdir())


@pytest.mark.parametrize("length", [0.05, 0.12])
def test_the_shipped_tip_path_is_for_wrists_of_any_length(call: Call, length: float) -> None:
    code, out, err = call("compare", "controllers", "--dry-run", "--set", f"wrist.length={length}")
    assert code == 0 and "kind: tip-path" in out and not err


def test_a_search_beyond_the_tendons_is_refused_unless_forced(call: Call, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("wrist: {stiffness: 6.0, length: 0.12}\n")
    asked = ("tune", "mine.yaml", "--set", "scenarios=[{reference: {angle_deg: -30}}]")
    for dry in ((), ("--dry-run",)):
        code, _, err = call(*asked, *dry)
        assert code == 2 and "tune.scenarios - fix: a tension_limit of 106 N" in err and err.count("\n") == 1
    assert [each.name for each in tmp_path.iterdir()] == ["mine.yaml"]
    assert call(*asked, "--dry-run", "--force")[0] == 0
    assert call(*asked, "--dry-run", "--set", "wrist.tension_limit=106")[0] == 0


def test_a_dry_run_says_which_values_a_leaf_may_have(call: Call) -> None:
    said = {
        ("simulate", "level"): "ideal, lagged, tendon", ("simulate", "kind"): "step, minimum-jerk, sine, multi-step",
        ("simulate", "inverse"): "none, closed-form, network", ("tune", "optimiser"): "pso, differential-evolution",
    }  # fmt: skip
    for (command, leaf), allowed in said.items():
        _, out, _ = call(command, "--dry-run", "--all")
        assert re.search(rf"^ *{leaf}: .*# .*: {allowed}", out, re.MULTILINE), (command, leaf)


def test_a_dry_run_of_compare_counts_the_directions_too(call: Call) -> None:
    code, out, _ = call("compare", "--dry-run", "--set", "directions=[ulnar, radial, flexion, extension]",
                        "--set", "loops={a: {}, b: {}, c: {}}", "--set", "references=[{kind: step}, {}, {kind: sine}]",
                        "--set", "inverses=[none]", "--set", "controllers=[{controller: feedforward}]")  # fmt: skip
    assert code == 0 and "# 36 rollouts of 5 s\n" in out


def test_a_dry_run_of_compare_counts_a_search_of_its_own_too(call: Call) -> None:
    search = "tuning={controllers: [smc, pid], candidates: 3, iterations: 5, horizon: 0.2}"
    code, out, _ = call(
        "compare",
        "--dry-run",
        "--set",
        "inverses=[none]",
        "--set",
        search,
        "--set",
        "controllers=[{controller: smc, gains: tuned}]",
    )
    assert code == 0 and "# a search first: 30 rollouts of 0.2 s for each of smc, pid\n" in out


def test_a_dry_run_counts_repetitions_where_they_can_differ(call: Call) -> None:
    one = "{plant_segments: 1}"
    seen = "{plant_segments: 1, sensor: {level: camera}}"
    few = "rows: [{controller: smc, gains: printed}], references: [{kind: step}, {}, {duration: 2.0}]"
    for command, more, said in (
        ("simulate", f"loop={seen}", "# 8 rollouts of 5 s"),
        ("simulate", f"loop={one}", "# one rollout of 5 s"),
        ("compare", f"compare={{inverses: [none], loops: {{a: {one}, b: {seen}}}, {few}}}", "# 27 rollouts of 5 s"),
        ("tune", f"loops={{four-segments: {seen}}}", "# 38400 rollouts of 5 s for each of smc"),
    ):
        code, out, _ = call(command, "--dry-run", "--set", "repetitions=8", "--set", more)
        assert code == 0 and f"{said}\n" in out
