"""Every leaf of every experiment decides the fingerprint, and no key is let in that nothing reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml

from wristctl.commands.compare import command as compare
from wristctl.commands.inputs import Inputs
from wristctl.commands.simulate import command as simulate
from wristctl.config.controller_row import Row
from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records.provenance import code_state, environment_state
from wristctl.records.start import fingerprint
from wristctl.study_files.error_messages import located
from wristctl.study_files.load import load_study, read_study
from wristctl.study_files.resolved import config_hash, resolved_yaml
from wristctl.study_files.strict_yaml import KeyPath, parse_yaml

EXPERIMENTS = sorted((Path(__file__).parents[2] / "experiments").rglob("*.yaml"))
SECTIONS = {field.alias or name: name for name, field in Study.model_fields.items()}
COMMANDS = [key for key, name in SECTIONS.items() if name not in ("seed", "wrist")]


def _other(value: Any) -> Any:
    match value:
        case bool():
            return not value
        case int() | float():
            return value + 1
        case tuple():
            return (1.0,)
    return "other"


def _perturbed(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The value with one of its leaves changed, for each leaf; in mappings too, and in a sequence's first and last."""
    if isinstance(value, Section):
        for name in type(value).model_fields:
            for at, changed in _perturbed(getattr(value, name), f"{path}.{name}"):
                yield at, value.model_copy(update={name: changed})
    elif isinstance(value, dict) and value:
        for key in value:
            for at, changed in _perturbed(value[key], f"{path}.{key}"):
                yield at, value | {key: changed}
    elif isinstance(value, tuple) and value:
        for number in sorted({0, len(value) - 1}):
            item = value[number]
            for at, changed in _perturbed(item, f"{path}[{number}]"):
                yield at, (*value[:number], changed, *value[number + 1 :])
    else:
        yield path, _other(value)


def _with_every_kind(study: Study) -> Study:
    """The study with gains by name and an inner search, which not every experiment has."""
    gains = {"P1": 1.0, "P2": 2.0, "P3": 3.0}
    rows = (*study.compare.rows, Row(controller="smc", gains=gains))
    compared = study.compare.model_copy(update={"rows": rows, "tuning": study.compare.tuning or study.tune})
    simulated = study.simulate.model_copy(update={"controller": "smc", "gains": gains})
    return study.model_copy(update={"compare": compared, "simulate": simulated})


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda file: file.stem)
def test_experiments_are_read_without_a_warning(file: Path, caplog: pytest.LogCaptureFixture) -> None:
    load_study([file])
    assert not caplog.messages


@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
@pytest.mark.slow
def test_every_leaf_changes_the_fingerprint_of_the_command_that_reads_it() -> None:
    code, environment = code_state()[0], environment_state()[0]
    seen = set()

    def of(changed: Study, command: str) -> str:
        return fingerprint(config_hash(changed, command), code, environment, {})

    for study in (_with_every_kind(load_study([file])) for file in EXPERIMENTS):
        for command in COMMANDS:
            before, leaves = of(study, command), 0
            if (command, before) in seen:
                continue
            seen.add((command, before))
            for name in ("seed", "wrist", SECTIONS[command]):
                for path, changed in _perturbed(getattr(study, name), name):
                    assert of(study.model_copy(update={name: changed}), command) != before, f"{command}: {path}"
                    leaves += 1
            assert leaves > len(type(study.wrist).model_fields)
    assert {command for command, _ in seen} == set(COMMANDS) and len(seen) > 2 * len(COMMANDS)


def test_code_inputs_and_machine_change_the_fingerprint_too() -> None:
    code, environment = code_state()[0], environment_state()[0]
    other = {"python": "4", "machine": "m", "cpu": "c", "threads": {"T": "1"}, "packages": {}}
    fingerprints = {
        fingerprint("config", code, environment, {}),
        fingerprint("other", code, environment, {}),
        fingerprint("config", code.model_copy(update={"tree_sha256": "other"}), environment, {}),
        fingerprint("config", code, environment, {"data": "result"}),
        fingerprint("config", code, environment, {"data": "other"}),
        *(
            fingerprint("config", code, environment.model_copy(update={name: value}), {})
            for name, value in other.items()
        ),
    }
    assert len(fingerprints) == 10


