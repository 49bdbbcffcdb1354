"""Studies and sealed runs with former names of keys, presets, loops and folders mean the same as ever; one note."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.config import former_names
from wristctl.config.loop import LOOPS
from wristctl.config.study import Study
from wristctl.control.law import Controller, Gain
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.errors import UserError
from wristctl.plotting.style import line
from wristctl.plugins.places import placed
from wristctl.records.replay import compare_files
from wristctl.study_files.load import load_study
from wristctl.study_files.resolved import resolved_yaml
from wristctl.study_files.sweeps import axes_of, study_at

OLD = """\
compare:
  rows: [{controller: smc, gains: stepper}, {controller: feedforward}, {controller: mrac, gains: stepper}]
  loops: {default: {}, sampled: {}}
  references: [{duration: 0.2}]
  inverses: [none]
  horizon: 0.3
study: {laws: [pd-ff, lqi]}
hw-run:
  rows: [{controller: smc, gains: stepper}]
laws: {springy: {spring: 2.0}}
tune:
  scenarios: [{loop: default}, {reference: {kind: step}}, {loop: sampled}]
"""
TODAY = (
    OLD.replace("rows:", "controllers:").replace("stepper", "hardware").replace("default", "four-segments")
    .replace("{laws:", "{controllers:").replace("laws:", "controller-settings:")
)  # fmt: skip


def written(folder: Path, text: str) -> Path:
    """A study file."""
    file = folder / "study.yaml"
    file.write_text(text)
    return file


def with_presets_of_today(study: Study) -> Study:
    """The study with the presets' names of today, which a study keeps as they were given."""
    renamed = {}
    for section in ("compare", "hw_run"):
        content = getattr(study, section)
        rows = tuple(row.model_copy(update={"gains": former_names.label_today(row.gains_name)}) for row in content.rows)
        renamed[section] = content.model_copy(update={"rows": rows})
    return study.model_copy(update=renamed)


def test_a_study_of_former_names_is_that_of_todays(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    old = load_study([written(tmp_path, OLD)])
    (note,) = caplog.messages
    assert note.startswith(f"{tmp_path}/study.yaml:2:")
    pairs = (
        ("compare.rows", "compare.controllers"), ("hw-run.rows", "hw-run.controllers"),
        ("study.laws", "study.controllers"), ("laws", "controller-settings"),
        ("loop default", "four-segments"), ("preset stepper", "hardware"),
    )  # fmt: skip
    assert all(f"{before} is now {today}" in note for before, today in pairs)
    today = load_study([written(tmp_path, TODAY)])
    assert len(caplog.messages) == 1, "names of today need no note"
    assert with_presets_of_today(old) == today != load_study([])


@pytest.mark.parametrize(
    ("command", "former", "today"),
    [
        ("compare", "rows=[{controller: pd-ff}]", "controllers=[{controller: pd-ff}]"),
        ("hw-run", "hw-run.rows=[{controller: pd-ff}]", "controllers=[{controller: pd-ff}]"),
        ("study", "laws=[lqi]", "controllers=[lqi]"),
        ("simulate", "laws={springy: {spring: 2.0}}", "controller-settings={springy: {spring: 2.0}}"),
        ("simulate", "laws.springy.spring=2.0", "controller-settings.springy.spring=2.0"),
        ("tune", "scenarios=[{loop: default}]", "scenarios=[{loop: four-segments}]"),
        ("tune", "loops={default: {}, other: {}}", "loops={four-segments: {}, other: {}}"),
    ],
)
def test_an_override_may_have_a_former_name(
    command: str, former: str, today: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert load_study([], [former], command) == load_study([], [today], command) != load_study([])
    (note,) = caplog.messages
    assert f"--set {former}: former names are read" in note


def test_a_former_key_beside_its_new_one_is_refused() -> None:
    with pytest.raises(UserError, match="unknown key 'rows'"):
        load_study([], ["compare={rows: [], controllers: [{}]}"])


def test_a_sweep_may_have_former_names() -> None:
    study = load_study([], ["compare.controllers=[{controller: smc}, {controller: pid}]"])
    swept = {"sweep": ("rows.1.gains=stepper,printed", "loops.default.plant_segments=2,3")}
    axes = axes_of(study.model_copy(update=swept), "compare")
    at = study_at(study, axes, ["printed", 3])
    assert (at.compare.rows[1].gains, at.compare.loops["four-segments"].plant_segments) == ("printed", 3)


def test_loops_of_ones_own_keep_their_names(caplog: pytest.LogCaptureFixture) -> None:
    loops = "loops={default: {control_period: 2.0e-3}, four-segments: {limits: false}}"
    study = load_study([], [loops, "scenarios=[{loop: default}, {loop: four-segments}]"], "tune")
    assert [study.tune.loops[each.loop].control_period for each in study.tune.scenarios] == [2e-3, 1e-3]
    alone = load_study([], ["loops={default: {limits: false}}", "scenarios=[{}, {loop: default}]"], "tune").tune
    assert [each.loop for each in alone.scenarios] == ["default", "default"] and list(alone.loops) == ["default"]
    assert not caplog.messages


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if "hardware" in controller(name).presets])
def test_the_former_name_of_a_preset_has_its_gains(name: str) -> None:
    assert gains_of(controller(name), "stepper") == gains_of(controller(name), "hardware")
    assert line(f"{name}/stepper") == line(f"{name}/hardware")


