"""What is set beside the study's files is something that the command reads; files may hold sections of all commands."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records.manifest import KINDS
from wristctl.study_files.keys import command_of, keys_of
from wristctl.study_files.load import load_study
from wristctl.study_files.resolved import config_hash, names_read
from wristctl.study_files.sweeps import axes_of

PASSED_ON = {("recommend", "simulate"), ("recommend", "hw-run"), ("calibrate-camera", "track")}
"""Sections that a command does not compute with, but writes down for the next one."""


def leaves(section: Section, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Dotted keys of all leaves of a section, with their values."""
    for key, name in zip(keys_of(type(section)), type(section).model_fields, strict=True):
        value = getattr(section, name)
        if isinstance(value, Section):
            yield from leaves(value, (*path, key))
        else:
            yield ".".join((*path, key)), value


def foreign() -> list[tuple[str, str]]:
    """Every command with every leaf of a section that it does not read."""
    study = Study()
    sections = {key: getattr(study, name) for key, name in zip(keys_of(Study), Study.model_fields, strict=True)}
    every = [
        (key, leaf) for key, one in sections.items() if isinstance(one, Section) for leaf, _ in leaves(one, (key,))
    ]
    return [
        (command, leaf)
        for command in KINDS
        for key, leaf in every
        if key.replace("-", "_") not in names_read(command) and (command, key) not in PASSED_ON
    ]


DRAWN = [("tune", "simulate.loop.planes"), *random.Random(60).sample(foreign(), 20)]


@pytest.mark.parametrize(("command", "key"), DRAWN)
def test_a_key_of_another_command_is_an_error_that_names_it(command: str, key: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as refused:
        load_study([], [f"{key}=2"], command)
    section = key.partition(".")[0]
    named = [f"`wristctl {command_of(one)}`" for one in KINDS if section.replace("-", "_") in names_read(one)]
    assert str(refused.value).startswith(f"{command_of(command)} does not read {key} - ")
    assert f"--set {key}=2" in str(refused.value) and named and all(name in str(refused.value) for name in named)


@pytest.mark.parametrize("command", ["simulate", "tune", "compare"])
def test_a_sweep_over_a_key_of_another_command_is_an_error_too(command: str) -> None:
    with pytest.raises(UserError, match=rf"{command} does not read hysteresis\.frequencies.*`wristctl analyse` reads"):
        axes_of(Study(sweep=("hysteresis.frequencies=1,2",)), command)


def test_a_file_may_hold_sections_of_other_commands(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("wrist: {length: 0.09}\nsimulate: {loop: {planes: 2}}\ntune: {iterations: 2}\n", encoding="utf-8")
    study = load_study([file], ["seed=3"], "tune")
    assert study.simulate.loop.planes == 2 and study.tune.iterations == 2
    assert config_hash(study, "tune") == config_hash(load_study([], ["wrist.length=0.09", "iterations=2", "seed=3"],
        "tune"), "tune")  # fmt: skip


def test_what_a_recommendation_hands_on_may_be_set() -> None:
    assert load_study([], ["hw-run.repetitions=2"], "recommend").hw_run.repetitions == 2


def test_the_budget_of_a_comparisons_own_search_is_named_by_its_key() -> None:
    with pytest.raises(UserError, match=r"compare does not read tune\.candidates") as refused:
        load_study(overrides=["tune.candidates=8"], command="compare")
    key = refused.value.fix.partition(":")[0]
    tuning = load_study(overrides=[f"{key}=8"], command="compare").compare.tuning
    assert tuning is not None and tuning.candidates == 8