Mapped = dict[str, Any]


def _mappings(value: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Mapped]]:
    """Every mapping of a study's data with its key path: sections, loops by name, gains by name; in sequences too."""
    if isinstance(value, dict):
        yield path, value
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, tuple) else ()
    for key, child in children:
        yield from _mappings(child, (*path, key))


def _alone(data: Mapped, path: KeyPath, more: Mapped) -> Mapped:
    """The mapping at the path with a key more, and of all the others only the leaves and the way there."""
    leaves = {key: value for key, value in data.items() if not list(_mappings(value))}
    if not path:
        return {**leaves, **more}
    here, *rest = path
    assert isinstance(here, str)
    if rest and isinstance(rest[0], int):
        return {**leaves, here: [_alone(data[here][rest[0]], tuple(rest[1:]), more)]}
    return {**leaves, here: _alone(data[here], tuple(rest), more)}


def _all_mappings() -> dict[str, tuple[Mapped, KeyPath, Mapped]]:
    """The data, key path and mapping of each place in the schema at which an experiment has a mapping."""
    found: dict[str, tuple[Mapped, KeyPath, Mapped]] = {}
    for file in EXPERIMENTS:
        study = _with_every_kind(load_study([file]))
        data: Mapped = {}
        for command in COMMANDS:
            data |= parse_yaml(resolved_yaml(study, command), command).data
        for path, mapping in (each for each in _mappings(data) if each[1]):
            names = ["*" if before == "loops" else key for before, key in zip(("", *path), path, strict=False)]
            place = ".".join(str(name) for name in names if not isinstance(name, int))
            found.setdefault(place, (data, path, mapping))
    return found


def _refusal(file: Path) -> UserError:
    """The error that keeps a command from running this study."""
    network: Any = SimpleNamespace(run=None)
    with pytest.raises(UserError) as caught:
        study, origins = read_study([file])
        for plan in (compare.plan, simulate.plan):
            try:
                plan(study, Inputs({"network": network}))
            except UserError as error:
                raise located(error, origins) from error
    return caught.value


MAPPINGS = _all_mappings()
OPEN = ("loops", "families", "budgets", "variants", "unknowns", "one_of")
"""Mappings that take any name, but no number under it."""


@pytest.mark.slow
def test_a_key_that_nothing_reads_is_refused_with_its_line_and_the_key_that_was_meant(tmp_path: Path) -> None:
    for place, (data, path, mapping) in MAPPINGS.items():
        meant = next(reversed(mapping))
        misspelt = f"{meant}x"
        file = tmp_path / "study.yaml"
        file.write_text(yaml.safe_dump(_alone(data, path, {misspelt: 1.0}), sort_keys=False))
        line = 1 + next(n for n, text in enumerate(file.read_text().splitlines()) if f"{misspelt}:" in text)
        error = _refusal(file)
        if "unknowns" in path and (path[-1] == "unless" or path[-2] == "one_of"):  # keys of leaves elsewhere
            assert error.where.startswith(f"{file}:"), place
            assert error.what.endswith(f"there is no setting {misspelt.split('.')[-1]}"), place
            continue
        names = (0 if isinstance(key, int) else key for key in (*path, misspelt))
        assert error.where == f"{file}:{line}: {'.'.join(map(str, names))}", place
        last = path[-1] if path else ""
        if last in (*OPEN, "terms", "draw"):
            wanted = {"terms": "be a valid list", "draw": "be a valid string"}.get(str(last), "have the form {")
            assert error.what.startswith(f"1.0 should {wanted}"), place
        else:
            assert "unknown" in error.what and repr(misspelt) in error.what, place
            assert error.fix == f"did you mean {meant!r}?", place


def test_mappings_of_every_kind_are_among_those_that_refuse_a_key() -> None:
    assert {
        "", "wrist", "compare.controllers", "compare.controllers.gains", "compare.loops", "compare.loops.*.plant",
        "train.rows",
        "compare.tuning.objective", "compare.tuning.loops.*.sensor", "tune.scenarios.reference", "simulate.gains",
    } <= set(MAPPINGS)  # fmt: skip
