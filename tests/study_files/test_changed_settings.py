"""Settings that are not at their defaults, as a dry run shows them: few lines, and the same study when read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.records.manifest import KINDS
from wristctl.study_files.load import load_study
from wristctl.study_files.resolved import changed_yaml, config_hash, resolved_yaml
from wristctl.study_files.shipped import shipped, shipped_names


@pytest.mark.parametrize("name", [name for name in shipped_names() if name != "claims"])
@pytest.mark.slow
def test_what_is_shown_gives_the_same_study(tmp_path: Path, name: str) -> None:
    study = load_study([shipped() / f"{name}.yaml"])
    for kind in KINDS[:10]:
        (tmp_path / "changed.yaml").write_text(changed_yaml(study, kind))
        again = load_study([tmp_path / "changed.yaml"])
        assert config_hash(again, kind) == config_hash(study, kind), kind


def test_a_study_of_defaults_shows_nothing_and_a_change_alone_with_its_unit() -> None:
    assert changed_yaml(Study(), "simulate") == ""
    told = changed_yaml(load_study([], ["wrist.length=0.12", "simulate.loop.plant_segments=2"]), "simulate")
    assert [line.split("#")[0].rstrip() for line in told.splitlines()] == [
        "wrist:", "  length: 0.12", "simulate:", "  loop:", "    plant_segments: 2",
    ]  # fmt: skip
    assert "[m]" in told


def test_a_loop_with_a_built_in_ones_name_is_whole() -> None:
    study = load_study([], ["compare.loops={sampled: {plant_segments: 4}}"])
    again = load_study(
        [], [f"compare.loops.sampled={{plant_segments: {study.compare.loops['sampled'].plant_segments}}}"]
    )
    assert again.compare.loops == study.compare.loops and "control_period" in changed_yaml(study, "compare")


def test_each_of_several_is_named_and_choices_are_not_repeated() -> None:
    study = load_study([shipped() / "controllers.yaml"])
    told, whole = changed_yaml(study, "compare"), resolved_yaml(study, "compare")
    assert len(told.splitlines()) < len(whole.splitlines()) / 4
    assert told.count("- controller: ") == len(study.compare.rows) and "gvsc, nc" not in told.partition("tuning")[0]
