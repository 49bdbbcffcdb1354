"""The written-out study is the study: nothing lost, every leaf in the hash."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.config.compare import CompareSettings
from wristctl.config.controller_row import Row
from wristctl.config.loop import Loop
from wristctl.config.plant import Plant
from wristctl.config.section import Section
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.study_files.keys import keys_of
from wristctl.study_files.load import load_study
from wristctl.study_files.resolved import config_hash, names_read, resolved_yaml
from wristctl.study_files.strict_yaml import parse_yaml

COMMANDS = ("gen-data", "train", "tune", "compare", "simulate", "analyse", "identify", "calibrate-wrist", "hw-run")


def _read_back(text: str) -> Study:
    return Study.model_validate(parse_yaml(text, "config.yaml").data)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_resolved_study_gives_the_same_study(command: str, tmp_path: Path) -> None:
    study = load_study([], ["wrist.length=0.0123456789012345", "seed=7", "horizon=1e-3"], "simulate")
    file = tmp_path / "config.yaml"
    file.write_text(resolved_yaml(study, command), encoding="utf-8")
    again = load_study([file])
    field = command.replace("-", "_")
    assert (again.seed, again.wrist, getattr(again, field)) == (study.seed, study.wrist, getattr(study, field))
    assert config_hash(again, command) == config_hash(study, command)
    assert resolved_yaml(again, command) == resolved_yaml(study, command)


@settings(max_examples=500 if os.environ.get("WRISTCTL_THOROUGH") else 25)
@given(st.text(max_size=30), st.dictionaries(st.text(max_size=8), st.floats(allow_nan=False, allow_infinity=False)))
@pytest.mark.slow
def test_any_text_survives_the_round_trip(text: str, gains: dict[str, float]) -> None:
    simulated = SimulateSettings(gains=gains, tuned=text, network=text)
    compared = CompareSettings(rows=(Row(gains=text.replace("=", "")), Row(gains=gains)), loops={text: Loop()})
    study = Study(simulate=simulated, compare=compared)
    assert _read_back(resolved_yaml(study, "simulate")).simulate == study.simulate
    assert _read_back(resolved_yaml(study, "compare")).compare == study.compare


def _plain(value: Any) -> Any:
    """As JSON has it, by the keys of a study file."""
    if isinstance(value, Plant):  # which leaves out what is at its default
        return value.model_dump(mode="json", by_alias=True)
    if isinstance(value, Section):
        names = zip(keys_of(type(value)), type(value).model_fields, strict=True)
        return {key: _plain(getattr(value, name)) for key, name in names}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    return list(map(_plain, value)) if isinstance(value, tuple) else value


@pytest.mark.parametrize("command", ["gen-data", "train"])
def test_the_hash_is_of_canonical_json_by_the_keys_of_a_file(command: str) -> None:
    study = load_study([], ["wrist.length=0.09", "seed=7"])
    read = {key: value for key, value in _plain(study).items() if key.replace("-", "_") in names_read(command)}
    assert {"seed", "wrist", command} <= set(read)
    text = json.dumps(read, sort_keys=True, separators=(",", ":"))
    assert config_hash(study, command) == hashlib.sha256(text.encode()).hexdigest()


def test_leaves_carry_unit_meaning_and_source() -> None:
    text = resolved_yaml(load_study([], ["wrist.mass=0.07"]), "train")
    assert "  length: 0.08  # [m] arc length from the first to the last disc (assumed)\n" in text
    assert "(assumed)" not in next(line for line in text.splitlines() if line.startswith("  mass: "))


def _other(value: Any) -> Any:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1
    if isinstance(value, tuple):
        return value[:-1] if value else ("other",)
    return "other"


def _changed(section: Section) -> Iterator[tuple[str, Section]]:
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, Section):
            for path, inner in _changed(value):
                yield f"{name}.{path}", section.model_copy(update={name: inner})
        else:
            yield name, section.model_copy(update={name: _other(value)})


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
@pytest.mark.slow
def test_every_leaf_that_a_command_reads_changes_its_hash(command: str) -> None:
    own = {
        "seed",
        "wrist",
        command.replace("-", "_"),
        {"train": "gen_data", "analyse": "simulate"}.get(command),
        "controller_settings" if command in ("tune", "compare", "simulate", "analyse", "hw-run", "study") else None,
    }
    drawn, swept = command in ("tune", "compare", "study"), command in ("tune", "compare", "simulate")
    own |= ({"families"} if drawn else set()) | ({"sweep"} if swept else set())
    base = config_hash(Study(), command)
    for path, study in _changed(Study()):
        assert isinstance(study, Study)
        changes = config_hash(study, command) != base
        assert changes == (path.split(".")[0] in own), path