def test_a_preset_of_ones_own_may_have_the_former_name() -> None:
    gains = {"stepper": {"Kp": 1.0}, "hardware": {"Kp": 2.0}}
    own = Controller("own", lambda *now: 0.0, "", {"Kp": Gain("", "", 0.1, 10.0)}, gains)
    assert (gains_of(own, "stepper"), gains_of(own, "hardware")) == ((1.0,), (2.0,))
    with pytest.raises(UserError, match="unknown gains 'stepper' of computed-torque"):
        gains_of(controller("computed-torque"), "stepper")


def test_a_run_of_former_names_comes_out_as_it_was(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The configuration as an earlier version sealed it: rows, loops in full, and a preset's former name."""
    first = wristctl.compare(load_study([written(tmp_path, TODAY)]))
    lines = resolved_yaml(first.study, "compare").replace("  controllers:  #", "  rows:  #")
    sealed = lines.replace("gains: hardware", "gains: stepper").replace("    four-segments:\n", "    default:\n")
    assert "  rows:  #" in sealed and "    default:\n" in sealed
    again = wristctl.compare(load_study([written(tmp_path, sealed)]))
    assert [(row.loop, row.label) for row in again.rows] == [
        (loop, label)
        for loop in ("default", "sampled")
        for label in ("smc/stepper", "feedforward/default", "mrac/stepper")
    ]
    before, after = ([row.repeated.first.metrics["rmse"] for row in each.rows] for each in (first, again))
    np.testing.assert_array_equal(before, after)


def test_what_a_preset_was_called_is_no_difference_of_a_repetition(tmp_path: Path) -> None:
    before, after, other = (tmp_path / f"{name}.csv" for name in ("before", "after", "other"))
    for file, origin in ((before, "stepper"), (after, "hardware"), (other, "default")):
        file.write_text(f"origin [1],objective [1]\nsearch,1.0\n{origin},2.0\n")
    assert compare_files(before, after).verdict == "within tolerance"
    assert compare_files(before, other).verdict == "differs"


def test_controllers_of_ours_are_found_by_their_former_folder(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    before, today = tmp_path / "experiments" / "laws", tmp_path / "experiments" / "own_controllers"
    today.mkdir(parents=True)
    (today / "lqr.py").write_text("")
    named = ("experiments/laws/lqr.py:LQR",)
    assert placed(named, tmp_path / "study.yaml") == (f"{today}/lqr.py:LQR",) and len(caplog.messages) == 1
    shutil.copytree(today, before)
    assert placed(named, tmp_path / "study.yaml") == (f"{before}/lqr.py:LQR",) and len(caplog.messages) == 1, (
        "one's own copy"
    )


def test_every_former_name_has_one_of_today() -> None:
    assert set(former_names.LOOPS.values()) <= set(LOOPS) and not set(former_names.LOOPS) & set(LOOPS)
    presets = {preset for name in CONTROLLERS for preset in controller(name).presets}
    assert set(former_names.PRESETS.values()) <= presets and not set(former_names.PRESETS) & presets
