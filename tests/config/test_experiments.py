"""Every leaf of every experiment decides the fingerprint, and no key is let in that nothing reads."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from wristctl.config.errors import UserError
from wristctl.config.load import load_study
from wristctl.config.resolved import config_hash, resolved_yaml
from wristctl.config.section import Section
from wristctl.config.study import Study
from wristctl.runs.code import code_state
from wristctl.runs.environment import environment_state
from wristctl.runs.start import fingerprint

EXPERIMENTS = sorted((Path(__file__).parents[2] / "experiments").rglob("*.yaml"))
SECTIONS = {field.alias or name: name for name, field in Study.model_fields.items()}
COMMANDS = [key for key, name in SECTIONS.items() if name not in ("seed", "wrist")]


def _other(value: Any) -> Any:
    match value:
        case bool():
            return not value
        case int() | float():
            return value + 1
        case tuple() if value and not isinstance(value[-1], str | Section):
            return (*value[:-1], _other(value[-1]))
        case tuple():
            return value[:-1] if value else (1.0,)
    return "other"


def _perturbed(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The value with one of its leaves changed, for each leaf; in mappings and sequences too."""
    if isinstance(value, Section):
        for name in type(value).model_fields:
            for at, changed in _perturbed(getattr(value, name), f"{path}.{name}"):
                yield at, value.model_copy(update={name: changed})
    elif isinstance(value, dict) and value:
        for key in value:
            for at, changed in _perturbed(value[key], f"{path}.{key}"):
                yield at, value | {key: changed}
    elif isinstance(value, tuple) and any(isinstance(item, Section) for item in value):
        for number, item in enumerate(value):
            for at, changed in _perturbed(item, f"{path}[{number}]"):
                yield at, (*value[:number], changed, *value[number + 1 :])
    else:
        yield path, _other(value)


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda file: file.stem)
@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
def test_every_leaf_changes_the_fingerprint_of_the_command_that_reads_it(file: Path) -> None:
    study = load_study([file])
    code, environment = code_state()[0], environment_state()[0]

    def of(changed: Study, command: str) -> str:
        return fingerprint(config_hash(changed, command), code, environment, {})

    for command in COMMANDS:
        before, leaves = of(study, command), 0
        for name in ("seed", "wrist", SECTIONS[command]):
            for path, changed in _perturbed(getattr(study, name), name):
                assert of(study.model_copy(update={name: changed}), command) != before, f"{command}: {path}"
                leaves += 1
        assert leaves > len(type(study.wrist).model_fields)


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


@pytest.mark.parametrize("file", EXPERIMENTS, ids=lambda file: file.stem)
def test_a_key_that_nothing_reads_is_refused_in_every_section(file: Path, tmp_path: Path) -> None:
    study = load_study([file])
    for command in COMMANDS:
        lines = resolved_yaml(study, command).splitlines()
        for number, line in enumerate(lines):
            key = line.split("#")[0].rstrip()
            opens = key.endswith(":") and number + 1 < len(lines)
            if not opens or lines[number + 1].lstrip().startswith("-") or key.strip() in ("loops:", "rows:", "gains:"):
                continue
            pad = lines[number + 1][: len(lines[number + 1]) - len(lines[number + 1].lstrip())]
            changed = tmp_path / "changed.yaml"
            changed.write_text("\n".join([*lines[: number + 1], f"{pad}nobody_reads_this: 1", *lines[number + 1 :]]))
            with pytest.raises(UserError, match="nobody_reads_this"):
                load_study([changed])
