"""The schema of study files that editors read: it takes what commands take, and refuses what they refuse."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Literal, get_origin

import pytest
import yaml
from annotated_types import Ge, Gt, Le, Lt
from jsonschema import Draft202012Validator
from pydantic.fields import FieldInfo

from tests.cli.conftest import ROOT
from wristctl.config.section import OneOf
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.study_files.json_schema import study_schema
from wristctl.study_files.keys import field_at, keys_of
from wristctl.study_files.load import load_study
from wristctl.study_files.strict_yaml import parse_yaml

STUDIES = sorted((ROOT / "experiments").rglob("*.yaml"))
KINDS = ("type", "range", "name", "unknown key", "structure")


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = study_schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def plain(data: Any) -> Any:
    """As JSON has it, of what a study file holds."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    return [plain(value) for value in data] if isinstance(data, tuple | list) else data


def refused(validator: Draft202012Validator, text: str) -> list[str]:
    return [error.message for error in validator.iter_errors(plain(parse_yaml(text, "").data))]


@pytest.mark.parametrize("file", STUDIES, ids=lambda file: file.stem)
def test_every_experiment_is_one(validator: Draft202012Validator, file: Path) -> None:
    assert refused(validator, file.read_text(encoding="utf-8")) == []


def test_a_motion_by_its_name_alone_is_one_where_it_is_known(validator: Draft202012Validator) -> None:
    text = "simulate: {{reference: {}}}\ncompare: {{references: [{{kind: step}}, {}, my.py:MINE]}}\n"
    assert not refused(validator, text.format("sine", "ramp"))
    assert len(refused(validator, text.format("sin", "ramp"))) == len(refused(validator, text.format("sine", "2"))) == 1


Leaf = tuple[tuple[str, ...], FieldInfo]


def leaves(kind: Any = Study, path: tuple[str, ...] = ()) -> Iterator[Leaf]:
    """Every setting below sections of sections, with its key path."""
    for key, field in keys_of(kind).items():
        inner = keys_of(field_at((*path, key))[0])
        if inner:
            yield from leaves(field_at((*path, key))[0], (*path, key))
        else:
            yield (*path, key), field


def wrong(kind: str, leaf: Leaf, rng: random.Random) -> tuple[tuple[str, ...], Any] | None:
    """A key path with a value that no command takes there; None where the leaf has no such fault."""
    path, field = leaf
    if kind == "type" and field.annotation in (float, int, bool):
        return path, rng.choice(["many", [1], {"a": 1}, *([True] if field.annotation is not bool else [3])])
    for bound in field.metadata if kind == "range" else ():
        match bound:
            case Ge(ge=least) if isinstance(least, int | float):
                return path, least - rng.choice([1, 100])
            case Gt(gt=least) if isinstance(least, int | float):
                return path, rng.choice([least, least - 1])
            case Le(le=most) if isinstance(most, int | float):
                return path, most + rng.choice([1, 100])
            case Lt(lt=most) if isinstance(most, int | float):
                return path, most
    named = any(isinstance(marker, OneOf) for marker in field.metadata) or get_origin(field.annotation) is Literal
    if kind == "name" and named:
        return path, rng.choice(["nobody", "pid-of", "Minimum-Jerk"])
    if kind == "unknown key" and len(path) > 1:
        return (*path[:-1], path[-1] + rng.choice(["s", "_", "x"])), 1
    if kind == "structure" and len(path) > 1:
        return path[:-1], rng.choice([[1, 2], "text", 3])
    return None


def drawn() -> list[Any]:
    """Fifty faults, ten of each kind, of different settings."""
    rng = random.Random(2026)
    found = []
    for kind in KINDS:
        faults = [fault for leaf in rng.sample(list(leaves()), 400) if (fault := wrong(kind, leaf, rng))]
        found += [pytest.param(*fault, id=f"{kind}-{'.'.join(fault[0])}") for fault in faults[:10]]
    return found


WRONG = drawn()


def test_there_are_ten_faults_of_each_kind() -> None:
    assert len(WRONG) == 10 * len(KINDS) and len({str(param.id) for param in WRONG}) > 40


@pytest.mark.parametrize(("path", "value"), WRONG)
def test_what_commands_refuse_it_refuses(
    validator: Draft202012Validator, tmp_path: Path, path: tuple[str, ...], value: Any
) -> None:
    content: Any = value
    for key in reversed(path):
        content = {key: content}
    file = tmp_path / "study.yaml"
    file.write_text(yaml.safe_dump(content))
    with pytest.raises(UserError):
        load_study([file])
    assert refused(validator, file.read_text())


@pytest.mark.parametrize(
    "text",
    [
        "hw-run: {controllers: [pid-ff, ct-dob/hardware]}", "hw-run: {controller: pid-ff, gains: {Kp: 1.0}}",
        "simulate: {controller: pid-ff/hardware}", "simulate: {gains: 'Kp=10,Ki=2'}", "include: [quick.yaml]",
        "compare: {controllers: [{controller: pid, gains: printed}]}", "wrist: {length: 1}", "wrist: {tendons: three}",
        "wrist: {tendons: [{angle_deg: 0}, {angle_deg: 120, radius: 0.01}, {angle_deg: 240}]}", "sweep: ['a=1,2']",
    ],
)  # fmt: skip
def test_short_forms_are_taken(validator: Draft202012Validator, text: str) -> None:
    assert refused(validator, text) == []


@pytest.mark.parametrize(
    ("text", "taken"),
    [
        *((f"{section}: {{controllers: pid}}", True) for section in ("compare", "tune", "hw-run", "recommend")),
        ("hw-run: {controllers: pid-ff/hardware}", True), ("compare: {references: sine}", True),
        ("compare: {directions: radial}", True), ("hw-run: {directions: radial}", True),
        ("study: {families: camera}", True), ("identify: {logs: a.csv}", True), ("tune: {scenarios: camera}", False),
        ("wrist: {tendons: 0}", False), ("analyse: {angles_deg: a}", False), ("compare: {controllers: pdi}", False),
    ],
)  # fmt: skip
def test_a_name_is_a_list_of_one_where_the_items_of_a_list_are_names(
    validator: Draft202012Validator, text: str, taken: bool, tmp_path: Path
) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(text)
    with nullcontext() if taken else pytest.raises(UserError):
        load_study([file])
    assert (refused(validator, text) == []) is taken


def test_an_editor_shows_unit_meaning_range_and_choices() -> None:
    sections = study_schema()["$defs"]
    length = sections["WristParameters"]["properties"]["length"]
    assert length["exclusiveMinimum"] == 0 and length["default"] == 0.08
    assert length["description"].startswith("[m] arc length from the first to the last disc")
    kind = sections["Reference"]["anyOf"][1]["properties"]["kind"]
    assert "minimum-jerk" in json.dumps(kind)
